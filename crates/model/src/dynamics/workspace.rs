//! Room for the recursions' intermediate and final results.

use nalgebra::DMatrix;

use super::Dynamics;
use super::spatial::{Placement, SpatialInertia, Twist, Wrench};

/// Where [`Dynamics`] works and leaves its results. Made once, used for every call; of use only with the dynamics that
/// made it.
#[derive(Clone, Debug)]
pub struct DynamicsWorkspace {
    pub(super) moving: Vec<Moving>,
    pub(super) torque: Vec<f64>,
    pub(super) other_torque: Vec<f64>,
    pub(super) mass_matrix: DMatrix<f64>,
}

/// What is known of one body while it moves, in its own frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moving {
    pub parent_from_body: Placement,
    pub velocity: Twist,
    pub acceleration: Twist,
    /// Force or momentum of the body and of all that it carries.
    pub wrench: Wrench,
    /// Of the body and of all that it carries, as if they were one.
    pub composite: SpatialInertia,
}

impl Dynamics {
    /// Room for this robot's results.
    pub fn workspace(&self) -> DynamicsWorkspace {
        let dof = self.dof();
        let moving = self.bodies.iter().map(|body| Moving {
            parent_from_body: body.placement(0.0),
            velocity: Twist::default(),
            acceleration: Twist::default(),
            wrench: Wrench::default(),
            composite: body.inertia,
        });
        DynamicsWorkspace {
            moving: moving.collect(),
            torque: vec![0.0; dof],
            other_torque: vec![0.0; dof],
            mass_matrix: DMatrix::zeros(dof, dof),
        }
    }
}

impl DynamicsWorkspace {
    /// Hands the torque of each body's wrench on its joint, τ_i = s_i · f_i, and each wrench on to the parent.
    pub(super) fn gather(&mut self, dynamics: &Dynamics) {
        for (index, body) in dynamics.bodies.iter().enumerate().rev() {
            let moving = self.moving[index];
            self.torque[index] = body.screw.dot(&moving.wrench);
            if let Some(parent) = body.parent {
                let handed = moving.parent_from_body.wrench_in_parent(&moving.wrench);
                self.moving[parent].wrench += handed;
            }
        }
    }
}
