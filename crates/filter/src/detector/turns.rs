//! What a joint that turns back adds to its noise in the charts of sudden changes: friction jumps there.

use super::onset::ONSETS;

/// Largest change amid a turn before any was seen, Nm, and the time amidst turns that this is worth, s.
const FIRST_PEAK: f64 = 0.3;
const FIRST_SECS: f64 = 4.0;
/// Time amidst turns in which a peak is forgotten, s.
const MEMORY_SECS: f64 = 30.0;
/// Standard deviations that noise alone reaches in such a time; what is beyond is the turn's. And a factor on its variance,
/// as the next turn may be worse.
const NOISE_PEAK: f64 = 4.5;
const WORSE: f64 = 1.5;

/// Some time, with how much a joint turned and its largest changes meanwhile.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TurnSpan {
    /// Turning times time, s.
    turning: f64,
    /// Largest squared readings times turning, Nm².
    peaks: [f64; ONSETS],
}

impl TurnSpan {
    /// Adds a sample's sudden changes, Nm.
    pub(super) fn add(&mut self, secs: f64, turning: f64, readings: [f64; ONSETS]) {
        self.turning += secs * turning;
        for (peak, reading) in self.peaks.iter_mut().zip(readings) {
            *peak = peak.max(turning * reading * reading);
        }
    }
}

/// What a joint's turns did to its sudden changes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turns {
    /// Largest squared readings amid turns, Nm²; they are forgotten slowly.
    peaks: [f64; ONSETS],
    /// Turning times time that they were learned from, s.
    seen: f64,
}

impl Turns {
    pub(super) fn new() -> Self {
        Self {
            peaks: [FIRST_PEAK * FIRST_PEAK; ONSETS],
            seen: FIRST_SECS,
        }
    }

    /// Variance that a chart's change has beyond its `noise` while the joint turns so much, Nm².
    pub(super) fn at(&self, chart: usize, turning: f64, noise: f64) -> f64 {
        let jump = self.peaks[chart] / (NOISE_PEAK * NOISE_PEAK) - noise;
        WORSE * turning * jump.max(0.0)
    }

    /// Learns from what happened.
    pub(super) fn learn(&mut self, span: &TurnSpan) {
        self.seen += span.turning;
        let kept = (-span.turning / self.seen.min(MEMORY_SECS)).exp();
        for (peak, seen) in self.peaks.iter_mut().zip(span.peaks) {
            *peak = seen.max(kept * *peak);
        }
    }
}
