//! One joint's noise: what its smoothed residuals are like while nothing touches.

use super::joint::CHARTS;

/// Standard deviation of the noise before anything was learned, Nm, and the samples that this is worth.
const WHITE_STD: f64 = 0.05;
const WHITE_SAMPLES: f64 = 5.0;
/// Time over which the white part is learned, s.
const WHITE_SECS: f64 = 2.0;
/// Standard deviation of what does not average out before anything was learned, Nm, and the time this is worth, s.
const SLOW_STD: f64 = 0.04;
const SLOW_SECS: f64 = 0.5;
/// Time that the belief in what motion does is worth, s at the fastest motion.
const MOTION_SECS: f64 = 0.05;
/// Standard deviation that a turn adds before anything was learned, Nm, and the time this is worth, s amidst a turn.
const TURNING_STD: f64 = 0.06;
const TURNING_SECS: f64 = 0.1;
/// What motion gets wrong is not Gaussian: factor on its variance.
const NOT_GAUSSIAN: f64 = 2.0;
/// Time from which on the noise counts as known, s.
const KNOWN_SECS: f64 = 3.0;
/// Time over which residuals are remembered, s.
const MEMORY_SECS: f64 = 60.0;
/// A second difference counts for at most so many standard deviations.
const CLIP: f64 = 6.0;

/// The part that differs from sample to sample: it shows in second differences, whatever touches.
#[derive(Clone, Copy, Debug)]
pub(super) struct White {
    last: [f64; 2],
    /// How many of `last` there are.
    known: u8,
    seen: f64,
    variance: f64,
}

impl White {
    pub(super) fn new() -> Self {
        Self {
            last: [0.0; 2],
            known: 0,
            seen: 0.0,
            variance: WHITE_STD * WHITE_STD,
        }
    }

    /// Variance of a sample, Nm².
    pub(super) fn variance(&self) -> f64 {
        self.variance
    }

    /// Forgets the last samples, as after a gap.
    pub(super) fn interrupt(&mut self) {
        self.known = 0;
    }

    pub(super) fn learn(&mut self, torque: f64, step_secs: f64) {
        let [last, before] = self.last;
        self.last = [torque, last];
        if self.known < 2 {
            self.known += 1;
            return;
        }
        self.seen += 1.0;
        let square = (torque - 2.0 * last + before).powi(2) / 6.0;
        let square = square.min(CLIP * CLIP * self.variance.max(1e-6));
        let share = 1.0 / (self.seen + WHITE_SAMPLES);
        let gain = share.max((step_secs / WHITE_SECS).min(1.0));
        self.variance += gain * (square - self.variance);
    }
}

/// Variance of one chart's smoothed residuals, v + m x² + t h, in a motion of quickness x while the joint turns by h.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spread {
    rest: f64,
    motion: f64,
    turning: f64,
    /// Sums of squares, times weight and time: all, beyond v, beyond v + m x².
    sums: [f64; 3],
}

/// Weights that the charts of a joint have seen, times time: for v, m and t.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Exposure {
    sums: [f64; 3],
    /// Time without weight, s.
    secs: f64,
}

/// Some time without contact, with how one joint moved and what its charts read.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Span {
    secs: f64,
    /// Squared quickness of the motion, how much the joint turned, and squares of what the charts read, times time.
    x2: f64,
    turning: f64,
    squares: [f64; CHARTS],
}

impl Span {
    /// Adds a sample.
    pub(super) fn add(&mut self, secs: f64, x2: f64, turning: f64, charts: [f64; CHARTS]) {
        self.secs += secs;
        self.x2 += secs * x2;
        self.turning += secs * turning;
        for (sum, read) in self.squares.iter_mut().zip(charts) {
            *sum += secs * read * read;
        }
    }

    /// Teaches the spread of every chart; what `only_turns` do, where the rest is in doubt.
    pub(super) fn teach(
        &self,
        exposure: &mut Exposure,
        spreads: &mut [Spread; CHARTS],
        motion_std: f64,
        only_turns: bool,
    ) {
        if self.secs <= 0.0 {
            return;
        }
        let (x2, turning) = (self.x2 / self.secs, self.turning / self.secs);
        let steady = (1.0 - turning).powi(2);
        // What happens in fast motion and in turns tells little of rest, but is not nothing.
        let rest = (1.0 - x2.sqrt()).powi(4) * steady + 0.01;
        let weights = match only_turns {
            true => [0.0, 0.0, turning],
            false => [rest, x2 * steady, turning],
        };
        let lesson = Lesson {
            secs: self.secs,
            kept: (-self.secs / MEMORY_SECS).exp(),
            x2,
            turning,
            weights,
        };
        exposure.take(&lesson);
        for (spread, square) in spreads.iter_mut().zip(self.squares) {
            spread.take(square / self.secs, &lesson, exposure, motion_std);
        }
    }
}

/// A span's means, and how much it tells of v, m and t.
struct Lesson {
    secs: f64,
    /// Share of what was known before that stays.
    kept: f64,
    x2: f64,
    turning: f64,
    weights: [f64; 3],
}

impl Exposure {
    /// Whether the noise is known.
    pub(super) fn is_long(&self) -> bool {
        self.secs > KNOWN_SECS
    }

    fn take(&mut self, lesson: &Lesson) {
        self.secs += lesson.secs;
        let regressors = [1.0, lesson.x2, lesson.turning];
        for ((sum, weight), regressor) in self.sums.iter_mut().zip(lesson.weights).zip(regressors) {
            *sum = lesson.kept * *sum + lesson.secs * weight * regressor;
        }
    }
}

impl Spread {
    pub(super) fn new(motion_std: f64) -> Self {
        Self {
            rest: SLOW_STD * SLOW_STD,
            motion: motion_std * motion_std,
            turning: TURNING_STD * TURNING_STD,
            sums: [0.0; 3],
        }
    }

    /// Variance at quickness squared `x2` while the joint turns by `turning`, Nm².
    pub(super) fn at(&self, x2: f64, turning: f64) -> f64 {
        self.rest + NOT_GAUSSIAN * (self.motion * x2 + self.turning * turning)
    }

    /// Takes a mean square in, after `exposure` took in its weights: v, m and t in this order, each by what those before
    /// it leave, with a prior.
    fn take(&mut self, square: f64, lesson: &Lesson, exposure: &Exposure, motion_std: f64) {
        let mut learn = |index: usize, beyond: f64, prior: f64, prior_secs: f64| {
            let taken = lesson.secs * lesson.weights[index] * beyond;
            self.sums[index] = lesson.kept * self.sums[index] + taken;
            let found =
                (self.sums[index] + prior_secs * prior) / (exposure.sums[index] + prior_secs);
            found.max(0.0)
        };
        self.rest = learn(0, square, SLOW_STD * SLOW_STD, SLOW_SECS);
        let beyond = square - self.rest;
        self.motion = learn(1, beyond, motion_std * motion_std, MOTION_SECS);
        let beyond = beyond - self.motion * lesson.x2;
        self.turning = learn(2, beyond, TURNING_STD * TURNING_STD, TURNING_SECS);
    }
}
