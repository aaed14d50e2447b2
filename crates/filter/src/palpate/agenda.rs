//! What is to be done between two keyframes, in portions that fit into the samples' time.
//!
//! The order and the results depend on nothing but the samples: a portion is counted in looks at a keyframe, never in
//! seconds.

/// Looks at a keyframe that a second of samples pays for; one costs about 2,000 instructions.
const LOOKS_PER_SEC: f64 = 1.2e6;

/// Kinds of work, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Phase {
    /// Nothing to do before the next keyframe.
    Idle,
    /// See how loud the noise is.
    Calibrate,
    /// Draw the first particles.
    Spread,
    /// Evaluate each particle against the new keyframe, then resample.
    Reweigh,
    /// One step of each peak.
    Climb,
    /// Climb from beside the peaks, so many rounds.
    Hop(usize),
    /// Scan the links for candidates.
    Ask,
    /// See which candidates of a scan are worth a climb.
    Screen,
    /// Climb from those, so many rounds, each with fewer of them.
    Scan(usize),
    /// Climb on the mesh from contacts with the smooth body, so many rounds.
    Facets(usize),
    /// Climb as bars from the best balls, so many rounds.
    Bars(usize),
    /// Climb as drifting obstacles from the best that rest, so many rounds.
    Drifts(usize),
    /// See what systematic errors would do to each peak.
    Sight,
    /// Move each particle, so many rounds.
    Move(usize),
}

/// Where the work stands.
#[derive(Clone, Debug)]
pub(super) struct Agenda {
    pub(super) phase: Phase,
    /// Units of the phase that are done.
    pub(super) done: usize,
    /// Looks paid for and not yet spent; may be a little negative, as a unit is not divided.
    credit: f64,
}

impl Agenda {
    pub(super) fn new() -> Self {
        Self {
            phase: Phase::Idle,
            done: 0,
            credit: 0.0,
        }
    }

    /// Goes on to another phase.
    pub(super) fn enter(&mut self, phase: Phase) {
        self.phase = phase;
        self.done = 0;
    }

    /// Pays for one sample's portion.
    pub(super) fn pay(&mut self, period_secs: f64) {
        let portion = LOOKS_PER_SEC * period_secs;
        self.credit = (self.credit + portion).min(portion);
    }

    /// How many of the phase's `units`, at `looks` each, the credit allows now; spends it.
    pub(super) fn take(&mut self, units: usize, looks: usize) -> std::ops::Range<usize> {
        let affordable = if self.credit > 0.0 {
            (self.credit / looks as f64).ceil() as usize
        } else {
            0
        };
        let first = self.done;
        self.done = units.min(first + affordable);
        self.credit -= ((self.done - first) * looks) as f64;
        first..self.done
    }

    /// Whether there is credit left and work to spend it on.
    pub(super) fn goes_on(&self) -> bool {
        self.phase != Phase::Idle && self.credit > 0.0
    }
}
