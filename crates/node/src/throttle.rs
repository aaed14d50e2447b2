//! Keeping a repeated complaint from filling the log.

use std::time::{Duration, Instant};

/// Lets one message through in each period.
#[derive(Clone, Debug)]
pub struct Throttle {
    period: Duration,
    last: Option<Instant>,
    held_back: u64,
}

impl Throttle {
    /// At most one message in each `period`.
    pub fn new(period: Duration) -> Self {
        Self {
            period,
            last: None,
            held_back: 0,
        }
    }

    /// Whether to speak at time `now`; if so, how many were held back since the last time.
    pub fn pass(&mut self, now: Instant) -> Option<u64> {
        if (self.last).is_some_and(|last| now.saturating_duration_since(last) < self.period) {
            self.held_back += 1;
            return None;
        }
        self.last = Some(now);
        Some(std::mem::take(&mut self.held_back))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_a_period_passes_and_tells_how_many_did_not() {
        let mut throttle = Throttle::new(Duration::from_secs(5));
        let start = Instant::now();
        let said: Vec<_> = (0..12)
            .map(|second| throttle.pass(start + Duration::from_secs(second)))
            .collect();
        assert_eq!(said[0], Some(0));
        assert_eq!(said[5], Some(4));
        assert_eq!(said[10], Some(4));
        assert_eq!(said.iter().flatten().count(), 3);
    }
}
