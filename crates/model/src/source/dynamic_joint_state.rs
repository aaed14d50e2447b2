//! `control_msgs/DynamicJointState` of ros2_control: a list of named interfaces a joint. Sensors stand among the joints,
//! so only those that have the interface are taken.

use super::{Fields, JointReading, JointValues};

pub(super) fn read<F: Fields>(message: F) -> Option<JointReading> {
    let names = message.field("joint_names")?.texts()?;
    let mut joints = Vec::new();
    for joint in message.field("interface_values")?.messages()? {
        let interfaces = joint.field("interface_names")?.texts()?;
        joints.push((interfaces, joint.field("values")?.numbers()?));
    }
    if names.len() != joints.len() {
        return None;
    }
    let values = |interface: &str| {
        let of_joint = |(name, (interfaces, values)): (&String, &(Vec<String>, Vec<f64>))| {
            let index = interfaces.iter().position(|found| found == interface)?;
            Some((name.clone(), *values.get(index)?))
        };
        let found = names.iter().zip(&joints).filter_map(of_joint);
        let (names, values) = found.unzip();
        JointValues::named(names, values)
    };
    Some(JointReading {
        stamp_ns: message.header_stamp_ns(),
        controller_ns: None,
        position: values("position"),
        effort: values("external_torque"),
        ..JointReading::default()
    })
}
