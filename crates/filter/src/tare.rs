//! A commanded tare: the mean of the torques over a given time becomes each joint's bias.

use crate::JointBias;

/// Shortest and longest time that a tare may average over, s.
pub(crate) const TARE_SECS: std::ops::RangeInclusive<f64> = 0.1..=60.0;

/// Why a tare was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TareRefusal {
    /// Something touches since this stamp.
    #[error("something touches since {since_ns} ns: release it before the tare")]
    InContact {
        /// Stamp of the contact's start, ns.
        since_ns: i64,
    },
    /// The time to average over is out of range.
    #[error("a tare over {found} s is not possible, expected 0.1 to 60")]
    Duration {
        /// What was asked for, s.
        found: f64,
    },
}

/// How far a commanded tare is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum TareState {
    /// None was commanded, or it was cleared.
    #[default]
    None,
    /// Samples are being averaged.
    Running {
        /// Time that is still to be averaged over, s.
        left_secs: f64,
    },
    /// The bias is set.
    Done,
    /// Something touched before it was done; the bias is as it was before.
    Interrupted,
}

/// The sums of a commanded tare.
#[derive(Clone, Debug)]
pub(crate) struct Tare {
    state: TareState,
    last_ns: Option<i64>,
    count: f64,
    /// Mean, and sum of squares about it, Nm and Nm² (Welford 1962).
    mean: Vec<f64>,
    squares: Vec<f64>,
}

impl Tare {
    pub(crate) fn new(dof: usize) -> Self {
        Self {
            state: TareState::None,
            last_ns: None,
            count: 0.0,
            mean: vec![0.0; dof],
            squares: vec![0.0; dof],
        }
    }

    pub(crate) fn state(&self) -> TareState {
        self.state
    }

    /// Begins to average; a tare that is running begins anew.
    pub(crate) fn start(&mut self, secs: f64) -> Result<(), TareRefusal> {
        if !TARE_SECS.contains(&secs) {
            return Err(TareRefusal::Duration { found: secs });
        }
        self.clear();
        self.state = TareState::Running { left_secs: secs };
        Ok(())
    }

    pub(crate) fn clear(&mut self) {
        self.state = TareState::None;
        self.last_ns = None;
        self.count = 0.0;
        self.mean.fill(0.0);
        self.squares.fill(0.0);
    }

    /// Ends a tare that is running without result.
    pub(crate) fn interrupt(&mut self) {
        if matches!(self.state, TareState::Running { .. }) {
            self.state = TareState::Interrupted;
        }
    }

    /// Takes in the torques of one sample, Nm. Whether the tare is done with it.
    pub(crate) fn take(&mut self, stamp_ns: i64, torque: &[f64]) -> bool {
        let TareState::Running { left_secs } = self.state else {
            return false;
        };
        self.count += 1.0;
        for ((mean, squares), torque) in self.mean.iter_mut().zip(&mut self.squares).zip(torque) {
            let before = torque - *mean;
            *mean += before / self.count;
            *squares += before * (torque - *mean);
        }
        let elapsed = |last: i64| stamp_ns.saturating_sub(last) as f64 * 1e-9;
        let left_secs = left_secs - self.last_ns.map_or(0.0, elapsed);
        self.last_ns = Some(stamp_ns);
        let is_done = left_secs <= 0.0;
        self.state = match is_done {
            true => TareState::Done,
            false => TareState::Running { left_secs },
        };
        is_done
    }

    /// What was found for one joint.
    pub(crate) fn bias(&self, joint: usize) -> JointBias {
        let variance = self.squares[joint] / (self.count - 1.0).max(1.0);
        JointBias {
            mean: self.mean[joint],
            std: (variance / self.count.max(1.0)).sqrt(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_is_taken_over_the_time_asked_for() {
        let mut tare = Tare::new(1);
        tare.start(0.5).unwrap();
        let torque = |index: i64| if index % 2 == 0 { 0.3 } else { 0.5 };
        let done = (0..200).find(|&index| tare.take(index * 10_000_000, &[torque(index)]));
        assert_eq!(done, Some(50));
        assert_eq!(tare.state(), TareState::Done);
        let bias = tare.bias(0);
        assert!((bias.mean - 0.4).abs() < 3e-3, "{bias:?}");
        assert!((bias.std - 0.1 / 51_f64.sqrt()).abs() < 2e-3, "{bias:?}");
        assert!(!tare.take(2_000_000_000, &[9.0]), "no more is taken in");
    }

    #[test]
    fn absurd_times_are_refused() {
        for secs in [0.0, -1.0, 61.0, f64::NAN] {
            let said = Tare::new(1).start(secs).unwrap_err().to_string();
            assert!(said.contains("0.1 to 60"), "{said}");
        }
    }
}
