//! Weighted places on the skin, link by link, column by column, in single precision.

use std::ops::Range;

use nalgebra::Vector3;
use palpate_model::Landing;

use crate::Particle;

/// Particles in one block: they share one unit of parallel work and one random stream.
pub(crate) const BLOCK: usize = 256;

/// One number for each particle of a block.
pub(crate) type Column = [f32; BLOCK];

/// The vector of one particle, given a column for each axis.
#[inline(always)]
pub(crate) fn vector(columns: &[Column; 3], at: usize) -> Vector3<f32> {
    Vector3::new(columns[0][at], columns[1][at], columns[2][at])
}

#[inline(always)]
pub(crate) fn set_vector(columns: &mut [Column; 3], at: usize, vector: &Vector3<f32>) {
    columns[0][at] = vector.x;
    columns[1][at] = vector.y;
    columns[2][at] = vector.z;
}

/// Places side by side, a column for each part of the state. Metres, newtons and N/m in the link's frame are good to a
/// ten-millionth in single precision, and half the size passes through memory.
#[derive(Clone)]
pub(crate) struct Block {
    /// Contact point, m.
    pub(crate) point: [Column; 3],
    /// Outward normal.
    pub(crate) normal: [Column; 3],
    /// Normal force, N.
    pub(crate) force: Column,
    /// Contact stiffness, N/m.
    pub(crate) stiffness: Column,
    /// Weight, relative to `scale`.
    pub(crate) weight: Column,
    /// Logarithm of the weight, relative to the largest of all particles after the last step.
    pub(crate) log_weight: Column,
    /// Mesh triangle.
    pub(crate) triangle: [u32; BLOCK],
    /// What the block's weights are to be multiplied with, so that all particles' sum to one.
    pub(crate) scale: f64,
}

impl Default for Block {
    fn default() -> Self {
        let zero = [0.0; BLOCK];
        Self {
            point: [zero; 3],
            normal: [zero; 3],
            force: zero,
            stiffness: zero,
            weight: zero,
            log_weight: zero,
            triangle: [0; BLOCK],
            scale: 0.0,
        }
    }
}

impl Block {
    #[inline(always)]
    pub(crate) fn point(&self, at: usize) -> Vector3<f32> {
        vector(&self.point, at)
    }

    #[inline(always)]
    pub(crate) fn set_point(&mut self, at: usize, point: &Vector3<f32>) {
        set_vector(&mut self.point, at, point);
    }

    #[inline(always)]
    pub(crate) fn land(&mut self, at: usize, place: &Landing) {
        self.set_point(at, &place.point);
        self.set_normal(at, &place.normal);
        self.triangle[at] = place.triangle;
    }

    /// Where a particle landed, so far (m) from where it would have been.
    pub(crate) fn landing(&self, at: usize, distance: f32) -> Landing {
        Landing {
            point: self.point(at),
            normal: self.normal(at),
            triangle: self.triangle[at],
            distance,
        }
    }

    #[inline(always)]
    pub(crate) fn normal(&self, at: usize) -> Vector3<f32> {
        vector(&self.normal, at)
    }

    #[inline(always)]
    pub(crate) fn set_normal(&mut self, at: usize, normal: &Vector3<f32>) {
        set_vector(&mut self.normal, at, normal);
    }

    /// Makes the state of the particle `at` that of one of another block.
    pub(crate) fn copy(&mut self, at: usize, from: &Self, parent: usize) {
        self.set_point(at, &from.point(parent));
        self.set_normal(at, &from.normal(parent));
        self.force[at] = from.force[parent];
        self.stiffness[at] = from.stiffness[parent];
        self.triangle[at] = from.triangle[parent];
    }

    pub(crate) fn set(&mut self, at: usize, particle: &Particle) {
        self.set_point(at, &particle.point_in_link.coords.cast());
        self.set_normal(at, &particle.normal_in_link.into_inner().cast());
        self.force[at] = particle.force as f32;
        self.stiffness[at] = particle.stiffness as f32;
        self.triangle[at] = particle.triangle;
        self.weight[at] = particle.weight as f32;
    }
}

/// All particles, those of one link side by side.
#[derive(Clone, Default)]
pub(crate) struct Cloud {
    pub(crate) blocks: Vec<Block>,
    /// Index of the first particle of each link, and the number of all.
    pub(crate) starts: Vec<usize>,
}

/// Particles of one link in one block.
pub(crate) struct Run {
    pub(crate) link: usize,
    pub(crate) range: Range<usize>,
}

impl Cloud {
    /// No particles, on a robot with so many links; room for so many.
    pub(crate) fn with_room(links: usize, count: usize) -> Self {
        Self {
            blocks: vec![Block::default(); count.div_ceil(BLOCK)],
            starts: vec![0; links + 1],
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.starts.last().copied().unwrap_or(0)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.len() == 0
    }

    pub(crate) fn clear(&mut self) {
        self.starts.fill(0);
    }

    /// Makes room for the particles that `starts` tell of.
    pub(crate) fn fit(&mut self) {
        self.blocks
            .resize_with(self.len().div_ceil(BLOCK), Block::default);
    }

    /// Takes particles in, in their order on each link.
    pub(crate) fn gather(&mut self, particles: &[Particle]) {
        self.starts.fill(0);
        for particle in particles {
            self.starts[particle.link + 1] += 1;
        }
        for link in 1..self.starts.len() {
            self.starts[link] += self.starts[link - 1];
        }
        self.fit();
        self.blocks.iter_mut().for_each(|block| block.scale = 1.0);
        for particle in particles {
            // Until the end, `starts` tell where the next particle of a link goes.
            let at = self.starts[particle.link];
            self.blocks[at / BLOCK].set(at % BLOCK, particle);
            self.starts[particle.link] += 1;
        }
        self.starts.rotate_right(1);
        self.starts[0] = 0;
    }

    /// The particles of a link, block by block.
    pub(crate) fn of_link(&self, link: usize) -> impl Iterator<Item = (&Block, Range<usize>)> {
        (self.blocks_of_link(link)).map(move |index| self.block_of_link(link, index))
    }

    /// Indices of the blocks that hold particles of a link.
    pub(crate) fn blocks_of_link(&self, link: usize) -> Range<usize> {
        let (start, end) = (self.starts[link], self.starts[link + 1]);
        match start < end {
            true => start / BLOCK..end.div_ceil(BLOCK),
            false => 0..0,
        }
    }

    /// A block, and which of its particles are of a link.
    pub(crate) fn block_of_link(&self, link: usize, index: usize) -> (&Block, Range<usize>) {
        let (start, end) = (self.starts[link], self.starts[link + 1]);
        (&self.blocks[index], within(index, start, end))
    }

    /// The particles of a block, link by link.
    pub(crate) fn runs(starts: &[usize], block: usize) -> impl Iterator<Item = Run> {
        let links = starts.windows(2).enumerate();
        links.filter_map(move |(link, ends)| {
            let range = within(block, ends[0], ends[1]);
            (!range.is_empty()).then_some(Run { link, range })
        })
    }
}

/// Those of the indices from `start` to `end` that lie in a block, seen from there.
fn within(block: usize, start: usize, end: usize) -> Range<usize> {
    let seen = |index: usize| index.saturating_sub(block * BLOCK).min(BLOCK);
    seen(start)..seen(end)
}
