//! Random numbers in bulk: all that one step needs for one block of particles.

use rand::Rng;

use super::bulk::{exp, normals, uniform};
use super::schedule::Level;
use crate::cloud::{BLOCK, Column};
use crate::random::Bundle;

/// Smallest and largest radius of the obstacle's curvature, m (uniform in log space).
const RADIUS_RANGE: [f32; 2] = [1e-3, 1.0];

/// What is drawn for each particle of a block.
pub(super) struct Draws {
    /// Noise on the location along two directions of the surface, m.
    pub(super) location: [Column; 2],
    /// Noise on the force, N.
    pub(super) force: Column,
    /// Factor on the stiffness.
    pub(super) stiffness: Column,
    /// Radius of the obstacle's curvature, m.
    pub(super) radius: Column,
    /// What the numbers are made of.
    bits: [[u32; BLOCK]; 2],
}

impl Default for Draws {
    fn default() -> Self {
        let zero = [0.0; BLOCK];
        Self {
            location: [zero; 2],
            force: zero,
            stiffness: zero,
            radius: zero,
            bits: [[0; BLOCK]; 2],
        }
    }
}

impl Draws {
    /// Draws anew.
    #[inline(always)]
    pub(super) fn draw(&mut self, level: &Level, random: &mut impl Rng) {
        let mut random = Bundle::new(random);
        let [location_noise, force_noise, stiffness_noise] = [
            level.location_noise,
            level.force_noise,
            level.stiffness_noise,
        ]
        .map(|noise| noise as f32);
        let along_surface = self.location.each_mut();
        draw_normals(&mut random, &mut self.bits, along_surface, |one, other| {
            (one * location_noise, other * location_noise)
        });
        let columns = [&mut self.force, &mut self.stiffness];
        draw_normals(&mut random, &mut self.bits, columns, |one, other| {
            (one * force_noise, exp(other * stiffness_noise))
        });
        let [least, most] = RADIUS_RANGE.map(f32::ln);
        random.fill(&mut self.bits[0]);
        for (radius, &bits) in self.radius.iter_mut().zip(&self.bits[0]) {
            *radius = exp(uniform(bits) * (most - least) + least);
        }
    }
}

/// Two columns of what is made of two standard normal numbers.
#[inline(always)]
fn draw_normals(
    random: &mut Bundle,
    bits: &mut [[u32; BLOCK]; 2],
    [first, second]: [&mut Column; 2],
    make: impl Fn(f32, f32) -> (f32, f32),
) {
    random.fill(&mut bits[0]);
    random.fill(&mut bits[1]);
    let [lengths, angles] = bits;
    let columns = first.iter_mut().zip(second);
    for ((first, second), (&length, &angle)) in columns.zip(lengths.iter().zip(&*angles)) {
        let (one, other) = normals(length, angle);
        (*first, *second) = make(one, other);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, stream};

    fn bundle(block: usize) -> Bundle {
        Bundle::new(&mut stream(1, 0, block, Purpose::Propagate))
    }

    /// Means of the first four powers, over many blocks.
    fn moments(mut columns: impl FnMut(usize) -> Vec<Column>) -> [f64; 4] {
        let all: Vec<f64> = (0..200)
            .flat_map(&mut columns)
            .flatten()
            .map(f64::from)
            .collect();
        [1, 2, 3, 4].map(|power| all.iter().map(|x| x.powi(power)).sum::<f64>() / all.len() as f64)
    }

    #[test]
    fn normals_have_the_moments_of_a_normal_distribution() {
        let columns = |block| {
            let mut columns = [[0.0; BLOCK]; 2];
            let [first, second] = &mut columns;
            let mut bits = [[0; BLOCK]; 2];
            draw_normals(&mut bundle(block), &mut bits, [first, second], |a, b| {
                (a, b)
            });
            columns.to_vec()
        };
        let [mean, variance, skew, kurtosis] = moments(columns);
        assert!(
            mean.abs() < 0.01 && (variance - 1.0).abs() < 0.02,
            "{mean} {variance}"
        );
        assert!(
            skew.abs() < 0.05 && (kurtosis - 3.0).abs() < 0.1,
            "{skew} {kurtosis}"
        );
    }

    #[test]
    fn uniforms_fill_the_interval_and_are_never_zero() {
        let columns = |block| {
            let mut bits = [0; BLOCK];
            bundle(block).fill(&mut bits);
            vec![bits.map(uniform)]
        };
        let [mean, square, ..] = moments(columns);
        assert!((mean - 0.5).abs() < 0.005 && (square - 1.0 / 3.0).abs() < 0.005);
        let all = (0..200).flat_map(columns).flatten();
        assert!(all.clone().all(|x| x > 0.0 && x <= 1.0) && all.fold(0.0, f32::max) > 0.999);
    }
}
