//! The estimator of this project: the paper's curvature model with memory.
//!
//! A particle is an obstacle that rests in the world ([`obstacle`]); its weight is the evidence of the contact's whole
//! history ([`memory`], [`evidence`]), with force, stiffness, friction and bias solved and the noise learned
//! ([`noise`]). Peaks of the evidence are found by asking every triangle ([`scan`]) and climbing ([`peaks`]); Markov
//! chain moves ([`moves`]) carry the particles between and around them, so that a wrong mode is left again.

mod chart;
mod evidence;
mod history;
mod memory;
mod moves;
mod noise;
mod obstacle;
mod parameters;
mod peaks;
mod scan;
mod sight;

use palpate_model::Robot;
use rand::{Rng, RngExt};
use rayon::prelude::*;

use crate::random::{Purpose, stream};
use crate::resample::{effective_sample_size, normalise, systematic};
use crate::step::Step;
use crate::{Mode, Particle};

use evidence::Evidence;
pub(crate) use evidence::MOST_JOINTS;
use history::History;
use memory::Memory;
use moves::Proposals;
use nalgebra::Matrix3;
use noise::Noise;
use obstacle::Obstacle;
pub use parameters::PalpateParameters;
use peaks::Peak;

/// Particles that share one random stream and one unit of parallel work.
const CHUNK: usize = 32;
/// Draws for each particle at the start.
const FIRST_DRAWS: usize = 8;

/// Climbs from new places at each keyframe, from the best peaks first, and the steps of each.
const HOPS: usize = 6;
const HOP_CLIMB: usize = 3;

/// Variance of a contact's place on a link without a peak, m².
const UNSEEN: f64 = 0.01;

/// One particle: an obstacle and what the history says of it.
#[derive(Clone, Copy, Debug)]
struct Hypothesis {
    obstacle: Obstacle,
    evidence: Evidence,
    log_prior: f64,
    log_weight: f64,
}

/// The filter of this project.
pub(crate) struct PalpateFilter {
    parameters: PalpateParameters,
    seed: u64,
    memory: Memory,
    noise: Noise,
    particles: Vec<Hypothesis>,
    weights: Vec<f64>,
    peaks: Vec<Peak>,
    /// Keyframes since the contact began.
    keyframes: usize,
}

impl PalpateFilter {
    pub(crate) fn new(robot: &Robot, parameters: PalpateParameters, seed: u64) -> Self {
        Self {
            parameters,
            seed,
            memory: Memory::new(robot),
            noise: Noise::new(robot.dof()),
            particles: Vec::new(),
            weights: Vec::new(),
            peaks: Vec::new(),
            keyframes: 0,
        }
    }

    /// Forgets the last contact.
    pub(crate) fn begin(&mut self, stamp_ns: i64) {
        self.memory.begin(stamp_ns);
        self.noise.begin();
        self.particles.clear();
        self.peaks.clear();
        self.keyframes = 0;
    }

    /// One step: remember; at each completed keyframe calibrate, reweigh, resample, look for peaks, move.
    pub(crate) fn step(&mut self, step: &Step, stamp_ns: i64) {
        self.noise.learn(step.torque);
        if !self
            .memory
            .push(step.robot, stamp_ns, step.position, step.torque)
        {
            return;
        }
        self.keyframes += 1;
        self.calibrate(step);
        self.noise.sum(&self.memory.keyframes);
        if self.particles.is_empty() {
            self.spread(step);
        } else {
            self.reweigh(step);
        }
        self.resample(step);
        self.seek_peaks(step);
        for round in 0..self.parameters.rounds {
            self.mutate(step, round);
        }
    }

    /// Learns from the best hypothesis' residuals how much larger they are than the noise model says.
    fn calibrate(&mut self, step: &Step) {
        let peak = self.peaks.iter().map(|peak| (peak.obstacle, peak.evidence));
        let particle = self
            .particles
            .iter()
            .map(|particle| (particle.obstacle, particle.evidence));
        let best = peak
            .chain(particle)
            .max_by(|a, b| a.1.log.total_cmp(&b.1.log));
        if let Some((obstacle, evidence)) = best {
            let history = history(step, &self.memory, &self.noise);
            let inflation = self.noise.calibrated(&obstacle, &evidence, &history);
            self.noise.inflate(inflation);
        }
    }

    /// Particles all over the robot, with any radius, as likely as the first keyframe says.
    fn spread(&mut self, step: &Step) {
        let history = history(step, &self.memory, &self.noise);
        let (seed, count) = (self.seed, self.parameters.hypotheses * FIRST_DRAWS);
        self.particles = (0..count.div_ceil(CHUNK))
            .into_par_iter()
            .flat_map_iter(|chunk| {
                let mut random = stream(seed, step.number, chunk, Purpose::Spread);
                (0..CHUNK).map(move |_| draw(&history, &mut random))
            })
            .collect();
    }

    /// Weighs every particle by what the newest keyframe changed in its evidence.
    fn reweigh(&mut self, step: &Step) {
        let history = history(step, &self.memory, &self.noise);
        self.particles
            .par_iter_mut()
            .with_min_len(CHUNK)
            .for_each(|particle| {
                let evidence = history.evidence(&mut particle.obstacle);
                particle.log_weight += evidence.log - particle.evidence.log;
                particle.log_prior = history.log_prior(&particle.obstacle, evidence.reference);
                particle.evidence = evidence;
            });
    }

    fn resample(&mut self, step: &Step) {
        let count = self.parameters.hypotheses;
        normalise(
            self.particles.iter().map(|particle| particle.log_weight),
            &mut self.weights,
        );
        if self.particles.len() == count
            && effective_sample_size(&self.weights) > 0.5 * count as f64
        {
            return;
        }
        let mut random = stream(self.seed, step.number, 0, Purpose::Resample);
        let mut chosen = Vec::new();
        systematic(&self.weights, count, random.random(), &mut chosen);
        self.particles = (chosen.iter())
            .map(|&parent| Hypothesis {
                log_weight: 0.0,
                ..self.particles[parent as usize]
            })
            .collect();
    }

    /// Keeps the peaks on top of the evidence, and now and then looks for others.
    fn seek_peaks(&mut self, step: &Step) {
        let history = history(step, &self.memory, &self.noise);
        self.peaks
            .par_iter_mut()
            .for_each(|peak| peak.climb(&history, 1));
        self.peaks.extend(self.hop(step, &history));
        if scan::is_due(self.keyframes) {
            self.peaks.extend(scan::peaks(&history));
        }
        peaks::keep_best(&mut self.peaks);
        self.peaks
            .par_iter_mut()
            .for_each(|peak| peak.sight = sight::sight(peak, &history));
    }

    /// Basin hopping (Wales and Doye 1997): climbs anew from beside the best peaks, and from some particles.
    fn hop(&self, step: &Step, history: &History) -> Vec<Peak> {
        let starts = |index: usize| {
            let mut random = stream(self.seed, step.number, index, Purpose::Hop);
            match self.peaks.get(index).filter(|_| index < HOPS - 2) {
                Some(peak) => Obstacle {
                    core: peak.draw(history, &mut random),
                    ..peak.obstacle
                },
                None => self.particles[random.random_range(0..self.particles.len())].obstacle,
            }
        };
        (0..HOPS)
            .into_par_iter()
            .map(|index| {
                let mut peak = Peak::new(starts(index), history);
                peak.climb(history, HOP_CLIMB);
                peak
            })
            .collect()
    }

    fn mutate(&mut self, step: &Step, round: usize) {
        let history = history(step, &self.memory, &self.noise);
        let others = self.particles.clone();
        let proposals = Proposals::new(history, &others, &self.peaks);
        let (seed, chunks) = (self.seed, others.len().div_ceil(CHUNK));
        self.particles
            .par_chunks_mut(CHUNK)
            .enumerate()
            .for_each(|(chunk, particles)| {
                let mut random = stream(
                    seed,
                    step.number,
                    chunk + round * chunks,
                    Purpose::Propagate,
                );
                for particle in particles {
                    proposals.mutate(particle, &mut random);
                }
            });
    }

    /// Adds to the modes' covariances what particles cannot show: the errors that systematically wrong torques cause.
    pub(crate) fn widen(&self, step: &Step, modes: &mut [Mode]) {
        for mode in modes {
            let apart = |peak: &&Peak| (peak.touch.point - mode.point_in_link).norm();
            let nearest = (self
                .peaks
                .iter()
                .filter(|peak| peak.obstacle.link as usize == mode.link))
            .min_by(|a, b| apart(a).total_cmp(&apart(b)));
            let sight = nearest.map_or_else(|| Matrix3::identity() * UNSEEN, |peak| peak.sight);
            let rotation = step
                .now
                .root_from_link(mode.link)
                .rotation
                .to_rotation_matrix();
            mode.covariance_in_root += rotation * sight * rotation.transpose();
        }
    }

    /// Writes the particles, with their weights, as the outside sees them at this sample.
    pub(crate) fn show(&mut self, step: &Step, cloud: &mut Vec<Particle>) {
        normalise(
            self.particles.iter().map(|particle| particle.log_weight),
            &mut self.weights,
        );
        cloud.extend(
            self.particles
                .iter()
                .zip(&self.weights)
                .map(|(particle, &weight)| {
                    let link = particle.obstacle.link as usize;
                    let link_from_root = step.now.root_from_link(link).inverse();
                    let touch = particle.obstacle.touch(step.skin, &link_from_root);
                    Particle {
                        link,
                        point_in_link: touch.point,
                        normal_in_link: touch.normal,
                        force: particle.evidence.force_at(touch.distance),
                        stiffness: particle.evidence.stiffness.max(0.0),
                        weight,
                    }
                }),
        );
    }
}

fn history<'a>(step: &Step<'a>, memory: &'a Memory, noise: &'a Noise) -> History<'a> {
    History {
        robot: step.robot,
        skin: step.skin,
        keyframes: &memory.keyframes,
        noise,
    }
}

/// A ball or bar anywhere on the robot.
fn draw(history: &History, random: &mut impl Rng) -> Hypothesis {
    let (link, place) = history.skin.sample(random.random());
    let [least, most] = obstacle::RADIUS_RANGE;
    let radius = least * (most / least).powf(random.random());
    let normal = history.skin.surface(link).normal(place.triangle);
    let turn = std::f64::consts::PI * random.random::<f64>();
    let bar = random.random::<bool>().then_some(turn);
    let mut obstacle =
        history.obstacle_on(link, place.triangle, &place.point, &normal, radius, bar);
    let evidence = history.evidence(&mut obstacle);
    Hypothesis {
        obstacle,
        evidence,
        log_prior: history.log_prior(&obstacle, radius),
        log_weight: evidence.log,
    }
}
