//! The memory of a contact: keyframes, each the mean of a short stretch of samples.

use nalgebra::{Isometry3, Matrix6xX, Vector6};
use palpate_model::{Kinematics, Robot};

/// Most keyframes kept; when one more comes, the two most alike neighbours become one.
const MOST: usize = 40;
/// Lengths of the first keyframes and of all later ones, s: short at first for a quick first answer.
const LENGTHS_SECS: [f64; 5] = [0.01, 0.02, 0.03, 0.05, 0.1];

/// Mean of some samples.
#[derive(Clone, Debug)]
pub(super) struct Keyframe {
    /// Number of samples.
    pub(super) samples: f64,
    /// Time between first and last sample, with one sample's length, s.
    pub(super) length_secs: f64,
    /// Mean stamp relative to the contact's begin, s.
    pub(super) time_secs: f64,
    /// Mean joint positions, rad.
    pub(super) position: Vec<f64>,
    /// Mean joint velocities, rad/s.
    pub(super) velocity: Vec<f64>,
    /// Mean external torques y, Nm.
    pub(super) torque: Vec<f64>,
    /// What follows from the positions and velocities, for each link.
    pub(super) links: Vec<LinkView>,
}

/// A keyframe seen from one link.
#[derive(Clone, Debug)]
pub(super) struct LinkView {
    pub(super) link_from_root: Isometry3<f64>,
    /// Screws (6 × k) of the joints on the link's path, in the link's frame.
    pub(super) screws: Matrix6xX<f64>,
    /// Velocity of the link (linear part at its origin, then angular) in the link's frame, m/s and rad/s.
    pub(super) velocity: Vector6<f64>,
}

impl Keyframe {
    fn refresh(&mut self, robot: &Robot, kinematics: &mut Kinematics) {
        kinematics.update(robot, &self.position);
        for (index, view) in self.links.iter_mut().enumerate() {
            view.link_from_root = kinematics.root_from_link(index).inverse();
            view.screws.copy_from(kinematics.screws_in_link(index));
            view.velocity.fill(0.0);
            for (column, &joint) in view.screws.column_iter().zip(&robot.links[index].path) {
                view.velocity += column * self.velocity[joint];
            }
        }
    }

    fn absorb(&mut self, other: &Keyframe) {
        let share = other.samples / (self.samples + other.samples);
        let blend = |mine: &mut [f64], others: &[f64]| {
            for (mine, other) in mine.iter_mut().zip(others) {
                *mine += share * (other - *mine);
            }
        };
        blend(&mut self.position, &other.position);
        blend(&mut self.velocity, &other.velocity);
        blend(&mut self.torque, &other.torque);
        self.time_secs += share * (other.time_secs - self.time_secs);
        self.samples += other.samples;
        self.length_secs += other.length_secs;
    }
}

/// Sums of the samples of the keyframe that is being filled.
#[derive(Clone, Debug, Default)]
struct Filling {
    samples: f64,
    first_ns: i64,
    last_ns: i64,
    first_position: Vec<f64>,
    last_position: Vec<f64>,
    position: Vec<f64>,
    torque: Vec<f64>,
}

/// All keyframes of the present contact, oldest first.
pub(super) struct Memory {
    pub(super) keyframes: Vec<Keyframe>,
    filling: Filling,
    kinematics: Kinematics,
    begin_ns: i64,
    committed: usize,
    /// Typical time between samples, s.
    period_secs: f64,
}

impl Memory {
    pub(super) fn new(robot: &Robot) -> Self {
        Self {
            keyframes: Vec::with_capacity(MOST + 1),
            filling: Filling::default(),
            kinematics: Kinematics::new(robot),
            begin_ns: 0,
            committed: 0,
            period_secs: 0.01,
        }
    }

    pub(super) fn begin(&mut self, stamp_ns: i64) {
        self.keyframes.clear();
        self.filling.samples = 0.0;
        self.begin_ns = stamp_ns;
        self.committed = 0;
    }

    /// Takes a sample in. Tells whether that completed a keyframe, which is then the last of `keyframes`.
    pub(super) fn push(
        &mut self,
        robot: &Robot,
        stamp_ns: i64,
        position: &[f64],
        torque: &[f64],
    ) -> bool {
        let filling = &mut self.filling;
        if filling.samples == 0.0 {
            filling.first_ns = if self.committed > 0 {
                filling.last_ns
            } else {
                stamp_ns
            };
            if self.committed == 0 {
                filling.last_position = position.to_vec();
            }
            filling.first_position.clone_from(&filling.last_position);
            filling.position.clear();
            filling.position.resize(position.len(), 0.0);
            filling.torque.clear();
            filling.torque.resize(torque.len(), 0.0);
        }
        if filling.last_ns > 0 && (self.committed > 0 || filling.samples > 0.0) {
            let period = (stamp_ns - filling.last_ns) as f64 * 1e-9;
            if period < 0.2 {
                self.period_secs += 0.05 * (period - self.period_secs);
            }
        }
        filling.samples += 1.0;
        filling.last_ns = stamp_ns;
        filling.last_position.copy_from_slice(position);
        for (sum, value) in filling.position.iter_mut().zip(position) {
            *sum += value;
        }
        for (sum, value) in filling.torque.iter_mut().zip(torque) {
            *sum += value;
        }
        let wanted = LENGTHS_SECS[self.committed.min(LENGTHS_SECS.len() - 1)];
        let length = filling.samples * self.period_secs;
        if length < wanted - 1e-4 {
            return false;
        }
        self.commit(robot);
        true
    }

    fn commit(&mut self, robot: &Robot) {
        let filling = &mut self.filling;
        let span = ((filling.last_ns - filling.first_ns) as f64 * 1e-9).max(self.period_secs);
        let mean = |sums: &[f64]| {
            sums.iter()
                .map(|sum| sum / filling.samples)
                .collect::<Vec<_>>()
        };
        let velocity = (filling.last_position.iter().zip(&filling.first_position))
            .map(|(last, first)| (last - first) / span)
            .collect();
        let middle = (filling.last_ns - self.begin_ns) as f64 * 1e-9 - span / 2.0;
        let mut keyframe = Keyframe {
            samples: filling.samples,
            length_secs: filling.samples * self.period_secs,
            time_secs: middle,
            position: mean(&filling.position),
            velocity,
            torque: mean(&filling.torque),
            links: (robot.links.iter())
                .map(|link| LinkView {
                    link_from_root: Isometry3::identity(),
                    screws: Matrix6xX::zeros(link.path.len()),
                    velocity: Vector6::zeros(),
                })
                .collect(),
        };
        filling.samples = 0.0;
        self.committed += 1;
        keyframe.refresh(robot, &mut self.kinematics);
        self.keyframes.push(keyframe);
        if self.keyframes.len() > MOST {
            self.merge_most_alike(robot);
        }
    }

    /// Merges the two neighbours whose configurations and velocities differ least, the newest excepted.
    fn merge_most_alike(&mut self, robot: &Robot) {
        let difference = |pair: &[Keyframe]| -> f64 {
            let apart = |a: &[f64], b: &[f64]| -> f64 {
                a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum()
            };
            let samples = pair[0].samples * pair[1].samples / (pair[0].samples + pair[1].samples);
            let position = apart(&pair[0].position, &pair[1].position);
            // A quarter of a second of the velocity's change weighs like a change of position.
            (position + 0.06 * apart(&pair[0].velocity, &pair[1].velocity)) * samples
        };
        let last = self.keyframes.len() - 1;
        let best = (self.keyframes[..last].windows(2).enumerate())
            .min_by(|a, b| difference(a.1).total_cmp(&difference(b.1)))
            .map(|(index, _)| index);
        if let Some(index) = best {
            let absorbed = self.keyframes.remove(index + 1);
            self.keyframes[index].absorb(&absorbed);
            self.keyframes[index].refresh(robot, &mut self.kinematics);
        }
    }
}
