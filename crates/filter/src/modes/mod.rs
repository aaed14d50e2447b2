//! Modes of a weighted cloud: where the weight gathers, link by link.

mod ball;
mod grid;

use std::ops::Range;

use nalgebra::Point3;
use palpate_model::{Kinematics, Robot};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use crate::Mode;
use crate::cloud::{BLOCK, Block, Cloud};
use crate::skin::Skin;

use ball::{Ball, Sums, add};
use grid::Grid;

/// About so many particles are asked where a mode is; what it is follows from all.
const GATHERED: usize = 2000;
/// Modes are looked for until they hold this share of the weight,
const ENOUGH: f64 = 0.95;
/// or there are this many,
const MOST: usize = 8;
/// or the next one would hold less than this.
const LEAST: f64 = 0.01;
/// Fewest blocks that are worth a thread of their own.
const FEW: usize = 4;

/// Finds modes; keeps its grids, so that finding allocates nothing in steady state.
pub(crate) struct ModeFinder {
    grids: Vec<Option<Grid>>,
    /// What the modes found so far hold, in their order.
    balls: Vec<Ball>,
    /// What each block adds to the sums over a ball.
    of_blocks: Vec<Sums>,
    processor: Arch,
}

impl ModeFinder {
    pub(crate) fn new(robot: &Robot, skin: &Skin) -> Self {
        let grid = |(index, link): (usize, &palpate_model::Link)| {
            skin.get(index)?;
            link.mesh.as_ref().map(|mesh| Grid::new(&mesh.vertices))
        };
        Self {
            grids: robot.links.iter().enumerate().map(grid).collect(),
            balls: Vec::with_capacity(MOST),
            of_blocks: Vec::new(),
            processor: Arch::new(),
        }
    }

    /// Searches by the instructions of this kind of processor.
    #[cfg(test)]
    pub(crate) fn run_on(&mut self, processor: Arch) {
        self.processor = processor;
    }

    /// Replaces `modes` by those of `cloud`, the heaviest first.
    pub(crate) fn find(
        &mut self,
        cloud: &Cloud,
        skin: &Skin,
        kinematics: &Kinematics,
        modes: &mut Vec<Mode>,
    ) {
        self.processor.dispatch(Search {
            finder: self,
            cloud,
            skin,
            kinematics,
            modes,
        });
    }

    #[inline(always)]
    fn search(
        &mut self,
        cloud: &Cloud,
        skin: &Skin,
        kinematics: &Kinematics,
        modes: &mut Vec<Mode>,
    ) {
        modes.clear();
        self.balls.clear();
        self.gather(cloud);
        let mut held = 0.0;
        while modes.len() < MOST && held < ENOUGH {
            let Some((link, peak)) = self.heaviest() else {
                break;
            };
            let ball = self.climb(cloud, link, peak);
            let mut mode = self.sums(cloud, &ball).mode(&ball, skin, kinematics);
            // Single precision may sum to a little more than there is.
            mode.probability = mode.probability.min(1.0 - held).max(0.0);
            held += mode.probability;
            if mode.probability < LEAST {
                break;
            }
            modes.push(mode);
            if held < ENOUGH {
                self.take_out(cloud, &ball);
            }
            self.balls.push(ball);
        }
        modes.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    }

    #[inline(always)]
    fn gather(&mut self, cloud: &Cloud) {
        for (link, grid) in self.grids.iter_mut().enumerate() {
            let Some(grid) = grid else { continue };
            grid.clear();
            for (block, range) in some_of_link(cloud, link) {
                grid.add(block, &range, &block.weight, block.scale as f32);
            }
        }
    }

    /// Centre of the cell with the largest weight in and around it, over all links.
    fn heaviest(&self) -> Option<(usize, Point3<f64>)> {
        let best = (self.grids.iter().enumerate())
            .filter_map(|(link, grid)| grid.as_ref()?.peak().map(|(weight, at)| (weight, link, at)))
            .max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some((best.1, best.2))
    }

    /// Two steps of mean shift (Comaniciu and Meer 2002) with a flat kernel.
    #[inline(always)]
    fn climb(&self, cloud: &Cloud, link: usize, start: Point3<f64>) -> Ball {
        let centre = start.coords.cast().into();
        let mut ball = Ball { link, centre };
        for _ in 0..2 {
            let mut sums = [0.0; 4];
            for (block, range) in some_of_link(cloud, link) {
                let held = ball.hold(&self.balls, block, &range);
                add(&mut sums, &ball.pull(block, &range, &held));
            }
            let [total, ..] = sums;
            if total > 0.0 {
                for axis in 0..3 {
                    ball.centre[axis] += (sums[axis + 1] / total) as f32;
                }
            }
        }
        ball
    }

    /// Sums up what `ball` holds: each block by itself, and then all in their order, so that the number of threads changes
    /// no bit.
    fn sums(&mut self, cloud: &Cloud, ball: &Ball) -> Sums {
        let mut of_blocks = std::mem::take(&mut self.of_blocks);
        let blocks = cloud.blocks_of_link(ball.link);
        of_blocks.resize(blocks.len(), Sums::ZERO);
        let sum = |(at, sums): (usize, &mut Sums)| {
            let (block, range) = cloud.block_of_link(ball.link, blocks.start + at);
            *sums = self.processor.dispatch(OfBlock {
                ball,
                earlier: &self.balls,
                block,
                range,
            });
        };
        // From outside the pool, the way in would take longer.
        match rayon::current_thread_index() {
            Some(_) => (of_blocks.par_iter_mut().with_min_len(FEW).enumerate()).for_each(sum),
            None => of_blocks.iter_mut().enumerate().for_each(sum),
        }
        let mut all = Sums::ZERO;
        of_blocks.iter().for_each(|sums| all.add(sums));
        self.of_blocks = of_blocks;
        all
    }

    /// Takes the weight that `ball` holds out of the search.
    #[inline(always)]
    fn take_out(&mut self, cloud: &Cloud, ball: &Ball) {
        let Some(grid) = &mut self.grids[ball.link] else {
            return;
        };
        for (block, range) in some_of_link(cloud, ball.link) {
            let held = ball.hold(&self.balls, block, &range);
            grid.add(block, &range, &held, -block.scale as f32);
        }
    }
}

/// The sums over what a ball holds of one block, compiled for each kind of processor that they may run on.
struct OfBlock<'a> {
    ball: &'a Ball,
    earlier: &'a [Ball],
    block: &'a Block,
    range: Range<usize>,
}

impl WithSimd for OfBlock<'_> {
    type Output = Sums;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Sums {
        let Self {
            ball,
            earlier,
            block,
            range,
        } = self;
        let held = ball.hold(earlier, block, &range);
        ball.sums(block, &range, &held)
    }
}

/// A search, compiled for each kind of processor that it may run on.
struct Search<'a> {
    finder: &'a mut ModeFinder,
    cloud: &'a Cloud,
    skin: &'a Skin,
    kinematics: &'a Kinematics,
    modes: &'a mut Vec<Mode>,
}

impl WithSimd for Search<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        (self.finder).search(self.cloud, self.skin, self.kinematics, self.modes);
    }
}

/// About [`GATHERED`] of all particles, those of a link: the first ones of each block.
fn some_of_link(cloud: &Cloud, link: usize) -> impl Iterator<Item = (&Block, Range<usize>)> {
    let one_in = (cloud.len() / GATHERED).clamp(1, BLOCK / 8);
    let of_link = cloud.of_link(link);
    of_link.map(move |(block, range)| {
        (
            block,
            range.start..range.start + range.len().div_ceil(one_in),
        )
    })
}
