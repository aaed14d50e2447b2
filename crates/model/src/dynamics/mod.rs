//! Forces and motion: what torque a motion needs, from the URDF's masses.
//!
//! The equation of motion, with the environment's torque as in [`JointSample`](crate::JointSample), is
//!
//! M(q) q̈ + C(q, q̇) q̇ + g(q) = τ + τ_ext,
//!
//! where τ is what the joints' motors give, friction removed. Links joined by fixed joints move as one body, so there is
//! one body a movable joint; the recursions go over these bodies, from the root outwards and back (R. Featherstone,
//! *Rigid Body Dynamics Algorithms*, 2008).

mod body;
mod composite;
mod momentum;
mod newton_euler;
mod spatial;
mod workspace;

use nalgebra::Vector3;

use self::body::{Body, bodies};
pub use self::momentum::Momentum;
use self::spatial::Twist;
pub use self::workspace::DynamicsWorkspace;
use crate::{ModelError, Payload, Robot};

/// The dynamics of one robot: its masses, what it carries, and how it is mounted. Never changes after it is built; the
/// results are in a [`DynamicsWorkspace`], so that no call allocates.
///
/// All vectors have one entry a movable joint, in the order of [`Robot::joints`]: positions q in rad or m, speeds q̇ in
/// rad/s or m/s, accelerations q̈ in rad/s² or m/s², torques in Nm or forces in N.
#[derive(Clone, Debug)]
pub struct Dynamics {
    bodies: Vec<Body>,
    gravity_in_root: Vector3<f64>,
}

impl Dynamics {
    /// Gravity of a robot whose root frame has z upwards, m/s².
    pub const UPRIGHT: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

    /// The dynamics of `robot`, which carries `payload`, in a field `gravity_in_root` (m/s²; [`Dynamics::UPRIGHT`] for a
    /// robot on the floor, (0, 0, 9.81) for one that hangs from the ceiling).
    ///
    /// # Errors
    /// Names the link that has a shape and moves, but has no mass in the URDF; the joint that moves no mass; a mass or an
    /// inertia that no body can have; the payload's link if there is none; a gravity that is not finite.
    pub fn new(
        robot: &Robot,
        gravity_in_root: Vector3<f64>,
        payload: Option<&Payload>,
    ) -> Result<Self, ModelError> {
        if !gravity_in_root.iter().all(|value| value.is_finite()) {
            let [x, y, z] = gravity_in_root.into();
            return Err(ModelError::Number {
                name: "gravity".to_owned(),
                expected: "three finite numbers",
                found: format!("{x} {y} {z}"),
            });
        }
        Ok(Self {
            bodies: bodies(robot, payload)?,
            gravity_in_root,
        })
    }

    /// Number of movable joints.
    pub fn dof(&self) -> usize {
        self.bodies.len()
    }

    /// Acceleration of the root that has gravity's effect: upwards.
    fn root_acceleration(&self) -> Twist {
        Twist {
            angular: Vector3::zeros(),
            linear: -self.gravity_in_root,
        }
    }
}
