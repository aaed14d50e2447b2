//! `sensor_msgs/msg/JointState`: names, and positions, efforts or both.

use super::{JointReading, header_stamp_ns};
use crate::Value;

pub(super) fn read(message: &Value<'_>) -> Option<JointReading> {
    let names = message.get("name")?.texts()?;
    Some(JointReading {
        stamp_ns: header_stamp_ns(message),
        names: names.into_iter().map(str::to_owned).collect(),
        position: message.get("position")?.numbers()?,
        effort: message.get("effort")?.numbers()?,
    })
}
