//! How the node fares, from what happened in the last second.

use std::time::Duration;

/// A sample whose stamp is further from the node's time than this, s, tells of clocks that differ.
const MOST_AGE_SECS: f64 = 1.0;

/// As `diagnostic_msgs` grades.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// All is well.
    Ok,
    /// The estimate may be worse than it could be.
    Warn,
    /// There is no estimate.
    Error,
}

/// What came in so far, and what was lost of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Losses {
    /// Messages with positions.
    pub positions: u64,
    /// Messages with torques.
    pub torques: u64,
    /// Samples that the filter took.
    pub used: u64,
    /// Messages and samples that were refused.
    pub refused: u64,
    /// Torques that found no position of their time.
    pub unpaired: u64,
    /// Samples that the filter did not come to.
    pub lost: u64,
}

impl Losses {
    /// Whether `earlier` may have been counted before this.
    pub fn is_after(&self, earlier: &Self) -> bool {
        self.positions >= earlier.positions
            && self.torques >= earlier.torques
            && self.used >= earlier.used
    }
}

/// Messages and samples a second, Hz.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rates {
    /// Of messages with positions.
    pub positions: f64,
    /// Of messages with torques.
    pub torques: f64,
    /// Of samples that the filter took.
    pub used: f64,
}

impl Rates {
    /// What came in `elapsed`, between two counts.
    pub fn between(before: &Losses, now: &Losses, elapsed: Duration) -> Self {
        let rate = |before: u64, now: u64| {
            now.saturating_sub(before) as f64 / elapsed.as_secs_f64().max(1e-9)
        };
        Self {
            positions: rate(before.positions, now.positions),
            torques: rate(before.torques, now.torques),
            used: rate(before.used, now.used),
        }
    }
}

/// What is judged.
#[derive(Clone, Copy, Debug)]
pub struct Health {
    /// The counts a second ago.
    pub before: Losses,
    /// The counts now.
    pub now: Losses,
    /// The node's time less the stamp of the newest sample, s.
    pub age_secs: Option<f64>,
    /// Whether the node was told not to estimate.
    pub is_disabled: bool,
    /// Whether positions come in the torques' messages.
    pub is_together: bool,
}

/// Level and reason; the most serious first.
pub fn judge(health: &Health) -> (Level, &'static str) {
    let (before, now) = (&health.before, &health.now);
    if health.is_disabled {
        (Level::Ok, "disabled")
    } else if now.positions == before.positions && !health.is_together {
        (Level::Error, "no messages on joint_states")
    } else if now.torques == before.torques {
        (Level::Error, "no messages on external_torque")
    } else if now.used == before.used && now.refused > before.refused {
        (Level::Error, "all messages are refused")
    } else if now.used == before.used {
        (Level::Error, "no torque finds a position of its time")
    } else if now.refused > before.refused {
        (Level::Warn, "some messages are refused")
    } else if now.lost > before.lost {
        let reason = "the filter is slower than the messages: samples are lost";
        (Level::Warn, reason)
    } else if now.unpaired > before.unpaired {
        (Level::Warn, "some torques find no position of their time")
    } else if health.age_secs.is_some_and(|age| age > MOST_AGE_SECS) {
        let reason = "stamps are old: clocks differ, or a bag is played without use_sim_time";
        (Level::Warn, reason)
    } else if health.age_secs.is_some_and(|age| age < -MOST_AGE_SECS) {
        (
            Level::Warn,
            "stamps lie ahead of the node's time: clocks differ",
        )
    } else {
        (Level::Ok, "working")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BEFORE: Losses = Losses {
        positions: 100,
        torques: 50,
        used: 50,
        refused: 1,
        unpaired: 2,
        lost: 3,
    };

    fn said(change: impl Fn(&mut Health)) -> (Level, &'static str) {
        let mut health = Health {
            before: BEFORE,
            now: Losses {
                positions: 200,
                torques: 100,
                used: 100,
                ..BEFORE
            },
            age_secs: Some(0.01),
            is_disabled: false,
            is_together: false,
        };
        change(&mut health);
        judge(&health)
    }

    /// What happens, and the level and words that tell of it.
    type Case = (fn(&mut Health), Level, &'static str);

    #[test]
    fn each_trouble_has_its_level_and_reason() {
        let cases: [Case; 10] = [
            (|_| {}, Level::Ok, "working"),
            (|at| at.now.positions = 100, Level::Error, "joint_states"),
            (|at| at.now.torques = 50, Level::Error, "external_torque"),
            (|at| at.now.used = 50, Level::Error, "no torque finds"),
            (|at| at.now.refused = 2, Level::Warn, "some messages"),
            (|at| at.now.lost = 4, Level::Warn, "slower"),
            (|at| at.now.unpaired = 3, Level::Warn, "some torques"),
            (|at| at.age_secs = Some(2.0), Level::Warn, "old"),
            (|at| at.age_secs = Some(-2.0), Level::Warn, "ahead"),
            (|at| at.is_disabled = true, Level::Ok, "disabled"),
        ];
        for (change, level, words) in cases {
            let (found, reason) = said(change);
            assert_eq!(found, level, "{reason}");
            assert!(reason.contains(words), "{reason}");
        }
        let silent = |at: &mut Health| (at.now, at.is_together) = (BEFORE, true);
        assert_eq!(said(silent).1, "no messages on external_torque");
        let all_refused = |at: &mut Health| (at.now.used, at.now.refused) = (50, 9);
        assert_eq!(
            said(all_refused),
            (Level::Error, "all messages are refused")
        );
    }

    #[test]
    fn rates_are_counts_over_time() {
        let now = Losses {
            positions: 350,
            torques: 150,
            ..BEFORE
        };
        let rates = Rates::between(&BEFORE, &now, Duration::from_millis(500));
        assert_eq!(
            (rates.positions, rates.torques, rates.used),
            (500.0, 200.0, 0.0)
        );
        assert!(now.is_after(&BEFORE) && !BEFORE.is_after(&now));
    }
}
