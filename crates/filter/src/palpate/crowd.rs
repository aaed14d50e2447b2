//! How many particles are enough: KLD-sampling (Fox, Adapting the Sample Size in Particle Filters, 2003).

/// With so much probability
const QUANTILE: f64 = 2.33;
/// the Kullback-Leibler divergence of the particles from the posterior over the bins stays below this.
const DIVERGENCE: f64 = 0.05;

/// Number of particles for a posterior that occupies so many bins (Fox 2003, eq. 6, with Wilson and Hilferty's χ²).
pub(super) fn enough(bins: usize) -> usize {
    if bins < 2 {
        return 1;
    }
    let freedom = (bins - 1) as f64;
    let spread = 2.0 / (9.0 * freedom);
    let root = 1.0 - spread + spread.sqrt() * QUANTILE;
    (freedom / (2.0 * DIVERGENCE) * root.powi(3)).ceil() as usize
}

/// Bins that hold at least the weight `least`; a bin and a weight for each particle. Sorts `occupied`, its workspace.
pub(super) fn bins<K: Ord + Copy>(
    particles: impl Iterator<Item = (K, f64)>,
    least: f64,
    occupied: &mut Vec<(K, f64)>,
) -> usize {
    occupied.clear();
    occupied.extend(particles);
    occupied.sort_unstable_by_key(|&(bin, _)| bin);
    let same = occupied.chunk_by(|one, other| one.0 == other.0);
    let weights = same.map(|bin| bin.iter().map(|&(_, weight)| weight).sum::<f64>());
    weights.filter(|&weight| weight >= least).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn enough_follows_the_chi_square_quantile() {
        // χ² at 99 %: 9.210 with 2 degrees of freedom, 76.15 with 50 (Abramowitz and Stegun 1964, table 26.8).
        for (bins, quantile) in [(3, 9.210), (51, 76.154)] {
            let exact = quantile / (2.0 * DIVERGENCE);
            assert!((enough(bins) as f64 / exact - 1.0).abs() < 0.02, "{bins}");
        }
        assert_eq!(enough(0), 1);
        assert_eq!(enough(1), 1);
    }

    #[test]
    fn bins_with_little_weight_do_not_count() {
        let particles = [
            (3, 0.3),
            (1, 0.004),
            (3, 0.3),
            (2, 0.39),
            (1, 0.004),
            (7, 0.002),
        ];
        let mut workspace = Vec::new();
        assert_eq!(bins(particles.into_iter(), 0.01, &mut workspace), 2);
        assert_eq!(bins(particles.into_iter(), 0.006, &mut workspace), 3);
    }
}
