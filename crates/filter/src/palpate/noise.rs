//! What is known of the torques' noise: white noise by joint, a slow part, and a constant bias of unknown scale.

use super::evidence::Evidence;
use super::history::History;
use super::memory::Keyframe;
use super::obstacle::Obstacle;
use crate::JointBias;

/// Standard deviations that a bias may have, Nm: which one fits, the data tell.
const BIAS_SCALES: [f64; 3] = [0.004, 0.05, 0.25];
/// No bias is known better than this, Nm.
const LEAST_BIAS_STD: f64 = 0.002;
/// Noise that does not average out within a keyframe: absolute, Nm, and as a share of the joint's rms torque.
const FLOOR: f64 = 0.01;
const FLOOR_SHARE: f64 = 0.01;
/// Time over which that part is one and the same, s.
const FLOOR_SECS: f64 = 0.2;

/// Fewest residuals that the noise is calibrated by, and the number that the belief in the model is worth.
const LEAST_RESIDUALS: f64 = 6.0;
const PRIOR_RESIDUALS: f64 = 8.0;

/// Weighted sums of one joint's residuals, in the order of time.
#[derive(Clone, Copy, Debug, Default)]
struct ResidualSums {
    count: f64,
    weight: f64,
    first: f64,
    second: f64,
    /// Product of neighbours, with the geometric mean of their weights.
    neighbours: f64,
    last: Option<(f64, f64)>,
}

impl ResidualSums {
    fn add(&mut self, residual: f64, weight: f64) {
        self.count += 1.0;
        self.weight += weight;
        self.first += weight * residual;
        self.second += weight * residual * residual;
        if let Some((last, last_weight)) = self.last {
            self.neighbours += (weight * last_weight).sqrt() * residual * last;
        }
        self.last = Some((residual, weight));
    }

    /// Mean square of the normalised residuals about their mean, which is the bias's business.
    fn variance_factor(&self, inflation: f64) -> f64 {
        let squares = (self.second - self.first * self.first / self.weight) * inflation;
        (squares + PRIOR_RESIDUALS) / (self.count - 1.0 + PRIOR_RESIDUALS)
    }

    /// How many residuals tell the same, (1 + ρ) / (1 − ρ), with ρ the correlation of neighbours (Bayley and
    /// Hammersley 1946).
    fn repetition(&self) -> f64 {
        let mean_part = self.first * self.first / self.weight;
        let square = (self.second - mean_part).max(f64::MIN_POSITIVE);
        // Shrunk, as few residuals show little of their correlation.
        let rho =
            (self.neighbours - mean_part) / square * self.count / (self.count + PRIOR_RESIDUALS);
        let rho = rho.clamp(0.0, 0.9);
        (1.0 + rho) / (1.0 - rho)
    }
}

/// Gaussian prior of what is left of a joint's bias in the torques.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BiasPrior {
    /// Nm.
    pub(super) mean: f64,
    /// Inverse variance, 1/Nm².
    pub(super) precision: f64,
    /// Log density of what was seen of the bias before the contact.
    log: f64,
}

impl BiasPrior {
    /// For biases of a scale s (Nm), of which one was found before the contact to be m ± σ and then taken out of the
    /// torques: b ~ N(0, s²), m ~ N(b, σ²), and b − m is left.
    fn new(scale: f64, found: &JointBias) -> Self {
        let prior = scale * scale;
        let seen = found.std.max(LEAST_BIAS_STD).powi(2);
        let total = prior + seen;
        Self {
            mean: -found.mean * seen / total,
            precision: total / (prior * seen),
            log: -0.5 * (found.mean * found.mean / total + total.ln()),
        }
    }
}

/// What the noise is by one hypothesis, and how well that explains the torques.
#[derive(Clone, Debug)]
pub(super) struct Calibration {
    /// Log of the hypothesis' evidence with this noise.
    pub(super) log: f64,
    /// Factor on the variance of each joint's noise.
    pub(super) inflation: Vec<f64>,
}

/// The noise model and the sums over the history that do not depend on a hypothesis.
#[derive(Clone)]
pub(super) struct Noise {
    /// Variance of a sample's white noise, Nm².
    white: Vec<f64>,
    /// Mean square of the torque, Nm².
    power: Vec<f64>,
    /// How much larger the residuals are than expected, as a factor on the variance.
    inflation: Vec<f64>,
    /// Running sums for `white` and `power`.
    last: [Vec<f64>; 2],
    seen: f64,
    second_difference: Vec<f64>,
    square: Vec<f64>,
    /// What is known of each joint's bias before the contact, for one scale of the biases.
    bias: [Vec<BiasPrior>; BIAS_SCALES.len()],
    /// Log evidence of each joint's torques if nothing touched, for one scale of the biases.
    base: [Vec<f64>; BIAS_SCALES.len()],
    /// The same of all joints together, with the density of what was seen of the biases before.
    base_of_all: [f64; BIAS_SCALES.len()],
    /// Half of the log of each joint's weights, summed.
    log_weights: Vec<f64>,
    /// Inverse variances, joint by joint for each keyframe.
    weights: Vec<f64>,
}

impl Noise {
    pub(super) fn new(dof: usize) -> Self {
        Self {
            white: vec![0.01; dof],
            power: vec![0.0; dof],
            inflation: vec![1.0; dof],
            last: [vec![0.0; dof], vec![0.0; dof]],
            seen: 0.0,
            second_difference: vec![0.0; dof],
            square: vec![0.0; dof],
            bias: std::array::from_fn(|_| vec![BiasPrior::default(); dof]),
            base: std::array::from_fn(|_| vec![0.0; dof]),
            base_of_all: [0.0; BIAS_SCALES.len()],
            log_weights: vec![0.0; dof],
            weights: Vec::new(),
        }
    }

    pub(super) fn begin(&mut self) {
        self.seen = 0.0;
        self.second_difference.fill(0.0);
        self.square.fill(0.0);
        self.inflation.fill(1.0);
    }

    /// Takes over what is known of the biases, which have been taken out of the torques.
    pub(super) fn know_biases(&mut self, biases: &[JointBias]) {
        for (scale, priors) in BIAS_SCALES.into_iter().zip(&mut self.bias) {
            for (prior, bias) in priors.iter_mut().zip(biases) {
                *prior = BiasPrior::new(scale, bias);
            }
        }
    }

    /// Learns from one sample's torques: white noise shows in their second differences.
    pub(super) fn learn(&mut self, torque: &[f64]) {
        self.seen += 1.0;
        for (joint, &torque) in torque.iter().enumerate() {
            let [last, before] = [self.last[0][joint], self.last[1][joint]];
            if self.seen > 2.0 {
                self.second_difference[joint] += (torque - 2.0 * last + before).powi(2) / 6.0;
            }
            self.square[joint] += torque * torque;
            self.last[1][joint] = last;
            self.last[0][joint] = torque;
            self.power[joint] = self.square[joint] / self.seen;
            // A prior worth 10 samples: 0.1 Nm and a tenth of the torque.
            let prior = 0.01_f64.max(0.01 * self.power[joint]);
            let differences = (self.seen - 2.0).max(0.0);
            self.white[joint] =
                (self.second_difference[joint] + 10.0 * prior) / (differences + 10.0);
            if differences > 60.0 {
                self.white[joint] = self.second_difference[joint] / differences;
            }
        }
    }

    /// Inverse variance of the mean torque of the keyframe with this index on one joint, as of the last
    /// [`Noise::sum`].
    pub(super) fn weight(&self, keyframe: usize, joint: usize) -> f64 {
        self.weights[keyframe * self.white.len() + joint]
    }

    fn weigh(&self, keyframe: &Keyframe, joint: usize) -> f64 {
        let floor = FLOOR * FLOOR + FLOOR_SHARE * FLOOR_SHARE * self.power[joint];
        let slow = floor * (FLOOR_SECS / keyframe.length_secs).min(1.0);
        1.0 / (self.inflation[joint] * (self.white[joint] / keyframe.samples + slow))
    }

    /// Mean squared normalised residual that a hypothesis, solved without it, leaves of the newest keyframe.
    pub(super) fn misfit(
        &self,
        obstacle: &Obstacle,
        evidence: &Evidence,
        history: &History,
    ) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        obstacle.predict_newest(evidence, history, |predicted, joint, torque| {
            let weight = self.weigh(history.newest(), joint);
            // What the biases may be is no misfit.
            let bias = self.bias(evidence.bias_scale, joint);
            let residual = torque.measured - predicted - bias.mean;
            sum += residual * residual / (1.0 / weight + 1.0 / bias.precision);
            count += 1.0;
        });
        sum / f64::max(count, 1.0)
    }

    /// How loud the noise is if a hypothesis is true. Each is judged by its own noise: by that of another one, which leaves
    /// more unexplained, it would hardly be better.
    pub(super) fn calibration(&self, mut obstacle: Obstacle, history: &History) -> Calibration {
        let evidence = history.evidence(&mut obstacle);
        let inflation = self.inflation_by(&obstacle, &evidence, history);
        let mut noise = self.clone();
        noise.inflate(&inflation, history.keyframes);
        let own = History {
            noise: &noise,
            ..*history
        };
        let log = own.evidence(&mut obstacle).log;
        Calibration { log, inflation }
    }

    /// How much larger than expected the residuals of a hypothesis are, joint by joint.
    fn inflation_by(
        &self,
        obstacle: &Obstacle,
        evidence: &Evidence,
        history: &History,
    ) -> Vec<f64> {
        let mut sums = vec![ResidualSums::default(); self.white.len()];
        obstacle.predict(evidence, history, |predicted, joint, torque| {
            sums[joint].add(torque.measured - predicted, torque.weight);
        });
        let inflation =
            |(&inflation, sums): (&f64, &ResidualSums)| match sums.count >= LEAST_RESIDUALS {
                true => (sums.variance_factor(inflation) * sums.repetition()).clamp(1.0, 1e4),
                false => inflation,
            };
        self.inflation.iter().zip(&sums).map(inflation).collect()
    }

    /// Sets the factors on the variance of each joint's noise.
    pub(super) fn inflate(&mut self, inflation: &[f64], keyframes: &[Keyframe]) {
        self.inflation.copy_from_slice(inflation);
        self.sum(keyframes);
    }

    /// The largest factor on a joint's variance.
    pub(super) fn most_inflated(&self) -> f64 {
        self.inflation.iter().copied().fold(1.0, f64::max)
    }

    /// What the best hypothesis leaves of a keyframe's torque on one joint beyond the noise expected, Nm.
    pub(super) fn unexplained(&self, keyframe: &Keyframe, joint: usize) -> f64 {
        let expected = 1.0 / (self.weigh(keyframe, joint) * self.inflation[joint]);
        ((self.inflation[joint] - 1.0) * expected).sqrt()
    }

    /// Root mean square of a joint's torque, Nm.
    pub(super) fn rms(&self, joint: usize) -> f64 {
        self.power[joint].sqrt()
    }

    /// Sums over the history what all hypotheses share.
    pub(super) fn sum(&mut self, keyframes: &[Keyframe]) {
        self.weights.clear();
        for keyframe in keyframes {
            for joint in 0..self.white.len() {
                self.weights.push(self.weigh(keyframe, joint));
            }
        }
        for joint in 0..self.white.len() {
            let (mut weight, mut first, mut second, mut log) = (0.0, 0.0, 0.0, 0.0);
            for keyframe in keyframes {
                let w = self.weigh(keyframe, joint);
                weight += w;
                first += w * keyframe.torque[joint];
                second += w * keyframe.torque[joint].powi(2);
                log += w.ln();
            }
            self.log_weights[joint] = 0.5 * log;
            for (base, bias) in self.base.iter_mut().zip(&self.bias) {
                let BiasPrior {
                    mean, precision, ..
                } = bias[joint];
                let sum = first + precision * mean;
                let explained = sum * sum / (weight + precision) - precision * mean * mean;
                base[joint] = 0.5 * (log - second + explained - (1.0 + weight / precision).ln());
            }
        }
        for (scale, all) in self.base_of_all.iter_mut().enumerate() {
            let bias = self.bias[scale].iter().map(|bias| bias.log);
            *all = self.base[scale].iter().sum::<f64>() + bias.sum::<f64>();
        }
    }

    pub(super) fn bias_scales(&self) -> usize {
        BIAS_SCALES.len()
    }

    /// What is known of a joint's bias before the contact, for one scale.
    pub(super) fn bias(&self, scale: usize, joint: usize) -> BiasPrior {
        self.bias[scale][joint]
    }

    /// Log evidence of the torques of all joints beside a path, which feel nothing, and for those of the path the
    /// noise's log density but for the products with its inverse covariance.
    pub(super) fn base_beside(&self, scale: usize, path: &[usize]) -> f64 {
        let own = |&joint: &usize| self.log_weights[joint] - self.base[scale][joint];
        self.base_of_all[scale] + path.iter().map(own).sum::<f64>()
    }
}
