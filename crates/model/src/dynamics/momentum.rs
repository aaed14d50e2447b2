//! Generalised momentum, and how the motion alone changes it: what a momentum observer needs, in one recursion, without
//! mass matrix or Christoffel symbols (as A. De Luca and L. Ferrajoli, *A modified Newton-Euler method for dynamic
//! computations in robot fault detection and control*, ICRA 2009, but for one way outwards and one back).

use super::spatial::Twist;
use super::{Dynamics, DynamicsWorkspace};

/// The momentum of a robot in motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Momentum<'a> {
    /// p = M(q) q̇, Nm s (N s for a prismatic joint).
    pub momentum: &'a [f64],
    /// C(q, q̇)ᵀ q̇, Nm (N): what ṗ is beyond the torques, ṗ = τ + τ_ext + Cᵀ q̇ − g.
    pub coriolis_transpose: &'a [f64],
}

impl Dynamics {
    /// Momentum of the robot, and Cᵀ q̇ = Ṁ q̇ − C q̇.
    ///
    /// As Ṁ − 2C is skew, Cᵀ q̇ is half of ∂(q̇ᵀ M q̇)/∂q. Of the kinetic energy only what joint i moves depends on q_i, and
    /// it changes as if its carrier's velocity were turned back about the joint, so that entry i is h_i · (v_i × s_i), with
    /// the joint's screw s_i, the velocity v_i of its body and the momentum h_i of all that it moves. And p_i = h_i · s_i.
    ///
    /// # Panics
    /// As [`Dynamics::inverse_dynamics`].
    pub fn momentum<'a>(
        &self,
        workspace: &'a mut DynamicsWorkspace,
        position: &[f64],
        velocity: &[f64],
    ) -> Momentum<'a> {
        for (index, body) in self.bodies.iter().enumerate() {
            let parent_from_body = body.placement(position[index]);
            let carried = body.parent.map_or(Twist::default(), |parent| {
                parent_from_body.twist_in_body(&workspace.moving[parent].velocity)
            });
            let moving = &mut workspace.moving[index];
            moving.parent_from_body = parent_from_body;
            moving.velocity = carried + body.screw * velocity[index];
            moving.wrench = body.inertia.of(&moving.velocity);
        }
        workspace.gather(self);
        for (index, body) in self.bodies.iter().enumerate() {
            let moving = &workspace.moving[index];
            let turned = moving.velocity.cross(&body.screw);
            workspace.other_torque[index] = turned.dot(&moving.wrench);
        }
        Momentum {
            momentum: &workspace.torque,
            coriolis_transpose: &workspace.other_torque,
        }
    }
}
