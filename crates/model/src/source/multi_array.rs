//! `std_msgs/Float64MultiArray`: numbers alone, taken for torques whatever the layout says.

use super::{Fields, JointReading, JointValues};

pub(super) fn read<F: Fields>(message: F) -> Option<JointReading> {
    Some(JointReading {
        effort: JointValues::unnamed(message.field("data")?.numbers()?),
        ..JointReading::default()
    })
}
