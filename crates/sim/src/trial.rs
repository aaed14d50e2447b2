//! From a scenario to what the robot would report, and the truth beside it.

use std::collections::BTreeMap;

use nalgebra::Unit;
use palpate_model::{JointSample, Kinematics, Robot};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

use crate::motion::{Exploration, Step, draw_exploration};
use crate::noise::measured;
use crate::scene::{Refusal, Scene, summary};
use crate::torque::{contact_force, joint_torques, point_velocity};
use crate::{Obstacle, Scenario, SimError, TrueContact, Truth};

/// A simulated trial. All vectors have one entry a sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// Samples a second, Hz.
    pub rate_hz: f64,
    /// Index of the touched link in [`Robot::links`].
    pub link: usize,
    /// What touches it, where it first is.
    pub obstacle: Obstacle,
    /// What the robot reports: exact positions, measured torques.
    pub samples: Vec<JointSample>,
    /// External torques without noise and bias, Nm (N for a prismatic joint).
    pub clean_torques: Vec<Vec<f64>>,
    /// What really happened.
    pub truth: Vec<Truth>,
}

/// Plays a scenario on a robot. The robot's meshes are the true ones, but for the touched link, which is first refined
/// as often as the scenario says.
///
/// Configuration, contact and motion are drawn until the obstacle touches this link only and the contact is kept.
///
/// # Errors
/// If the scenario asks for something impossible, or no draw out of many gives a contact; then with the reasons.
pub fn simulate(robot: &Robot, scenario: &Scenario) -> Result<Trial, SimError> {
    const DRAWS: usize = 2000;
    let link = scenario.checked_link(robot)?;
    let scene = Scene::new(robot, scenario, link)?;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(scenario.seed);
    let mut refusals: BTreeMap<Refusal, usize> = BTreeMap::new();
    for _ in 0..DRAWS {
        match draw_exploration(&scene, scenario, &mut rng) {
            Ok(exploration) => return Ok(report(&scene, scenario, exploration)),
            Err(refusal) => *refusals.entry(refusal).or_default() += 1,
        }
    }
    Err(SimError::NoContact {
        link: scenario.link.clone(),
        obstacle: scenario.obstacle.name(),
        draws: DRAWS,
        reasons: summary(&refusals),
    })
}

/// Forces, torques, noise and truth of a motion.
fn report(scene: &Scene, scenario: &Scenario, exploration: Exploration) -> Trial {
    const NOISE_STREAM: u64 = 0x6e6f_6973_6500_0001;
    let Exploration { obstacle, steps } = exploration;
    let speeds = joint_speeds(&steps, scenario.rate_hz);
    let mut kinematics = Kinematics::new(scene.robot);
    let (mut truth, mut clean_torques) = (Vec::new(), Vec::new());
    for (index, (step, speed)) in steps.iter().zip(&speeds).enumerate() {
        kinematics.update(scene.robot, &step.position);
        let contact = contact_at(scene, scenario, &kinematics, step, speed);
        clean_torques.push(contact.map_or_else(
            || vec![0.0; scene.robot.dof()],
            |c| {
                joint_torques(
                    scene.robot,
                    &kinematics,
                    scene.link,
                    &c.point_in_root,
                    &c.force_in_root,
                )
            },
        ));
        let link = &scene.robot.links[scene.link];
        truth.push(Truth {
            stamp_ns: (index as f64 * 1e9 / scenario.rate_hz).round() as i64,
            link: scene.link,
            link_number: link.path.len(),
            link_name: link.name.clone(),
            contact,
        });
    }
    let in_contact: Vec<_> = truth.iter().map(|row| row.contact.is_some()).collect();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(scenario.seed ^ NOISE_STREAM);
    let torques = measured(&clean_torques, &in_contact, scenario, &mut rng);
    let samples = (steps.into_iter().zip(torques).zip(&truth))
        .map(|((step, external_torque), row)| JointSample {
            stamp_ns: row.stamp_ns,
            position: step.position,
            external_torque,
        })
        .collect();
    Trial {
        rate_hz: scenario.rate_hz,
        link: scene.link,
        obstacle,
        samples,
        clean_torques,
        truth,
    }
}

fn contact_at(
    scene: &Scene,
    scenario: &Scenario,
    kinematics: &Kinematics,
    step: &Step,
    speed: &[f64],
) -> Option<TrueContact> {
    let touch = &step.touch;
    if touch.penetration <= 0.0 {
        return None;
    }
    let velocity = point_velocity(
        scene.robot,
        kinematics,
        scene.link,
        &touch.point_in_root,
        speed,
    );
    let force_in_root = contact_force(
        &touch.push_in_root,
        scenario.stiffness * touch.penetration,
        scenario.friction,
        &(velocity - step.drift),
    );
    Some(TrueContact {
        point_in_root: touch.point_in_root,
        point_in_link: scene.in_link(kinematics, &touch.point_in_root),
        normal_in_root: Unit::new_unchecked(-touch.push_in_root.into_inner()),
        force_in_root,
        penetration: touch.penetration,
    })
}

/// Joint speeds by central differences, one-sided at the ends.
fn joint_speeds(steps: &[Step], rate_hz: f64) -> Vec<Vec<f64>> {
    let last = steps.len().saturating_sub(1);
    (0..steps.len())
        .map(|index| {
            let (before, after) = (index.saturating_sub(1), (index + 1).min(last));
            let secs = (after - before).max(1) as f64 / rate_hz;
            (steps[before].position.iter().zip(&steps[after].position))
                .map(|(a, b)| (b - a) / secs)
                .collect()
        })
        .collect()
}
