//! Message types that tell of joints: one file a type.

mod joint_state;

use crate::Value;

/// What one message tells of the joints.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct JointReading {
    /// From the message's header; none if it has none, or it is zero.
    pub(crate) stamp_ns: Option<i64>,
    /// Joint names in the order of the values.
    pub(crate) names: Vec<String>,
    /// Positions, rad or m; empty if the message has none.
    pub(crate) position: Vec<f64>,
    /// Efforts, Nm or N; empty if the message has none.
    pub(crate) effort: Vec<f64>,
}

/// Takes what concerns the joints out of a decoded message; none if it lacks what its type promises.
pub(crate) type ReadJoints = fn(&Value<'_>) -> Option<JointReading>;

const SOURCES: &[(&str, ReadJoints)] = &[("sensor_msgs/JointState", joint_state::read)];

/// The reader for a type by its short name, `pkg/Type`; none if the type tells of no joints.
pub(crate) fn source_of(short_name: &str) -> Option<ReadJoints> {
    SOURCES
        .iter()
        .find(|(name, _)| *name == short_name)
        .map(|(_, read)| *read)
}

/// The types that have a reader, for people.
pub(crate) fn readable_types() -> String {
    let names: Vec<_> = SOURCES.iter().map(|(name, _)| *name).collect();
    names.join(", ")
}

/// Stamp of the message's header, ns; none if there is none, or it is zero.
fn header_stamp_ns(message: &Value<'_>) -> Option<i64> {
    let secs = message.get("header.stamp.sec")?.as_i64()?;
    let nanos = message.get("header.stamp.nanosec")?.as_i64()?;
    let stamp_ns = secs.checked_mul(1_000_000_000)?.checked_add(nanos)?;
    (stamp_ns != 0).then_some(stamp_ns)
}
