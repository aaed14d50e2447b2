//! Is anything touching? A threshold with hysteresis on the size of the external torque.

use serde::{Deserialize, Serialize};

use crate::ParameterError;

/// Parameters of the contact detector.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct DetectorParameters {
    /// Contact begins when the smoothed torque of some joint exceeds this, Nm. Default 0.3.
    pub on_torque: f64,
    /// Contact ends when the smoothed torque of every joint is below this, Nm. Default 0.2.
    pub off_torque: f64,
    /// Time constant of the smoothing, s. Default 0.02.
    pub smoothing_secs: f64,
    /// The torque must stay below `off_torque` for this long before contact ends, s. Default 0.2.
    pub release_secs: f64,
}

impl Default for DetectorParameters {
    fn default() -> Self {
        Self {
            on_torque: 0.3,
            off_torque: 0.2,
            smoothing_secs: 0.02,
            release_secs: 0.2,
        }
    }
}

impl DetectorParameters {
    pub(crate) fn check(&self) -> Result<(), ParameterError> {
        let check = ParameterError::check;
        check(
            "filter.detector.on_torque",
            "> 0",
            self.on_torque,
            self.on_torque > 0.0,
        )?;
        let below = (0.0..=self.on_torque).contains(&self.off_torque);
        check(
            "filter.detector.off_torque",
            "0 … on_torque",
            self.off_torque,
            below,
        )?;
        let smooth = (0.0..=10.0).contains(&self.smoothing_secs);
        check(
            "filter.detector.smoothing_secs",
            "0 … 10",
            self.smoothing_secs,
            smooth,
        )?;
        let release = (0.0..=60.0).contains(&self.release_secs);
        check(
            "filter.detector.release_secs",
            "0 … 60",
            self.release_secs,
            release,
        )
    }
}

/// Decides between contact and no contact.
#[derive(Clone, Debug)]
pub(crate) struct Detector {
    parameters: DetectorParameters,
    smoothed: Vec<f64>,
    last_ns: Option<i64>,
    quiet_secs: f64,
    contact: bool,
}

impl Detector {
    pub(crate) fn new(parameters: DetectorParameters, dof: usize) -> Self {
        Self {
            parameters,
            smoothed: vec![0.0; dof],
            last_ns: None,
            quiet_secs: 0.0,
            contact: false,
        }
    }

    /// Takes the external torques of one sample, Nm; tells whether anything touches.
    pub(crate) fn update(&mut self, stamp_ns: i64, external_torque: &[f64]) -> bool {
        let step_secs = self.last_ns.map_or(f64::INFINITY, |last| {
            stamp_ns.saturating_sub(last) as f64 * 1e-9
        });
        self.last_ns = Some(stamp_ns);
        let gain = 1.0 - (-step_secs / self.parameters.smoothing_secs.max(1e-9)).exp();
        for (smoothed, torque) in self.smoothed.iter_mut().zip(external_torque) {
            *smoothed += gain * (torque - *smoothed);
        }
        let largest = self
            .smoothed
            .iter()
            .fold(0.0_f64, |most, torque| most.max(torque.abs()));
        if largest >= self.parameters.on_torque {
            self.contact = true;
        }
        let quiet = largest < self.parameters.off_torque && step_secs.is_finite();
        self.quiet_secs = if quiet {
            self.quiet_secs + step_secs
        } else {
            0.0
        };
        if self.quiet_secs > self.parameters.release_secs {
            self.contact = false;
        }
        self.contact
    }

    pub(crate) fn reset(&mut self) {
        self.smoothed.fill(0.0);
        self.last_ns = None;
        self.quiet_secs = 0.0;
        self.contact = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(detector: &mut Detector, from_ms: i64, to_ms: i64, torque: f64) -> bool {
        (from_ms..to_ms)
            .map(|ms| detector.update(ms * 1_000_000, &[0.0, torque]))
            .last()
            .unwrap()
    }

    #[test]
    fn contact_begins_above_one_threshold_and_ends_below_another() {
        let mut detector = Detector::new(DetectorParameters::default(), 2);
        assert!(!run(&mut detector, 0, 500, 0.25));
        assert!(run(&mut detector, 500, 1000, -0.4));
        assert!(
            run(&mut detector, 1000, 2000, 0.25),
            "between the thresholds it stays"
        );
        assert!(
            run(&mut detector, 2000, 2100, 0.1),
            "a short dip does not end it"
        );
        assert!(!run(&mut detector, 2100, 2500, 0.1));
    }
}
