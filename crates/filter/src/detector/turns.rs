//! What a joint that turns back adds to its noise in the charts of sudden changes: friction jumps there.

use super::onset::ONSETS;

/// Largest change amid a turn before any was seen, Nm, and the time amidst turns of all joints that this is worth, s.
const FIRST_PEAK: f64 = 0.4;
const FIRST_SECS: f64 = 2.0;
/// Time amidst its turns in which a joint's peak is forgotten, s, less before it turned for so long; then it tells as much
/// of itself as the others do.
const MEMORY_SECS: f64 = 30.0;
/// Standard deviations that noise alone reaches in such a time; what is beyond is the turn's. And factors on its variance,
/// as the next turn may be worse; the slowest chart also shows what friction gets wrong of the speed around a turn.
const NOISE_PEAK: f64 = 4.5;
const WORSE: [f64; ONSETS] = [1.5, 1.5, 1.5, 2.0];

/// The part of a squared change, Nm², that noise of this variance, Nm², does not reach.
pub(super) fn beyond_noise(change: f64, variance: f64) -> f64 {
    (change * change - NOISE_PEAK * NOISE_PEAK * variance).max(0.0)
}

/// Some time, with how much a joint turned and its largest changes meanwhile.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TurnSpan {
    /// Turning times time, s.
    turning: f64,
    /// Largest squared changes beyond noise times turning, Nm².
    peaks: [f64; ONSETS],
}

impl TurnSpan {
    /// Adds a sample's sudden changes: their squares beyond noise, Nm².
    pub(super) fn add(&mut self, secs: f64, turning: f64, excess: [f64; ONSETS]) {
        self.turning += secs * turning;
        for (peak, excess) in self.peaks.iter_mut().zip(excess) {
            *peak = peak.max(turning * excess);
        }
    }
}

/// What a joint's turns did to its sudden changes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Turns {
    /// Largest squared changes beyond noise amid turns, Nm²; they are forgotten slowly.
    peaks: [f64; ONSETS],
    /// Turning times time that they were learned from, s.
    seen: f64,
}

impl Turns {
    /// Peaks, Nm², to be expected of a joint whose turns are not known, by those of all joints: where friction is wrong on
    /// some, it is so on others. What one joint alone showed may have been a push, though.
    pub(super) fn pooled<'a>(joints: impl Iterator<Item = &'a Self>) -> [f64; ONSETS] {
        let mut most = [0.0_f64; ONSETS];
        let mut second = [0.0_f64; ONSETS];
        let mut seen = 0.0;
        for turns in joints {
            seen += turns.seen;
            for (chart, &peak) in turns.peaks.iter().enumerate() {
                second[chart] = second[chart].max(peak.min(most[chart]));
                most[chart] = most[chart].max(peak);
            }
        }
        let first = FIRST_PEAK * FIRST_PEAK * FIRST_SECS / (FIRST_SECS + seen);
        second.map(|peak| peak.max(first))
    }

    /// Variance that a chart's change has beyond its noise while the joint turns so much, Nm²; `pooled` as of all joints.
    pub(super) fn at(&self, chart: usize, turning: f64, pooled: &[f64; ONSETS]) -> f64 {
        let unknown = MEMORY_SECS / (MEMORY_SECS + self.seen);
        let peak = self.peaks[chart].max(unknown * pooled[chart]);
        WORSE[chart] * turning * peak / (NOISE_PEAK * NOISE_PEAK)
    }

    /// Learns from what happened.
    pub(super) fn learn(&mut self, span: &TurnSpan) {
        self.seen += span.turning;
        let memory_secs = MEMORY_SECS.min(FIRST_SECS + self.seen);
        let kept = (-span.turning / memory_secs).exp();
        for (peak, seen) in self.peaks.iter_mut().zip(span.peaks) {
            *peak = seen.max(kept * *peak);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turned(secs: f64, excess: f64) -> Turns {
        let mut span = TurnSpan::default();
        span.add(secs, 1.0, [excess; ONSETS]);
        let mut turns = Turns::default();
        turns.learn(&span);
        turns
    }

    #[test]
    fn turns_without_a_jump_free_all_joints_of_what_was_believed() {
        let before = Turns::pooled([Turns::default(); 3].iter());
        let after = Turns::pooled([turned(18.0, 0.0), Turns::default(), Turns::default()].iter());
        assert!((before[0] - FIRST_PEAK * FIRST_PEAK).abs() < 1e-12);
        assert!((after[0] - before[0] * FIRST_SECS / (FIRST_SECS + 18.0)).abs() < 1e-12);
    }

    #[test]
    fn jumps_of_two_joints_are_expected_of_a_third_but_not_those_of_one() {
        let (quiet, jumped) = (turned(40.0, 0.0), turned(40.0, 1.0));
        let two = Turns::pooled([jumped, jumped, Turns::default()].iter());
        let one = Turns::pooled([jumped, quiet, Turns::default()].iter());
        assert!(two[0] > 0.9 && one[0] < 0.01, "{two:?} {one:?}");
        let unknown = Turns::default().at(0, 1.0, &two);
        assert!(unknown > 1.5 * quiet.at(0, 1.0, &two));
    }

    #[test]
    fn what_noise_reaches_is_no_jump() {
        assert!(beyond_noise(0.44, 0.01) < 1e-12);
        assert!((beyond_noise(0.5, 0.01) - (0.25 - 0.2025)).abs() < 1e-12);
    }
}
