//! The filter's parameters: the one place of their defaults.

use serde::{Deserialize, Serialize};

use crate::detector::DetectorParameters;
use crate::palpate::PalpateParameters;
use crate::paper::PaperParameters;

/// How contacts are estimated.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// The paper's filter, as published.
    Paper,
    /// The paper's curvature model with memory: obstacles at rest in the world, weighed by the whole contact.
    #[default]
    Palpate,
}

/// Parameters of the filter. Each field has its unit and default; unknown keys are refused.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct Parameters {
    /// The method: `paper` or `palpate`. Default `palpate`.
    pub method: Method,
    /// Number of particles of the paper's filter. Default 10,000.
    pub particles: usize,
    /// The node takes fewer where its machine is too slow for the samples, down to this many; see
    /// [`Filter::limit_particles`](crate::Filter::limit_particles). Where `particles` is less, that counts. Default 1000.
    pub min_particles: usize,
    /// A contact counts as located when its first mode has at least this probability. Default 0.6.
    pub located_probability: f64,
    /// … and at most this standard deviation of the position, m. Default 0.03.
    pub located_std: f64,
    /// What meshes and positions are wrong by, m: added to every estimate's uncertainty. Default 0.001.
    pub tolerance: f64,
    /// When something touches.
    pub detector: DetectorParameters,
    /// This project's filter.
    pub palpate: PalpateParameters,
    /// The paper's filter.
    pub paper: PaperParameters,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            method: Method::Palpate,
            particles: 10_000,
            min_particles: 1000,
            located_probability: 0.6,
            located_std: 0.03,
            tolerance: 0.001,
            detector: DetectorParameters::default(),
            palpate: PalpateParameters::default(),
            paper: PaperParameters::default(),
        }
    }
}

impl Parameters {
    /// Most particles of the chosen method.
    pub fn particle_count(&self) -> usize {
        match self.method {
            Method::Paper => self.particles,
            Method::Palpate => self.palpate.hypotheses,
        }
    }

    /// Fewest and most particles that the node lets the paper's filter have.
    pub fn particle_range(&self) -> [usize; 2] {
        [self.min_particles.min(self.particles), self.particles]
    }

    /// Checks every range.
    ///
    /// # Errors
    /// Names the parameter, what is allowed and what was found.
    pub fn check(&self) -> Result<(), ParameterError> {
        let check = ParameterError::check;
        for (name, count) in [
            ("filter.particles", self.particles),
            ("filter.min_particles", self.min_particles),
        ] {
            let count = count as f64;
            let fits = (100.0..=1e7).contains(&count);
            check(name, "100 … 10,000,000", count, fits)?;
        }
        let probability = (0.0..=1.0).contains(&self.located_probability);
        check(
            "filter.located_probability",
            "0 … 1",
            self.located_probability,
            probability,
        )?;
        check(
            "filter.located_std",
            "> 0",
            self.located_std,
            self.located_std > 0.0,
        )?;
        let tolerance = (0.0..=0.1).contains(&self.tolerance);
        check("filter.tolerance", "0 … 0.1", self.tolerance, tolerance)?;
        self.detector.check()?;
        self.palpate.check()?;
        self.paper.check()
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
    /// More joints act on a link than the filter has room for.
    #[error(
        "link {link} has {found} movable joints on its path to the root, expected at most {most}"
    )]
    TooManyJoints {
        /// The link.
        link: String,
        /// How many joints there may be.
        most: usize,
        /// How many there are.
        found: usize,
    },
    /// The robot has nothing to touch.
    #[error(
        "robot {robot} has no link with both a mesh and a movable joint on its path: nothing can be located"
    )]
    NothingToTouch {
        /// Name of the robot.
        robot: String,
    },
}

impl ParameterError {
    /// Refuses `found` unless `good`. NaN is never good, as no comparison with it holds.
    pub(crate) fn check(
        name: &'static str,
        expected: &'static str,
        found: f64,
        good: bool,
    ) -> Result<(), Self> {
        if good && found.is_finite() {
            return Ok(());
        }
        Err(Self::Range {
            name,
            expected,
            found: found.to_string(),
        })
    }
}
