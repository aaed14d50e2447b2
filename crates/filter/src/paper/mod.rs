//! The filter of Bimbo, Pacchierotti, Tsagarakis and Prattichizzo, _Collision Detection and Isolation on a Robot using
//! Joint Torque Sensing_ (IROS 2019), with its letters.

mod likelihood;
mod motion;
mod parameters;
mod schedule;

use nalgebra::Point3;
use rand::{Rng, RngExt};
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
    seed: u64,
    particles: Vec<State>,
    offspring: Vec<State>,
    weights: Vec<f64>,
    chosen: Vec<u32>,
    likelihoods: Vec<LinkLikelihood>,
    motions: Vec<LinkMotion>,
    /// How far the joints have moved since contact began, rad or m.
    travelled: f64,
}

impl PaperFilter {
    pub(crate) fn new(parameters: PaperParameters, count: usize, links: usize, seed: u64) -> Self {
        Self {
            parameters,
            seed,
            particles: Vec::with_capacity(count),
            offspring: Vec::with_capacity(count),
            weights: Vec::with_capacity(count),
            chosen: Vec::with_capacity(count),
            likelihoods: vec![LinkLikelihood::default(); links],
            motions: vec![LinkMotion::default(); links],
            travelled: 0.0,
        }
    }

    /// Spreads all particles over the whole skin, as at the start of a contact.
    pub(crate) fn begin(&mut self, skin: &Skin, step: u64, count: usize) {
        self.travelled = 0.0;
        let mut random = stream(self.seed, step, 0, Purpose::Spread);
        self.particles.clear();
        self.particles
            .extend((0..count).map(|_| spread(skin, &self.parameters, &mut random)));
    }

    /// One step: propagate, reweight, normalise, resample.
    pub(crate) fn step(&mut self, step: &Step) {
        self.travelled += step.joint_motion();
        let level = Level::at(&self.parameters, self.travelled);
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

    fn propagate(&mut self, step: &Step, level: &Level) {
        for &link in step.skin.links() {
            self.motions[link] = LinkMotion::new(self.parameters.motion_model, step, link);
        }
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
        for &link in step.skin.links() {
            self.likelihoods[link] = LinkLikelihood::new(step, link);
        }
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
                *particle = spread(step.skin, &self.parameters, &mut random);
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
            normal_in_link: skin.surface(state.link as usize).normal(state.triangle),
            force: state.force,
            stiffness: state.stiffness,
            weight,
        };
        cloud.extend(self.particles.iter().zip(&self.weights).map(show));
    }
}

/// A particle anywhere on the skin, uniform by area, with any force and stiffness of the ranges given.
fn spread(skin: &Skin, parameters: &PaperParameters, random: &mut impl Rng) -> State {
    let (link, place) = skin.sample(random.random());
    let [low, high] = parameters.stiffness_range;
    State {
        link: link as u16,
        triangle: place.triangle,
        point: place.point,
        force: parameters.force_max * random.random::<f64>(),
        stiffness: low * (high / low).powf(random.random()),
        log_weight: 0.0,
    }
}
