//! Credible regions: where the contact is, with a stated probability.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::Mode;

/// Places tried in each mode to find the density that bounds the region.
const TRIES: usize = 64;

/// The smallest region that holds the contact with a given probability: all places where the density of the mixture
/// of the modes' Gaussians is at least a threshold (Hyndman 1996, highest density regions).
#[derive(Clone, Debug)]
pub struct CredibleRegion {
    parts: Vec<Part>,
    threshold: f64,
}

#[derive(Clone, Debug)]
struct Part {
    weight: f64,
    centre: Point3<f64>,
    root: Matrix3<f64>,
    inverse_root: Matrix3<f64>,
    /// Density at the centre for weight one, 1/m³.
    peak: f64,
}

impl CredibleRegion {
    /// The region with probability `level` (0 … 1) for modes, whose probabilities count relative to each other.
    pub(crate) fn new(modes: &[Mode], level: f64) -> Self {
        let total: f64 = modes.iter().map(|mode| mode.probability).sum();
        let parts = modes
            .iter()
            .filter_map(|mode| Part::new(mode, total))
            .collect();
        let mut region = Self {
            parts,
            threshold: 0.0,
        };
        let mut tried: Vec<(f64, f64)> = Vec::with_capacity(region.parts.len() * TRIES);
        for part in &region.parts {
            for index in 0..TRIES {
                let place = part.centre + part.root * normal(index);
                tried.push((region.density(&place), part.weight / TRIES as f64));
            }
        }
        tried.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut held = 0.0;
        let bound = tried.iter().find(|(_, weight)| {
            held += weight;
            held >= level
        });
        region.threshold = bound.map_or(f64::INFINITY, |(density, _)| *density);
        region
    }

    /// Whether a place, in the root frame (m), lies within.
    pub fn holds(&self, place: &Point3<f64>) -> bool {
        self.density(place) >= self.threshold
    }

    fn density(&self, place: &Point3<f64>) -> f64 {
        self.parts.iter().map(|part| part.density(place)).sum()
    }
}

impl Part {
    fn new(mode: &Mode, total: f64) -> Option<Self> {
        let root = mode.covariance_in_root.cholesky()?.l();
        let inverse_root = root.try_inverse()?;
        Some(Self {
            weight: mode.probability / total,
            centre: mode.point_in_root,
            peak: inverse_root.determinant() / std::f64::consts::TAU.powf(1.5),
            root,
            inverse_root,
        })
    }

    fn density(&self, place: &Point3<f64>) -> f64 {
        let squared = (self.inverse_root * (place - self.centre)).norm_squared();
        self.weight * self.peak * (-0.5 * squared).exp()
    }
}

/// The index-th of [`TRIES`] vectors that are spread like a standard normal distribution: directions on a spherical
/// Fibonacci lattice, lengths at the quantiles of the Maxwell distribution, in an order that mixes both.
fn normal(index: usize) -> Vector3<f64> {
    let golden = 0.618_033_988_75;
    let u = (index as f64 + 0.5) / TRIES as f64;
    let z = 1.0 - 2.0 * u;
    let around = std::f64::consts::TAU * (index as f64 * golden).fract();
    let ring = (1.0 - z * z).sqrt();
    let quantile = ((index as f64 * 23.0 + 0.5) / TRIES as f64).fract();
    Vector3::new(ring * around.cos(), ring * around.sin(), z) * maxwell(quantile)
}

/// Quantile of the length of a standard normal vector, by Wilson and Hilferty's approximation (1931) of χ² with three
/// degrees of freedom.
fn maxwell(quantile: f64) -> f64 {
    // Normal quantile by the logistic approximation, good to 0.02 where it is used.
    let z = ((quantile / (1.0 - quantile)).ln()) / 1.702;
    let third = 2.0_f64 / 27.0;
    (3.0 * (1.0 - third + z * third.sqrt()).max(0.0).powi(3)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mode(x: f64, sigma: f64, probability: f64) -> Mode {
        Mode {
            link: 0,
            probability,
            point_in_root: Point3::new(x, 0.0, 0.0),
            point_in_link: Point3::origin(),
            normal_in_root: Vector3::z_axis(),
            force_in_root: Vector3::zeros(),
            force: 1.0,
            stiffness: 1.0,
            covariance_in_root: Matrix3::identity() * sigma * sigma,
        }
    }

    fn radius(region: &CredibleRegion, centre: f64) -> f64 {
        let inside = |i: &usize| region.holds(&Point3::new(centre, *i as f64 * 1e-5, 0.0));
        (0..100_000).take_while(inside).count() as f64 * 1e-5
    }

    #[test]
    fn one_gaussian_gives_the_ball_of_the_chi_square_quantile() {
        // χ² with three degrees of freedom: 6.251 at 90 %, 2.366 at 50 %.
        for (level, squared) in [(0.9, 6.251_f64), (0.5, 2.366)] {
            let region = CredibleRegion::new(&[mode(0.0, 0.01, 1.0)], level);
            let expected = 0.01 * squared.sqrt();
            assert!(
                (radius(&region, 0.0) / expected - 1.0).abs() < 0.06,
                "{level}"
            );
        }
    }

    #[test]
    fn far_modes_share_the_region_and_faint_ones_have_none() {
        let modes = [
            mode(0.0, 0.01, 0.6),
            mode(1.0, 0.01, 0.395),
            mode(2.0, 0.01, 0.005),
        ];
        let region = CredibleRegion::new(&modes, 0.9);
        assert!(radius(&region, 0.0) > radius(&region, 1.0));
        assert!(radius(&region, 1.0) > 0.01);
        assert_eq!(radius(&region, 2.0), 0.0);
    }

    #[test]
    fn no_modes_hold_nothing() {
        assert!(!CredibleRegion::new(&[], 0.9).holds(&Point3::origin()));
    }
}
