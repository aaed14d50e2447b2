//! The filter of Bimbo, Pacchierotti, Tsagarakis and Prattichizzo, _Collision Detection and Isolation on a Robot using
//! Joint Torque Sensing_ (IROS 2019), with its letters.

mod bulk;
mod draws;
mod likelihood;
mod motion;
mod offspring;
mod parameters;
mod schedule;
mod stage;
mod weights;
mod window;

use nalgebra::{Unit, Vector3};
use palpate_model::Robot;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use crate::Particle;
use crate::cloud::{BLOCK, Block, Cloud, Column, Run};
use crate::random::{Purpose, stream};
use crate::step::Step;

use draws::Draws;
use likelihood::LinkLikelihood;
pub use motion::MotionModel;
use motion::{LinkMotion, Room};
use offspring::{Generation, Nursery};
pub use parameters::PaperParameters;
use schedule::Level;
pub use stage::Stage;
use weights::{BlockWeights, Weights};
use window::Window;

/// The paper's particle filter. The state x = {n, p, F, K} of the particles is kept link by link.
pub(crate) struct PaperFilter {
    parameters: PaperParameters,
    count: usize,
    seed: u64,
    cloud: Cloud,
    offspring: Cloud,
    generation: Generation,
    weights: Weights,
    likelihoods: Vec<LinkLikelihood>,
    motions: Vec<LinkMotion>,
    /// How far the joints have moved since contact began, rad or m.
    travelled: f64,
    window: Window,
    /// Particles that the last sample moved; none where it made no step.
    moved: usize,
    processor: Arch,
}

impl PaperFilter {
    pub(crate) fn new(robot: &Robot, parameters: PaperParameters, count: usize, seed: u64) -> Self {
        let links = robot.links.len();
        let cloud = Cloud::with_room(links, count);
        Self {
            parameters,
            count,
            seed,
            offspring: cloud.clone(),
            generation: Generation::new(&cloud),
            weights: Weights::new(&cloud),
            cloud,
            likelihoods: vec![LinkLikelihood::default(); links],
            motions: vec![LinkMotion::default(); links],
            travelled: 0.0,
            window: Window::new(robot),
            moved: 0,
            processor: Arch::new(),
        }
    }

    /// Makes steps by the instructions of this kind of processor.
    #[cfg(test)]
    pub(crate) fn run_on(&mut self, processor: Arch) {
        self.processor = processor;
    }

    /// Forgets the last contact.
    pub(crate) fn begin(&mut self) {
        self.travelled = 0.0;
        self.cloud.clear();
        self.window.clear();
    }

    /// Takes a sample in, and makes a step by the mean of the samples since the last one when it is time.
    pub(crate) fn step(&mut self, sample: &Step, stamp_ns: i64) {
        self.window.add(stamp_ns, sample.position, sample.torque);
        self.moved = 0;
        if !self.cloud.is_empty() && !self.window.is_full(self.parameters.rate_hz) {
            return;
        }
        let mut window = std::mem::take(&mut self.window);
        window.close(sample.robot, self.cloud.is_empty());
        // Into the pool once a step, not once a loop.
        rayon::scope(|_| self.update(&window.step(sample)));
        self.window = window;
    }

    /// One step of the filter: propagate, reweight, normalise, resample.
    fn update(&mut self, step: &Step) {
        self.travelled += step.joint_motion();
        let level = Level::at(&self.parameters, self.travelled);
        self.condition(step);
        let most = self.count.min(step.limit);
        if self.cloud.is_empty() {
            self.renew(step, [0, most]);
        }
        self.moved = self.cloud.len();
        self.propagate_and_reweight(step, &level);
        self.weights.normalise(&mut self.cloud);
        let least = self.parameters.resample_below * self.moved as f64;
        let is_poor = self.weights.effective_sample_size() < least;
        // So few that it is worth a resampling, or too many.
        let misfits = self.moved < most / 2 || self.moved > most;
        if is_poor || misfits {
            self.resample(step);
        }
    }

    /// Particles that the last sample moved and weighed.
    pub(crate) fn moved(&self) -> usize {
        self.moved
    }

    /// Makes a new generation of as many as there may be, some of them fresh.
    fn resample(&mut self, step: &Step) {
        let most = self.count.min(step.limit);
        let fresh = (self.parameters.fresh_share * most as f64).round() as usize;
        self.renew(step, [most - fresh, fresh]);
    }

    /// Conditions the models on this sample: what all particles of a link share.
    fn condition(&mut self, step: &Step) {
        for &link in step.skin.links() {
            self.motions[link] = LinkMotion::new(self.parameters.motion_model, step, link);
            self.likelihoods[link] = LinkLikelihood::new(step, link);
        }
    }

    /// Both in one pass over memory, block by block.
    fn propagate_and_reweight(&mut self, step: &Step, level: &Level) {
        let pass = Pass {
            step,
            level,
            motions: &self.motions,
            likelihoods: &self.likelihoods,
            starts: &self.cloud.starts,
            seed: self.seed,
            largest_before: self.weights.largest(),
        };
        (self.cloud.blocks.par_iter_mut())
            .zip(self.weights.blocks_mut())
            .enumerate()
            .for_each_init(Scratch::default, |scratch, (index, (block, weights))| {
                *weights = self.processor.dispatch(OfBlock {
                    pass: &pass,
                    index,
                    block,
                    scratch,
                });
            });
    }

    /// Makes a new generation of so many children and so many fresh particles; all weigh the same.
    fn renew(&mut self, step: &Step, counts: [usize; 2]) {
        let nursery = Nursery {
            skin: step.skin,
            likelihoods: &self.likelihoods,
            parameters: &self.parameters,
            seed: self.seed,
            number: step.number,
        };
        (self.generation).fill(&self.cloud, &mut self.offspring, counts, &nursery);
        std::mem::swap(&mut self.cloud, &mut self.offspring);
        self.weights.renew(&self.cloud);
    }

    /// The particles, with their weights.
    pub(crate) fn cloud(&self) -> &Cloud {
        &self.cloud
    }

    /// The particles as the outside sees them.
    pub(crate) fn particles(&self) -> Vec<Particle> {
        let links = 0..self.cloud.starts.len() - 1;
        let of_link = |link| {
            let blocks = self.cloud.of_link(link);
            blocks.flat_map(move |(block, range)| range.map(move |at| shown(link, block, at)))
        };
        links.flat_map(of_link).collect()
    }
}

/// What all blocks share in one pass.
struct Pass<'a> {
    step: &'a Step<'a>,
    level: &'a Level,
    motions: &'a [LinkMotion],
    likelihoods: &'a [LinkLikelihood],
    starts: &'a [usize],
    seed: u64,
    largest_before: f32,
}

/// Room for what is needed of one block and no longer.
struct Scratch {
    draws: Draws,
    room: Room,
    errors: Column,
}

impl Default for Scratch {
    fn default() -> Self {
        Self {
            draws: Draws::default(),
            room: Room::default(),
            errors: [0.0; BLOCK],
        }
    }
}

/// One block in one pass. As a type of its own it is compiled for each kind of processor that it may run on; all must be
/// inlined for that. The operations are the same and in the same order, and so are the bits.
struct OfBlock<'a> {
    pass: &'a Pass<'a>,
    index: usize,
    block: &'a mut Block,
    scratch: &'a mut Scratch,
}

impl WithSimd for OfBlock<'_> {
    type Output = BlockWeights;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> BlockWeights {
        let Self {
            pass,
            index,
            block,
            scratch,
        } = self;
        let Scratch {
            draws,
            room,
            errors,
        } = scratch;
        let number = pass.step.number;
        draws.draw(
            pass.level,
            &mut stream(pass.seed, number, index, Purpose::Propagate),
        );
        for Run { link, range } in Cloud::runs(pass.starts, index) {
            let surface = pass.step.skin.surface(link);
            pass.motions[link].propagate(block, range.clone(), surface, draws, room);
            pass.likelihoods[link].squared_errors(block, range, &mut room.places, errors);
        }
        let count = pass.starts.last().copied().unwrap_or(0);
        let held = (count - index * BLOCK).min(BLOCK);
        BlockWeights::reweight(block, held, errors, pass.level.lambda, pass.largest_before)
    }
}

fn shown(link: usize, block: &Block, at: usize) -> Particle {
    let normal: Vector3<f64> = block.normal(at).cast();
    Particle {
        link,
        point_in_link: block.point(at).cast().into(),
        triangle: block.triangle[at],
        normal_in_link: Unit::new_normalize(normal),
        force: f64::from(block.force[at]),
        stiffness: f64::from(block.stiffness[at]),
        weight: f64::from(block.weight[at]) * block.scale,
    }
}
