//! Whatever passes the intake, the filter neither panics nor says anything that is not finite or not on the robot.

#![allow(clippy::unwrap_used)]

mod robots;

use nalgebra::Point3;
use palpate_filter::{
    ContactEstimate, ContactStatus, DetectorParameters, Filter, Intake, Method, Mode,
    PalpateParameters, ParameterError, Parameters, Particle,
};
use palpate_model::{JointSample, Robot, TriangleMesh};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

/// Samples between two looks at every particle.
const LOOK_EVERY: usize = 16;
/// Samples between two changes of what the garbage is like.
const CHANGE_EVERY: usize = 24;

/// Samples that no robot would send, each a valid one.
struct Garbage {
    random: Xoshiro256PlusPlus,
    sample: JointSample,
    /// What the torques, positions and time steps are like at present.
    kinds: [u8; 3],
    count: usize,
}

impl Garbage {
    fn new(dof: usize, seed: u64) -> Self {
        let sample = JointSample {
            stamp_ns: -1_000_000_000,
            position: vec![0.0; dof],
            external_torque: vec![0.0; dof],
        };
        Self {
            random: Xoshiro256PlusPlus::seed_from_u64(seed),
            sample,
            kinds: [0; 3],
            count: 0,
        }
    }

    fn next(&mut self) -> &JointSample {
        if self.count.is_multiple_of(CHANGE_EVERY) {
            let random = &mut self.random;
            self.kinds = [8, 5, 5].map(|kinds| random.random_range(0..kinds));
        }
        self.count += 1;
        for joint in 0..self.sample.position.len() {
            self.sample.external_torque[joint] = self.torque(joint);
            self.sample.position[joint] = self.position(self.sample.position[joint]);
        }
        self.sample.stamp_ns += self.time_step_ns();
        &self.sample
    }

    fn torque(&mut self, joint: usize) -> f64 {
        let sign = if self.count.is_multiple_of(2) {
            1.0
        } else {
            -1.0
        };
        match self.kinds[0] {
            0 => self.random.random_range(-5.0..5.0),
            1 => self.random.random_range(-1e6..1e6),
            2 => 0.0,
            3 => 1e-12 * sign,
            4 => 3.0,
            5 => 4.0 * sign,
            6 => f64::MIN_POSITIVE / 8.0 * sign,
            _ => {
                if joint == 0 {
                    1e6
                } else {
                    f64::MIN_POSITIVE / 8.0
                }
            }
        }
    }

    fn position(&mut self, last: f64) -> f64 {
        match self.kinds[1] {
            0 => last,
            1 => last + self.random.random_range(-0.01..0.01),
            2 => self.random.random_range(-100.0..100.0),
            3 => self.random.random_range(-1e6..1e6),
            _ => f64::MIN_POSITIVE / 8.0,
        }
    }

    fn time_step_ns(&self) -> i64 {
        [1, 1_000_000, 10_000_000, 1_000_000_000, 1_000_000_000_000][self.kinds[2] as usize]
    }
}

/// Distance from a point to a mesh, by asking every triangle: to its plane where the foot is inside, else to its sides.
fn distance_to_mesh(mesh: &TriangleMesh, point: &Point3<f64>) -> f64 {
    let to_triangle = |triangle: usize| {
        let [a, b, c] = mesh.corners(triangle);
        let normal = (b - a).cross(&(c - a)).normalize();
        let sides = [(a, b), (b, c), (c, a)];
        let is_inside = |(from, to): &(Point3<f64>, Point3<f64>)| {
            (to - from).cross(&(point - from)).dot(&normal) >= 0.0
        };
        if sides.iter().all(is_inside) {
            return (point - a).dot(&normal).abs();
        }
        let to_side = |(from, to): (Point3<f64>, Point3<f64>)| {
            let along = to - from;
            let share = (point - from).dot(&along) / along.norm_squared();
            (point - from - along * share.clamp(0.0, 1.0)).norm()
        };
        sides.map(to_side).into_iter().fold(f64::MAX, f64::min)
    };
    let all = (0..mesh.triangles.len()).map(to_triangle);
    all.fold(f64::MAX, f64::min)
}

fn assert_on_link(robot: &Robot, link: usize, point: &Point3<f64>, what: &str) {
    assert!(
        !robot.links[link].path.is_empty(),
        "{what}: {link} does not move"
    );
    let mesh = robot.links[link].mesh.as_ref().unwrap();
    let distance = distance_to_mesh(mesh, point);
    // The contact may be on the smooth body that the mesh stands for.
    assert!(
        distance < 3e-3,
        "{what}: {point} is {distance} m off link {link}"
    );
}

fn assert_sane_mode(robot: &Robot, mode: &Mode, what: &str) {
    let numbers = (mode.point_in_root.iter())
        .chain(mode.normal_in_root.iter())
        .chain(mode.force_in_root.iter())
        .chain(mode.covariance_in_root.iter())
        .chain([&mode.force, &mode.stiffness, &mode.probability]);
    let numbers: Vec<f64> = numbers.copied().collect();
    assert!(
        numbers.iter().all(|number| number.is_finite()),
        "{what}: {mode:?}"
    );
    assert!(
        (0.0..=1.0 + 1e-9).contains(&mode.probability),
        "{what}: {mode:?}"
    );
    assert!(
        (mode.normal_in_root.norm() - 1.0).abs() < 1e-9,
        "{what}: {mode:?}"
    );
    assert!(
        mode.force >= 0.0 && mode.stiffness >= 0.0,
        "{what}: {mode:?}"
    );
    assert_on_link(robot, mode.link, &mode.point_in_link, what);
}

fn assert_sane_estimate(robot: &Robot, estimate: &ContactEstimate, what: &str) {
    let is_free = estimate.status == ContactStatus::NoContact;
    assert!(
        !is_free || estimate.modes.is_empty(),
        "{what}: {estimate:?}"
    );
    for mode in &estimate.modes {
        assert_sane_mode(robot, mode, what);
    }
    let probability: f64 = estimate.modes.iter().map(|mode| mode.probability).sum();
    assert!(probability <= 1.0 + 1e-9, "{what}: {probability}");
    let sorted = |pair: &[Mode]| pair[0].probability >= pair[1].probability;
    assert!(estimate.modes.windows(2).all(sorted), "{what}");
}

fn assert_sane_particles(robot: &Robot, particles: &[Particle], what: &str) {
    for particle in particles {
        let numbers = [particle.force, particle.stiffness, particle.weight];
        let sane = |number: &f64| number.is_finite() && *number >= 0.0;
        assert!(numbers.iter().all(sane), "{what}: {particle:?}");
        let length = particle.normal_in_link.norm();
        assert!((length - 1.0).abs() < 1e-9, "{what}: {particle:?}");
        assert_on_link(robot, particle.link, &particle.point_in_link, what);
    }
    let weight: f64 = particles.iter().map(|particle| particle.weight).sum();
    assert!(
        particles.is_empty() || (weight - 1.0).abs() < 1e-9,
        "{what}: {weight}"
    );
}

/// The fewest particles that are allowed, and a detector that takes most garbage for a contact.
fn fewest(method: Method) -> Parameters {
    Parameters {
        method,
        detector: DetectorParameters {
            false_alarms_per_hour: 1000.0,
            least_torque: 0.001,
            min_secs: 0.0,
            release_share: 0.1,
            release_secs: 60.0,
            motion_std: 0.0,
            ..DetectorParameters::default()
        },
        particles: 100,
        palpate: PalpateParameters {
            hypotheses: 50,
            rounds: 1,
            ..PalpateParameters::default()
        },
        ..Parameters::default()
    }
}

/// Feeds garbage; tells how many samples had a contact.
fn feed(robot: &Robot, method: Method, seed: u64, samples: usize) -> usize {
    let mut filter = Filter::new(robot, &fewest(method), seed).unwrap();
    let mut intake = Intake::new(robot.dof());
    let mut garbage = Garbage::new(robot.dof(), seed);
    let mut in_contact = 0;
    // Calm first, so that the detector does not take the garbage for the torques' noise.
    for index in 0..100 {
        let calm = JointSample {
            stamp_ns: -3_000_000_000 + index * 10_000_000,
            position: vec![0.0; robot.dof()],
            external_torque: vec![0.0; robot.dof()],
        };
        filter.update(intake.admit(&calm).unwrap());
    }
    for index in 0..samples {
        let admitted = intake.admit(garbage.next()).unwrap();
        let what = format!("{} {method:?} seed {seed} sample {index}", robot.name);
        let estimate = filter.update(admitted);
        assert_eq!(estimate.stamp_ns, admitted.sample().stamp_ns);
        assert_sane_estimate(robot, estimate, &what);
        in_contact += usize::from(!estimate.modes.is_empty());
        if index.is_multiple_of(LOOK_EVERY) {
            assert_sane_particles(robot, filter.particles(), &what);
        }
    }
    in_contact
}

fn survives(robot: &Robot, samples: usize) {
    for method in [Method::Paper, Method::Palpate] {
        let in_contact: usize = (1..=2).map(|seed| feed(robot, method, seed, samples)).sum();
        assert!(
            in_contact > samples / 2,
            "{method:?}: only {in_contact} in contact"
        );
    }
}

#[test]
fn garbage_on_one_turning_joint() {
    survives(&robots::hinge(), 250);
}

#[test]
fn garbage_on_one_sliding_joint() {
    survives(&robots::slider(), 250);
}

#[test]
fn garbage_on_a_tree_with_a_link_without_a_mesh() {
    survives(&robots::tree(), 250);
}

#[test]
fn garbage_on_a_long_chain() {
    survives(&robots::chain(12), 300);
}

#[test]
fn garbage_on_the_iiwa() {
    survives(&robots::iiwa(), 250);
}

#[test]
fn a_robot_without_anything_to_touch_is_named() {
    for robot in [robots::bare(), robots::statue()] {
        let refusal = Filter::new(&robot, &Parameters::default(), 1)
            .err()
            .unwrap();
        assert!(matches!(refusal, ParameterError::NothingToTouch { .. }));
        assert!(refusal.to_string().contains(&robot.name), "{refusal}");
    }
}

#[test]
fn a_chain_too_long_for_the_filter_is_refused_by_its_link() {
    let refusal = Filter::new(&robots::chain(13), &Parameters::default(), 1).err();
    let said = refusal.unwrap().to_string();
    assert!(said.contains("link_13") && said.contains("12"), "{said}");
}
fn constant(robot: &Robot, stamp_ns: i64, position: f64, torque: f64) -> JointSample {
    JointSample {
        stamp_ns,
        position: vec![position; robot.dof()],
        external_torque: vec![torque; robot.dof()],
    }
}

fn survives_samples(robot: &Robot, samples: &[JointSample]) {
    for method in [Method::Paper, Method::Palpate] {
        let mut filter = Filter::new(robot, &fewest(method), 1).unwrap();
        let mut intake = Intake::new(robot.dof());
        for (index, sample) in samples.iter().enumerate() {
            // Refusing it is fine as well.
            if let Ok(admitted) = intake.admit(sample) {
                let what = format!("{} {method:?} sample {index}", robot.name);
                assert_sane_estimate(robot, filter.update(admitted), &what);
                assert_sane_particles(robot, filter.particles(), &what);
            }
        }
    }
}

#[test]
fn the_first_and_the_last_stamp_that_there_are() {
    for torque in [0.0, 5.0] {
        let robot = robots::hinge();
        let at = |stamp_ns| constant(&robot, stamp_ns, 0.1, torque);
        survives_samples(&robot, &[i64::MIN, 0, 10_000_000, i64::MAX].map(at));
    }
}

#[test]
fn the_largest_torques_that_there_are() {
    let robot = robots::hinge();
    for torque in [1e160, f64::MAX] {
        let samples = (1..40).map(|index| constant(&robot, index * 10_000_000, 0.1, torque));
        survives_samples(&robot, &samples.collect::<Vec<_>>());
    }
}

#[test]
fn the_largest_positions_that_there_are() {
    for robot in [robots::slider(), robots::tree()] {
        for far in [1e160, f64::MAX] {
            let at = |index: i64| if index % 2 == 0 { far } else { -far };
            let samples = (1..40).map(|index| constant(&robot, index * 10_000_000, at(index), 5.0));
            survives_samples(&robot, &samples.collect::<Vec<_>>());
        }
    }
}
