//! How many particles there is time for, as the steps tell.

use std::time::Duration;

/// A step that takes a larger share of the time there is, takes too long: what else the machine does delays some.
const MOST: f64 = 0.7;
/// What a step is to take.
const AIM: f64 = 0.55;
/// One step takes away half of the particles at most: it may have been another program that took so long.
const FEWER: f64 = 0.5;
/// One step adds so much at most.
const MORE: f64 = 1.02;
/// The median of the samples' distances is followed by so much a sample.
const DRIFT: f64 = 1.02;

/// Sets the number of particles so that steps keep up with the samples: down at once, where one takes too long or samples
/// wait for it, and up again little by little. It is told all times, and reads no clock.
#[derive(Clone, Debug)]
pub struct Pacing {
    least: f64,
    most: f64,
    particles: f64,
    /// Median of the times between samples, s; none before the second sample.
    period_secs: Option<f64>,
    last_ns: Option<i64>,
}

impl Pacing {
    /// Begins with `most` particles, and never has fewer than `least`.
    pub fn new([least, most]: [usize; 2]) -> Self {
        Self {
            least: least as f64,
            most: most as f64,
            particles: most as f64,
            period_secs: None,
            last_ns: None,
        }
    }

    /// The number of particles that there is time for.
    pub fn particles(&self) -> usize {
        self.particles.round() as usize
    }

    /// A sample of this stamp came.
    pub fn see_sample(&mut self, stamp_ns: i64) {
        let passed_ns = (self.last_ns).and_then(|last_ns| stamp_ns.checked_sub(last_ns));
        self.last_ns = Some(stamp_ns);
        let Some(passed_ns) = passed_ns.filter(|&passed_ns| passed_ns > 0) else {
            return;
        };
        let passed_secs = passed_ns as f64 * 1e-9;
        // So that a sample that is missing, or one on the heels of another, does not count for more than any other.
        self.period_secs = Some(match self.period_secs {
            None => passed_secs,
            Some(period_secs) => passed_secs.clamp(period_secs / DRIFT, period_secs * DRIFT),
        });
    }

    /// A step with so many `particles` took so long, and at its begin so many more samples were `waiting`.
    pub fn see_step(&mut self, particles: usize, took: Duration, waiting: usize) {
        let Some(period_secs) = self.period_secs.filter(|_| particles > 0) else {
            return;
        };
        // All that wait are to be used up within a period.
        let there_is_secs = period_secs / (1.0 + waiting as f64);
        let took_share = took.as_secs_f64() / there_is_secs;
        let particles = particles as f64;
        let aimed_at = particles * AIM / took_share.max(f64::MIN_POSITIVE);
        let wanted = match took_share > MOST {
            true => aimed_at.max(particles * FEWER).min(self.particles),
            false => aimed_at.min(self.particles * MORE).max(self.particles),
        };
        self.particles = wanted.clamp(self.least, self.most);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use super::*;

    const PERIOD_NS: i64 = 1_000_000;
    const RANGE: [usize; 2] = [1000, 10_000];

    /// A machine that takes so long for each particle, and for each step besides, in a queue with samples of 1 kHz.
    struct Machine {
        pacing: Pacing,
        waiting: VecDeque<i64>,
        next_ns: i64,
        now_ns: i64,
    }

    impl Machine {
        fn new() -> Self {
            Self {
                pacing: Pacing::new(RANGE),
                waiting: VecDeque::new(),
                next_ns: 0,
                now_ns: 0,
            }
        }

        fn arrive(&mut self) {
            while self.next_ns <= self.now_ns {
                self.waiting.push_back(self.next_ns);
                self.next_ns += PERIOD_NS;
            }
        }

        /// One step; gives the particles that it took, and how old its sample was at its end, ns.
        fn step(&mut self, ns_a_particle: f64, more_ns: i64) -> (usize, i64) {
            self.now_ns = self.now_ns.max(match self.waiting.is_empty() {
                true => self.next_ns,
                false => self.now_ns,
            });
            self.arrive();
            let stamp_ns = self.waiting.pop_front().unwrap();
            let particles = self.pacing.particles();
            let took_ns = (particles as f64 * ns_a_particle) as i64 + more_ns;
            self.pacing.see_sample(stamp_ns);
            let took = Duration::from_nanos(took_ns as u64);
            self.pacing.see_step(particles, took, self.waiting.len());
            self.now_ns += took_ns;
            self.arrive();
            assert!((RANGE[0]..=RANGE[1]).contains(&self.pacing.particles()));
            (particles, self.now_ns - stamp_ns)
        }

        fn steps(&mut self, count: usize, ns_a_particle: f64) -> Vec<(usize, i64)> {
            (0..count)
                .map(|_| self.step(ns_a_particle, 20_000))
                .collect()
        }
    }

    #[test]
    fn a_machine_that_is_fast_enough_always_has_the_most() {
        let steps = Machine::new().steps(1000, 60.0);
        assert!(steps.iter().all(|&(particles, _)| particles == RANGE[1]));
    }

    #[test]
    fn a_slow_machine_has_as_many_as_it_keeps_up_with() {
        for (ns_a_particle, expected) in [(80.0, 6600), (150.0, 3500), (400.0, 1300)] {
            let steps = Machine::new().steps(500, ns_a_particle);
            for &(particles, age_ns) in &steps[50..] {
                let few = (expected as f64 * 0.95) as usize;
                assert!(
                    (few..expected * 14 / 10).contains(&particles),
                    "{particles}"
                );
                assert!(age_ns < PERIOD_NS, "{age_ns}");
            }
        }
    }

    #[test]
    fn a_machine_that_is_too_slow_for_the_fewest_has_the_fewest() {
        let steps = Machine::new().steps(100, 2000.0);
        assert!(
            steps[10..]
                .iter()
                .all(|&(particles, _)| particles == RANGE[0])
        );
    }

    #[test]
    fn when_steps_become_cheap_again_all_come_back() {
        let mut machine = Machine::new();
        machine.steps(50, 400.0);
        let steps = machine.steps(200, 40.0);
        assert!(steps[0].0 < 1500 && steps[199].0 == RANGE[1]);
        // Little by little.
        assert!(
            steps
                .windows(2)
                .all(|pair| pair[1].0 <= pair[0].0 * 103 / 100)
        );
    }

    #[test]
    fn what_waits_after_one_step_that_was_held_up_is_soon_used_up() {
        let mut machine = Machine::new();
        machine.steps(100, 50.0);
        machine.step(50.0, 20 * PERIOD_NS);
        let held_up_ns = machine.now_ns;
        while !machine.waiting.is_empty() {
            machine.step(50.0, 20_000);
        }
        assert!(machine.now_ns - held_up_ns < 5 * PERIOD_NS);
        assert_eq!(machine.steps(200, 50.0)[199].0, RANGE[1]);
    }

    #[test]
    fn samples_that_cause_no_step_tell_nothing() {
        let mut pacing = Pacing::new(RANGE);
        pacing.see_step(10_000, Duration::from_secs(1), 5);
        assert_eq!(pacing.particles(), RANGE[1], "before there is a period");
        pacing.see_sample(0);
        pacing.see_sample(PERIOD_NS);
        pacing.see_step(10_000, Duration::from_millis(1), 0);
        assert_eq!(pacing.particles(), 5500);
        pacing.see_step(0, Duration::ZERO, 9);
        assert_eq!(pacing.particles(), 5500);
        pacing.see_step(5500, Duration::ZERO, 0);
        assert_eq!(pacing.particles(), 5610);
    }

    #[test]
    fn neither_gaps_nor_bursts_nor_stamps_that_lie_back_change_the_period() {
        let mut pacing = Pacing::new(RANGE);
        let mut stamp_ns = 0;
        for index in 0..1000 {
            stamp_ns += match index % 10 {
                7 => 50 * PERIOD_NS,
                8 => 1000,
                9 => -PERIOD_NS,
                _ => PERIOD_NS,
            };
            pacing.see_sample(stamp_ns);
        }
        let period_secs = pacing.period_secs.unwrap();
        assert!((period_secs - 1e-3).abs() < 5e-5, "{period_secs}");
        assert_eq!(Pacing::new([3, 3]).particles(), 3);
    }

    #[test]
    fn the_period_follows_another_rate() {
        let mut pacing = Pacing::new(RANGE);
        for stamp in 0..1000 {
            pacing.see_sample(stamp * PERIOD_NS);
        }
        for stamp in 0..300 {
            pacing.see_sample((1000 + 10 * stamp) * PERIOD_NS);
        }
        let period_secs = pacing.period_secs.unwrap();
        assert!((period_secs - 1e-2).abs() < 1e-9, "{period_secs}");
    }
}
