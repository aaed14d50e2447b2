//! One joint's control charts.

use super::bias::{BiasFilter, Forgetting};
use super::noise::{Exposure, Span, Spread, White};
use super::onset::{ONSETS, Partial};
use super::touch::Ended;
use super::turns::{TurnSpan, Turns};
use super::{DetectorParameters, JointBias};

/// Time constants of the charts, s.
pub(super) const CHARTS: usize = 3;
pub(super) const SCALES: [f64; CHARTS] = [0.004, 0.02, 0.08];
/// The chart that says whether a contact ended.
const RELEASE: usize = 1;
/// A sample counts for at most so many standard deviations: one wrong sample is no contact.
const CLIP: f64 = 6.0;
/// Below so many standard deviations of the chart there is no sign of a contact.
const CALM: f64 = 2.0;

/// Share of a squared limit that is beyond what noise reaches amid turns.
const JUMP_SHARE: f64 = 0.5;
/// A joint that turns by less does not explain what its charts read, 0 to 1.
pub(super) const DOUBTFUL_TURN: f64 = 0.3;

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

/// How much a joint turns back, 0 to 1.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Turning {
    /// As far as slow charts see, long before and after.
    pub(super) wide: f64,
    /// While its speed is about zero.
    pub(super) narrow: f64,
}

/// Some time without contact, as seen by the charts of one joint.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Seen {
    smoothed: Span,
    onset: TurnSpan,
}

/// The charts, the noise and the bias of one joint.
#[derive(Clone, Copy, Debug)]
pub(super) struct JointDetector {
    pub(super) bias: BiasFilter,
    white: White,
    spread: [Spread; CHARTS],
    exposure: Exposure,
    /// What was seen during the present contact.
    doubt: Seen,
    /// What each chart reads where a contact begins, Nm.
    limit: [f64; CHARTS],
    smoothed: [f64; CHARTS],
    /// By how much each was beyond its threshold with the last sample, in thresholds.
    last_ratio: [f64; CHARTS],
    /// What turning back does to the charts of sudden changes.
    pub(super) turns: Turns,
    partial: Partial,
    /// The same limits and ratios for them.
    onset_limit: [f64; ONSETS],
    onset_ratio: [f64; ONSETS],
    /// Standard deviation of a sample's residual, Nm.
    sample_std: f64,
    residual: f64,
    /// The chart that was furthest beyond its threshold with both of the last two samples, in thresholds; and the same with
    /// the last alone.
    pub(super) ratio: f64,
    pub(super) newest_ratio: f64,
    /// Whether a chart is beyond its threshold while nothing turns that it sees.
    pub(super) is_off_turns: bool,
    /// The same ratio for the chart that ends contacts.
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
            doubt: Seen::default(),
            limit: [0.0; CHARTS],
            smoothed: [0.0; CHARTS],
            last_ratio: [0.0; CHARTS],
            turns: Turns::default(),
            onset_limit: [f64::INFINITY; ONSETS],
            partial: Partial::default(),
            onset_ratio: [0.0; ONSETS],
            residual: 0.0,
            ratio: 0.0,
            newest_ratio: 0.0,
            is_off_turns: false,
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

    /// The last sample's torque, as far as it is believed, Nm.
    pub(super) fn torque(&self) -> f64 {
        self.bias.mean + self.residual
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

    /// Weighs the charts against their thresholds.
    pub(super) fn weigh(
        &mut self,
        stamp_ns: i64,
        turning: Turning,
        charts: &Charts,
        partial: &Partial,
        scene: &Weighing,
    ) {
        self.ratio = 0.0;
        self.newest_ratio = 0.0;
        self.is_off_turns = false;
        let stirs = self.weigh_smoothed(turning.wide, charts, scene);
        let jolts = self.weigh_onset(turning.wide, partial, scene);
        self.stirred_ns = match stirs || jolts {
            true => self.stirred_ns.or(Some(stamp_ns)),
            false => None,
        };
    }

    /// Tells whether there is a sign of a contact.
    fn weigh_smoothed(&mut self, turning: f64, charts: &Charts, scene: &Weighing) -> bool {
        let bias = self.bias.variance + scene.frozen_variance;
        let white = self.white.variance();
        let noise = white.max(self.spread[0].at(scene.x2, turning));
        self.sample_std = (noise + bias).sqrt();
        for scale in 0..CHARTS {
            let noise = (white * charts.share[scale]).max(self.spread[scale].at(scene.x2, turning));
            let std = (noise + bias).sqrt();
            let smoothed = self.smoothed[scale].abs();
            let limit = (scene.threshold * std).max(self.least_torque);
            let ratio = smoothed / limit;
            self.limit[scale] = limit;
            let last = std::mem::replace(&mut self.last_ratio[scale], ratio);
            self.compare(last, ratio, turning);
            if scale == RELEASE {
                let known = scene.threshold * (noise + self.bias.variance).sqrt();
                let limit = known.max(scene.lasting * std).max(self.least_torque);
                self.release_ratio = smoothed / limit;
                self.release_std = std;
            }
        }
        self.smoothed[RELEASE].abs() >= CALM * self.release_std
    }

    /// The same for sudden changes.
    fn weigh_onset(&mut self, turning: f64, partial: &Partial, scene: &Weighing) -> bool {
        let mut stirs = false;
        self.partial = *partial;
        for chart in 0..ONSETS {
            let std = partial.variance[chart].sqrt();
            let size = partial.residual[chart].abs();
            let limit = (scene.threshold * std).max(self.least_torque);
            self.onset_limit[chart] = limit;
            let last = std::mem::replace(&mut self.onset_ratio[chart], size / limit);
            self.compare(last, size / limit, turning);
            stirs |= size > CALM * std;
        }
        stirs
    }

    /// Takes what a chart read with the last sample but one and with the last in, in thresholds. One wrong sample is no
    /// contact, but nothing to learn from either.
    fn compare(&mut self, last: f64, newest: f64, turning: f64) {
        let ratio = last.min(newest);
        self.newest_ratio = self.newest_ratio.max(newest);
        self.ratio = self.ratio.max(ratio);
        self.is_off_turns |= ratio >= 1.0 && turning < DOUBTFUL_TURN;
    }

    /// Learns the bias from the last sample; `trust` is the share of the full gain. A turn teaches nothing until it is over.
    pub(super) fn learn_bias(&mut self, trust: f64, turning: f64, forgetting: Forgetting) {
        let white = self.white.variance();
        let trust = trust * (1.0 - turning);
        self.bias.learn(self.residual, white, trust, forgetting);
    }

    /// Adds the last sample to what was seen.
    pub(super) fn see(&self, seen: &mut Seen, step_secs: f64, x2: f64, turning: Turning) {
        (seen.smoothed).add(step_secs, x2, turning.wide, self.smoothed);
        (seen.onset).add(step_secs, turning.narrow, self.partial.excess);
    }

    /// Learns the noise from what was seen without contact.
    pub(super) fn learn_noise(&mut self, seen: &Seen, motion_std: f64) {
        (seen.smoothed).teach(&mut self.exposure, &mut self.spread, motion_std, false);
        self.turns.learn(&seen.onset);
    }

    /// Notes what a contact looks like, for it may turn out to be none. No more counts than what begins a contact.
    pub(super) fn doubt(&mut self, step_secs: f64, x2: f64, turning: Turning) {
        let smoothed = at_most(self.smoothed, self.limit);
        let squares = self.onset_limit.map(|limit| JUMP_SHARE * limit * limit);
        let excess = at_most(self.partial.excess, squares);
        (self.doubt.smoothed).add(step_secs, x2, turning.wide, smoothed);
        (self.doubt.onset).add(step_secs, turning.narrow, excess);
    }

    /// Learns from what was noted and forgets it; not if it was a contact without doubt, nor, of the slow charts, `off_turns`
    /// once the noise is known. Jumps stand out, so that the charts of sudden changes learn from any short contact that may
    /// have been a turn, a little each.
    pub(super) fn settle(&mut self, ended: Ended, motion_std: f64) {
        let doubt = std::mem::take(&mut self.doubt);
        let is_known = self.exposure.is_long();
        if ended.is_doubtful && !(is_known && ended.off_turns) {
            (doubt.smoothed).teach(&mut self.exposure, &mut self.spread, motion_std, is_known);
        }
        if ended.was_turn {
            self.turns.learn(&doubt.onset);
        }
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

fn at_most<const N: usize>(readings: [f64; N], limits: [f64; N]) -> [f64; N] {
    std::array::from_fn(|chart| readings[chart].abs().min(limits[chart]))
}

/// What a sample is weighed with, the same for all joints.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Weighing {
    /// Standard deviations that begin a contact.
    pub(super) threshold: f64,
    /// Those that say that one goes on, where the bias is as uncertain as it became meanwhile.
    pub(super) lasting: f64,
    /// Squared quickness of the motion.
    pub(super) x2: f64,
    /// By how much the biases became more uncertain since they are frozen, Nm²; 0 without contact.
    pub(super) frozen_variance: f64,
}
