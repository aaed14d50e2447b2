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
    /// Mean time since the contact began, s.
    pub(super) secs: f64,
    /// Time between first and last sample, with one sample's length, s.
    pub(super) length_secs: f64,
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
        self.secs += share * (other.secs - self.secs);
        let blend = |mine: &mut [f64], others: &[f64]| {
            for (mine, other) in mine.iter_mut().zip(others) {
                *mine += share * (other - *mine);
            }
        };
        blend(&mut self.position, &other.position);
        blend(&mut self.velocity, &other.velocity);
        blend(&mut self.torque, &other.torque);
        self.samples += other.samples;
        self.length_secs += other.length_secs;
    }
}

/// Sums of the samples of the keyframe that is being filled.
#[derive(Clone, Debug, Default)]
struct Filling {
    samples: f64,
    /// Sum of the samples' times since the contact began, s.
    secs: f64,
    first_ns: i64,
    last_ns: Option<i64>,
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
    committed: usize,
    /// When the contact began, and the time since then at the last sample, s.
    begin_ns: i64,
    now_secs: f64,
    /// Typical time between samples, s.
    period_secs: f64,
}

impl Memory {
    pub(super) fn new(robot: &Robot) -> Self {
        Self {
            keyframes: Vec::with_capacity(MOST + 1),
            filling: Filling::default(),
            kinematics: Kinematics::new(robot),
            committed: 0,
            begin_ns: 0,
            now_secs: 0.0,
            period_secs: 0.01,
        }
    }

    /// Forgets the last contact.
    pub(super) fn begin(&mut self) {
        self.keyframes.clear();
        self.filling.samples = 0.0;
        self.filling.last_ns = None;
        self.committed = 0;
    }

    /// Takes a sample in.
    pub(super) fn push(&mut self, stamp_ns: i64, position: &[f64], torque: &[f64]) {
        let filling = &mut self.filling;
        if filling.last_ns.is_none() {
            self.begin_ns = stamp_ns;
        }
        self.now_secs = stamp_ns.saturating_sub(self.begin_ns) as f64 * 1e-9;
        if let Some(last_ns) = filling.last_ns {
            let period = stamp_ns.saturating_sub(last_ns) as f64 * 1e-9;
            // A gap is not the rate.
            self.period_secs += 0.05 * (period.min(0.2) - self.period_secs);
        }
        if filling.samples == 0.0 {
            filling.first_ns = filling.last_ns.unwrap_or(stamp_ns);
            if filling.last_ns.is_none() {
                filling.last_position.clear();
                filling.last_position.extend(position);
            }
            filling.first_position.clone_from(&filling.last_position);
            filling.secs = 0.0;
            refill(&mut filling.position, position.len());
            refill(&mut filling.torque, torque.len());
        }
        filling.samples += 1.0;
        filling.secs += self.now_secs;
        filling.last_ns = Some(stamp_ns);
        filling.last_position.copy_from_slice(position);
        add(&mut filling.position, position);
        add(&mut filling.torque, torque);
    }

    /// Whether the samples taken in are enough for a keyframe.
    pub(super) fn is_complete(&self) -> bool {
        let wanted = LENGTHS_SECS[self.committed.min(LENGTHS_SECS.len() - 1)];
        self.filling.samples * self.period_secs > wanted - 1e-4
    }

    /// Typical time between samples, s.
    pub(super) fn period_secs(&self) -> f64 {
        self.period_secs
    }

    /// Time of the newest keyframe since the contact began, s; 0 without one.
    pub(super) fn newest_secs(&self) -> f64 {
        self.keyframes.last().map_or(0.0, |newest| newest.secs)
    }

    /// Time of the last sample since the newest keyframe, s.
    pub(super) fn since_newest_secs(&self) -> f64 {
        self.now_secs - self.newest_secs()
    }

    /// Forgets all but the last keyframes.
    pub(super) fn keep_last(&mut self, count: usize) {
        let drop = self.keyframes.len().saturating_sub(count);
        self.keyframes.drain(..drop);
    }

    /// Makes the samples taken in a keyframe, the last of `keyframes`.
    pub(super) fn commit(&mut self, robot: &Robot) {
        let filling = &mut self.filling;
        let last_ns = filling.last_ns.unwrap_or(filling.first_ns);
        let span = (last_ns.saturating_sub(filling.first_ns) as f64 * 1e-9).max(self.period_secs);
        let mean = |sums: &[f64]| {
            sums.iter()
                .map(|sum| sum / filling.samples)
                .collect::<Vec<_>>()
        };
        let velocity = (filling.last_position.iter().zip(&filling.first_position))
            .map(|(last, first)| (last - first) / span)
            .collect();
        let mut keyframe = Keyframe {
            samples: filling.samples,
            secs: filling.secs / filling.samples,
            length_secs: filling.samples * self.period_secs,
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

fn refill(sums: &mut Vec<f64>, length: usize) {
    sums.clear();
    sums.resize(length, 0.0);
}

fn add(sums: &mut [f64], values: &[f64]) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += value;
    }
}
