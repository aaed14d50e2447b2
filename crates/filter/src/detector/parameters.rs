//! Parameters of the contact detector.

use serde::{Deserialize, Serialize};

use crate::ParameterError;

/// Parameters of the contact detector, in physical units.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct DetectorParameters {
    /// False alarms an hour that the noise may cause, at most. Default 0.1.
    pub false_alarms_per_hour: f64,
    /// Torques below this are no contact, however little noise there is, Nm (N for a prismatic joint). Default 0.15.
    pub least_torque: f64,
    /// A contact begins when the torques speak for it this long without a break, s. Default 0.002.
    pub min_secs: f64,
    /// It ends when every joint's torque is below this share of what begins a contact … Default 0.6.
    pub release_share: f64,
    /// … for this long, s. Default 0.2.
    pub release_secs: f64,
    /// Standard deviation of each joint's bias before anything was learned, Nm. Default 0.05.
    pub bias_std: f64,
    /// Time over which the bias is learned while the robot rests, s. Default 10.
    pub bias_secs: f64,
    /// Travel of the joints over which it is learned while the robot moves, rad. Default 0.1.
    pub bias_travel: f64,
    /// Standard deviation of what the external torque is wrong by in fast motion before anything was learned, Nm.
    /// Default 0.25.
    pub motion_std: f64,
}

impl Default for DetectorParameters {
    fn default() -> Self {
        Self {
            false_alarms_per_hour: 0.1,
            least_torque: 0.15,
            min_secs: 0.002,
            release_share: 0.6,
            release_secs: 0.2,
            bias_std: 0.05,
            bias_secs: 10.0,
            bias_travel: 0.1,
            motion_std: 0.25,
        }
    }
}

impl DetectorParameters {
    pub(crate) fn check(&self) -> Result<(), ParameterError> {
        let within = |name, expected, found: f64, range: std::ops::RangeInclusive<f64>| {
            ParameterError::check(name, expected, found, range.contains(&found))
        };
        within(
            "filter.detector.false_alarms_per_hour",
            "0.000001 … 1000",
            self.false_alarms_per_hour,
            1e-6..=1e3,
        )?;
        let least = self.least_torque;
        within(
            "filter.detector.least_torque",
            "0.001 … 1000",
            least,
            1e-3..=1e3,
        )?;
        within(
            "filter.detector.min_secs",
            "0 … 1",
            self.min_secs,
            0.0..=1.0,
        )?;
        let share = self.release_share;
        within("filter.detector.release_share", "0.1 … 1", share, 0.1..=1.0)?;
        let release = self.release_secs;
        within(
            "filter.detector.release_secs",
            "0 … 60",
            release,
            0.0..=60.0,
        )?;
        within(
            "filter.detector.bias_std",
            "0.001 … 100",
            self.bias_std,
            1e-3..=100.0,
        )?;
        within(
            "filter.detector.bias_secs",
            "0.1 … 3600",
            self.bias_secs,
            0.1..=3600.0,
        )?;
        let travel = self.bias_travel;
        within(
            "filter.detector.bias_travel",
            "0.001 … 10",
            travel,
            1e-3..=10.0,
        )?;
        within(
            "filter.detector.motion_std",
            "0 … 100",
            self.motion_std,
            0.0..=100.0,
        )
    }
}
