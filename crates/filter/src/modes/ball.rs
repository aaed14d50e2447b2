//! Balls around what may be modes, and sums over the particles that they hold.

use std::ops::Range;

use nalgebra::{Matrix3, Point3, Unit, Vector3};
use palpate_model::Kinematics;

use crate::Mode;
use crate::cloud::{BLOCK, Block, Column};
use crate::skin::Skin;

/// Particles of one link within this distance of a mode's centre belong to it, m.
const REACH: f32 = 0.04;

/// The particles of one link around a centre, but those that an earlier ball holds.
#[derive(Clone, Copy)]
pub(super) struct Ball {
    pub(super) link: usize,
    pub(super) centre: [f32; 3],
}

impl Ball {
    /// The weights of those of a range of a block's particles that this ball holds and no earlier one, else zeros.
    #[inline(always)]
    pub(super) fn hold(&self, earlier: &[Self], block: &Block, range: &Range<usize>) -> Column {
        let mut held = [0.0; BLOCK];
        // So that the compiler knows that every index is within a column.
        let range = range.start..range.end.min(BLOCK);
        for at in range.clone() {
            held[at] = if self.reaches(block, at) {
                block.weight[at]
            } else {
                0.0
            };
        }
        for other in earlier.iter().filter(|other| other.link == self.link) {
            for at in range.clone() {
                held[at] = if other.reaches(block, at) {
                    0.0
                } else {
                    held[at]
                };
            }
        }
        held
    }

    #[inline(always)]
    fn reaches(&self, block: &Block, at: usize) -> bool {
        let [x, y, z] = &block.point;
        let [a, b, c] = self.centre;
        let (x, y, z) = (x[at] - a, y[at] - b, z[at] - c);
        x * x + y * y + z * z < REACH * REACH
    }

    /// Sums of the weight held and of the offsets from the centre, m.
    #[inline(always)]
    pub(super) fn pull(&self, block: &Block, range: &Range<usize>, held: &Column) -> [f64; 4] {
        let [a, b, c] = self.centre;
        let mut sums = [[0.0; LANES]; 4];
        for strip in strips(range) {
            let weight = lanes(held, strip);
            let [x, y, z] = [0, 1, 2].map(|axis| lanes(&block.point[axis], strip));
            let [sum, sum_x, sum_y, sum_z] = &mut sums;
            for at in 0..LANES {
                let w = weight[at];
                sum[at] += w;
                sum_x[at] += w * (x[at] - a);
                sum_y[at] += w * (y[at] - b);
                sum_z[at] += w * (z[at] - c);
            }
        }
        totals(sums, block.scale)
    }

    /// Sums over what is held of a block.
    #[inline(always)]
    pub(super) fn sums(&self, block: &Block, range: &Range<usize>, held: &Column) -> Sums {
        let [a, b, c] = self.centre;
        let mut sums = [[0.0; LANES]; SUMS];
        for strip in strips(range) {
            let weight = lanes(held, strip);
            let [x, y, z] = [0, 1, 2].map(|axis| lanes(&block.point[axis], strip));
            let [n_x, n_y, n_z] = [0, 1, 2].map(|axis| lanes(&block.normal[axis], strip));
            let [force, stiffness] = [&block.force, &block.stiffness].map(|of| lanes(of, strip));
            for at in 0..LANES {
                let w = weight[at];
                let (x, y, z) = (x[at] - a, y[at] - b, z[at] - c);
                let (wx, wy, wz) = (w * x, w * y, w * z);
                sums[0][at] += w;
                sums[1][at] += wx;
                sums[2][at] += wy;
                sums[3][at] += wz;
                sums[4][at] += wx * x;
                sums[5][at] += wx * y;
                sums[6][at] += wx * z;
                sums[7][at] += wy * y;
                sums[8][at] += wy * z;
                sums[9][at] += wz * z;
                sums[10][at] += w * n_x[at];
                sums[11][at] += w * n_y[at];
                sums[12][at] += w * n_z[at];
                sums[13][at] += w * force[at];
                sums[14][at] += w * stiffness[at];
            }
        }
        Sums(totals(sums, block.scale))
    }
}

/// Numbers that are added side by side: enough that their loops stay loops, which compilers turn into vector
/// instructions.
const LANES: usize = 32;

/// The strips of so many particles that hold a range.
#[inline(always)]
fn strips(range: &Range<usize>) -> Range<usize> {
    range.start / LANES..range.end.min(BLOCK).div_ceil(LANES)
}

#[inline(always)]
fn lanes(column: &Column, strip: usize) -> &[f32; LANES] {
    &column.as_chunks().0[strip]
}

/// The lanes' sums, scaled: single precision within a block, double between them.
#[inline(always)]
fn totals<const N: usize>(mut sums: [[f32; LANES]; N], scale: f64) -> [f64; N] {
    let mut totals = [0.0; N];
    for (total, lanes) in totals.iter_mut().zip(&mut sums) {
        let mut half = LANES / 2;
        while half >= 8 {
            let (low, high) = lanes.split_at_mut(half);
            low.iter_mut()
                .zip(high)
                .for_each(|(low, high)| *low += *high);
            half /= 2;
        }
        for &lane in &lanes[..8] {
            *total += f64::from(lane);
        }
        *total *= scale;
    }
    totals
}

/// Number of sums over what a ball holds.
const SUMS: usize = 15;

/// Weighted sums over particles: of the weight, the offset from a centre, its outer product, normal, force and
/// stiffness.
#[derive(Clone, Copy)]
pub(super) struct Sums([f64; SUMS]);

/// Adds each to its sum.
pub(super) fn add<const N: usize>(sums: &mut [f64; N], summands: &[f64; N]) {
    for (sum, summand) in sums.iter_mut().zip(summands) {
        *sum += summand;
    }
}

impl Sums {
    pub(super) const ZERO: Self = Self([0.0; SUMS]);

    pub(super) fn add(&mut self, other: &Self) {
        add(&mut self.0, &other.0);
    }

    /// The mode that a ball with these sums is.
    pub(super) fn mode(&self, ball: &Ball, skin: &Skin, kinematics: &Kinematics) -> Mode {
        let [weight, x, y, z, xx, xy, xz, yy, yz, zz, ..] = self.0;
        let [.., nx, ny, nz, force, stiffness] = self.0;
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
