//! What a drive is made from.

use palpate_model::{Payload, Robot};
use rand::{Rng, RngExt};

use super::Push;
use crate::SimError;
use crate::scenario::within;

/// How an arm swings, what pushes it, and what its torque sensors add. Start from [`DriveScenario::slow`] or
/// [`DriveScenario::fast`] and change what matters.
///
/// The truth has this payload, these frictions, and masses that are off by `mass_error`. An estimator is given the URDF and
/// what one believes, [`Payload::scaled`] by 0.9 for a payload that is wrong by 10 %, say.
#[derive(Clone, Debug, PartialEq)]
pub struct DriveScenario {
    /// Seed of everything random.
    pub seed: u64,
    /// Samples a second, Hz. Default 1000.
    pub rate_hz: f64,
    /// Length, s. Default 60.
    pub duration_secs: f64,
    /// Speed that the fastest joints reach, rad/s (m/s for a prismatic joint); each joint gets between half of it and all.
    pub peak_speed: f64,
    /// How often each joint swings, Hz, within a quarter more or less; where its limits are narrow, it does not reach the
    /// speed.
    pub swing_hz: f64,
    /// Gravity in the root frame, m/s². Default upright.
    pub gravity: [f64; 3],
    /// What the arm carries. Default nothing.
    pub payload: Option<Payload>,
    /// Largest share by which the true mass and inertia of a link differ from the URDF's, drawn for each link. Default 0.
    pub mass_error: f64,
    /// Viscous friction of each joint, Nm s/rad; empty for none. Default none.
    pub viscous_friction: Vec<f64>,
    /// Coulomb friction of each joint, Nm; empty for none. Default none.
    pub coulomb_friction: Vec<f64>,
    /// White noise on the torques, σ, Nm. Default 0.1.
    pub torque_noise: f64,
    /// Slow bias of the torques, σ, Nm: it starts anywhere and forgets itself within `drift_secs`. Default 0.05.
    pub torque_drift: f64,
    /// Time constant of the slow bias, s. Default 60.
    pub drift_secs: f64,
    /// White noise on the speeds, σ, rad/s. Default 0.001.
    pub velocity_noise: f64,
    /// White noise on the positions, σ, rad. Default 0.
    pub position_noise: f64,
    /// What pushes the arm. Default nothing.
    pub pushes: Vec<Push>,
}

impl DriveScenario {
    /// Up to 0.25 rad/s, about one swing in ten seconds.
    pub fn slow(seed: u64) -> Self {
        Self {
            seed,
            rate_hz: 1000.0,
            duration_secs: 60.0,
            peak_speed: 0.25,
            swing_hz: 0.1,
            gravity: [0.0, 0.0, -9.81],
            payload: None,
            mass_error: 0.0,
            viscous_friction: Vec::new(),
            coulomb_friction: Vec::new(),
            torque_noise: 0.1,
            torque_drift: 0.05,
            drift_secs: 60.0,
            velocity_noise: 0.001,
            position_noise: 0.0,
            pushes: Vec::new(),
        }
    }

    /// Up to 1.5 rad/s, about one swing in three seconds.
    pub fn fast(seed: u64) -> Self {
        Self {
            peak_speed: 1.5,
            swing_hz: 0.3,
            ..Self::slow(seed)
        }
    }

    pub(super) fn check(&self, robot: &Robot) -> Result<(), SimError> {
        within("rate_hz", self.rate_hz, 1.0, 1e5, "Hz")?;
        within("duration_secs", self.duration_secs, 0.0, 1e6, "s")?;
        within("peak_speed", self.peak_speed, 0.0, 10.0, "rad/s")?;
        within("swing_hz", self.swing_hz, 1e-3, 10.0, "Hz")?;
        for component in self.gravity {
            within("gravity", component, -100.0, 100.0, "m/s²")?;
        }
        within("mass_error", self.mass_error, 0.0, 0.9, "")?;
        within("torque_noise", self.torque_noise, 0.0, 100.0, "Nm")?;
        within("torque_drift", self.torque_drift, 0.0, 100.0, "Nm")?;
        within("drift_secs", self.drift_secs, 1e-3, 1e6, "s")?;
        within("velocity_noise", self.velocity_noise, 0.0, 10.0, "rad/s")?;
        within("position_noise", self.position_noise, 0.0, 1.0, "rad")?;
        for push in &self.pushes {
            within("force", push.force, 0.0, 1e4, "N")?;
            within("rise_secs", push.rise_secs, 0.0, 1e3, "s")?;
        }
        for (field, values) in [
            ("viscous_friction", &self.viscous_friction),
            ("coulomb_friction", &self.coulomb_friction),
        ] {
            if !values.is_empty() && values.len() != robot.dof() {
                return Err(SimError::OutOfRange {
                    field,
                    expected: format!("empty or {} values", robot.dof()),
                    found: format!("{} values", values.len()),
                });
            }
            for &value in values {
                within(field, value, 0.0, 1e3, "Nm or Nm s/rad")?;
            }
        }
        Ok(())
    }

    /// The robot as it really is.
    pub(super) fn true_masses(&self, robot: &Robot, rng: &mut impl Rng) -> Robot {
        let mut truth = robot.clone();
        for inertial in truth
            .links
            .iter_mut()
            .filter_map(|link| link.inertial.as_mut())
        {
            let factor = 1.0 + self.mass_error * rng.random_range(-1.0..1.0);
            inertial.mass *= factor;
            inertial.inertia_in_link *= factor;
        }
        truth
    }
}
