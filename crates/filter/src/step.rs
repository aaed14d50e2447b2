//! What one step knows: the robot before and now, and the torques measured now.

use palpate_model::{Kinematics, Robot};

use crate::JointBias;
use crate::skin::Skin;

/// The inputs of one filter step.
pub(crate) struct Step<'a> {
    /// The robot.
    pub(crate) robot: &'a Robot,
    /// Its touchable surfaces.
    pub(crate) skin: &'a Skin,
    /// Kinematics at the last sample.
    pub(crate) before: &'a Kinematics,
    /// Kinematics at this sample.
    pub(crate) now: &'a Kinematics,
    /// Joint positions at the last sample, rad or m.
    pub(crate) position_before: &'a [f64],
    /// Joint positions at this sample, rad or m.
    pub(crate) position: &'a [f64],
    /// External torques at this sample without their bias, Nm or N.
    pub(crate) torque: &'a [f64],
    /// The bias taken out of each joint's torque, and how uncertain it is, Nm or N; it stays as it is in contact.
    pub(crate) bias: &'a [JointBias],
    /// Number of the sample since the filter began; keys the random streams.
    pub(crate) number: u64,
    /// Most particles that the paper's filter may have from this step on.
    pub(crate) limit: usize,
}

impl Step<'_> {
    /// How far the joints moved since the last sample: Euclidean norm, rad or m.
    pub(crate) fn joint_motion(&self) -> f64 {
        let squared = |(now, before): (&f64, &f64)| (now - before).powi(2);
        self.position
            .iter()
            .zip(self.position_before)
            .map(squared)
            .sum::<f64>()
            .sqrt()
    }
}
