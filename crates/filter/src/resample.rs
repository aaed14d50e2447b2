//! Weights and systematic resampling (Thrun, Burgard and Fox, Probabilistic Robotics, 2005, sections 4.3 and 4.2.4).

/// Turns log weights into weights that sum to one, written to `weights`. Returns the log of their sum before.
pub(crate) fn normalise(
    log_weights: impl Iterator<Item = f64> + Clone,
    weights: &mut Vec<f64>,
) -> f64 {
    let largest = log_weights.clone().fold(f64::NEG_INFINITY, f64::max);
    weights.clear();
    weights.extend(log_weights.map(|log| (log - largest).exp()));
    let sum: f64 = weights.iter().sum();
    weights.iter_mut().for_each(|weight| *weight /= sum);
    largest + sum.ln()
}

/// Effective sample size 1 / Σ w² of normalised weights (Kong, Liu and Wong 1994).
pub(crate) fn effective_sample_size(weights: &[f64]) -> f64 {
    1.0 / weights.iter().map(|weight| weight * weight).sum::<f64>()
}

/// Low-variance (systematic) resampling: writes to `chosen`, in ascending order, the index of the parent of each of
/// `count` equally weighted children, for one uniform number in \[0, 1).
pub(crate) fn systematic(weights: &[f64], count: usize, uniform: f64, chosen: &mut Vec<u32>) {
    chosen.clear();
    let mut index = 0;
    let mut cumulative = weights[0];
    for child in 0..count {
        let wanted = (child as f64 + uniform) / count as f64;
        while cumulative < wanted && index + 1 < weights.len() {
            index += 1;
            cumulative += weights[index];
        }
        chosen.push(index as u32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_sum_to_one_whatever_their_scale() {
        let mut weights = Vec::new();
        let log_sum = normalise([-1e4, -1e4 + 1.0, -2e4].into_iter(), &mut weights);
        assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!((weights[1] / weights[0] - 1f64.exp()).abs() < 1e-9);
        assert!((log_sum - (-1e4 + (1.0 + 1f64.exp()).ln())).abs() < 1e-9);
    }

    #[test]
    fn effective_sample_size_counts_equal_weights() {
        assert!((effective_sample_size(&[0.25; 4]) - 4.0).abs() < 1e-12);
        assert!((effective_sample_size(&[1.0, 0.0, 0.0]) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn each_parent_has_its_expected_number_of_children_to_within_one() {
        let weights = [0.5, 0.05, 0.0, 0.25, 0.2];
        for step in 0..100 {
            let mut chosen = Vec::new();
            systematic(&weights, 1000, f64::from(step) / 100.0, &mut chosen);
            assert_eq!(chosen.len(), 1000);
            for (parent, weight) in weights.iter().enumerate() {
                let children = chosen
                    .iter()
                    .filter(|&&index| index as usize == parent)
                    .count() as f64;
                assert!(
                    (children - 1000.0 * weight).abs() <= 1.0 + 1e-9,
                    "{parent}: {children}"
                );
            }
        }
    }
}
