//! Parts of the step by themselves, for benchmarks.

use std::hint::black_box;
use std::ops::Range;

use pulp::{Simd, WithSimd};
use rand::Rng;

use super::draws::Draws;
use super::likelihood::LinkLikelihood;
use super::schedule::Level;
use super::{PaperFilter, Scratch};
use crate::cloud::{Block, Cloud};
use crate::random::{Purpose, stream};
use crate::step::Step;

/// A part of the step.
#[derive(Clone, Copy, Debug)]
pub enum Stage {
    /// Random numbers for all particles.
    Draws,
    /// Predicted against measured torques of all particles.
    Likelihood,
    /// Both with the projections, as they are done in the step: in one pass.
    PropagateAndReweight,
    /// Common scale of all weights.
    Normalise,
    /// A new generation.
    Resample,
    /// Modes of the cloud.
    Modes,
}

impl PaperFilter {
    /// Runs one stage by itself, on the particles as they are.
    pub(crate) fn run_stage(&mut self, stage: Stage, step: &Step) {
        let level = Level::at(&self.parameters, self.travelled);
        let scratch = &mut Scratch::default();
        match stage {
            Stage::Draws => {
                for index in 0..self.cloud.blocks.len() {
                    let purpose = Purpose::Propagate;
                    let random = stream(self.seed, step.number, index, purpose);
                    let draws = &mut scratch.draws;
                    self.processor.dispatch(Draw {
                        level: &level,
                        random,
                        draws,
                    });
                    black_box(&scratch.draws);
                }
            }
            Stage::Likelihood => {
                for (index, block) in self.cloud.blocks.iter().enumerate() {
                    for run in Cloud::runs(&self.cloud.starts, index) {
                        self.processor.dispatch(Weigh {
                            likelihood: &self.likelihoods[run.link],
                            block,
                            range: run.range,
                            scratch,
                        });
                    }
                    black_box(&scratch.errors);
                }
            }
            Stage::PropagateAndReweight => self.propagate_and_reweight(step, &level),
            Stage::Normalise => self.weights.normalise(&mut self.cloud),
            Stage::Resample => self.resample(step),
            Stage::Modes => {}
        }
    }
}

struct Draw<'a, R> {
    level: &'a Level,
    random: R,
    draws: &'a mut Draws,
}

impl<R: Rng> WithSimd for Draw<'_, R> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) {
        self.draws.draw(self.level, &mut self.random);
    }
}

struct Weigh<'a> {
    likelihood: &'a LinkLikelihood,
    block: &'a Block,
    range: Range<usize>,
    scratch: &'a mut Scratch,
}

impl WithSimd for Weigh<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Scratch { room, errors, .. } = self.scratch;
        (self.likelihood).squared_errors(self.block, self.range, &mut room.places, errors);
    }
}
