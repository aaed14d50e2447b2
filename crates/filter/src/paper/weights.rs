//! Weights by blocks: each block normalises its own, so that one pass does, and what all blocks share comes after.

use super::bulk::exp;
use crate::cloud::{Block, Cloud, Column};

/// Log weights end here: lower ones weigh nothing, and differences of them would not be finite.
const LEAST: f32 = -1e30;

/// Sums are kept in so many parts, so that they can be added side by side.
const LANES: usize = 8;

/// What a block's weights amount to.
#[derive(Clone, Copy, Default)]
pub(super) struct BlockWeights {
    /// The largest log weight.
    largest: f32,
    /// Sums of the weights and of their squares, both relative to the largest.
    sum: f64,
    squares: f64,
}

impl BlockWeights {
    /// Eq. 5: p(z | x) = exp(−λ ‖τ_ext − τ̂‖²), for the first `held` particles of a block, given the squared errors (Nm²)
    /// and the largest log weight before, which is taken off.
    #[inline(always)]
    pub(super) fn reweight(
        block: &mut Block,
        held: usize,
        errors: &Column,
        lambda: f64,
        before: f32,
    ) -> Self {
        let lambda = lambda as f32;
        for (log, error) in block.log_weight.iter_mut().zip(errors) {
            *log = (*log - before - error * lambda).max(LEAST);
        }
        block.log_weight[held..].fill(LEAST);
        let logs = block.log_weight.as_chunks::<LANES>().0;
        let larger = |largest: [f32; LANES], logs: &[f32; LANES]| {
            std::array::from_fn(|lane| largest[lane].max(logs[lane]))
        };
        let largest = logs.iter().fold([LEAST; LANES], larger);
        let largest = largest.into_iter().fold(LEAST, f32::max);
        for (weight, log) in block.weight.iter_mut().zip(&block.log_weight) {
            *weight = exp(log - largest);
        }
        block.weight[held..].fill(0.0);
        let (mut sum, mut squares) = ([0.0; LANES], [0.0; LANES]);
        for weights in block.weight.as_chunks::<LANES>().0 {
            for ((sum, squares), &weight) in sum.iter_mut().zip(&mut squares).zip(weights) {
                let weight = f64::from(weight);
                *sum += weight;
                *squares += weight * weight;
            }
        }
        Self {
            largest,
            sum: total(sum),
            squares: total(squares),
        }
    }
}

#[inline(always)]
fn total(lanes: [f64; LANES]) -> f64 {
    lanes.into_iter().sum()
}

/// The weights of all blocks.
pub(super) struct Weights {
    blocks: Vec<BlockWeights>,
    largest: f32,
    effective_sample_size: f64,
}

impl Weights {
    pub(super) fn new(cloud: &Cloud) -> Self {
        Self {
            blocks: vec![BlockWeights::default(); cloud.blocks.len()],
            largest: 0.0,
            effective_sample_size: 0.0,
        }
    }

    pub(super) fn blocks_mut(&mut self) -> &mut [BlockWeights] {
        &mut self.blocks
    }

    /// The largest log weight after the last step; the next one takes it off.
    pub(super) fn largest(&self) -> f32 {
        self.largest
    }

    /// Effective sample size 1 / Σ w² of normalised weights (Kong, Liu and Wong 1994).
    pub(super) fn effective_sample_size(&self) -> f64 {
        self.effective_sample_size
    }

    /// Those of a new generation: all are equal, all log weights zero.
    pub(super) fn renew(&mut self, cloud: &Cloud) {
        self.blocks
            .resize_with(cloud.blocks.len(), BlockWeights::default);
        self.largest = 0.0;
    }

    /// Sets the blocks' scales so that all weights sum to one.
    pub(super) fn normalise(&mut self, cloud: &mut Cloud) {
        let logs = self.blocks.iter().map(|block| block.largest);
        let largest = logs.fold(LEAST, f32::max);
        let scale = |block: &BlockWeights| f64::from(block.largest - largest).exp();
        let (mut sum, mut squares) = (0.0, 0.0);
        for block in &self.blocks {
            sum += block.sum * scale(block);
            squares += block.squares * scale(block).powi(2);
        }
        for (weights, block) in self.blocks.iter().zip(&mut cloud.blocks) {
            block.scale = scale(weights) / sum;
        }
        self.largest = largest;
        self.effective_sample_size = sum * sum / squares;
    }
}
