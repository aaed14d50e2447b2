//! What the sensors add.

use palpate_model::MeasuredSample;
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;
use rand_distr::{Distribution, StandardNormal};

use super::DriveScenario;

/// Sensors of all joints: white noise, and on torques a slow bias, an Ornstein-Uhlenbeck process from its stationary
/// distribution on.
pub(super) struct TorqueSensors {
    scenario: DriveScenario,
    bias: Vec<f64>,
    rng: Xoshiro256PlusPlus,
}

impl TorqueSensors {
    pub fn new(scenario: &DriveScenario, dof: usize) -> Self {
        const NOISE_STREAM: u64 = 0x6e6f_6973_6500_0002;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(scenario.seed ^ NOISE_STREAM);
        let bias = (0..dof).map(|_| scenario.torque_drift * gaussian(&mut rng));
        Self {
            bias: bias.collect(),
            scenario: scenario.clone(),
            rng,
        }
    }

    /// The sample with what the sensors add to it.
    pub fn measure(&mut self, mut sample: MeasuredSample) -> MeasuredSample {
        let kept = (-1.0 / (self.scenario.drift_secs * self.scenario.rate_hz)).exp();
        let fresh = self.scenario.torque_drift * (1.0 - kept * kept).sqrt();
        for (torque, bias) in sample.torque.iter_mut().zip(&mut self.bias) {
            *torque += *bias + self.scenario.torque_noise * gaussian(&mut self.rng);
            *bias = kept * *bias + fresh * gaussian(&mut self.rng);
        }
        for velocity in &mut sample.velocity {
            *velocity += self.scenario.velocity_noise * gaussian(&mut self.rng);
        }
        for position in &mut sample.position {
            *position += self.scenario.position_noise * gaussian(&mut self.rng);
        }
        sample
    }
}

fn gaussian(rng: &mut Xoshiro256PlusPlus) -> f64 {
    StandardNormal.sample(rng)
}
