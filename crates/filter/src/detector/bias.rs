//! What each joint's external torque reads while nothing touches.

use super::DetectorParameters;

/// Noise is taken as one and the same for at least this long, s: torques are often low-passed.
const CORRELATION_SECS: f64 = 0.01;
/// Variance of the noise, at least, Nm².
const LEAST_VARIANCE: f64 = 1e-4;
/// How a bias may change while it cannot be learned: with the configuration, Nm/rad, and with time, Nm/√s.
const CHANGE: f64 = 0.5;
const DRIFT: f64 = 0.015;

/// The bias of one joint's external torque.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointBias {
    /// The bias, Nm (N for a prismatic joint); subtracted before anything else looks at the torque.
    pub mean: f64,
    /// Standard deviation of what is left of it, Nm.
    pub std: f64,
}

/// How the bias forgets: set by the motion, the same for all joints.
#[derive(Clone, Copy, Debug)]
pub(super) struct Forgetting {
    pub(super) step_secs: f64,
    /// Time over which the bias is learned, s.
    pub(super) secs: f64,
}

impl Forgetting {
    /// At rest the bias is what drifts, in motion also what changes with the configuration (payload, friction).
    pub(super) fn new(parameters: &DetectorParameters, step_secs: f64, speed: f64) -> Self {
        let rate = 1.0 / parameters.bias_secs + speed / parameters.bias_travel;
        let secs = 1.0 / rate;
        Self { step_secs, secs }
    }
}

/// A Kalman filter of one joint's bias, a random walk whose step is such that it is learned within a given time.
#[derive(Clone, Copy, Debug)]
pub(super) struct BiasFilter {
    pub(super) mean: f64,
    pub(super) variance: f64,
}

impl BiasFilter {
    pub(super) fn new(parameters: &DetectorParameters) -> Self {
        Self {
            mean: 0.0,
            variance: parameters.bias_std.powi(2),
        }
    }

    /// Learns from a torque's residual, Nm, that has this white noise, Nm². `trust` is the share of the full gain.
    pub(super) fn learn(&mut self, residual: f64, white: f64, trust: f64, forgetting: Forgetting) {
        let Forgetting { step_secs, secs } = forgetting;
        let spread = (white + LEAST_VARIANCE) * CORRELATION_SECS.max(step_secs);
        let noise = spread / step_secs;
        self.variance += spread * step_secs / (secs * secs);
        let gain = trust * self.variance / (self.variance + noise);
        self.mean += gain * residual;
        self.variance *= 1.0 - gain;
    }
}

/// By how much a bias becomes more uncertain while it cannot be learned, Nm²: `distance` rad away, after some time.
pub(super) fn frozen_variance(distance: f64, secs: f64) -> f64 {
    (CHANGE * distance).powi(2) + DRIFT * DRIFT * secs
}
