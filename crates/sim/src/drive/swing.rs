//! How one joint swings: two sinusoids about a middle, within the joint's limits.

use std::f64::consts::TAU;

use palpate_model::{Joint, JointKind};
use rand::{Rng, RngExt};

use super::DriveScenario;

pub(super) struct Swing {
    middle: f64,
    terms: [Sinusoid; 2],
}

struct Sinusoid {
    /// rad or m.
    amplitude: f64,
    /// rad/s.
    omega: f64,
    phase: f64,
}

impl Swing {
    /// Draws a swing that stays within nine tenths of the joint's range.
    pub fn draw(joint: &Joint, scenario: &DriveScenario, rng: &mut impl Rng) -> Self {
        /// Reach of a joint without limits, rad, and of a slide that has none, m.
        const REACH: f64 = 2.0;
        const SLIDE: f64 = 0.5;
        /// Shares of both terms, and the second's frequency against the first's.
        const SHARES: [f64; 2] = [0.7, 0.3];
        const FASTER: f64 = 1.7;
        let reach = match joint.kind {
            JointKind::Prismatic => SLIDE,
            JointKind::Revolute | JointKind::Continuous => REACH,
        };
        let limits = joint.limits.filter(|limits| limits.lower < limits.upper);
        let (lower, upper) = limits.map_or((-reach, reach), |limits| {
            let middle = 0.5 * (limits.lower + limits.upper);
            (
                limits.lower.max(middle - reach),
                limits.upper.min(middle + reach),
            )
        });
        let middle = 0.5 * (lower + upper) + 0.25 * (upper - lower) * rng.random_range(-1.0..1.0);
        let room = 0.9 * (upper - middle).min(middle - lower);
        let omega = TAU * scenario.swing_hz * rng.random_range(0.75..1.25);
        let speed = scenario.peak_speed * rng.random_range(0.5..1.0);
        let amplitude = room.min(speed / (omega * (SHARES[0] + SHARES[1] * FASTER)));
        let mut term = |share: f64, omega: f64| Sinusoid {
            amplitude: amplitude * share,
            omega,
            phase: TAU * rng.random::<f64>(),
        };
        Self {
            middle,
            terms: [term(SHARES[0], omega), term(SHARES[1], omega * FASTER)],
        }
    }

    pub fn position(&self, secs: f64) -> f64 {
        self.middle + self.sum(|term, angle| term.amplitude * angle.sin(), secs)
    }

    pub fn velocity(&self, secs: f64) -> f64 {
        self.sum(
            |term, angle| term.amplitude * term.omega * angle.cos(),
            secs,
        )
    }

    pub fn acceleration(&self, secs: f64) -> f64 {
        self.sum(
            |term, angle| -term.amplitude * term.omega.powi(2) * angle.sin(),
            secs,
        )
    }

    fn sum(&self, of: impl Fn(&Sinusoid, f64) -> f64, secs: f64) -> f64 {
        (self.terms.iter())
            .map(|term| of(term, term.omega * secs + term.phase))
            .sum()
    }
}
