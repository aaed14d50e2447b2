//! Parameters of this project's filter.

use serde::{Deserialize, Serialize};

use crate::ParameterError;

/// Parameters of this project's filter.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct PalpateParameters {
    /// Number of hypotheses that are weighed by the whole history; these are the cloud's particles. Default 400.
    pub hypotheses: usize,
    /// Moves that each hypothesis tries after each keyframe. Default 4.
    pub rounds: usize,
}

impl Default for PalpateParameters {
    fn default() -> Self {
        Self {
            hypotheses: 400,
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
        let rounds = self.rounds as f64;
        check(
            "filter.palpate.rounds",
            "1 … 100",
            rounds,
            (1.0..=100.0).contains(&rounds),
        )
    }
}
