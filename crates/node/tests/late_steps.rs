//! What waits for a filter that is late: time here is counted in samples, not taken from a clock.

#![allow(clippy::unwrap_used)]

use palpate_model::JointSample;
use palpate_node::{Newest, TimedSample};

const PERIOD_NS: i64 = 1_000_000;
const MAX_WAIT_NS: i64 = 100 * PERIOD_NS;

/// A driver that sends a sample a period, and what waits for the filter.
struct Stream {
    waiting: Newest<TimedSample>,
    sent: i64,
}

impl Stream {
    fn new() -> Self {
        Self {
            waiting: Newest::new(10_000),
            sent: 0,
        }
    }

    /// Sends the samples of so many periods, during which a step takes its time.
    fn pass(&mut self, periods: i64) {
        for _ in 0..periods {
            self.sent += 1;
            let sample = TimedSample {
                sample: JointSample {
                    stamp_ns: self.sent * PERIOD_NS,
                    position: Vec::new(),
                    external_torque: Vec::new(),
                },
                epoch: 0,
            };
            let stale =
                |oldest: &TimedSample, newest: &TimedSample| oldest.is_older(newest, MAX_WAIT_NS);
            self.waiting.push_over(sample, stale);
        }
    }

    /// The sample that the next step takes, by its number, and how old it is.
    fn take(&mut self) -> (i64, i64) {
        let stamp_ns = self.waiting.try_pop().unwrap().sample.stamp_ns;
        (stamp_ns / PERIOD_NS, self.sent * PERIOD_NS - stamp_ns)
    }
}

#[test]
fn steps_that_keep_up_use_every_sample() {
    let mut stream = Stream::new();
    for number in 1..=1000 {
        stream.pass(1);
        assert_eq!(stream.take(), (number, 0));
    }
    assert_eq!(stream.waiting.lost(), 0);
}

#[test]
fn a_step_that_is_a_little_late_loses_nothing() {
    let mut stream = Stream::new();
    stream.pass(100);
    let taken: Vec<_> = (0..100).map(|_| stream.take().0).collect();
    assert_eq!(taken, (1..=100).collect::<Vec<_>>());
    assert_eq!(stream.waiting.lost(), 0);
}

#[test]
fn after_a_step_that_is_late_the_newest_sample_is_used_and_the_lost_are_counted() {
    let mut stream = Stream::new();
    stream.pass(102);
    assert_eq!(stream.take(), (102, 0));
    assert_eq!(stream.waiting.lost(), 101);
    stream.pass(1);
    assert_eq!(stream.take(), (103, 0));
    assert_eq!(stream.waiting.lost(), 101);
}

#[test]
fn a_filter_that_is_too_slow_for_ever_never_uses_what_is_stale() {
    for periods_a_step in [2, 3, 7, 500] {
        let mut stream = Stream::new();
        let steps = 1000;
        for _ in 0..steps {
            stream.pass(periods_a_step);
            let (_, age_ns) = stream.take();
            assert!(age_ns <= MAX_WAIT_NS, "{age_ns}");
        }
        let waiting = std::iter::from_fn(|| stream.waiting.try_pop()).count();
        let lost = stream.waiting.lost();
        // Nothing is lost without being counted.
        assert_eq!(steps + waiting as u64 + lost, stream.sent as u64);
    }
}
