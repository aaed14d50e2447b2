//! `sensor_msgs/JointState`: names, and any of positions, speeds and efforts.

use super::{Fields, JointReading, JointValues};

pub(super) fn read<F: Fields>(message: F) -> Option<JointReading> {
    let names = message.field("name")?.texts()?;
    Some(JointReading {
        stamp_ns: message.header_stamp_ns(),
        controller_ns: None,
        position: JointValues::named(names.clone(), message.field("position")?.numbers()?),
        velocity: JointValues::named(names.clone(), message.field("velocity")?.numbers()?),
        effort: JointValues::named(names, message.field("effort")?.numbers()?),
    })
}
