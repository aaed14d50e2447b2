//! Parameters of the paper's filter.

use serde::{Deserialize, Serialize};

use super::MotionModel;
use crate::ParameterError;

/// Parameters of the paper's filter. Pairs are the values before and after the exploratory motion.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct PaperParameters {
    /// What the contact does while the robot moves: `curvature`, `link` or `world`. Default `curvature`.
    pub motion_model: MotionModel,
    /// Steps a second, each by the mean of the samples since the last, Hz. Default 10, as the authors' own.
    pub rate_hz: f64,
    /// λ of eq. 5, 1/(Nm)². Default 1, 20.
    pub lambda: [f64; 2],
    /// Noise σ on the location, m a step. Default 0.005, 0.0005.
    pub location_noise: [f64; 2],
    /// Noise σ on the force, N a step. Default 1, 0.1.
    pub force_noise: [f64; 2],
    /// Noise σ on the logarithm of the stiffness a step. Default 0.1, 0.01.
    pub stiffness_noise: [f64; 2],
    /// Sum of the joints' motion over which the first values turn into the second, rad. Default 0.05.
    pub schedule_travel: f64,
    /// Largest force of a fresh particle, N. Default 80.
    pub force_max: f64,
    /// Smallest and largest stiffness of a fresh particle, N/m. Default 500, 20000.
    pub stiffness_range: [f64; 2],
    /// Resample when the effective sample size falls below this share of the particles. Default 0.5.
    pub resample_below: f64,
    /// Share of fresh particles at each resampling. Default 0.01.
    pub fresh_share: f64,
}

impl Default for PaperParameters {
    fn default() -> Self {
        Self {
            motion_model: MotionModel::Curvature,
            rate_hz: 10.0,
            lambda: [1.0, 20.0],
            location_noise: [0.005, 0.0005],
            force_noise: [1.0, 0.1],
            stiffness_noise: [0.1, 0.01],
            schedule_travel: 0.05,
            force_max: 80.0,
            stiffness_range: [500.0, 20_000.0],
            resample_below: 0.5,
            fresh_share: 0.01,
        }
    }
}

impl PaperParameters {
    pub(crate) fn check(&self) -> Result<(), ParameterError> {
        let check = ParameterError::check;
        let pairs = [
            ("filter.paper.lambda", self.lambda),
            ("filter.paper.location_noise", self.location_noise),
            ("filter.paper.force_noise", self.force_noise),
            ("filter.paper.stiffness_noise", self.stiffness_noise),
            ("filter.paper.stiffness_range", self.stiffness_range),
        ];
        for (name, pair) in pairs {
            for value in pair {
                check(name, "> 0", value, value > 0.0)?;
            }
        }
        let rate = (0.1..=10_000.0).contains(&self.rate_hz);
        check("filter.paper.rate_hz", "0.1 … 10,000", self.rate_hz, rate)?;
        let [low, high] = self.stiffness_range;
        let expected = "two values in ascending order";
        check("filter.paper.stiffness_range", expected, high, low <= high)?;
        check(
            "filter.paper.schedule_travel",
            "> 0",
            self.schedule_travel,
            self.schedule_travel > 0.0,
        )?;
        check(
            "filter.paper.force_max",
            "> 0",
            self.force_max,
            self.force_max > 0.0,
        )?;
        let share = 0.0..=1.0;
        check(
            "filter.paper.resample_below",
            "0 … 1",
            self.resample_below,
            share.contains(&self.resample_below),
        )?;
        check(
            "filter.paper.fresh_share",
            "0 … 1",
            self.fresh_share,
            share.contains(&self.fresh_share),
        )
    }
}
