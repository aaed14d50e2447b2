//! Modes of a weighted cloud: where the weight gathers, link by link.

use std::ops::Range;

use nalgebra::{Matrix3, Point3, Unit, Vector3};
use palpate_model::{Kinematics, Robot};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use wide::f32x8;

use crate::Mode;
use crate::cloud::{BLOCK, Block, Cloud};
use crate::eight::Eight;
use crate::skin::Skin;

/// Edge of the cells that the weight is gathered in, m.
const CELL: f64 = 0.02;
/// Particles of one link within this distance of a mode's centre belong to it, m.
const REACH: f32 = 0.04;
/// About so many particles are asked where a mode is; what it is follows from all.
const GATHERED: usize = 2000;
/// Modes are looked for until they hold this share of the weight,
const ENOUGH: f64 = 0.95;
/// or there are this many,
const MOST: usize = 8;
/// or the next one would hold less than this.
const LEAST: f64 = 0.01;

/// Finds modes; keeps its grids, so that finding allocates nothing in steady state.
pub(crate) struct ModeFinder {
    grids: Vec<Option<Grid>>,
    /// What the modes found so far hold, in their order.
    balls: Vec<Ball>,
    /// What each block adds to the sums over a ball.
    of_blocks: Vec<[f64; SUMS]>,
    processor: Arch,
}

/// The particles of one link around a centre, but those that an earlier ball holds.
#[derive(Clone, Copy)]
struct Ball {
    link: usize,
    centre: [f32; 3],
}

/// Weight gathered in the cells of a link's bounding box.
struct Grid {
    corner: Point3<f64>,
    shape: [usize; 3],
    weight: Vec<f64>,
    occupied: Vec<usize>,
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
        let stride = stride(cloud);
        for (link, grid) in self.grids.iter_mut().enumerate() {
            let Some(grid) = grid else { continue };
            grid.clear();
            for (block, range) in cloud.of_link(link) {
                for group in groups(&range).step_by(stride) {
                    let weights = weights(block, group, &range) * block.scale as f32;
                    grid.add(&place(block, group), weights);
                }
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
        let summands = |_: usize, weight: Eight, offset: [Eight; 3]| {
            let [x, y, z] = offset;
            [weight, x * weight, y * weight, z * weight]
        };
        for _ in 0..2 {
            let mut sums = [0.0; 4];
            for of_link in cloud.of_link(link) {
                add(
                    &mut sums,
                    self.visit(&ball, of_link, stride(cloud), summands),
                );
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
        of_blocks.resize(blocks.len(), [0.0; SUMS]);
        let sum = |(at, sums): (usize, &mut [f64; SUMS])| {
            let finder = &*self;
            let of_link = cloud.block_of_link(ball.link, blocks.start + at);
            *sums = self.processor.dispatch(OfBlock {
                finder,
                ball,
                of_link,
            });
        };
        // From outside the pool, the way in would take longer.
        match rayon::current_thread_index() {
            Some(_) => (of_blocks.par_iter_mut().with_min_len(FEW).enumerate()).for_each(sum),
            None => of_blocks.iter_mut().enumerate().for_each(sum),
        }
        let mut all = [0.0; SUMS];
        for &sums in &of_blocks {
            add(&mut all, sums);
        }
        self.of_blocks = of_blocks;
        Sums(all)
    }

    /// Adds up, over what `ball` holds of one block, what `summands` tells of eight particles: from group, weights and
    /// offsets from the centre, m; every `stride` groups. Single precision here, double between the blocks.
    #[inline(always)]
    fn visit<const N: usize>(
        &self,
        ball: &Ball,
        (block, range): (&Block, Range<usize>),
        stride: usize,
        summands: impl Fn(usize, Eight, [Eight; 3]) -> [Eight; N],
    ) -> [f64; N] {
        let mut sums = [Eight::ZERO; N];
        for group in groups(&range).step_by(stride) {
            let place = place(block, group);
            let held = self.held(ball, &place, weights(block, group, &range));
            if held.is_zero() {
                continue;
            }
            let summands = summands(group, held, ball.offset(&place));
            for (sum, summand) in sums.iter_mut().zip(summands) {
                *sum += summand;
            }
        }
        sums.map(|sum| sum.0.into_iter().map(f64::from).sum::<f64>() * block.scale)
    }

    /// The weights of those of eight particles of the ball's link that it holds, else zeros.
    #[inline(always)]
    fn held(&self, ball: &Ball, place: &[Eight; 3], weights: Eight) -> Eight {
        let within = |squared: f32| squared < REACH * REACH;
        let mut held = weights.only(ball.squared(place), within);
        if held.is_zero() {
            return held;
        }
        let earlier = self.balls.iter();
        for earlier in earlier.filter(|earlier| earlier.link == ball.link) {
            held = held.only(earlier.squared(place), |squared| !within(squared));
        }
        held
    }

    /// Takes the weight that `ball` holds out of the search.
    #[inline(always)]
    fn take_out(&mut self, cloud: &Cloud, ball: &Ball) {
        let Some(mut grid) = self.grids[ball.link].take() else {
            return;
        };
        let stride = stride(cloud);
        for (block, range) in cloud.of_link(ball.link) {
            for group in groups(&range).step_by(stride) {
                let place = place(block, group);
                let held = self.held(ball, &place, weights(block, group, &range));
                if !held.is_zero() {
                    grid.add(&place, held * (-block.scale as f32));
                }
            }
        }
        self.grids[ball.link] = Some(grid);
    }
}

/// The sums over what a ball holds of one block, compiled for each kind of processor that they may run on.
struct OfBlock<'a> {
    finder: &'a ModeFinder,
    ball: &'a Ball,
    of_link: (&'a Block, Range<usize>),
}

impl WithSimd for OfBlock<'_> {
    type Output = [f64; SUMS];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> [f64; SUMS] {
        let Self {
            finder,
            ball,
            of_link: (block, range),
        } = self;
        let summands = |group: usize, weight: Eight, offset: [Eight; 3]| {
            let [x, y, z] = offset;
            let [wx, wy, wz] = [x * weight, y * weight, z * weight];
            let [nx, ny, nz] = &block.normal;
            [
                weight,
                wx,
                wy,
                wz,
                wx * x,
                wx * y,
                wx * z,
                wy * y,
                wy * z,
                wz * z,
                Eight::of(nx, group) * weight,
                Eight::of(ny, group) * weight,
                Eight::of(nz, group) * weight,
                Eight::of(&block.force, group) * weight,
                Eight::of(&block.stiffness, group) * weight,
            ]
        };
        finder.visit(ball, (block, range), 1, summands)
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

/// Every so many groups of eight particles are asked where a mode is.
fn stride(cloud: &Cloud) -> usize {
    (cloud.len() / GATHERED).clamp(1, BLOCK / 8)
}

#[inline(always)]
fn place(block: &Block, group: usize) -> [Eight; 3] {
    let [x, y, z] = &block.point;
    [
        Eight::of(x, group),
        Eight::of(y, group),
        Eight::of(z, group),
    ]
}

/// The groups of eight that hold a range.
#[inline(always)]
fn groups(range: &Range<usize>) -> Range<usize> {
    range.start / 8..range.end.div_ceil(8)
}

/// The weights of those of a group that are in a range, else zeros.
#[inline(always)]
fn weights(block: &Block, group: usize, range: &Range<usize>) -> Eight {
    let (weights, first) = (Eight::of(&block.weight, group), group * 8);
    if range.start <= first && first + 8 <= range.end {
        return weights;
    }
    let mut within = Eight::ZERO;
    for at in 0..8 {
        if range.contains(&(first + at)) {
            within.0[at] = weights.0[at];
        }
    }
    within
}

impl Ball {
    #[inline(always)]
    fn offset(&self, place: &[Eight; 3]) -> [Eight; 3] {
        let [x, y, z] = self.centre;
        [place[0] - x, place[1] - y, place[2] - z]
    }

    /// Squared distances of eight places, m².
    #[inline(always)]
    fn squared(&self, place: &[Eight; 3]) -> Eight {
        let [x, y, z] = self.offset(place);
        let mut squared = x * x;
        squared += y * y;
        squared += z * z;
        squared
    }
}

/// Weighted sums over particles: of the weight, the offset from a centre, its outer product, normal, force and
/// stiffness.
struct Sums([f64; SUMS]);

/// Number of sums over what a ball holds.
const SUMS: usize = 15;
/// Fewest blocks that are worth a thread of their own.
const FEW: usize = 4;

fn add<const N: usize>(sums: &mut [f64; N], summands: [f64; N]) {
    for (sum, summand) in sums.iter_mut().zip(summands) {
        *sum += summand;
    }
}

impl Sums {
    fn mode(&self, ball: &Ball, skin: &Skin, kinematics: &Kinematics) -> Mode {
        let [
            weight,
            x,
            y,
            z,
            xx,
            xy,
            xz,
            yy,
            yz,
            zz,
            nx,
            ny,
            nz,
            force,
            stiffness,
        ] = self.0;
        let total = weight.max(f64::MIN_POSITIVE);
        let mean = Vector3::new(x, y, z) / total;
        let outer = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) / total;
        let centre = Point3::from(ball.centre.map(f64::from));
        let surface = skin.surface(ball.link);
        let on_surface = surface.land_anew(&(centre + mean).coords.cast());
        let point_in_link = Point3::from(on_surface.point.cast());
        let fallback = surface.normal(on_surface.triangle);
        let normal = Unit::try_new(Vector3::new(nx, ny, nz), 1e-6 * total).unwrap_or(fallback);
        let root_from_link = kinematics.root_from_link(ball.link);
        let rotation = root_from_link.rotation.to_rotation_matrix();
        let covariance = outer - mean * mean.transpose();
        let (force, stiffness) = (force / total, stiffness / total);
        let normal_in_root = root_from_link.rotation * normal;
        Mode {
            link: ball.link,
            probability: weight,
            point_in_root: root_from_link * point_in_link,
            point_in_link,
            normal_in_root,
            force_in_root: normal_in_root.into_inner() * -force,
            force,
            stiffness,
            covariance_in_root: rotation * covariance * rotation.transpose(),
        }
    }
}

impl Grid {
    fn new(vertices: &[Point3<f64>]) -> Self {
        let fold = |start: f64, pick: fn(f64, f64) -> f64| {
            vertices
                .iter()
                .fold(Point3::new(start, start, start), |bound, vertex| {
                    Point3::from(bound.coords.zip_map(&vertex.coords, pick))
                })
        };
        let (low, high) = (
            fold(f64::INFINITY, f64::min),
            fold(f64::NEG_INFINITY, f64::max),
        );
        // One cell more on each side, so that a neighbour of any cell exists.
        let shape = [0, 1, 2].map(|axis| ((high[axis] - low[axis]) / CELL) as usize + 3);
        let cells = shape.iter().product();
        Self {
            corner: low - Vector3::repeat(CELL),
            shape,
            weight: vec![0.0; cells],
            occupied: Vec::with_capacity(cells),
        }
    }

    fn clear(&mut self) {
        for cell in self.occupied.drain(..) {
            self.weight[cell] = 0.0;
        }
    }

    /// The cells of eight places.
    #[inline]
    fn cells(&self, place: &[Eight; 3]) -> [i32; 8] {
        let place = place.map(|axis| f32x8::new(axis.0));
        let [x, y, z]: [f32x8; 3] = std::array::from_fn(|axis| {
            let along = (place[axis] - self.corner[axis] as f32) * (1.0 / CELL as f32);
            let most = f32x8::splat((self.shape[axis] - 2) as f32);
            along.trunc().max(f32x8::ONE).min(most)
        });
        let cell = (z * self.shape[1] as f32 + y) * self.shape[0] as f32 + x;
        cell.fast_trunc_int().to_array()
    }

    #[inline(always)]
    fn add(&mut self, place: &[Eight; 3], weights: Eight) {
        let cells = self.cells(place);
        if cells == [cells[0]; 8] {
            // So that no addition waits for the one before to be stored.
            self.put(cells[0], weights.0.into_iter().sum());
        } else {
            for (cell, weight) in cells.into_iter().zip(weights.0) {
                self.put(cell, weight);
            }
        }
    }

    #[inline]
    fn put(&mut self, cell: i32, weight: f32) {
        let (cell, weight) = (cell as usize, f64::from(weight));
        if self.weight[cell] == 0.0 && weight > 0.0 {
            self.occupied.push(cell);
        }
        self.weight[cell] += weight;
    }

    /// The largest weight of a cell with its 26 neighbours, and the cell's centre.
    fn peak(&self) -> Option<(f64, Point3<f64>)> {
        let (row, layer) = (self.shape[0], self.shape[0] * self.shape[1]);
        let block = |cell: usize| -> f64 {
            let mut sum = 0.0;
            for z in [cell - layer, cell, cell + layer] {
                for y in [z - row, z, z + row] {
                    sum += self.weight[y - 1] + self.weight[y] + self.weight[y + 1];
                }
            }
            sum
        };
        let best = (self.occupied.iter())
            .filter(|&&cell| self.weight[cell] > 0.0)
            .map(|&cell| (block(cell), cell))
            .max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)))?;
        let cell = best.1;
        let index = [cell % row, cell / row % self.shape[1], cell / layer];
        let at = |axis: usize| self.corner[axis] + (index[axis] as f64 + 0.5) * CELL;
        Some((best.0, Point3::new(at(0), at(1), at(2))))
    }
}
