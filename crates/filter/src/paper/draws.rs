//! Random numbers in bulk: all that one step needs for one block of particles.

use rand::Rng;

use super::bulk::{self, exp, map, uniform};
use super::schedule::Level;
use crate::cloud::{BLOCK, Column};

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
}

impl Draws {
    pub(super) fn new(level: &Level, random: &mut impl Rng) -> Self {
        let [mut location_1, mut location_2] = normals(random);
        let [mut force, mut stiffness] = normals(random);
        let location_noise = level.location_noise as f32;
        map(&mut location_1, |normal| normal * location_noise);
        map(&mut location_2, |normal| normal * location_noise);
        let force_noise = level.force_noise as f32;
        map(&mut force, |normal| normal * force_noise);
        let stiffness_noise = level.stiffness_noise as f32;
        map(&mut stiffness, |normal| exp(normal * stiffness_noise));
        let [least, most] = RADIUS_RANGE.map(f32::ln);
        let mut radius = bits(random).map(uniform);
        map(&mut radius, |uniform| exp(uniform * (most - least) + least));
        Self {
            location: [location_1, location_2],
            force,
            stiffness,
            radius,
        }
    }
}

fn bits(random: &mut impl Rng) -> [u32; BLOCK] {
    let mut bits = [0; _];
    for pair in bits.as_chunks_mut::<2>().0 {
        let both = random.next_u64();
        *pair = [both as u32, (both >> 32) as u32];
    }
    bits
}

/// Two columns of standard normal numbers.
fn normals(random: &mut impl Rng) -> [Column; 2] {
    let (lengths, angles) = (bits(random), bits(random));
    let (mut first, mut second) = ([0.0; BLOCK], [0.0; BLOCK]);
    let columns = first.iter_mut().zip(&mut second);
    for ((first, second), (length, angle)) in columns.zip(lengths.into_iter().zip(angles)) {
        (*first, *second) = bulk::normals(length, angle);
    }
    [first, second]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, stream};

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
        let columns = |block| normals(&mut stream(1, 0, block, Purpose::Propagate)).to_vec();
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
        let columns = |block| vec![bits(&mut stream(1, 0, block, Purpose::Propagate)).map(uniform)];
        let [mean, square, ..] = moments(columns);
        assert!((mean - 0.5).abs() < 0.005 && (square - 1.0 / 3.0).abs() < 0.005);
        let all = (0..200).flat_map(columns).flatten();
        assert!(all.clone().all(|x| x > 0.0 && x <= 1.0) && all.fold(0.0, f32::max) > 0.999);
    }
}
