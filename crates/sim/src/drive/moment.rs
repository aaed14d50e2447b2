//! What is reported, and what is true, at one moment.

use nalgebra::{Point3, Vector3};
use palpate_model::MeasuredSample;

use super::DriveScenario;

/// One sample of a [`Drive`](super::Drive).
#[derive(Clone, Debug, PartialEq)]
pub struct DriveMoment {
    /// What the robot reports.
    pub measured: MeasuredSample,
    /// True joint positions, rad or m.
    pub position: Vec<f64>,
    /// True external torque, what the pushes apply on the joints, τ_ext = Jᵀ f, Nm (N for a prismatic joint).
    pub external_torque: Vec<f64>,
    /// The push that acts, the last one where there are several; none in free space.
    pub push: Option<TruePush>,
}

/// A push, at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruePush {
    /// Index in the scenario's pushes.
    pub index: usize,
    /// Index of the pushed link in [`Robot::links`](palpate_model::Robot::links).
    pub link: usize,
    /// Where it pushes, in the root frame, m.
    pub point_in_root: Point3<f64>,
    /// Force on the robot, in the root frame, N.
    pub force_in_root: Vector3<f64>,
}

/// Torque that the joint's drive needs against friction, Nm (N): viscous, and Coulomb friction that turns over steeply,
/// but not in an instant.
pub(super) fn friction_torque(scenario: &DriveScenario, joint: usize, speed: f64) -> f64 {
    const TURNING_SPEED: f64 = 0.005;
    let of = |values: &[f64]| values.get(joint).copied().unwrap_or(0.0);
    of(&scenario.viscous_friction) * speed
        + of(&scenario.coulomb_friction) * (speed / TURNING_SPEED).tanh()
}
