//! One joint's noise: what its smoothed residuals are like while nothing touches.

/// Standard deviation of the noise before anything was learned, Nm, and the samples that this is worth.
const WHITE_STD: f64 = 0.05;
const WHITE_SAMPLES: f64 = 5.0;
/// Time over which the white part is learned, s.
const WHITE_SECS: f64 = 2.0;
/// Standard deviation of what does not average out before anything was learned, Nm, and the time this is worth, s.
const SLOW_STD: f64 = 0.04;
const SLOW_SECS: f64 = 0.5;
/// Time that the belief in what motion does is worth, s at fast motion.
const MOTION_SECS: f64 = 1.0;
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

/// Variance of the smoothed residuals, v + m x² for a motion of quickness x: least squares with a prior.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spread {
    rest: f64,
    motion: f64,
    /// Σ s² and Σ s² x², times time.
    square: f64,
    square_motion: f64,
}

/// The sums of quickness that all joints and scales share: Σ 1, Σ x² and Σ x⁴, times time.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Exposure {
    time: f64,
    motion: f64,
    motion_square: f64,
}

impl Exposure {
    /// Takes some time in at quickness squared `x2`.
    pub(super) fn take(&mut self, secs: f64, x2: f64) {
        let keep = (-secs / MEMORY_SECS).exp();
        self.time = keep * self.time + secs;
        self.motion = keep * self.motion + secs * x2;
        self.motion_square = keep * self.motion_square + secs * x2 * x2;
    }
}

impl Spread {
    pub(super) fn new(motion_std: f64) -> Self {
        Self {
            rest: SLOW_STD * SLOW_STD,
            motion: motion_std * motion_std,
            square: 0.0,
            square_motion: 0.0,
        }
    }

    /// Variance at quickness squared `x2`, Nm².
    pub(super) fn at(&self, x2: f64) -> f64 {
        self.rest + self.motion * x2
    }

    /// Takes in a mean square over some time, after `exposure` took in the time.
    pub(super) fn take(
        &mut self,
        mean_square: f64,
        secs: f64,
        x2: f64,
        exposure: &Exposure,
        motion_std: f64,
    ) {
        let keep = (-secs / MEMORY_SECS).exp();
        self.square = keep * self.square + secs * mean_square;
        self.square_motion = keep * self.square_motion + secs * mean_square * x2;
        // The normal equations of [v, m], with the prior's squares.
        let (a, b, d) = (
            exposure.time + SLOW_SECS,
            exposure.motion,
            exposure.motion_square + MOTION_SECS,
        );
        let p = self.square + SLOW_SECS * SLOW_STD * SLOW_STD;
        let q = self.square_motion + MOTION_SECS * motion_std * motion_std;
        let determinant = a * d - b * b;
        self.rest = ((d * p - b * q) / determinant).max(0.0);
        self.motion = ((a * q - b * p) / determinant).max(0.0);
        // Where one would be negative, the other alone explains what was seen.
        if self.rest == 0.0 {
            self.motion = q / d;
        } else if self.motion == 0.0 {
            self.rest = p / a;
        }
    }
}
