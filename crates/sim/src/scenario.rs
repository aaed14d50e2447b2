//! What a trial is made from.

use palpate_model::Robot;
use serde::{Deserialize, Serialize};

use crate::{ObstacleKind, SimError};

/// One trial: who touches what, how the arm moves and what its sensors add. Only `link` has no default.
///
/// The same scenario and robot give the same bits. Geometry and motion are drawn from one random stream and the noise
/// from another, so that a change of noise leaves the motion as it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Seed of everything random. Default 1.
    #[serde(default = "defaults::seed")]
    pub seed: u64,
    /// Name of the link that is touched.
    pub link: String,
    /// What touches it. Default: a sphere of 30 mm radius.
    #[serde(default = "defaults::obstacle")]
    pub obstacle: ObstacleKind,
    /// Contact stiffness K, N/m: force is K times penetration. Default 8000.
    #[serde(default = "defaults::stiffness")]
    pub stiffness: f64,
    /// Largest commanded normal force, N; it varies smoothly between a fifth of it and all of it. The penetration that
    /// belongs to it must stay below 0.8 of the obstacle's rounding. Default 30.
    #[serde(default = "defaults::max_force")]
    pub max_force: f64,
    /// Coulomb friction coefficient. Default 0.
    #[serde(default)]
    pub friction: f64,
    /// Velocity of the obstacle in the root frame, m/s, from the end of the lead-in on. Default 0.
    #[serde(default)]
    pub drift: [f64; 3],
    /// How far the link's point under the contact moves, m, as far as `joint_speed` and the link's free joints let it.
    /// Default 0.012.
    #[serde(default = "defaults::travel")]
    pub travel: f64,
    /// Highest speed of a joint in the free part of the motion, rad/s or m/s; pressing adds to it. Default 0.05.
    #[serde(default = "defaults::joint_speed")]
    pub joint_speed: f64,
    /// Samples a second, Hz. Default 100.
    #[serde(default = "defaults::rate_hz")]
    pub rate_hz: f64,
    /// Length of the contact, s. Default 10.
    #[serde(default = "defaults::duration_secs")]
    pub duration_secs: f64,
    /// Approach before it, s, added to the length: the arm starts 25 mm away and meets the obstacle in the last fifth of
    /// this time. Default 0: in contact from the first sample.
    #[serde(default)]
    pub lead_in_secs: f64,
    /// White noise, as a fraction of the rms over all samples in contact of each joint's torque. Default 0.
    #[serde(default)]
    pub noise_fraction: f64,
    /// White noise on every joint, Nm. Default 0.
    #[serde(default)]
    pub noise_floor: f64,
    /// Standard deviation from which a constant bias is drawn for every joint, Nm. Default 0.
    #[serde(default)]
    pub bias_sigma: f64,
    /// Constant bias of each joint, Nm, added to the drawn one; empty, or one entry a joint. Default empty.
    #[serde(default)]
    pub bias: Vec<f64>,
    /// Random walk of the bias, Nm per square root of a second. Default 0.
    #[serde(default)]
    pub bias_walk: f64,
    /// How often the touched link's mesh is [refined](crate::refine), each time rounder and with four times the
    /// triangles. 0 is the robot's own mesh. Default 1.
    #[serde(default = "defaults::refine_levels")]
    pub refine_levels: u32,
}

mod defaults {
    use crate::ObstacleKind;

    pub fn seed() -> u64 {
        1
    }
    pub fn obstacle() -> ObstacleKind {
        ObstacleKind::Sphere { radius: 0.03 }
    }
    pub fn stiffness() -> f64 {
        8000.0
    }
    pub fn max_force() -> f64 {
        30.0
    }
    pub fn travel() -> f64 {
        0.012
    }
    pub fn joint_speed() -> f64 {
        0.05
    }
    pub fn rate_hz() -> f64 {
        100.0
    }
    pub fn duration_secs() -> f64 {
        10.0
    }
    pub fn refine_levels() -> u32 {
        1
    }
}

impl Scenario {
    /// Every default, for a link of this name.
    pub fn new(link: &str) -> Self {
        Self {
            seed: defaults::seed(),
            link: link.to_owned(),
            obstacle: defaults::obstacle(),
            stiffness: defaults::stiffness(),
            max_force: defaults::max_force(),
            friction: 0.0,
            drift: [0.0; 3],
            travel: defaults::travel(),
            joint_speed: defaults::joint_speed(),
            rate_hz: defaults::rate_hz(),
            duration_secs: defaults::duration_secs(),
            lead_in_secs: 0.0,
            noise_fraction: 0.0,
            noise_floor: 0.0,
            bias_sigma: 0.0,
            bias: Vec::new(),
            bias_walk: 0.0,
            refine_levels: defaults::refine_levels(),
        }
    }

    /// An upright pole at the link that three joints move, 8 s, 5 % noise.
    ///
    /// # Errors
    /// If the robot has no link with a mesh behind exactly three movable joints.
    pub fn demo(robot: &Robot) -> Result<Self, SimError> {
        let third = (robot.links.iter()).find(|link| link.path.len() == 3 && link.mesh.is_some());
        let link = third.ok_or_else(|| SimError::UnknownLink {
            link: "moved by three joints".to_owned(),
            known: names(robot, |_| true),
        })?;
        Ok(Self {
            obstacle: ObstacleKind::Cylinder {
                radius: 0.025,
                half_length: 0.5,
                axis: Some([0.0, 0.0, 1.0]),
            },
            duration_secs: 8.0,
            noise_fraction: 0.05,
            ..Self::new(&link.name)
        })
    }

    /// Reads a scenario from YAML. Its numbers are checked when it is simulated.
    ///
    /// # Errors
    /// If it is not YAML, `link` is missing, or a key is not known.
    pub fn from_yaml(text: &str) -> Result<Self, SimError> {
        Ok(serde_yaml_ng::from_str(text)?)
    }

    /// Index of the touched link, after everything was checked against the robot.
    pub(crate) fn checked_link(&self, robot: &Robot) -> Result<usize, SimError> {
        self.check_numbers()?;
        self.check_obstacle()?;
        if !self.bias.is_empty() && self.bias.len() != robot.dof() {
            return Err(SimError::OutOfRange {
                field: "bias",
                expected: format!("empty or {} values", robot.dof()),
                found: format!("{} values", self.bias.len()),
            });
        }
        link_to_touch(robot, &self.link)
    }

    fn check_numbers(&self) -> Result<(), SimError> {
        within("stiffness", self.stiffness, 1.0, 1e7, "N/m")?;
        within("max_force", self.max_force, 1e-3, 1e4, "N")?;
        within("friction", self.friction, 0.0, 2.0, "")?;
        for velocity in self.drift {
            within("drift", velocity, -0.1, 0.1, "m/s")?;
        }
        within("travel", self.travel, 0.0, 0.1, "m")?;
        within("joint_speed", self.joint_speed, 1e-3, 2.0, "rad/s")?;
        within("rate_hz", self.rate_hz, 1.0, 1e4, "Hz")?;
        within("duration_secs", self.duration_secs, 0.1, 3600.0, "s")?;
        within("lead_in_secs", self.lead_in_secs, 0.0, 60.0, "s")?;
        let samples = self.rate_hz * (self.duration_secs + self.lead_in_secs);
        within("rate_hz times all secs", samples, 2.0, 1e6, "samples")?;
        within("noise_fraction", self.noise_fraction, 0.0, 10.0, "")?;
        within("noise_floor", self.noise_floor, 0.0, 100.0, "Nm")?;
        within("bias_sigma", self.bias_sigma, 0.0, 100.0, "Nm")?;
        within("bias_walk", self.bias_walk, 0.0, 100.0, "Nm/sqrt(s)")?;
        for &bias in &self.bias {
            within("bias", bias, -1e3, 1e3, "Nm")?;
        }
        within("refine_levels", f64::from(self.refine_levels), 0.0, 3.0, "")
    }

    fn check_obstacle(&self) -> Result<(), SimError> {
        match self.obstacle {
            ObstacleKind::Sphere { radius } => within("radius", radius, 1e-3, 1.0, "m")?,
            ObstacleKind::Cylinder {
                radius,
                half_length,
                axis,
            } => {
                within("radius", radius, 1e-3, 1.0, "m")?;
                within("half_length", half_length, 1e-3, 10.0, "m")?;
                if let Some([x, y, z]) = axis {
                    within("axis (its length)", x.hypot(y).hypot(z), 1e-3, 1e3, "")?;
                }
            }
            ObstacleKind::Box {
                half_extents,
                fillet,
            } => {
                within("fillet", fillet, 1e-4, 1.0, "m")?;
                for half in half_extents {
                    within("half_extents", half, fillet + 1e-3, 10.0, "m")?;
                }
            }
            ObstacleKind::Plane {} => {}
        }
        let Some(rounding) = self.obstacle.rounding() else {
            return Ok(());
        };
        let (deepest, depth) = (0.8 * rounding, self.max_force / self.stiffness);
        within(
            "max_force / stiffness",
            depth,
            0.0,
            deepest,
            "m (0.8 of the rounding)",
        )
    }
}

/// Index of a link that can be touched and moves.
pub(crate) fn link_to_touch(robot: &Robot, name: &str) -> Result<usize, SimError> {
    let link = robot
        .link_index(name)
        .ok_or_else(|| SimError::UnknownLink {
            link: name.to_owned(),
            known: names(robot, |_| true),
        })?;
    if robot.links[link].mesh.is_none() {
        return Err(SimError::NoMesh {
            link: name.to_owned(),
            known: names(robot, |index| robot.links[index].mesh.is_some()),
        });
    }
    if robot.links[link].path.is_empty() {
        let link = name.to_owned();
        return Err(SimError::Immovable { link });
    }
    Ok(link)
}

pub(crate) fn within(
    field: &'static str,
    value: f64,
    low: f64,
    high: f64,
    unit: &str,
) -> Result<(), SimError> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(SimError::OutOfRange {
        field,
        expected: format!("{low} to {high} {unit}").trim_end().to_owned(),
        found: value.to_string(),
    })
}

fn names(robot: &Robot, keep: impl Fn(usize) -> bool) -> String {
    let names: Vec<_> = (robot.links.iter().enumerate())
        .filter(|(index, _)| keep(*index))
        .map(|(_, link)| link.name.as_str())
        .collect();
    if names.is_empty() {
        "none".to_owned()
    } else {
        names.join(", ")
    }
}
