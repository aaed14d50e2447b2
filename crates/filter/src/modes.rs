//! Modes of a weighted cloud: where the weight gathers, link by link.

use std::ops::Range;

use nalgebra::{Matrix3, Point3, Unit, Vector3};
use palpate_model::{Kinematics, Robot};
use wide::f32x8;

use crate::Mode;
use crate::cloud::{BLOCK, Block, Cloud, Column};
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
        }
    }

    /// Replaces `modes` by those of `cloud`, the heaviest first.
    pub(crate) fn find(
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

    fn gather(&mut self, cloud: &Cloud) {
        let stride = stride(cloud);
        for (link, grid) in self.grids.iter_mut().enumerate() {
            let Some(grid) = grid else { continue };
            grid.clear();
            for (block, range) in cloud.of_link(link) {
                for (group, mask) in eights(range).step_by(stride) {
                    let weight = mask & (eight(&block.weight, group) * block.scale as f32);
                    grid.add(place(block, group), weight.to_array());
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
    fn climb(&self, cloud: &Cloud, link: usize, start: Point3<f64>) -> Ball {
        let centre = start.coords.cast().into();
        let mut ball = Ball { link, centre };
        let summands = |_: &Block, _: usize, weight: f32x8, offset: [f32x8; 3]| {
            let [x, y, z] = offset.map(|part| part * weight);
            [weight, x, y, z]
        };
        for _ in 0..2 {
            let mut sums = [0.0; 4];
            self.visit(cloud, &ball, summands, stride(cloud), &mut sums);
            let [total, ..] = sums;
            if total > 0.0 {
                for axis in 0..3 {
                    ball.centre[axis] += (sums[axis + 1] / total) as f32;
                }
            }
        }
        ball
    }

    /// Sums up what `ball` holds.
    fn sums(&self, cloud: &Cloud, ball: &Ball) -> Sums {
        let mut sums = Sums([0.0; 15]);
        let summands = |block: &Block, group: usize, weight: f32x8, offset: [f32x8; 3]| {
            let [x, y, z] = offset;
            let [wx, wy, wz] = offset.map(|part| part * weight);
            let normal = block
                .normal
                .each_ref()
                .map(|part| eight(part, group) * weight);
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
                normal[0],
                normal[1],
                normal[2],
                eight(&block.force, group) * weight,
                eight(&block.stiffness, group) * weight,
            ]
        };
        self.visit(cloud, ball, summands, 1, &mut sums.0);
        sums
    }

    /// Adds up, over all that `ball` holds, what `summands` tells of eight particles: from block, group, weights and
    /// offsets from the centre, m; every `stride` groups. Single precision within a block, double between them.
    fn visit<const N: usize>(
        &self,
        cloud: &Cloud,
        ball: &Ball,
        summands: impl Fn(&Block, usize, f32x8, [f32x8; 3]) -> [f32x8; N],
        stride: usize,
        sums: &mut [f64; N],
    ) {
        for (block, range) in cloud.of_link(ball.link) {
            let mut of_block = [f32x8::ZERO; N];
            for (group, mask) in eights(range).step_by(stride) {
                let place = place(block, group);
                let held = self.held(ball, &place, mask);
                if !held.any() {
                    continue;
                }
                let weight = held & eight(&block.weight, group);
                let offset = ball.offset(&place);
                for (sum, summand) in
                    (of_block.iter_mut()).zip(summands(block, group, weight, offset))
                {
                    *sum += summand;
                }
            }
            for (sum, of_block) in sums.iter_mut().zip(of_block) {
                let of_block: f64 = of_block.to_array().into_iter().map(f64::from).sum();
                *sum += of_block * block.scale;
            }
        }
    }

    /// Which of some particles of the ball's link it holds, as a mask.
    #[inline]
    fn held(&self, ball: &Ball, place: &[f32x8; 3], mask: f32x8) -> f32x8 {
        let mut held = mask & ball.reaches(place);
        if held.any() {
            let earlier = self.balls.iter();
            for earlier in earlier.filter(|earlier| earlier.link == ball.link) {
                held &= !earlier.reaches(place);
            }
        }
        held
    }

    /// Takes the weight that `ball` holds out of the search.
    fn take_out(&mut self, cloud: &Cloud, ball: &Ball) {
        let Some(mut grid) = self.grids[ball.link].take() else {
            return;
        };
        let stride = stride(cloud);
        for (block, range) in cloud.of_link(ball.link) {
            for (group, mask) in eights(range).step_by(stride) {
                let place = place(block, group);
                let held = self.held(ball, &place, mask);
                if held.any() {
                    let weight = held & (eight(&block.weight, group) * -block.scale as f32);
                    grid.add(place, weight.to_array());
                }
            }
        }
        self.grids[ball.link] = Some(grid);
    }
}

/// Every so many groups of eight particles are asked where a mode is.
fn stride(cloud: &Cloud) -> usize {
    (cloud.len() / GATHERED).clamp(1, BLOCK / 8)
}

/// Eight numbers of a column side by side.
#[inline]
fn eight(column: &Column, group: usize) -> f32x8 {
    f32x8::new(column.as_chunks().0[group])
}

#[inline]
fn place(block: &Block, group: usize) -> [f32x8; 3] {
    block.point.each_ref().map(|column| eight(column, group))
}

/// The groups of eight that hold a range, each with a mask of those in the range.
fn eights(range: Range<usize>) -> impl Iterator<Item = (usize, f32x8)> {
    let [start, end] = [range.start, range.end].map(|index| f32x8::splat(index as f32));
    (range.start / 8..range.end.div_ceil(8)).map(move |group| {
        let first = group as f32 * 8.0;
        let index = f32x8::new([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]) + first;
        (group, index.simd_ge(start) & index.simd_lt(end))
    })
}

impl Ball {
    #[inline]
    fn offset(&self, place: &[f32x8; 3]) -> [f32x8; 3] {
        std::array::from_fn(|axis| place[axis] - self.centre[axis])
    }

    /// Which of eight places are within reach, as a mask.
    #[inline]
    fn reaches(&self, place: &[f32x8; 3]) -> f32x8 {
        let [x, y, z] = self.offset(place);
        (x * x + y * y + z * z).simd_lt(f32x8::splat(REACH * REACH))
    }
}

/// Weighted sums over particles: of the weight, the offset from a centre, its outer product, normal, force and
/// stiffness.
struct Sums([f64; 15]);

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
    fn cells(&self, place: [f32x8; 3]) -> [i32; 8] {
        let [x, y, z]: [f32x8; 3] = std::array::from_fn(|axis| {
            let along = (place[axis] - self.corner[axis] as f32) * (1.0 / CELL as f32);
            let most = f32x8::splat((self.shape[axis] - 2) as f32);
            along.trunc().max(f32x8::ONE).min(most)
        });
        let cell = (z * self.shape[1] as f32 + y) * self.shape[0] as f32 + x;
        cell.fast_trunc_int().to_array()
    }

    #[inline]
    fn add(&mut self, place: [f32x8; 3], weights: [f32; 8]) {
        for (cell, weight) in self.cells(place).into_iter().zip(weights) {
            let (cell, weight) = (cell as usize, f64::from(weight));
            if self.weight[cell] == 0.0 && weight > 0.0 {
                self.occupied.push(cell);
            }
            self.weight[cell] += weight;
        }
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
