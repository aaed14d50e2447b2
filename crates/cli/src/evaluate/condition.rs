//! What touches the arm, and what its sensors and the filter's mesh get wrong.

use anyhow::{Context, Result};
use nalgebra::Vector3;
use palpate_model::Robot;
use palpate_sim::solid::with_finer_body;
use palpate_sim::{ObstacleKind, Scenario, coarsen};

/// Time without contact before it, s: an arm that touches something was free before.
const LEAD_IN_SECS: f64 = 2.0;

/// A variation of the one basic scenario: a sphere, met after a short approach, white noise of 10 % of each joint's rms
/// torque, and the filter's own mesh as the true one.
pub struct Condition {
    /// Name in options, tables and files.
    pub name: &'static str,
    /// In words.
    pub title: &'static str,
    /// What it changes in the basic scenario.
    change: fn(&mut Scenario),
    /// The filter's mesh is coarsened to triangles of this size, m.
    pub filter_mesh_edge: Option<f64>,
    /// The true link has triangles so many times smaller than the filter's, made from the iiwa's solids.
    finer_body: Option<f64>,
}

impl Condition {
    const fn new(name: &'static str, title: &'static str, change: fn(&mut Scenario)) -> Self {
        Self {
            name,
            title,
            change,
            filter_mesh_edge: None,
            finer_body: None,
        }
    }

    /// The scenario of a trial.
    pub fn scenario(&self, link: &str, seed: u64, secs: f64) -> Scenario {
        let mut scenario = Scenario {
            seed,
            noise_fraction: 0.1,
            lead_in_secs: LEAD_IN_SECS,
            duration_secs: secs,
            refine_levels: 0,
            ..Scenario::new(link)
        };
        (self.change)(&mut scenario);
        scenario
    }

    /// The robot as it is, for contacts on a link.
    ///
    /// # Errors
    /// If the condition asks for a body that is only known of the iiwa that ships with the project.
    pub fn true_robot(&self, robot: &Robot, link: usize) -> Result<Robot> {
        match self.finer_body {
            None => Ok(robot.clone()),
            Some(finer) => with_finer_body(robot, link, finer)
                .context("only the shipped iiwa has a finer body"),
        }
    }

    /// The robot as the filter knows it.
    pub fn known_robot(&self, robot: &Robot) -> Robot {
        let mut known = robot.clone();
        if let Some(edge) = self.filter_mesh_edge {
            for mesh in known.links.iter_mut().filter_map(|link| link.mesh.as_mut()) {
                *mesh = coarsen(mesh, edge);
            }
        }
        known
    }
}

/// Every condition.
pub static CONDITIONS: [Condition; 14] = [
    Condition::new("noise0", "sphere, no noise", |s| s.noise_fraction = 0.0),
    Condition::new("noise5", "sphere, 5 % noise", |s| s.noise_fraction = 0.05),
    Condition::new("noise10", "sphere of 30 mm radius, 10 % noise", |_| {}),
    Condition::new(
        "edge",
        "edge of a cube of 100 mm, rounded by 5 mm, 10 % noise",
        |s| {
            s.obstacle = ObstacleKind::Box {
                half_extents: [0.05; 3],
                fillet: 0.005,
            };
        },
    ),
    Condition::new(
        "bias",
        "sphere, 10 % noise, a constant bias on every joint, drawn with σ = 0.2 Nm",
        |s| s.bias_sigma = 0.2,
    ),
    Condition::new(
        "begun",
        "the same bias, and in contact from the first sample",
        |s| {
            s.bias_sigma = 0.2;
            s.lead_in_secs = 0.0;
        },
    ),
    Condition::new(
        "friction",
        "sphere, 10 % noise, Coulomb friction 0.3",
        |s| s.friction = 0.3,
    ),
    Condition::new(
        "floor",
        "sphere, 10 % noise and 0.1 Nm of white noise on every joint",
        |s| s.noise_floor = 0.1,
    ),
    Condition::new(
        "cylinder",
        "pole of 30 mm radius and 400 mm length, 10 % noise",
        |s| {
            s.obstacle = ObstacleKind::Cylinder {
                radius: 0.03,
                half_length: 0.2,
                axis: None,
            };
        },
    ),
    Condition::new("plane", "plane, 10 % noise", |s| {
        s.obstacle = ObstacleKind::Plane {};
    }),
    Condition {
        filter_mesh_edge: Some(0.015),
        ..Condition::new(
            "mesh15",
            "sphere, 10 % noise, the filter's mesh coarsened to triangles of 15 mm",
            |_| {},
        )
    },
    Condition {
        finer_body: Some(3.0),
        ..Condition::new(
            "finer",
            "sphere, 10 % noise, the true link made anew from the solid behind the filter's mesh, with nine times its \
             triangles",
            |_| {},
        )
    },
    Condition::new(
        "refined",
        "sphere, 10 % noise, the true mesh the filter's with each triangle split into four and rounded",
        |s| s.refine_levels = 1,
    ),
    Condition::new(
        "drift",
        "sphere, 10 % noise, the obstacle drifts by 5 mm/s in a drawn direction",
        |s| s.drift = (direction(s.seed) * 0.005).into(),
    ),
];

/// The condition of this name; the names in [experiments](super::experiment) all exist, which a test checks.
pub fn named(name: &str) -> Option<&'static Condition> {
    CONDITIONS.iter().find(|condition| condition.name == name)
}

/// A direction that follows from the seed, uniform over the sphere.
fn direction(seed: u64) -> Vector3<f64> {
    let share = |salt| super::seed::share(&[seed, salt]);
    let (height, angle) = (2.0 * share(1) - 1.0, std::f64::consts::TAU * share(2));
    let level = (1.0 - height * height).max(0.0).sqrt();
    Vector3::new(level * angle.cos(), level * angle.sin(), height)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_have_unit_length_and_cancel_out() {
        let all: Vec<_> = (0..2000).map(direction).collect();
        assert!(all.iter().all(|d| (d.norm() - 1.0).abs() < 1e-12));
        let mean = all.iter().sum::<Vector3<f64>>() / 2000.0;
        // Standard deviation of each coordinate's mean: 1 / sqrt(3 · 2000) = 0.013.
        assert!(mean.amax() < 0.06, "{mean}");
    }
}
