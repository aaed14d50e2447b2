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
