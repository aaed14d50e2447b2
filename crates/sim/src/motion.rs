//! The exploratory motion: small, smooth, and never out of contact.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point3, Vector3};
use palpate_model::Kinematics;
use rand::{Rng, RngExt};

use crate::obstacle::Touch;
use crate::placement::{Placement, draw_placement};
use crate::scene::{Refusal, Scene};
use crate::torque::{joint_torques, point_velocity};
use crate::{Obstacle, Scenario};

/// How far away the arm starts where there is a lead-in, m.
const RETREAT: f64 = 0.025;
/// Farthest that the contact may go along the link in one sample, m: beyond it, it is another contact.
const LONGEST_JUMP: f64 = 0.005;
/// Largest turn of its direction in one sample, rad: in a groove, where two contacts are equally deep, the deepest point
/// goes back and forth between them.
const LARGEST_TURN: f64 = 0.1;
/// Farthest that it may go in all, m, with an obstacle at rest.
const LONGEST_TRAVEL: f64 = 0.04;
/// Least share of the wanted travel, where the link has joints enough for it.
const LEAST_TRAVEL_SHARE: f64 = 0.3;

/// One sample of the motion, as geometry.
pub(crate) struct Step {
    pub position: Vec<f64>,
    pub touch: Touch,
    /// Velocity of the obstacle, m/s.
    pub drift: Vector3<f64>,
}

/// A motion and what it touches.
pub(crate) struct Exploration {
    /// The obstacle where it first is.
    pub obstacle: Obstacle,
    pub steps: Vec<Step>,
}

/// Two sinusoids with random phases, within ±1.
struct Wave {
    /// Amplitude, angular frequency in rad/s, and phase.
    terms: [(f64, f64, f64); 2],
}

impl Wave {
    fn draw(rng: &mut impl Rng) -> Self {
        let mut term = |amplitude: f64, slow: f64, fast: f64| {
            let frequency = rng.random_range(slow..fast);
            (amplitude, TAU * frequency, TAU * rng.random::<f64>())
        };
        Self {
            terms: [term(0.65, 0.08, 0.2), term(0.35, 0.2, 0.4)],
        }
    }

    fn at(&self, secs: f64) -> f64 {
        (self.terms.iter())
            .map(|(amplitude, omega, phase)| amplitude * (omega * secs + phase).sin())
            .sum()
    }
}

/// Draws a placement and a motion that keeps the contact.
pub(crate) fn draw_exploration(
    scene: &Scene,
    scenario: &Scenario,
    rng: &mut impl Rng,
) -> Result<Exploration, Refusal> {
    let press = Wave::draw(rng);
    let deepest = scenario.max_force / scenario.stiffness;
    let depth_at = |secs: f64| deepest * (0.6 + 0.4 * press.at(secs));
    let start = draw_placement(scene, scenario, depth_at(0.0), rng)?;
    let free = draw_free_motion(scene, scenario, &start, rng)?;
    let mut steps = approach(scene, scenario, &start)?;
    steps.extend(follow(scene, scenario, &start, &free, depth_at)?);
    Ok(Exploration {
        obstacle: start.obstacle,
        steps,
    })
}

fn samples(scenario: &Scenario, secs: f64) -> usize {
    (secs * scenario.rate_hz).round() as usize
}

/// Offsets of all joints from the start, sample by sample, that slide and roll on the obstacle without pressing (to first
/// order) and are as large as travel and joint speed allow.
fn draw_free_motion(
    scene: &Scene,
    scenario: &Scenario,
    start: &Placement,
    rng: &mut impl Rng,
) -> Result<Vec<Vec<f64>>, Refusal> {
    let mut kinematics = Kinematics::new(scene.robot);
    kinematics.update(scene.robot, &start.position);
    let lever = lever(scene, &kinematics, &start.touch);
    let path = &scene.robot.links[scene.link].path;
    let mut waves: Vec<Option<(f64, Wave)>> = start.position.iter().map(|_| None).collect();
    for &joint in path {
        waves[joint] = Some((rng.random_range(0.4..1.0), Wave::draw(rng)));
    }
    let count = samples(scenario, scenario.duration_secs);
    let mut offsets: Vec<Vec<f64>> = (0..count)
        .map(|sample| {
            let secs = sample as f64 / scenario.rate_hz;
            let offset = (waves.iter())
                .map(|wave| {
                    wave.as_ref()
                        .map_or(0.0, |(a, w)| a * (w.at(secs) - w.at(0.0)))
                })
                .collect();
            without_pressing(offset, &lever)
        })
        .collect();

    let velocity = |offset: &Vec<f64>| {
        let point = &start.touch.point_in_root;
        Point3::from(point_velocity(
            scene.robot,
            &kinematics,
            scene.link,
            point,
            offset,
        ))
    };
    let travel = span(offsets.iter().map(velocity));
    let speed = (offsets.windows(2))
        .flat_map(|pair| pair[0].iter().zip(&pair[1]))
        .fold(0.0_f64, |most, (a, b)| most.max((b - a).abs()))
        * scenario.rate_hz;
    let share = |wanted: f64, found: f64| if found > 1e-9 { wanted / found } else { 0.0 };
    let scale = share(scenario.travel, travel).min(share(scenario.joint_speed, speed));
    if path.len() > 2 && travel * scale < LEAST_TRAVEL_SHARE * scenario.travel {
        return Err(Refusal::Still);
    }
    for value in offsets.iter_mut().flatten() {
        *value *= scale;
    }
    Ok(offsets)
}

/// Torque of a unit force along the contact; minus the change of penetration with the joints.
fn lever(scene: &Scene, kinematics: &Kinematics, touch: &Touch) -> Vec<f64> {
    let push = touch.push_in_root.into_inner();
    joint_torques(
        scene.robot,
        kinematics,
        scene.link,
        &touch.point_in_root,
        &push,
    )
}

fn without_pressing(mut offset: Vec<f64>, lever: &[f64]) -> Vec<f64> {
    let squared: f64 = lever.iter().map(|l| l * l).sum();
    let pressing: f64 = lever.iter().zip(&offset).map(|(l, o)| l * o).sum::<f64>() / squared;
    for (value, l) in offset.iter_mut().zip(lever) {
        *value -= pressing * l;
    }
    offset
}

/// From free space to the start, along the direction of contact; nothing without a lead-in.
fn approach(scene: &Scene, scenario: &Scenario, start: &Placement) -> Result<Vec<Step>, Refusal> {
    let mut kinematics = Kinematics::new(scene.robot);
    kinematics.update(scene.robot, &start.position);
    let lever = lever(scene, &kinematics, &start.touch);
    let squared: f64 = lever.iter().map(|l| l * l).sum();
    let count = samples(scenario, scenario.lead_in_secs);
    let mut steps = Vec::with_capacity(count);
    for sample in 0..count {
        let progress = sample as f64 / count as f64;
        let away = RETREAT * (1.0 - progress * progress * (3.0 - 2.0 * progress));
        let position: Vec<_> = (start.position.iter().zip(&lever))
            .map(|(q, l)| q + away * l / squared)
            .collect();
        kinematics.update(scene.robot, &position);
        let touch = scene.touch(&kinematics, &start.obstacle.root_from_obstacle)?;
        let is_free = sample > 0 || touch.penetration < 0.0;
        if !is_free || !scene.is_clear(&kinematics, &start.obstacle) {
            return Err(Refusal::NoApproach);
        }
        if !is_within_limits(scene, &position) {
            return Err(Refusal::Limits);
        }
        steps.push(Step {
            position,
            touch,
            drift: Vector3::zeros(),
        });
    }
    Ok(steps)
}

/// The free motion, corrected at every sample so that the obstacle stays as deep in the link as `depth_at` (s to m) says.
fn follow(
    scene: &Scene,
    scenario: &Scenario,
    start: &Placement,
    free: &[Vec<f64>],
    depth_at: impl Fn(f64) -> f64,
) -> Result<Vec<Step>, Refusal> {
    const SAMPLES_BETWEEN_CHECKS: usize = 10;
    let drift = Vector3::from(scenario.drift);
    let mut kinematics = Kinematics::new(scene.robot);
    let mut correction = vec![0.0; start.position.len()];
    let mut steps = Vec::with_capacity(free.len());
    let mut contacts: Vec<Point3<f64>> = Vec::with_capacity(free.len());
    for (sample, offset) in free.iter().enumerate() {
        let secs = sample as f64 / scenario.rate_hz;
        let obstacle = start.obstacle.moved(&(drift * secs));
        let base: Vec<_> = start
            .position
            .iter()
            .zip(offset)
            .map(|(q, o)| q + o)
            .collect();
        let pose = &obstacle.root_from_obstacle;
        let (position, touch) = hold_depth(
            scene,
            &mut kinematics,
            &base,
            &mut correction,
            pose,
            depth_at(secs),
        )?;
        let contact = scene.in_link(&kinematics, &touch.point_in_root);
        let jump = contacts.last().map_or(0.0, |last| (contact - last).norm());
        let turn = (steps.last()).map_or(0.0, |last: &Step| {
            last.touch.push_in_root.angle(&touch.push_in_root)
        });
        if jump > LONGEST_JUMP || turn > LARGEST_TURN {
            return Err(Refusal::Jumps);
        }
        if !is_within_limits(scene, &position) {
            return Err(Refusal::Limits);
        }
        if sample % SAMPLES_BETWEEN_CHECKS == 0 && !scene.is_clear(&kinematics, &obstacle) {
            return Err(Refusal::Covered);
        }
        contacts.push(contact);
        steps.push(Step {
            position,
            touch,
            drift,
        });
    }
    let allowed = LONGEST_TRAVEL + 1.5 * drift.norm() * scenario.duration_secs;
    if span(contacts.into_iter()) > allowed {
        return Err(Refusal::Wanders);
    }
    Ok(steps)
}

/// Adds to `correction` the least joint motion that makes the penetration `depth`, by damped Newton steps; leaves
/// `kinematics` at the returned position.
fn hold_depth(
    scene: &Scene,
    kinematics: &mut Kinematics,
    base: &[f64],
    correction: &mut [f64],
    root_from_obstacle: &Isometry3<f64>,
    depth: f64,
) -> Result<(Vec<f64>, Touch), Refusal> {
    const NEWTON_STEPS: usize = 5;
    const CLOSE_ENOUGH: f64 = 1e-6;
    const TOLERATED_SHARE: f64 = 0.1;
    const DAMPING: f64 = 0.005;
    let mut newton_steps = 0;
    loop {
        let position: Vec<_> = base
            .iter()
            .zip(correction.iter())
            .map(|(b, c)| b + c)
            .collect();
        kinematics.update(scene.robot, &position);
        let touch = scene.touch(kinematics, root_from_obstacle)?;
        let missing = depth - touch.penetration;
        if missing.abs() < CLOSE_ENOUGH {
            return Ok((position, touch));
        }
        if newton_steps == NEWTON_STEPS {
            let is_tolerable = missing.abs() < TOLERATED_SHARE * depth;
            return is_tolerable
                .then_some((position, touch))
                .ok_or(Refusal::Lost);
        }
        newton_steps += 1;
        let lever = lever(scene, kinematics, &touch);
        let squared: f64 = lever.iter().map(|l| l * l).sum();
        for (value, l) in correction.iter_mut().zip(&lever) {
            *value -= missing * l / (squared + DAMPING * DAMPING);
        }
    }
}

fn is_within_limits(scene: &Scene, position: &[f64]) -> bool {
    (scene.robot.joints.iter().zip(position)).all(|(joint, q)| {
        let limits = joint.limits.as_ref();
        limits.is_none_or(|limits| (limits.lower..=limits.upper).contains(q))
    })
}

/// Diagonal of the box around some points.
pub(crate) fn span(points: impl Iterator<Item = Point3<f64>>) -> f64 {
    let bounds = points.fold(None, |bounds, point| match bounds {
        None => Some((point, point)),
        Some((least, most)) => Some((least.inf(&point), most.sup(&point))),
    });
    bounds.map_or(0.0, |(least, most)| (most - least).norm())
}
