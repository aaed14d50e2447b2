//! What one message tells of the joints, and the robot's joints picked out of it.

use crate::{JointMap, MeasuredSample, ModelError, Robot};

/// What one message tells of the joints.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointReading {
    /// Stamp of the message's header, ns; none if it has no header, or the stamp is zero.
    pub stamp_ns: Option<i64>,
    /// Time by the robot controller's own clock, ns since the epoch, where the message tells it. That clock may be off
    /// by any amount, so it is no stamp of ROS 2.
    pub controller_ns: Option<i64>,
    /// Positions, rad or m; empty if the message has none.
    pub position: JointValues,
    /// Speeds, rad/s or m/s; empty if the message has none.
    pub velocity: JointValues,
    /// Efforts, Nm or N; empty if the message has none. External torques, but for a `JointState`, whose topic decides.
    pub effort: JointValues,
}

/// One value a joint.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointValues {
    /// Joint names in the order of the values; none if the message does not name them.
    pub names: Option<Vec<String>>,
    /// The values.
    pub values: Vec<f64>,
}

impl JointValues {
    /// Values with names.
    pub fn named(names: Vec<String>, values: Vec<f64>) -> Self {
        let names = Some(names);
        Self { names, values }
    }

    /// Values whose message does not name the joints.
    pub fn unnamed(values: Vec<f64>) -> Self {
        Self {
            names: None,
            values,
        }
    }
}

impl JointReading {
    /// The message as a measured sample of the robot's joints: its efforts are what the joints drive with. Speeds may be
    /// absent.
    ///
    /// # Errors
    /// As [`JointPicker::pick`]; with the quantity that is wrong.
    pub fn measured(
        &self,
        robot: &Robot,
        picker: &mut JointPicker,
        stamp_ns: i64,
    ) -> Result<MeasuredSample, (&'static str, ModelError)> {
        let mut pick = |what, joints: &JointValues| {
            let picked = picker.pick(robot, joints);
            picked.map_err(|error| (what, error))
        };
        Ok(MeasuredSample {
            stamp_ns,
            position: pick("position", &self.position)?,
            velocity: match self.velocity.values.is_empty() {
                true => Vec::new(),
                false => pick("velocity", &self.velocity)?,
            },
            torque: pick("effort", &self.effort)?,
        })
    }
}

/// Picks the robot's joints out of messages. Names decide, and may change from message to message.
#[derive(Clone, Debug)]
pub struct JointPicker {
    unnamed: Vec<String>,
    names: Vec<String>,
    map: Option<JointMap>,
}

impl JointPicker {
    /// Takes values without names to be those of `joint_names` in this order; of all of the robot's joints, in its
    /// order, if that is empty.
    pub fn new(robot: &Robot, joint_names: &[String]) -> Self {
        let of_robot = || robot.joints.iter().map(|joint| joint.name.clone());
        Self {
            unnamed: match joint_names {
                [] => of_robot().collect(),
                names => names.to_vec(),
            },
            names: Vec::new(),
            map: None,
        }
    }

    /// The values of the robot's joints, in its order.
    ///
    /// # Errors
    /// If a joint is missing among the names, or there is not one value a name.
    pub fn pick(&mut self, robot: &Robot, joints: &JointValues) -> Result<Vec<f64>, ModelError> {
        let names = joints.names.as_ref().unwrap_or(&self.unnamed);
        // Names seldom change, but no driver promises that they do not.
        let map = match self.map.take() {
            Some(map) if self.names == *names => map,
            _ => JointMap::new(robot, names)?,
        };
        self.names.clone_from(names);
        let map = self.map.insert(map);
        if joints.values.len() != self.names.len() {
            return Err(ModelError::ValueCount {
                expected: self.names.len(),
                found: joints.values.len(),
            });
        }
        map.pick(&joints.values)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::{Joint, JointKind};

    fn robot() -> Robot {
        let joint = |name: &str| Joint {
            name: name.to_owned(),
            kind: JointKind::Revolute,
            axis_in_joint: Vector3::z_axis(),
            limits: None,
        };
        Robot {
            name: "robot".to_owned(),
            joints: ["a", "b"].map(joint).to_vec(),
            links: Vec::new(),
        }
    }

    fn names(names: &[&str]) -> Vec<String> {
        names.iter().map(|name| (*name).to_owned()).collect()
    }

    #[test]
    fn names_decide_and_may_change_and_vanish() {
        let robot = robot();
        let mut picker = JointPicker::new(&robot, &[]);
        for joints in [
            JointValues::named(names(&["a", "b"]), vec![1.0, 2.0]),
            JointValues::named(names(&["b", "gripper", "a"]), vec![2.0, 9.0, 1.0]),
            JointValues::unnamed(vec![1.0, 2.0]),
            JointValues::named(names(&["b", "a"]), vec![2.0, 1.0]),
        ] {
            assert_eq!(picker.pick(&robot, &joints).unwrap(), [1.0, 2.0]);
        }
    }

    #[test]
    fn values_without_names_follow_the_names_that_are_given() {
        let robot = robot();
        let mut picker = JointPicker::new(&robot, &names(&["b", "a"]));
        let joints = JointValues::unnamed(vec![2.0, 1.0]);
        assert_eq!(picker.pick(&robot, &joints).unwrap(), [1.0, 2.0]);
    }

    #[test]
    fn refusals_tell_the_joint_or_both_numbers_and_are_forgotten() {
        let robot = robot();
        let mut picker = JointPicker::new(&robot, &[]);
        let mut say = |joints: &JointValues| picker.pick(&robot, joints).unwrap_err().to_string();
        let said = say(&JointValues::named(names(&["a"]), vec![1.0]));
        assert!(said.contains("needs b; the message has a"), "{said}");
        let said = say(&JointValues::unnamed(vec![1.0]));
        assert_eq!(said, "expected 2 values, one a name, found 1");
        let said = say(&JointValues::unnamed(vec![1.0, 2.0, 3.0]));
        assert_eq!(said, "expected 2 values, one a name, found 3");
        let joints = JointValues::unnamed(vec![1.0, 2.0]);
        assert_eq!(picker.pick(&robot, &joints).unwrap(), [1.0, 2.0]);
    }
}
