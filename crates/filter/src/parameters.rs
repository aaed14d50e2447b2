//! The filter's parameters: the one place of their defaults.

use serde::{Deserialize, Serialize};

/// Parameters of the filter. Each field has its unit and default; unknown keys are refused.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct Parameters {
    /// Number of particles. Default 10,000.
    pub particles: usize,
}

impl Default for Parameters {
    fn default() -> Self {
        Self { particles: 10_000 }
    }
}

/// Why parameters were refused.
#[derive(Debug, thiserror::Error)]
pub enum ParameterError {
    /// The text is not what is expected: bad syntax, an unknown key, a wrong type.
    #[error("parameters: {0}")]
    Text(#[from] serde_yaml_ng::Error),
    /// A value lies outside its range.
    #[error("parameter {name} is {found}, expected {expected}")]
    Range {
        /// Full name of the parameter.
        name: &'static str,
        /// What is allowed.
        expected: &'static str,
        /// What was found.
        found: String,
    },
}
