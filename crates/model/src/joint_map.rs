//! Matching a message's joint names to the robot's joints.

use crate::{ModelError, Robot};

/// Where each of the robot's joints stands in a message. Drivers promise no order, so names decide.
#[derive(Clone, Debug, PartialEq)]
pub struct JointMap {
    index_in_message: Vec<usize>,
}

impl JointMap {
    /// Matches `names`, as a message carries them, to the joints of `robot`. More names than the robot has are allowed.
    ///
    /// # Errors
    /// Names the missing joints, and those that the message has, if any joint of the robot is not among `names`.
    pub fn new<S: AsRef<str>>(robot: &Robot, names: &[S]) -> Result<Self, ModelError> {
        let find = |wanted: &str| names.iter().position(|name| name.as_ref() == wanted);
        let found: Vec<_> = robot.joints.iter().map(|joint| find(&joint.name)).collect();
        let missing: Vec<_> = (robot.joints.iter().zip(&found))
            .filter(|(_, index)| index.is_none())
            .map(|(joint, _)| joint.name.clone())
            .collect();
        if missing.is_empty() {
            return Ok(Self {
                index_in_message: found.into_iter().flatten().collect(),
            });
        }
        Err(ModelError::JointsMissing {
            missing: missing.join(", "),
            found: join(names),
        })
    }

    /// Picks the robot's joints, in its order, from a message's `values`.
    ///
    /// # Errors
    /// If `values` is too short for the names that this map was made from.
    pub fn pick(&self, values: &[f64]) -> Result<Vec<f64>, ModelError> {
        let expected = self
            .index_in_message
            .iter()
            .max()
            .map_or(0, |most| most + 1);
        if values.len() < expected {
            return Err(ModelError::ArrayLength {
                expected,
                found: values.len(),
            });
        }
        Ok(self
            .index_in_message
            .iter()
            .map(|&index| values[index])
            .collect())
    }
}

fn join<S: AsRef<str>>(names: &[S]) -> String {
    let names: Vec<_> = names.iter().map(AsRef::as_ref).collect();
    if names.is_empty() {
        "none".to_owned()
    } else {
        names.join(", ")
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::{Joint, JointKind};

    fn robot(names: &[&str]) -> Robot {
        let joint = |name: &&str| Joint {
            name: (*name).to_owned(),
            kind: JointKind::Revolute,
            axis_in_joint: Vector3::z_axis(),
            limits: None,
        };
        Robot {
            name: "robot".to_owned(),
            joints: names.iter().map(joint).collect(),
            links: Vec::new(),
        }
    }

    #[test]
    fn values_follow_their_names_in_any_order_and_company() {
        let map = JointMap::new(&robot(&["a", "b", "c"]), &["c", "gripper", "a", "b"]).unwrap();
        assert_eq!(map.pick(&[3.0, 9.0, 1.0, 2.0]).unwrap(), [1.0, 2.0, 3.0]);
        // A value beyond the names belongs to no joint.
        assert_eq!(
            map.pick(&[3.0, 9.0, 1.0, 2.0, 8.0]).unwrap(),
            [1.0, 2.0, 3.0]
        );
    }

    #[test]
    fn missing_joints_are_named_with_what_is_there() {
        let error = JointMap::new(&robot(&["a", "b", "c"]), &["b", "x"]).unwrap_err();
        let expected = "joints missing: the robot needs a, c; the message has b, x";
        assert_eq!(error.to_string(), expected);
        let error = JointMap::new::<&str>(&robot(&["a"]), &[]).unwrap_err();
        assert!(error.to_string().ends_with("none"), "{error}");
    }

    #[test]
    fn too_few_values_are_refused_with_both_numbers() {
        let map = JointMap::new(&robot(&["a", "b"]), &["x", "b", "a"]).unwrap();
        let error = map.pick(&[1.0, 2.0]).unwrap_err().to_string();
        assert!(
            error.contains("at least 3") && error.contains("found 2"),
            "{error}"
        );
        assert!(map.pick(&[]).is_err());
    }

    #[test]
    fn a_robot_without_joints_needs_nothing() {
        let map = JointMap::new(&robot(&[]), &["a"]).unwrap();
        assert_eq!(map.pick(&[]).unwrap(), Vec::<f64>::new());
    }
}
