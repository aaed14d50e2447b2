//! Where the external torque comes from.

use nalgebra::Point3;
use palpate_model::{
    Dynamics, ExternalTorque, ExternalTorqueOptions, Inertial, JointFriction, ModelError, Payload,
    Robot, TorqueMethod, VelocitySource, inertia_matrix,
};
use serde::{Deserialize, Serialize};

use crate::ParameterError;

/// What gives the external torque.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum TorqueSource {
    /// The driver: what comes in is external torque.
    #[default]
    External,
    /// [`TorqueMethod::Static`], of the torques measured beside the positions.
    Static,
    /// [`TorqueMethod::MomentumObserver`], of the torques measured beside the positions.
    MomentumObserver,
}

/// Where the external torque comes from, and what has to be known of the robot to tell it from the measured torque. Lists
/// of one value are for all joints, others have one value a joint, in the order of [`Robot::joints`].
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct TorqueSettings {
    /// What gives it. All below matters only where that is not `external`. Default `external`.
    pub source: TorqueSource,
    /// Gravity in the root frame, m/s². Default 0, 0, −9.81: the root's z points up.
    pub gravity: [f64; 3],
    /// What the arm carries beyond what the URDF says.
    pub payload: PayloadSettings,
    /// Friction that is in the measured torque.
    pub friction: FrictionSettings,
    /// Where joint speeds come from.
    pub velocity: VelocitySettings,
    /// The momentum observer.
    pub observer: ObserverSettings,
}

impl Default for TorqueSettings {
    fn default() -> Self {
        Self {
            source: TorqueSource::External,
            gravity: Dynamics::UPRIGHT.into(),
            payload: PayloadSettings::default(),
            friction: FrictionSettings::default(),
            velocity: VelocitySettings::default(),
            observer: ObserverSettings::default(),
        }
    }
}

/// What the arm carries beyond what the URDF says.
#[derive(Clone, Debug, Default, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct PayloadSettings {
    /// Name of the link that carries it. Empty (the default): nothing.
    pub link: String,
    /// Its mass, kg.
    pub mass: f64,
    /// Its centre of mass in that link's frame, m.
    pub centre: [f64; 3],
    /// Its inertia about that centre along that link's axes: xx, xy, xz, yy, yz, zz, kg m².
    pub inertia: [f64; 6],
}

/// Friction that is in the measured torque; see [`JointFriction`].
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct FrictionSettings {
    /// Nm s/rad (N s/m). Default 0.
    pub viscous: Vec<f64>,
    /// Nm (N). Default 0.
    pub coulomb: Vec<f64>,
}

impl Default for FrictionSettings {
    fn default() -> Self {
        Self {
            viscous: vec![0.0],
            coulomb: vec![0.0],
        }
    }
}

/// What gives the joint speeds.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum SpeedSource {
    /// The driver; messages without are refused.
    #[default]
    Driver,
    /// The positions; see [`VelocitySource::Differentiated`].
    Differentiated,
}

/// Where joint speeds come from.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct VelocitySettings {
    /// What gives them. Default `driver`.
    pub source: SpeedSource,
    /// Bandwidth of the low-pass on differentiated speeds, Hz. Default 20.
    pub cutoff_hz: f64,
}

impl Default for VelocitySettings {
    fn default() -> Self {
        Self {
            source: SpeedSource::Driver,
            cutoff_hz: 20.0,
        }
    }
}

/// The momentum observer.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct ObserverSettings {
    /// Gain, 1/s: the observer is a low-pass of gain/2π Hz. Default 25, which is 4 Hz.
    pub gain: Vec<f64>,
}

impl Default for ObserverSettings {
    fn default() -> Self {
        Self { gain: vec![25.0] }
    }
}

impl TorqueSettings {
    /// What makes external torques for `robot` of measured ones; none where the driver gives them.
    ///
    /// # Errors
    /// If a link that moves has no mass, a list fits the robot's joints not, or the payload is none.
    pub fn external_torque(&self, robot: &Robot) -> Result<Option<ExternalTorque>, ModelError> {
        let dof = robot.dof();
        let method = match self.source {
            TorqueSource::External => return Ok(None),
            TorqueSource::Static => TorqueMethod::Static,
            TorqueSource::MomentumObserver => TorqueMethod::MomentumObserver {
                gain: spread(&self.observer.gain, dof),
            },
        };
        let viscous = spread(&self.friction.viscous, dof);
        let coulomb = spread(&self.friction.coulomb, dof);
        if viscous.len() != coulomb.len() {
            return Err(ModelError::JointCount {
                what: "torque.friction.coulomb",
                expected: viscous.len(),
                found: coulomb.len(),
            });
        }
        let friction = viscous.into_iter().zip(coulomb);
        let options = ExternalTorqueOptions {
            method,
            gravity_in_root: self.gravity.into(),
            payload: self.payload.payload(),
            friction: friction
                .map(|(viscous, coulomb)| JointFriction { viscous, coulomb })
                .collect(),
            velocity: match self.velocity.source {
                SpeedSource::Driver => VelocitySource::Driver,
                SpeedSource::Differentiated => VelocitySource::Differentiated {
                    cutoff_hz: self.velocity.cutoff_hz,
                },
            },
        };
        ExternalTorque::new(robot, &options).map(Some)
    }

    pub(crate) fn check(&self) -> Result<(), ParameterError> {
        let within = |name, expected, values: &[f64], least: f64, most: f64| {
            values.iter().try_for_each(|value| {
                let good = (least..=most).contains(value);
                ParameterError::check(name, expected, *value, good)
            })
        };
        within(
            "torque.gravity",
            "-100 to 100",
            &self.gravity,
            -100.0,
            100.0,
        )?;
        let Self {
            payload, friction, ..
        } = self;
        within(
            "torque.payload.mass",
            "0 to 1000",
            &[payload.mass],
            0.0,
            1e3,
        )?;
        within(
            "torque.payload.centre",
            "-10 to 10",
            &payload.centre,
            -10.0,
            10.0,
        )?;
        within(
            "torque.payload.inertia",
            "-1000 to 1000",
            &payload.inertia,
            -1e3,
            1e3,
        )?;
        within(
            "torque.friction.viscous",
            "0 to 1000",
            &friction.viscous,
            0.0,
            1e3,
        )?;
        within(
            "torque.friction.coulomb",
            "0 to 1000",
            &friction.coulomb,
            0.0,
            1e3,
        )?;
        let cutoff = self.velocity.cutoff_hz;
        within(
            "torque.velocity.cutoff_hz",
            "0.1 to 1000",
            &[cutoff],
            0.1,
            1e3,
        )?;
        self.observer.gain.iter().try_for_each(|&gain| {
            let good = gain > 0.0 && gain <= 1e3;
            ParameterError::check("torque.observer.gain", "> 0, at most 1000", gain, good)
        })
    }
}

impl PayloadSettings {
    fn payload(&self) -> Option<Payload> {
        let is_none = self.link.is_empty() && self.mass == 0.0;
        (!is_none).then(|| Payload {
            link: self.link.clone(),
            inertial: Inertial {
                mass: self.mass,
                centre_in_link: Point3::from(self.centre),
                inertia_in_link: inertia_matrix(self.inertia),
            },
        })
    }
}

/// One value for all joints, or one a joint.
fn spread(values: &[f64], dof: usize) -> Vec<f64> {
    match values {
        [value] => vec![*value; dof],
        _ => values.to_vec(),
    }
}

#[cfg(test)]
mod tests {
    use palpate_model::{LoadOptions, MeasuredSample, iiwa14};

    use super::*;
    use crate::Settings;

    fn settings(text: &str) -> TorqueSettings {
        let text = format!("/**: {{ros__parameters: {{torque: {text}}}}}");
        Settings::from_ros_yaml(&text).unwrap().torque
    }

    fn refusal(text: &str) -> String {
        let text = format!("/**: {{ros__parameters: {{torque: {text}}}}}");
        Settings::from_ros_yaml(&text).unwrap_err().to_string()
    }

    fn robot() -> Robot {
        iiwa14(&LoadOptions::default()).unwrap()
    }

    /// External torque at rest, at a bent position, with no measured torque: what is believed to pull at the joints.
    fn believed(text: &str) -> Vec<f64> {
        let mut external = settings(text).external_torque(&robot()).unwrap().unwrap();
        let sample = MeasuredSample {
            stamp_ns: 1,
            position: vec![0.0, 0.8, 0.0, -1.0, 0.0, 0.5, 0.0],
            velocity: vec![0.0, 0.1, 0.0, 0.0, 0.0, 0.0, -0.5],
            torque: vec![0.0; 7],
        };
        external.update(&sample).unwrap().external_torque.clone()
    }

    #[test]
    fn the_drivers_torque_is_taken_as_it_is_unless_asked_otherwise() {
        let default = TorqueSettings::default();
        assert!(default.external_torque(&robot()).unwrap().is_none());
    }

    #[test]
    fn gravity_payload_and_friction_reach_the_dynamics() {
        let plain = believed("{source: static}");
        assert!(plain[1].abs() > 10.0);
        let hanging = believed("{source: static, gravity: [0, 0, 9.81]}");
        assert!((plain[1] + hanging[1]).abs() < 0.1 * plain[1].abs());
        let payload =
            "{link: lbr_link_7, mass: 2, centre: [0, 0, 0.1], inertia: [0.1, 0, 0, 0.1, 0, 0.1]}";
        let loaded = believed(&format!("{{source: static, payload: {payload}}}"));
        assert!((loaded[1] - plain[1]).abs() > 5.0);
        let viscous = "[0, 0, 0, 0, 0, 0, 2]";
        let rough = believed(&format!(
            "{{source: static, friction: {{viscous: {viscous}, coulomb: [1.5]}}}}"
        ));
        assert!((rough[6] - plain[6] + 2.5).abs() < 1e-9);
        assert!((rough[1] - plain[1] - 1.5).abs() < 1e-3);
        assert!((rough[0] - plain[0]).abs() < 1e-12);
    }

    #[test]
    fn the_observer_has_a_gain_for_all_or_for_each_joint() {
        for gain in ["[30]", "[30, 30, 30, 50, 50, 50, 50]"] {
            let text = format!("{{source: momentum_observer, observer: {{gain: {gain}}}}}");
            assert!(settings(&text).external_torque(&robot()).unwrap().is_some());
        }
        let say = |text: &str| {
            let refused = settings(text).external_torque(&robot());
            refused.unwrap_err().to_string()
        };
        let said = say("{source: momentum_observer, observer: {gain: [30, 40]}}");
        assert!(
            said.contains("gain") && said.contains("expected 7"),
            "{said}"
        );
        let said = say("{source: momentum_observer, observer: {gain: []}}");
        assert!(said.contains("found 0"), "{said}");
        let said = say("{source: static, friction: {viscous: [1, 2], coulomb: [0]}}");
        assert!(
            said.contains("friction") && said.contains("found"),
            "{said}"
        );
        let said = say("{source: static, payload: {mass: 2}}");
        assert!(
            said.contains("payload") && said.contains("lbr_link_7"),
            "{said}"
        );
        let said = say("{source: static, payload: {link: lbr_link_7}}");
        assert!(said.contains("mass of the payload"), "{said}");
    }

    #[test]
    fn what_is_out_of_range_or_of_another_shape_is_named() {
        for (text, name) in [
            (
                "{observer: {gain: [30, 0, 30, 30, 30, 30, 30]}}",
                "torque.observer.gain",
            ),
            ("{observer: {gain: [.nan]}}", "torque.observer.gain"),
            ("{gravity: [0, 0]}", "torque.gravity"),
            ("{source: guess}", "torque.source"),
            ("{payload: {weight: 3}}", "torque.payload.weight"),
            ("{friction: {coulomb: [-0.1]}}", "torque.friction.coulomb"),
            ("{velocity: {cutoff_hz: 0}}", "torque.velocity.cutoff_hz"),
        ] {
            let said = refusal(text);
            assert!(said.contains(name), "{text}: {said}");
        }
    }

    #[test]
    fn speeds_come_from_the_driver_or_from_positions() {
        let silent = MeasuredSample {
            stamp_ns: 1,
            position: vec![0.0; 7],
            velocity: Vec::new(),
            torque: vec![0.0; 7],
        };
        let update = |text: &str| {
            let mut external = settings(text).external_torque(&robot()).unwrap().unwrap();
            external
                .update(&silent)
                .map(|_| ())
                .map_err(|error| error.to_string())
        };
        let said = update("{source: static}").unwrap_err();
        assert!(said.contains("torque.velocity.source"), "{said}");
        assert!(update("{source: static, velocity: {source: differentiated}}").is_ok());
    }
}
