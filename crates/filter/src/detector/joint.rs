//! One joint's control charts.

use super::bias::{BiasFilter, Forgetting};
use super::noise::{Exposure, Span, Spread, White};
use super::{DetectorParameters, JointBias};

/// Time constants of the charts, s.
pub(super) const CHARTS: usize = 3;
pub(super) const SCALES: [f64; CHARTS] = [0.004, 0.02, 0.08];
/// The chart that says whether a contact ended.
const RELEASE: usize = 1;
/// A sample counts for at most so many standard deviations: one wrong sample is no contact.
const CLIP: f64 = 8.0;
/// Below so many standard deviations of the chart there is no sign of a contact.
const CALM: f64 = 2.0;

/// What the charts of all joints share: gains of this step, and the share of white noise's variance that each keeps.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Charts {
    gain: [f64; CHARTS],
    share: [f64; CHARTS],
}

impl Charts {
    /// Begins anew with the next sample.
    pub(super) fn begin(&mut self) {
        self.gain = [1.0; CHARTS];
        self.share = [1.0; CHARTS];
    }

    pub(super) fn advance(&mut self, step_secs: f64) {
        for (scale, secs) in SCALES.into_iter().enumerate() {
            let gain = 1.0 - (-step_secs / secs).exp();
            self.gain[scale] = gain;
            self.share[scale] = (1.0 - gain).powi(2) * self.share[scale] + gain * gain;
        }
    }
}

/// The charts, the noise and the bias of one joint.
#[derive(Clone, Copy, Debug)]
pub(super) struct JointDetector {
    pub(super) bias: BiasFilter,
    white: White,
    pub(super) spread: [Spread; CHARTS],
    pub(super) exposure: Exposure,
    /// What was seen during the present contact.
    doubt: Span,
    /// What each chart reads where a contact begins, Nm.
    limit: [f64; CHARTS],
    pub(super) smoothed: [f64; CHARTS],
    /// Standard deviation of a sample's residual, Nm.
    sample_std: f64,
    residual: f64,
    /// The chart that is furthest beyond its threshold, in thresholds.
    pub(super) ratio: f64,
    /// The same for the chart that ends contacts.
    pub(super) release_ratio: f64,
    least_torque: f64,
    release_std: f64,
    /// Since when the joint shows a sign of a contact, ns.
    pub(super) stirred_ns: Option<i64>,
}

impl JointDetector {
    pub(super) fn new(parameters: &DetectorParameters) -> Self {
        let white = White::new();
        Self {
            bias: BiasFilter::new(parameters),
            sample_std: (white.variance() + parameters.bias_std.powi(2)).sqrt(),
            white,
            spread: [Spread::new(parameters.motion_std); CHARTS],
            exposure: Exposure::default(),
            doubt: Span::default(),
            limit: [0.0; CHARTS],
            smoothed: [0.0; CHARTS],
            residual: 0.0,
            ratio: 0.0,
            release_ratio: 0.0,
            least_torque: parameters.least_torque,
            release_std: 0.0,
            stirred_ns: None,
        }
    }

    /// Sets the torque below which nothing is a contact, Nm.
    pub(super) fn set_least_torque(&mut self, least_torque: f64) {
        self.least_torque = least_torque;
    }

    /// Begins anew after a gap in time: noise and bias stay as they are known.
    pub(super) fn begin(&mut self) {
        self.white.interrupt();
        self.stirred_ns = None;
    }

    /// Puts a sample's torque, Nm, on the charts.
    pub(super) fn look(&mut self, torque: f64, step_secs: f64, charts: &Charts) {
        self.white.learn(torque, step_secs);
        let most = CLIP * self.sample_std;
        self.residual = (torque - self.bias.mean).clamp(-most, most);
        for (smoothed, gain) in self.smoothed.iter_mut().zip(charts.gain) {
            *smoothed += gain * (self.residual - *smoothed);
        }
    }

    /// Weighs the charts against their thresholds, while the joint turns by `turning`.
    pub(super) fn weigh(&mut self, stamp_ns: i64, turning: f64, charts: &Charts, scene: &Weighing) {
        let bias = self.bias.variance + scene.frozen_variance;
        let white = self.white.variance();
        let noise = white.max(self.spread[0].at(scene.x2, turning));
        self.sample_std = (noise + bias).sqrt();
        self.ratio = 0.0;
        for scale in 0..CHARTS {
            let noise = (white * charts.share[scale]).max(self.spread[scale].at(scene.x2, turning));
            let std = (noise + bias).sqrt();
            let smoothed = self.smoothed[scale].abs();
            let limit = (scene.threshold * std).max(self.least_torque);
            let ratio = smoothed / limit;
            self.limit[scale] = limit;
            self.ratio = self.ratio.max(ratio);
            if scale == RELEASE {
                self.release_ratio = ratio;
                self.release_std = std;
                self.stirred_ns = match smoothed < CALM * std {
                    true => None,
                    false => self.stirred_ns.or(Some(stamp_ns)),
                };
            }
        }
    }

    /// Learns the bias from the last sample; `trust` is the share of the full gain. A turn teaches nothing until it is over.
    pub(super) fn learn_bias(&mut self, trust: f64, turning: f64, forgetting: Forgetting) {
        let white = self.white.variance();
        let trust = trust * (1.0 - turning);
        self.bias.learn(self.residual, white, trust, forgetting);
    }

    /// Notes what a contact looks like, for it may turn out to be none. No more counts than what begins a contact.
    pub(super) fn doubt(&mut self, step_secs: f64, x2: f64, turning: f64) {
        let charts = std::array::from_fn(|scale| self.smoothed[scale].abs().min(self.limit[scale]));
        self.doubt.add(step_secs, x2, turning, charts);
    }

    /// Learns from what was noted and forgets it; not if it was a contact without doubt, or `off_turns` and the noise is
    /// known.
    pub(super) fn settle(&mut self, is_doubtful: bool, off_turns: bool, motion_std: f64) {
        let span = std::mem::take(&mut self.doubt);
        let is_known = self.exposure.is_long();
        if is_doubtful && !(is_known && off_turns) {
            span.teach(&mut self.exposure, &mut self.spread, motion_std, is_known);
        }
    }

    /// Learns the noise from a span without contact.
    pub(super) fn learn_noise(&mut self, span: &Span, motion_std: f64) {
        span.teach(&mut self.exposure, &mut self.spread, motion_std, false);
    }

    /// Sets the bias, as after a tare.
    pub(super) fn set_bias(&mut self, bias: JointBias) {
        for smoothed in &mut self.smoothed {
            *smoothed += self.bias.mean - bias.mean;
        }
        self.bias.mean = bias.mean;
        self.bias.variance = bias.std * bias.std;
    }

    /// Goes on to learn the bias, which became more uncertain by so much while it was frozen, Nm².
    pub(super) fn thaw(&mut self, frozen_variance: f64) {
        self.bias.variance += frozen_variance;
    }

    /// The bias, with an uncertainty that includes all that does not average out over the slowest chart.
    pub(super) fn bias(&self, charts: &Charts, scene: &Weighing) -> JointBias {
        let slowest = CHARTS - 1;
        let white = self.white.variance() * charts.share[slowest];
        let slow = (self.spread[slowest].at(scene.x2, 0.0) - white).max(0.0);
        JointBias {
            mean: self.bias.mean,
            std: (self.bias.variance + scene.frozen_variance + slow).sqrt(),
        }
    }

    /// Probability that no torque as large as the least that counts is hidden in the noise.
    pub(super) fn freedom(&self) -> f64 {
        let room = (self.least_torque - self.smoothed[RELEASE].abs()) / self.release_std;
        0.5 * libm::erfc(-room / std::f64::consts::SQRT_2)
    }
}

/// What a sample is weighed with, the same for all joints.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Weighing {
    /// Standard deviations that begin a contact.
    pub(super) threshold: f64,
    /// Squared quickness of the motion.
    pub(super) x2: f64,
    /// By how much the biases became more uncertain since they are frozen, Nm²; 0 without contact.
    pub(super) frozen_variance: f64,
}
