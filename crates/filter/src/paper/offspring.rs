//! The next generation: children of the weighted particles, and fresh ones anywhere on the skin.
//!
//! Systematic resampling (Thrun, Burgard and Fox, Probabilistic Robotics, 2005, section 4.2.4) keeps the order of the
//! particles; the fresh ones go to the end of each link's, so that those of a link stay side by side. Which child has
//! which parent follows from sums over blocks, so that blocks of children are filled independently of each other.

use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use rayon::prelude::*;

use super::PaperParameters;
use super::likelihood::LinkLikelihood;
use crate::Particle;
use crate::cloud::{BLOCK, Block, Cloud, Run};
use crate::random::{Purpose, stream};
use crate::skin::Skin;

/// Relative spread of a fresh particle's force about the one that fits best.
const FORCE_SPREAD: f64 = 0.2;

/// Parents in one strip: sums of weights before each tell where to look for the parents of a block of children.
const STRIP: usize = 32;
const STRIPS: usize = BLOCK / STRIP;

/// Who the parents are, where the children go.
#[derive(Default)]
pub(super) struct Generation {
    /// Sum of the weights before each strip, and of all.
    before_strip: Vec<f64>,
    /// Number of children before each link, and of all.
    children: Vec<usize>,
    /// Place of the systematic comb, in teeth: 0 … 1.
    offset: f64,
}

/// What fresh particles are drawn by.
pub(super) struct Nursery<'a> {
    pub(super) skin: &'a Skin,
    pub(super) likelihoods: &'a [LinkLikelihood],
    pub(super) parameters: &'a PaperParameters,
    pub(super) seed: u64,
    pub(super) number: u64,
}

impl Generation {
    /// Room for the parents that `cloud` has room for.
    pub(super) fn new(cloud: &Cloud) -> Self {
        Self {
            before_strip: Vec::with_capacity(cloud.blocks.len() * STRIPS + 1),
            children: Vec::with_capacity(cloud.starts.len()),
            offset: 0.0,
        }
    }

    /// Fills `offspring` with so many children of `parents` and so many fresh particles, all of equal weight.
    pub(super) fn fill(
        &mut self,
        parents: &Cloud,
        offspring: &mut Cloud,
        [children, fresh]: [usize; 2],
        nursery: &Nursery,
    ) {
        let mut random = stream(nursery.seed, nursery.number, 0, Purpose::Resample);
        self.offset = random.random();
        self.count_children(parents, children);
        let mut area = 0.0;
        let links = offspring.starts.len() - 1;
        for (link, start) in offspring.starts[..links].iter_mut().enumerate() {
            let share = area / nursery.skin.area();
            let fresh_before = (share * fresh as f64).round() as usize;
            *start = self.children[link] + fresh_before.min(fresh);
            area += nursery.skin.get(link).map_or(0.0, |surface| surface.area());
        }
        offspring.starts[links] = children + fresh;
        offspring.fit();
        let (starts, blocks) = (&offspring.starts, &mut offspring.blocks);
        let scale = 1.0 / (children + fresh) as f64;
        blocks
            .par_iter_mut()
            .enumerate()
            .for_each(|(index, block)| {
                block.weight.fill(1.0);
                block.log_weight.fill(0.0);
                block.scale = scale;
                let mut random = stream(nursery.seed, nursery.number, index, Purpose::Fresh);
                for run in Cloud::runs(starts, index) {
                    let first = index * BLOCK + run.range.start - starts[run.link];
                    self.fill_run(parents, block, &run, first, nursery, &mut random);
                }
            });
    }

    /// Sums the parents' weights, and shares the children out between the links.
    fn count_children(&mut self, parents: &Cloud, children: usize) {
        let mut sum = 0.0;
        self.before_strip.clear();
        self.before_strip.push(sum);
        for block in &parents.blocks[..parents.len().div_ceil(BLOCK)] {
            // Places after the last parent weigh nothing.
            for weights in block.weight.as_chunks::<STRIP>().0 {
                sum += sum_of(weights) * block.scale;
                self.before_strip.push(sum);
            }
        }
        self.children.clear();
        for &start in &parents.starts {
            let before = self.before(parents, start) / sum.max(f64::MIN_POSITIVE);
            let teeth = (before * children as f64 - self.offset).ceil().max(0.0) as usize;
            // After the last parent comes no child, however the sums were rounded: links that end the list empty get none.
            let is_end = start == parents.len();
            self.children.push(if is_end {
                children
            } else {
                teeth.min(children)
            });
        }
    }

    /// Sum of the weights of the parents before this one.
    fn before(&self, parents: &Cloud, index: usize) -> f64 {
        if index == parents.len() {
            return self.total();
        }
        let (block, at) = (&parents.blocks[index / BLOCK], index % BLOCK);
        let within = &block.weight[at / STRIP * STRIP..at];
        let sum: f64 = within.iter().map(|&weight| f64::from(weight)).sum();
        self.before_strip[index / STRIP] + sum * block.scale
    }

    fn total(&self) -> f64 {
        self.before_strip.last().copied().unwrap_or(0.0)
    }

    /// The parents of at most [`BLOCK`] successive children, of which `first` is the number of the first: of each the
    /// first one with which the sum of the weights reaches the child's tooth. How many children a parent has cannot be
    /// predicted, so no branch asks: each is put down where its children would begin, and gives way to the next one
    /// where it has none.
    fn find_parents(
        &self,
        parents: &Cloud,
        first: usize,
        children: usize,
    ) -> impl Iterator<Item = u32> {
        let mut places = [0; 2 * BLOCK];
        let teeth = self.children.last().copied().unwrap_or(0) as f64;
        let per_weight = teeth / self.total().max(f64::MIN_POSITIVE);
        let before = first as f64 + self.offset;
        let ends = &self.before_strip[1..];
        let begin = ends.partition_point(|&end| end * per_weight < before);
        let mut next = 0;
        for strip in begin.min(ends.len().saturating_sub(1))..ends.len() {
            if next == children {
                break;
            }
            let block = &parents.blocks[strip / STRIPS];
            let scale = block.scale * per_weight;
            let mut sum = self.before_strip[strip] * per_weight - before;
            let weights = &block.weight.as_chunks::<STRIP>().0[strip % STRIPS];
            for (at, &weight) in weights.iter().enumerate() {
                places[next % places.len()] = (strip * STRIP + at) as u32;
                sum += f64::from(weight) * scale;
                next = teeth_within(sum, children as f64);
            }
        }
        let latest = |parent: &mut u32, at: u32| {
            *parent = at.max(*parent);
            Some(*parent)
        };
        places.into_iter().take(children).scan(0, latest)
    }

    /// Fills those places of a block that belong to one link; `first` is the number among the link's particles of the
    /// first one.
    fn fill_run(
        &self,
        parents: &Cloud,
        block: &mut Block,
        run: &Run,
        first: usize,
        nursery: &Nursery,
        random: &mut impl Rng,
    ) {
        let [before, after] = [run.link, run.link + 1].map(|link| self.children[link]);
        let children = (after - before).saturating_sub(first).min(run.range.len());
        let middle = run.range.start + children;
        let (start, end) = (parents.starts[run.link], parents.starts[run.link + 1]);
        let found = self.find_parents(parents, before + first, children);
        for (at, parent) in (run.range.start..middle).zip(found) {
            let parent = (parent as usize).clamp(start, end - 1);
            block.copy(at, &parents.blocks[parent / BLOCK], parent % BLOCK);
        }
        for at in middle..run.range.end {
            block.set(at, &nursery.fresh(run.link, random));
            block.weight[at] = 1.0;
        }
    }
}

/// How many of the teeth 0, 1, 2 and so on a length reaches, at most so many, which is a whole number: ⌊length⌋ + 1, by a
/// few instructions. Casts, minima and maxima that care about what is no number take many.
#[inline(always)]
fn teeth_within(length: f64, most: f64) -> usize {
    /// Adding this rounds to a whole number, which then stands in the lowest bits of the sum.
    const ROUND: f64 = 4_503_599_627_370_496.0;
    let count = length + 0.5;
    let count = if count > 0.0 { count } else { 0.0 };
    let count = if count < most { count } else { most };
    (count + ROUND).to_bits() as u32 as usize
}

/// In several parts, so that they can be added side by side.
fn sum_of(weights: &[f32; STRIP]) -> f64 {
    let mut sums = [0.0; 8];
    for lane in weights.as_chunks::<8>().0 {
        for (sum, &weight) in sums.iter_mut().zip(lane) {
            *sum += f64::from(weight);
        }
    }
    sums.into_iter().sum()
}

impl Nursery<'_> {
    /// A particle anywhere on a link, uniform by area, with a force about as large as the measured torques ask for there
    /// and any stiffness of the range given.
    fn fresh(&self, link: usize, random: &mut impl Rng) -> Particle {
        let surface = self.skin.surface(link);
        let place = surface.sample(random.random());
        let normal = surface.normal(place.triangle);
        let best_force = self.likelihoods[link].best_force(&place.point, &normal);
        let spread = 1.0 + FORCE_SPREAD * random.sample::<f64, _>(StandardNormal);
        let [low, high] = self.parameters.stiffness_range;
        Particle {
            link,
            point_in_link: place.point,
            triangle: place.triangle,
            normal_in_link: normal,
            force: (best_force * spread).clamp(0.0, self.parameters.force_max),
            stiffness: low * (high / low).powf(random.random()),
            weight: 1.0,
        }
    }
}
