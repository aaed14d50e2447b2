//! The evidence of a contact's whole history for one obstacle, with force, stiffness, friction and bias solved.
//!
//! For a fixed obstacle centre c the torques are linear in what remains. With d_t the distance from c to the link,
//! the force is F_t = F₀ + K e_t, e_t = d₀ − d_t (the paper's eq. 8 summed over time), and the torque of joint j is
//! τ_jt = (gⁿ_jt + μ gᵗ_jt)(F₀ + K e_t) + b_j + noise, where gⁿ and gᵗ are the torques of a unit force along the
//! inward normal and against the slip. All that the history says about these is in [`Sums`].

use nalgebra::Vector3;

use super::noise::Noise;
use super::sums::{Reduced, Sums};

/// Most joints on a link's path.
pub(crate) const MOST_JOINTS: usize = 12;

/// Grid of friction coefficients μ and their prior probabilities.
const FRICTION: [(f64, f64); 5] = [
    (0.0, 0.4),
    (0.1, 0.15),
    (0.2, 0.15),
    (0.3, 0.15),
    (0.45, 0.15),
];
/// Prior standard deviation of the force F₀, N, and of the stiffness K, N/m.
pub(super) const FORCE_SCALE: f64 = 60.0;
const STIFFNESS_SCALE: f64 = 2e4;

/// A term of the evidence whose exponent is so much less than another one's changes nothing.
const NEGLIGIBLE: f64 = 80.0;

/// Log of the evidence where torques and motion that no robot has leave no digit of it.
const HOPELESS: f64 = -1e300;

/// The evidence of the sums over a history. `path` are the joints that they belong to.
pub(super) fn evidence(sums: &Sums, noise: &Noise, path: &[usize]) -> Evidence {
    let mut total = Total::default();
    let mut reduced = Reduced::new();
    for scale in 0..noise.bias_scales() {
        sums.reduce(noise, scale, path, &mut reduced);
        let mut is_best = false;
        for (friction, prior) in FRICTION {
            is_best |= total.add(&reduced, scale, friction, prior);
        }
        if is_best {
            let Evidence {
                force,
                stiffness,
                friction,
                ..
            } = total.best;
            total.best.tilt =
                reduced.tilt([force, stiffness, friction * force, friction * stiffness]);
        }
    }
    let log = total.exponent + total.sum.ln();
    Evidence {
        log: if log.is_finite() { log } else { HOPELESS },
        ..total.best
    }
}

/// A sum of terms, each a factor times e to an exponent, and the solution of the largest.
struct Total {
    /// The largest exponent, which the sum and the largest term are relative to.
    exponent: f64,
    sum: f64,
    largest: f64,
    best: Evidence,
}

impl Default for Total {
    fn default() -> Self {
        Self {
            exponent: f64::NEG_INFINITY,
            sum: 0.0,
            largest: 0.0,
            best: Evidence::default(),
        }
    }
}

impl Total {
    /// Adds the evidence for one scale of the biases and one friction coefficient μ. Tells whether its term is the
    /// largest.
    fn add(&mut self, reduced: &Reduced, scale: usize, mu: f64, prior: f64) -> bool {
        let p = &reduced.gram;
        let a = [
            p[0][0] + mu * (2.0 * p[0][2] + mu * p[2][2]),
            p[0][1] + mu * (p[0][3] + p[1][2] + mu * p[2][3]),
            p[1][1] + mu * (2.0 * p[1][3] + mu * p[3][3]),
        ];
        let r = [p[0][4] + mu * p[2][4], p[1][4] + mu * p[3][4]];
        // Posterior precision of F₀ and K in units of the prior's scales.
        let p00 = a[0] * FORCE_SCALE * FORCE_SCALE + 1.0;
        let p01 = a[1] * FORCE_SCALE * STIFFNESS_SCALE;
        let p11 = a[2] * STIFFNESS_SCALE * STIFFNESS_SCALE + 1.0;
        let (r0, r1) = (r[0] * FORCE_SCALE, r[1] * STIFFNESS_SCALE);
        let determinant = (p00 * p11 - p01 * p01).max(1e-300);
        let force = (p11 * r0 - p01 * r1) / determinant;
        let stiffness = (p00 * r1 - p01 * r0) / determinant;
        let exponent = reduced.log + 0.5 * (r0 * force + r1 * stiffness);
        if exponent < self.exponent - NEGLIGIBLE {
            return false;
        }
        // Force and stiffness are positive: the share of the Gaussian that is, taken one by one.
        let root = determinant.sqrt();
        let pushes = normal_cdf(force * root / p11.sqrt());
        let stiffens = normal_cdf(stiffness * root / p00.sqrt());
        let factor = prior * pushes.factor * stiffens.factor / root;
        let term = self.scaled(exponent + pushes.exponent + stiffens.exponent, factor);
        self.sum += term;
        let is_largest = term > self.largest;
        if is_largest {
            self.largest = term;
            self.best = Evidence {
                force: force * FORCE_SCALE,
                stiffness: stiffness * STIFFNESS_SCALE,
                friction: mu,
                bias_scale: scale,
                ..Evidence::default()
            };
        }
        is_largest
    }

    /// A term in units of e to the largest exponent, which it may raise.
    fn scaled(&mut self, exponent: f64, factor: f64) -> f64 {
        if exponent <= self.exponent {
            return factor * (exponent - self.exponent).exp();
        }
        let shrink = (self.exponent - exponent).exp();
        self.sum *= shrink;
        self.largest *= shrink;
        self.exponent = exponent;
        factor
    }
}

/// What the history says about one hypothesis.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Evidence {
    /// Log of the evidence, up to a constant shared by all hypotheses.
    pub(super) log: f64,
    /// Most probable force F₀ at e = 0, N.
    pub(super) force: f64,
    /// Distance d₀ at which e = 0, m.
    pub(super) reference: f64,
    /// Most probable stiffness K, N/m.
    pub(super) stiffness: f64,
    /// Most probable friction coefficient μ.
    pub(super) friction: f64,
    /// Most probable scale of the biases, as an index.
    pub(super) bias_scale: usize,
    /// Most probable tilt: what to add to the unit push, in the link's frame.
    pub(super) tilt: Vector3<f64>,
}

impl Evidence {
    /// Most probable force when the obstacle's centre is `distance` (m) from the link, N.
    pub(super) fn force_at(&self, distance: f64) -> f64 {
        (self.force + self.stiffness * (self.reference - distance)).max(0.0)
    }
}

/// A factor times e to an exponent.
struct Scaled {
    exponent: f64,
    factor: f64,
}

/// Φ(x) of the standard normal distribution, to 1e-3 relative where it matters.
fn normal_cdf(x: f64) -> Scaled {
    if x > 8.5 {
        // One but for less than its rounding.
        return Scaled {
            exponent: 0.0,
            factor: 1.0,
        };
    }
    let squared = x * x;
    let exponent = -0.5 * squared;
    if x < -5.0 {
        // Leading terms of the asymptotic series (Abramowitz and Stegun 1964, 26.2.12).
        let factor = (1.0 - 1.0 / squared) / (-x * 2.506_628_274_6);
        return Scaled { exponent, factor };
    }
    // Abramowitz and Stegun 26.2.17, on the side where it is small.
    let t = 1.0 / (1.0 + 0.231_641_9 * x.abs());
    let series = t
        * (0.319_381_530
            + t * (-0.356_563_782
                + t * (1.781_477_937 + t * (-1.821_255_978 + t * 1.330_274_429))));
    let factor = 0.398_942_280_4 * series;
    if x > 0.0 {
        Scaled {
            exponent: 0.0,
            factor: 1.0 - factor * exponent.exp(),
        }
    } else {
        Scaled { exponent, factor }
    }
}
