//! Messages as r2r gives them where their type is not known when this is compiled.
//!
//! So a driver's messages need not be there to build the node, and another version of them does not stop the build.

use palpate_model::Fields;
use serde_json::Value;

/// A value of a message. NaN and infinity, which JSON has not, come as null.
#[derive(Clone, Copy, Debug)]
pub struct Untyped<'a>(pub &'a Value);

impl Untyped<'_> {
    fn list<T>(self, element: impl Fn(Self) -> Option<T>) -> Option<Vec<T>> {
        let elements = self.0.as_array()?.iter();
        elements.map(|value| element(Untyped(value))).collect()
    }
}

impl Fields for Untyped<'_> {
    fn field(self, name: &str) -> Option<Self> {
        self.0.get(name).map(Untyped)
    }

    fn integer(self) -> Option<i64> {
        self.0.as_i64()
    }

    fn numbers(self) -> Option<Vec<f64>> {
        self.list(|element| match element.0 {
            Value::Null => Some(f64::NAN),
            value => value.as_f64(),
        })
    }

    fn texts(self) -> Option<Vec<String>> {
        self.list(|element| element.0.as_str().map(str::to_owned))
    }

    fn messages(self) -> Option<Vec<Self>> {
        self.list(Some)
    }
}

#[cfg(test)]
mod tests {
    use palpate_model::Source;
    use serde_json::json;

    use super::*;

    #[test]
    fn a_joint_state_is_read_with_its_nan() {
        let message = json!({
            "header": {"stamp": {"sec": 5, "nanosec": 6}, "frame_id": ""},
            "name": ["a", "b"],
            "position": [1.0, 2],
            "velocity": [],
            "effort": [null, 0.5],
        });
        let reading = Source::JointState.read(Untyped(&message)).unwrap();
        assert_eq!(reading.stamp_ns, Some(5_000_000_006));
        assert_eq!(reading.position.values, [1.0, 2.0]);
        assert!(reading.effort.values[0].is_nan());
        assert_eq!(reading.effort.values[1], 0.5);
        let names = Some(vec!["a".to_owned(), "b".to_owned()]);
        assert_eq!(reading.effort.names, names);
    }

    #[test]
    fn a_dynamic_joint_state_is_read_by_interface() {
        let message = json!({
            "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""},
            "joint_names": ["a", "sensor"],
            "interface_values": [
                {"interface_names": ["external_torque", "position"], "values": [3.0, 1.0]},
                {"interface_names": ["force.x"], "values": [9.0]},
            ],
        });
        let reading = Source::DynamicJointState.read(Untyped(&message)).unwrap();
        assert_eq!(reading.stamp_ns, None, "a zero stamp is none");
        assert_eq!(reading.position.names, Some(vec!["a".to_owned()]));
        assert_eq!(reading.position.values, [1.0]);
        assert_eq!(reading.effort.values, [3.0]);
    }

    #[test]
    fn what_lacks_its_fields_gives_nothing() {
        for message in [
            json!(null),
            json!({}),
            json!({"data": "text"}),
            json!({"data": ["text"]}),
        ] {
            for source in Source::ALL {
                assert_eq!(source.read(Untyped(&message)), None, "{message}");
            }
        }
    }
}
