//! `lbr_fri_idl/LBRState` of lbr_fri_ros2_stack: joints A1 to A7 in order, and the controller's clock.

use super::fields::stamp_ns;
use super::{Fields, JointReading, JointValues};

pub(super) fn read<F: Fields>(message: F) -> Option<JointReading> {
    let values = |name| Some(JointValues::unnamed(message.field(name)?.numbers()?));
    Some(JointReading {
        stamp_ns: None,
        controller_ns: stamp_ns(
            message.field("time_stamp_sec")?.integer()?,
            message.field("time_stamp_nano_sec")?.integer()?,
        ),
        position: values("measured_joint_position")?,
        effort: values("external_torque")?,
        ..JointReading::default()
    })
}
