//! `franka_msgs/FrankaRobotState` of franka_ros2: the measured joint state, and the filtered external torque.

use super::{Fields, JointReading, JointValues};

pub(super) fn read<F: Fields>(message: F) -> Option<JointReading> {
    let values = |state: &str, quantity: &str| {
        let state = message.field(state)?;
        let names = state.field("name")?.texts()?;
        Some(JointValues::named(names, state.field(quantity)?.numbers()?))
    };
    Some(JointReading {
        stamp_ns: message.header_stamp_ns(),
        controller_ns: None,
        position: values("measured_joint_state", "position")?,
        effort: values("tau_ext_hat_filtered", "effort")?,
        ..JointReading::default()
    })
}
