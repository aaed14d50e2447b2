//! Parameters of this project's filter.

use serde::{Deserialize, Serialize};

use crate::ParameterError;

/// Parameters of this project's filter.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct PalpateParameters {
    /// Most hypotheses that are weighed by the whole history; these are the cloud's particles. Default 400.
    pub hypotheses: usize,
    /// Fewest of them, where all agree about the place: KLD-sampling (Fox 2003) sets their number. Where `hypotheses` is
    /// less, that counts. Default 100.
    pub min_hypotheses: usize,
    /// Moves that each hypothesis tries after each keyframe. Default 4.
    pub rounds: usize,
}

impl Default for PalpateParameters {
    fn default() -> Self {
        Self {
            hypotheses: 400,
            min_hypotheses: 100,
            rounds: 4,
        }
    }
}

impl PalpateParameters {
    pub(crate) fn check(&self) -> Result<(), ParameterError> {
        let check = ParameterError::check;
        let count = self.hypotheses as f64;
        check(
            "filter.palpate.hypotheses",
            "50 … 100,000",
            count,
            (50.0..=1e5).contains(&count),
        )?;
        let least = self.min_hypotheses as f64;
        check(
            "filter.palpate.min_hypotheses",
            "50 … 100,000",
            least,
            (50.0..=1e5).contains(&least),
        )?;
        let rounds = self.rounds as f64;
        check(
            "filter.palpate.rounds",
            "1 … 100",
            rounds,
            (1.0..=100.0).contains(&rounds),
        )
    }
}
