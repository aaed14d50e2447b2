//! The filter of Bimbo, Pacchierotti, Tsagarakis and Prattichizzo, _Collision Detection and Isolation on a Robot using
//! Joint Torque Sensing_ (IROS 2019), with its letters.

mod likelihood;
mod motion;
mod parameters;
mod schedule;
mod window;

use nalgebra::Point3;
use palpate_model::Robot;
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use rayon::prelude::*;

use crate::Particle;
use crate::random::{CHUNK, Purpose, stream};
use crate::resample::{effective_sample_size, normalise, systematic};
use crate::skin::Skin;
use crate::step::Step;

use likelihood::LinkLikelihood;
use motion::LinkMotion;
pub use motion::MotionModel;
pub use parameters::PaperParameters;
use schedule::Level;
use window::Window;

/// Relative spread of a fresh particle's force about the one that fits best.
const FORCE_SPREAD: f64 = 0.2;

/// The paper's state x = {n, p, F, K} of one particle, with its log weight.
#[derive(Clone, Copy, Debug)]
pub(crate) struct State {
    /// Link n.
    link: u16,
    /// Mesh triangle that p lies on.
    triangle: u32,
    /// Contact point p in the link's frame, m.
    point: Point3<f64>,
    /// Normal force F ≥ 0, N.
    force: f64,
    /// Contact stiffness K, N/m.
    stiffness: f64,
    log_weight: f64,
}

/// The paper's particle filter.
pub(crate) struct PaperFilter {
    parameters: PaperParameters,
    count: usize,
    seed: u64,
    particles: Vec<State>,
    offspring: Vec<State>,
    weights: Vec<f64>,
    chosen: Vec<u32>,
    likelihoods: Vec<LinkLikelihood>,
    motions: Vec<LinkMotion>,
    /// How far the joints have moved since contact began, rad or m.
    travelled: f64,
    window: Window,
}

impl PaperFilter {
    pub(crate) fn new(robot: &Robot, parameters: PaperParameters, count: usize, seed: u64) -> Self {
        Self {
            parameters,
            count,
            seed,
            particles: Vec::with_capacity(count),
            offspring: Vec::with_capacity(count),
            weights: Vec::with_capacity(count),
            chosen: Vec::with_capacity(count),
            likelihoods: vec![LinkLikelihood::default(); robot.links.len()],
            motions: vec![LinkMotion::default(); robot.links.len()],
            travelled: 0.0,
            window: Window::new(robot),
        }
    }

    /// Forgets the last contact.
    pub(crate) fn begin(&mut self) {
        self.travelled = 0.0;
        self.particles.clear();
        self.window.clear();
    }

    /// Takes a sample in, and makes a step by the mean of the samples since the last one when it is time.
    pub(crate) fn step(&mut self, sample: &Step, stamp_ns: i64) {
        self.window.add(stamp_ns, sample.position, sample.torque);
        if !self.particles.is_empty() && self.window.length_secs() < 1.0 / self.parameters.rate_hz {
            return;
        }
        let mut window = std::mem::take(&mut self.window);
        window.close(sample.robot, self.particles.is_empty());
        self.update(&window.step(sample));
        self.window = window;
    }

    /// One step of the filter: propagate, reweight, normalise, resample.
    fn update(&mut self, step: &Step) {
        self.travelled += step.joint_motion();
        let level = Level::at(&self.parameters, self.travelled);
        self.condition(step);
        if self.particles.is_empty() {
            self.spread(step);
        }
        self.propagate(step, &level);
        self.reweight(step, &level);
        normalise(
            self.particles.iter().map(|particle| particle.log_weight),
            &mut self.weights,
        );
        if effective_sample_size(&self.weights)
            < self.parameters.resample_below * self.particles.len() as f64
        {
            self.resample(step);
        }
    }

    /// Conditions the models on this sample: what all particles of a link share.
    fn condition(&mut self, step: &Step) {
        for &link in step.skin.links() {
            self.motions[link] = LinkMotion::new(self.parameters.motion_model, step, link);
            self.likelihoods[link] = LinkLikelihood::new(step, link);
        }
    }

    /// Spreads all particles over the whole skin, as at the start of a contact.
    fn spread(&mut self, step: &Step) {
        let mut random = stream(self.seed, step.number, 0, Purpose::Spread);
        let (likelihoods, parameters) = (&self.likelihoods, &self.parameters);
        let fresh = |_| fresh(step.skin, likelihoods, parameters, &mut random);
        self.particles.extend((0..self.count).map(fresh));
    }

    fn propagate(&mut self, step: &Step, level: &Level) {
        let (motions, skin, seed, number) = (&self.motions, step.skin, self.seed, step.number);
        self.particles
            .par_chunks_mut(CHUNK)
            .enumerate()
            .for_each(|(chunk, particles)| {
                let mut random = stream(seed, number, chunk, Purpose::Propagate);
                for particle in particles {
                    let link = particle.link as usize;
                    motions[link].propagate(particle, skin.surface(link), level, &mut random);
                }
            });
    }

    fn reweight(&mut self, step: &Step, level: &Level) {
        let (likelihoods, skin) = (&self.likelihoods, step.skin);
        self.particles.par_chunks_mut(CHUNK).for_each(|particles| {
            for particle in particles {
                let link = particle.link as usize;
                let normal = skin.surface(link).normal(particle.triangle);
                let squared =
                    likelihoods[link].squared_error(&particle.point, &normal, particle.force);
                // Eq. 5: p(z | x) = exp(−λ ‖τ_ext − τ̂‖²).
                particle.log_weight -= level.lambda * squared;
            }
        });
    }

    fn resample(&mut self, step: &Step) {
        let mut random = stream(self.seed, step.number, 0, Purpose::Resample);
        systematic(
            &self.weights,
            self.particles.len(),
            random.random(),
            &mut self.chosen,
        );
        self.offspring.clear();
        self.offspring.extend(
            self.chosen
                .iter()
                .map(|&parent| self.particles[parent as usize]),
        );
        let mut random = stream(self.seed, step.number, 0, Purpose::Fresh);
        for particle in &mut self.offspring {
            particle.log_weight = 0.0;
            if random.random::<f64>() < self.parameters.fresh_share {
                *particle = fresh(step.skin, &self.likelihoods, &self.parameters, &mut random);
            }
        }
        std::mem::swap(&mut self.particles, &mut self.offspring);
        self.weights.fill(1.0 / self.particles.len() as f64);
    }

    /// Writes the particles, with their weights, as the outside sees them.
    pub(crate) fn show(&self, skin: &Skin, cloud: &mut Vec<Particle>) {
        let show = |(state, &weight): (&State, &f64)| Particle {
            link: state.link as usize,
            point_in_link: state.point,
            triangle: state.triangle,
            normal_in_link: skin.surface(state.link as usize).normal(state.triangle),
            force: state.force,
            stiffness: state.stiffness,
            weight,
        };
        cloud.extend(self.particles.iter().zip(&self.weights).map(show));
    }
}

/// A particle anywhere on the skin, uniform by area, with a force about as large as the measured torques ask for there
/// and any stiffness of the range given.
fn fresh(
    skin: &Skin,
    likelihoods: &[LinkLikelihood],
    parameters: &PaperParameters,
    random: &mut impl Rng,
) -> State {
    let (link, place) = skin.sample(random.random());
    let normal = skin.surface(link).normal(place.triangle);
    let best_force = likelihoods[link].best_force(&place.point, &normal);
    let spread = 1.0 + FORCE_SPREAD * random.sample::<f64, _>(StandardNormal);
    let [low, high] = parameters.stiffness_range;
    State {
        link: link as u16,
        triangle: place.triangle,
        point: place.point,
        force: (best_force * spread).clamp(0.0, parameters.force_max),
        stiffness: low * (high / low).powf(random.random()),
        log_weight: 0.0,
    }
}
