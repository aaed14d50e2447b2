//! Joint speeds from positions.

use std::f64::consts::TAU;

/// Backward differences of the positions, through a first-order low-pass.
///
/// The low-pass is exact for differences that are constant between samples: its share of the newest difference is
/// 1 − exp(−2π · cut-off · step). So it bears any step, and jitter in it.
#[derive(Clone, Debug)]
pub(super) struct Differentiator {
    cutoff_hz: f64,
    position: Vec<f64>,
    velocity: Vec<f64>,
}

impl Differentiator {
    pub fn new(cutoff_hz: f64, dof: usize) -> Self {
        Self {
            cutoff_hz,
            position: vec![0.0; dof],
            velocity: vec![0.0; dof],
        }
    }

    /// Speeds at these positions, the time since the last ones being `step_secs`. Without it they are zero.
    pub fn update(&mut self, step_secs: Option<f64>, position: &[f64]) -> &[f64] {
        match step_secs {
            Some(secs) => {
                let share = 1.0 - (-TAU * self.cutoff_hz * secs).exp();
                for (joint, velocity) in self.velocity.iter_mut().enumerate() {
                    let difference = (position[joint] - self.position[joint]) / secs;
                    *velocity += share * (difference - *velocity);
                }
            }
            None => self.velocity.fill(0.0),
        }
        self.position.copy_from_slice(position);
        &self.velocity
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_steady_speed_is_found_whatever_the_steps_and_a_ramp_lags_as_documented() {
        let (cutoff_hz, acceleration) = (10.0, 2.0);
        let mut steady = Differentiator::new(cutoff_hz, 1);
        let mut ramp = Differentiator::new(cutoff_hz, 1);
        let (mut secs, mut last) = (0.0, (0.0, 0.0));
        for index in 0..400 {
            let step = if index % 3 == 0 { 0.004 } else { 0.001 };
            secs += step;
            let known = (index > 0).then_some(step);
            last = (
                steady.update(known, &[0.7 * secs])[0],
                ramp.update(known, &[0.5 * acceleration * secs * secs])[0],
            );
        }
        assert!((last.0 - 0.7).abs() < 1e-9, "{last:?}");
        let lag = secs - last.1 / acceleration;
        let documented = 1.0 / (TAU * cutoff_hz) + 0.001;
        assert!((lag - documented).abs() < 0.002, "{lag} {documented}");
    }

    #[test]
    fn a_pause_starts_at_rest() {
        let mut speed = Differentiator::new(10.0, 1);
        assert_eq!(speed.update(None, &[5.0]), [0.0]);
        assert!(speed.update(Some(0.01), &[5.1])[0] > 1.0);
        assert_eq!(speed.update(None, &[9.0]), [0.0]);
    }
}
