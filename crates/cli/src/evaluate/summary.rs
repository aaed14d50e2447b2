//! What the trials of a cell, or of several, come to together.

use super::region;
use super::score::{FOUND, Score};
use super::trial::Outcome;
use crate::last_second::median;

/// Statistics over trials. Lengths in m.
#[derive(Clone, Debug)]
pub struct Summary {
    /// Trials scored.
    pub count: usize,
    /// Trials that the simulator could not make.
    pub refused: usize,
    pub error_median: f64,
    pub error_mean: f64,
    /// 90 % of the trials err by at most this.
    pub error_p90: f64,
    pub error_max: f64,
    /// Share of trials that end closer than [`FOUND`].
    pub found: f64,
    /// Mean share of the last second with the right link.
    pub right_link: f64,
    /// Median, N.
    pub force_error: f64,
    /// Median, s.
    pub settled_secs: f64,
    /// Share of trials whose truth lies in the region, for each of [`region::LEVELS`].
    pub held: [f64; region::LEVELS.len()],
    /// Mean share of the last second with status "ambiguous".
    pub ambiguous: f64,
    /// Median standard deviation that the estimate gives itself.
    pub std: f64,
}

impl Summary {
    /// Of outcomes.
    pub fn of<'a>(outcomes: impl IntoIterator<Item = &'a Outcome>) -> Self {
        let outcomes: Vec<_> = outcomes.into_iter().collect();
        let scores: Vec<_> = outcomes
            .iter()
            .filter_map(|outcome| outcome.as_ref().ok())
            .collect();
        let mut errors: Vec<_> = scores.iter().map(|score| score.error).collect();
        errors.sort_by(f64::total_cmp);
        let mean = |value: &dyn Fn(&Score) -> f64| {
            scores.iter().map(|score| value(score)).sum::<f64>() / scores.len() as f64
        };
        let middle = |value: &dyn Fn(&Score) -> f64| {
            median(
                scores
                    .iter()
                    .map(|score| value(score))
                    .filter(|v| !v.is_nan()),
            )
        };
        Self {
            count: scores.len(),
            refused: outcomes.len() - scores.len(),
            error_median: median(errors.iter().copied()),
            error_mean: mean(&|score| score.error),
            error_p90: quantile(&errors, 0.9),
            error_max: errors.last().copied().unwrap_or(f64::NAN),
            found: mean(&|score| f64::from(score.error < FOUND)),
            right_link: mean(&|score| score.right_link),
            force_error: middle(&|score| score.force_error),
            settled_secs: middle(&|score| score.settled_secs),
            held: std::array::from_fn(|level| mean(&|score| f64::from(score.holds[level]))),
            ambiguous: mean(&|score| score.ambiguous),
            std: middle(&|score| score.std),
        }
    }
}

/// The smallest of sorted values that is not exceeded by this share of them; NaN of nothing.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted
        .get(rank.saturating_sub(1))
        .copied()
        .unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn score(error: f64) -> Score {
        Score {
            error,
            right_link: 1.0,
            right_link_all: 1.0,
            force_error: f64::NAN,
            force_error_share: f64::NAN,
            settled_secs: 0.1,
            without: 0.0,
            ambiguous: 0.0,
            std: 0.001,
            holds: [error < 0.0015, true],
            course: Vec::new(),
        }
    }

    #[test]
    fn refused_trials_are_counted_apart() {
        let mut outcomes: Vec<Outcome> =
            (1..=10).map(|mm| Ok(score(1e-3 * f64::from(mm)))).collect();
        outcomes.push(Err("nothing".to_owned()));
        let summary = Summary::of(&outcomes);
        assert_eq!((summary.count, summary.refused), (10, 1));
        assert!((summary.error_median - 5.5e-3).abs() < 1e-12);
        assert!((summary.error_p90 - 9e-3).abs() < 1e-12);
        assert_eq!(summary.error_max, 1e-2);
        assert_eq!(summary.held, [0.1, 1.0]);
        assert!(summary.force_error.is_nan());
    }

    #[test]
    fn nothing_comes_to_nothing() {
        let summary = Summary::of(&[]);
        assert_eq!(summary.count, 0);
        assert!(summary.error_median.is_nan() && summary.error_p90.is_nan());
    }
}
