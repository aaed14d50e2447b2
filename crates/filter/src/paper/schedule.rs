//! The schedule of λ and σ: a wide search while the robot is still, a narrow one once it has moved (section II-B).

use super::PaperParameters;

/// λ and the noises σ of one step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Level {
    /// λ of eq. 5, 1/(Nm)².
    pub(super) lambda: f64,
    /// σ of the location, m.
    pub(super) location_noise: f64,
    /// σ of the force, N.
    pub(super) force_noise: f64,
    /// σ of the stiffness' logarithm.
    pub(super) stiffness_noise: f64,
}

impl Level {
    /// The level after the joints have moved by `travelled` (rad or m) in all: from the first value of each parameter
    /// to its second, exponentially in the way travelled.
    pub(super) fn at(parameters: &PaperParameters, travelled: f64) -> Self {
        let progress = 1.0 - (-travelled / parameters.schedule_travel).exp();
        let blend = |[first, last]: [f64; 2]| first * (last / first).powf(progress);
        Self {
            lambda: blend(parameters.lambda),
            location_noise: blend(parameters.location_noise),
            force_noise: blend(parameters.force_noise),
            stiffness_noise: blend(parameters.stiffness_noise),
        }
    }
}
