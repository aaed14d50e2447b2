//! The evidence of a contact's whole history for one obstacle, with force, stiffness, friction and bias solved.
//!
//! For a fixed obstacle centre c the torques are linear in what remains. With d_t the distance from c to the link,
//! the force is F_t = F₀ + K e_t, e_t = d₀ − d_t (the paper's eq. 8 summed over time), and the torque of joint j is
//! τ_jt = (gⁿ_jt + μ gᵗ_jt)(F₀ + K e_t) + b_j + noise, where gⁿ and gᵗ are the torques of a unit force along the
//! inward normal and against the slip. The sums below are all that the history says about (F₀, K, μ, b).

use super::noise::Noise;

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
const FORCE_SCALE: f64 = 60.0;
const STIFFNESS_SCALE: f64 = 2e4;

/// Sums over the history for one hypothesis, weighted by the inverse noise variance.
#[derive(Clone, Debug, Default)]
pub(super) struct Sums {
    /// Σ gⁿgⁿ, gⁿgᵗ, gᵗgᵗ, each times 1, e, e².
    nn: [f64; 3],
    nt: [f64; 3],
    tt: [f64; 3],
    /// Σ gⁿ y and gᵗ y, each times 1, e.
    ny: [f64; 2],
    ty: [f64; 2],
    /// For each joint Σ gⁿ and gᵗ, each times 1, e.
    n: [[f64; 2]; MOST_JOINTS],
    t: [[f64; 2]; MOST_JOINTS],
}

/// Unit-force torques of one keyframe on one joint of the path.
#[derive(Clone, Copy, Debug)]
pub(super) struct JointTorque {
    pub(super) normal: f64,
    pub(super) tangential: f64,
    /// Measured torque y, Nm.
    pub(super) measured: f64,
    /// Inverse variance of the measured torque.
    pub(super) weight: f64,
}

impl Sums {
    /// Adds one keyframe with approach e = d₀ − d, m.
    pub(super) fn add(&mut self, e: f64, joints: impl Iterator<Item = JointTorque>) {
        let (mut nn, mut nt, mut tt, mut ny, mut ty) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (index, joint) in joints.enumerate() {
            let (n, t) = (joint.weight * joint.normal, joint.weight * joint.tangential);
            nn += n * joint.normal;
            nt += n * joint.tangential;
            tt += t * joint.tangential;
            ny += n * joint.measured;
            ty += t * joint.measured;
            self.n[index][0] += n;
            self.n[index][1] += n * e;
            self.t[index][0] += t;
            self.t[index][1] += t * e;
        }
        for (power, factor) in [1.0, e, e * e].into_iter().enumerate() {
            self.nn[power] += nn * factor;
            self.nt[power] += nt * factor;
            self.tt[power] += tt * factor;
        }
        for (power, factor) in [1.0, e].into_iter().enumerate() {
            self.ny[power] += ny * factor;
            self.ty[power] += ty * factor;
        }
    }

    /// Integrates force, stiffness, friction and biases out. `path` are the joints that the sums belong to.
    pub(super) fn evidence(&self, noise: &Noise, path: &[usize]) -> Evidence {
        let mut best = Evidence {
            log: f64::NEG_INFINITY,
            ..Evidence::default()
        };
        let mut total = 0.0;
        for (friction, prior) in FRICTION {
            for scale in 0..noise.bias_scales() {
                let one = self.evidence_at(friction, noise, scale, path);
                let log = one.log + f64::ln(prior);
                if log > best.log {
                    total = total * (best.log - log).exp() + 1.0;
                    best = Evidence { log, ..one };
                } else {
                    total += (log - best.log).exp();
                }
            }
        }
        best.log += total.ln();
        best
    }

    fn evidence_at(&self, mu: f64, noise: &Noise, scale: usize, path: &[usize]) -> Evidence {
        let gram =
            |power: usize| self.nn[power] + mu * (2.0 * self.nt[power] + mu * self.tt[power]);
        let mut a = [gram(0), gram(1), gram(2)];
        let mut r = [self.ny[0] + mu * self.ty[0], self.ny[1] + mu * self.ty[1]];
        for (index, &joint) in path.iter().enumerate() {
            let s = [0, 1].map(|power| self.n[index][power] + mu * self.t[index][power]);
            let bias = noise.bias(scale, joint);
            a[0] -= bias.gain * s[0] * s[0];
            a[1] -= bias.gain * s[0] * s[1];
            a[2] -= bias.gain * s[1] * s[1];
            r[0] -= bias.mean * s[0];
            r[1] -= bias.mean * s[1];
        }
        // Posterior precision of (F₀, K / STIFFNESS_SCALE · FORCE_SCALE …) in units of the prior's scale.
        let p00 = a[0] * FORCE_SCALE * FORCE_SCALE + 1.0;
        let p01 = a[1] * FORCE_SCALE * STIFFNESS_SCALE;
        let p11 = a[2] * STIFFNESS_SCALE * STIFFNESS_SCALE + 1.0;
        let (r0, r1) = (r[0] * FORCE_SCALE, r[1] * STIFFNESS_SCALE);
        let determinant = (p00 * p11 - p01 * p01).max(1e-300);
        let force = (p11 * r0 - p01 * r1) / determinant;
        let stiffness = (p00 * r1 - p01 * r0) / determinant;
        let explained = 0.5 * (r0 * force + r1 * stiffness);
        // Force and stiffness are positive: the share of the Gaussian that is, taken one by one.
        let positive = log_normal_cdf(force / (p11 / determinant).sqrt())
            + log_normal_cdf(stiffness / (p00 / determinant).sqrt());
        Evidence {
            log: noise.base(scale) + explained - 0.5 * determinant.ln() + positive,
            force: force * FORCE_SCALE,
            stiffness: stiffness * STIFFNESS_SCALE,
            friction: mu,
            reference: 0.0,
            bias_scale: scale,
        }
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
}

impl Evidence {
    /// Most probable force when the obstacle's centre is `distance` (m) from the link, N.
    pub(super) fn force_at(&self, distance: f64) -> f64 {
        (self.force + self.stiffness * (self.reference - distance)).max(0.0)
    }
}

/// ln Φ(x) of the standard normal distribution, to 1e-3 relative where it matters.
fn log_normal_cdf(x: f64) -> f64 {
    if x < -5.0 {
        // Leading terms of the asymptotic series (Abramowitz and Stegun 1964, 26.2.12).
        let squared = x * x;
        return -0.5 * squared - (-x * 2.506_628_274_6).ln() + (1.0 - 1.0 / squared).ln();
    }
    // Abramowitz and Stegun 26.2.17, on the side where it is small.
    let t = 1.0 / (1.0 + 0.231_641_9 * x.abs());
    let series = t
        * (0.319_381_530
            + t * (-0.356_563_782
                + t * (1.781_477_937 + t * (-1.821_255_978 + t * 1.330_274_429))));
    let tail = 0.398_942_280_4 * (-0.5 * x * x).exp() * series;
    if x > 0.0 {
        (1.0 - tail).ln()
    } else {
        tail.ln()
    }
}
