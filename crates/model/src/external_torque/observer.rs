//! The generalised-momentum observer.

use crate::Momentum;

/// Follows the external torque by the momentum that the known torques do not explain (A. De Luca, R. Mattone, ICRA 2005;
/// S. Haddadin, A. De Luca, A. Albu-Schäffer, *Robot Collisions: A Survey on Detection, Isolation, and Identification*,
/// IEEE Transactions on Robotics 2017).
///
/// ṗ = τ_ext − u + Cᵀ q̇ with u = g + τ_f − τ, and the residual r obeys ṙ = K (τ_ext − r): a low-pass with gain K, for each
/// joint on its own. As its integral form needs no q̈, neither does this one: over a step, the mean of τ_ext is the change
/// of p over the step plus the mean of u − Cᵀ q̇ at its ends, and r follows it by the share 1 − exp(−K · step). This is the
/// exact solution for torques that change linearly, stable for any gain and step.
#[derive(Clone, Debug)]
pub(super) struct MomentumObserver {
    gain: Vec<f64>,
    momentum: Vec<f64>,
    /// u − Cᵀ q̇ at the last sample.
    unexplained: Vec<f64>,
    residual: Vec<f64>,
}

impl MomentumObserver {
    pub fn new(gain: Vec<f64>) -> Self {
        let dof = gain.len();
        Self {
            gain,
            momentum: vec![0.0; dof],
            unexplained: vec![0.0; dof],
            residual: vec![0.0; dof],
        }
    }

    /// Takes u in `torque`, and leaves the residual there. `step_secs` is the time since the last sample; without it, the
    /// observer starts as if the momentum had not changed.
    pub fn update(&mut self, step_secs: Option<f64>, now: Momentum, torque: &mut [f64]) {
        for (joint, torque) in torque.iter_mut().enumerate() {
            let unexplained = *torque - now.coriolis_transpose[joint];
            self.residual[joint] = match step_secs {
                Some(secs) => {
                    let rate = (now.momentum[joint] - self.momentum[joint]) / secs;
                    let mean = rate + 0.5 * (unexplained + self.unexplained[joint]);
                    let share = 1.0 - (-self.gain[joint] * secs).exp();
                    self.residual[joint] + share * (mean - self.residual[joint])
                }
                None => unexplained,
            };
            self.unexplained[joint] = unexplained;
            self.momentum[joint] = now.momentum[joint];
            *torque = self.residual[joint];
        }
    }
}
