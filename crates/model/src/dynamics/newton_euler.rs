//! Inverse dynamics: the recursive Newton-Euler algorithm (Luh, Walker and Paul 1980; Featherstone 2008, table 5.1).

use super::spatial::Twist;
use super::{Dynamics, DynamicsWorkspace};

impl Dynamics {
    /// Torques that the motion needs: M(q) q̈ + C(q, q̇) q̇ + g(q).
    ///
    /// # Panics
    /// If an array is shorter than the robot's number of joints, or the workspace is another robot's.
    pub fn inverse_dynamics<'a>(
        &self,
        workspace: &'a mut DynamicsWorkspace,
        position: &[f64],
        velocity: &[f64],
        acceleration: &[f64],
    ) -> &'a [f64] {
        let motion = |joint: usize| (velocity[joint], acceleration[joint]);
        self.newton_euler(workspace, position, motion, self.root_acceleration());
        &workspace.torque
    }

    /// Torques that hold the robot at rest: g(q).
    ///
    /// # Panics
    /// As [`Dynamics::inverse_dynamics`].
    pub fn gravity_torque<'a>(
        &self,
        workspace: &'a mut DynamicsWorkspace,
        position: &[f64],
    ) -> &'a [f64] {
        self.newton_euler(
            workspace,
            position,
            |_| (0.0, 0.0),
            self.root_acceleration(),
        );
        &workspace.torque
    }

    /// Torques of the Coriolis and centrifugal forces: C(q, q̇) q̇.
    ///
    /// # Panics
    /// As [`Dynamics::inverse_dynamics`].
    pub fn coriolis_torque<'a>(
        &self,
        workspace: &'a mut DynamicsWorkspace,
        position: &[f64],
        velocity: &[f64],
    ) -> &'a [f64] {
        let motion = |joint: usize| (velocity[joint], 0.0);
        self.newton_euler(workspace, position, motion, Twist::default());
        &workspace.torque
    }

    /// Outwards the motion of each body and the force that it needs, inwards the torques. `motion` gives a joint's speed
    /// and acceleration.
    fn newton_euler(
        &self,
        workspace: &mut DynamicsWorkspace,
        position: &[f64],
        motion: impl Fn(usize) -> (f64, f64),
        root_acceleration: Twist,
    ) {
        for (index, body) in self.bodies.iter().enumerate() {
            let (speed, acceleration) = motion(index);
            let parent_from_body = body.placement(position[index]);
            let (v, a) = match body.parent {
                Some(parent) => {
                    let carrier = &workspace.moving[parent];
                    (carrier.velocity, carrier.acceleration)
                }
                None => (Twist::default(), root_acceleration),
            };
            let own = body.screw * speed;
            let velocity = parent_from_body.twist_in_body(&v) + own;
            let acceleration = parent_from_body.twist_in_body(&a)
                + body.screw * acceleration
                + velocity.cross(&own);
            let mut wrench = body.inertia.of(&acceleration);
            wrench += velocity.cross_wrench(&body.inertia.of(&velocity));
            let moving = &mut workspace.moving[index];
            moving.parent_from_body = parent_from_body;
            moving.velocity = velocity;
            moving.acceleration = acceleration;
            moving.wrench = wrench;
        }
        workspace.gather(self);
    }
}
