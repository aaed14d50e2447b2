//! How large a residual must be to be no noise, for a stated rate of false alarms.

/// Standard deviations that a Gaussian statistic exceeds in at most `looks_per_hour` looks with an expected number of
/// `false_alarms_per_hour`: the union bound over all looks, with the bound φ(z) / z of the normal distribution's tail.
/// Looks are correlated, so that the true rate is lower.
pub(super) fn threshold(false_alarms_per_hour: f64, looks_per_hour: f64) -> f64 {
    // Both sides count.
    let share = (0.5 * false_alarms_per_hour / looks_per_hour).min(0.1);
    let root = (2.0 * std::f64::consts::PI).sqrt();
    let mut z = 2.0_f64;
    for _ in 0..6 {
        z = (-2.0 * (share * z * root).ln()).max(1.0).sqrt();
    }
    z
}

/// What the sum of `count` squared Gaussian statistics exceeds as rarely as one of them exceeds `z` standard deviations to
/// either side: of the series of the χ² distribution's tail, all terms with a bound for what remains.
pub(super) fn joined_threshold(z: f64, count: usize) -> f64 {
    let tail = |x: f64, count: usize| {
        let half = 0.5 * x;
        let odd = count % 2 == 1;
        let mut term = if odd {
            (std::f64::consts::PI * half).sqrt().recip()
        } else {
            1.0
        };
        let mut sum = term;
        for twice in (2 - count % 2..count - 1).step_by(2) {
            term *= half / (0.5 * twice as f64);
            sum += term;
        }
        sum
    };
    // Both without their common factor exp(-x / 2).
    let rarity = tail(z * z, 1).ln() - 0.5 * z * z;
    let mut x = z * z;
    for _ in 0..20 {
        x = 2.0 * (tail(x, count).ln() - rarity);
    }
    x
}

/// Probability that an hour without contact brings nothing as large as `ratio` times the threshold `z`.
pub(super) fn confidence(false_alarms_per_hour: f64, z: f64, ratio: f64) -> f64 {
    let rarer = (-0.5 * z * z * (ratio * ratio - 1.0)).exp();
    (-false_alarms_per_hour * rarer).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thresholds_are_the_normal_distributions_quantiles() {
        // Quantiles of 1e-9 and 1e-5 on one side.
        assert!((threshold(2e-9, 1.0) - 5.9978).abs() < 0.01);
        assert!((threshold(2e-5, 1.0) - 4.2649).abs() < 0.03);
        assert!(threshold(1e3, 1.0) >= 1.0);
    }

    #[test]
    fn joined_thresholds_are_the_chi_squared_distributions_quantiles() {
        let z = threshold(2e-9, 1.0);
        assert!((joined_threshold(z, 1) - z * z).abs() < 1e-9);
        assert!((joined_threshold(z, 2) - -2.0 * 2e-9_f64.ln()).abs() < 0.02);
        // Quantiles of 2e-9 by other means.
        assert!((joined_threshold(z, 4) - 46.4344).abs() < 0.1);
        assert!((joined_threshold(z, 7) - 54.3557).abs() < 0.1);
    }

    #[test]
    fn confidence_grows_with_the_residual() {
        assert!((confidence(0.1, 6.0, 1.0) - (-0.1_f64).exp()).abs() < 1e-12);
        assert!(confidence(0.1, 6.0, 1.2) > 0.9999);
    }
}
