//! The samples between two steps of the paper's filter, which runs at a tenth of a sensor's usual rate: their mean.

use palpate_model::{Kinematics, Robot};

use crate::step::Step;

/// Samples since the last step, and the configurations at the last two steps.
#[derive(Default)]
pub(super) struct Window {
    count: f64,
    /// When the last step was made, and when the last sample came.
    closed_ns: i64,
    last_ns: i64,
    position_sum: Vec<f64>,
    torque_sum: Vec<f64>,
    position: [Vec<f64>; 2],
    torque: Vec<f64>,
    /// Before and now; none only while a step is made.
    kinematics: Option<[Kinematics; 2]>,
}

impl Window {
    pub(super) fn new(robot: &Robot) -> Self {
        let zeros = || vec![0.0; robot.dof()];
        Self {
            position_sum: zeros(),
            torque_sum: zeros(),
            position: [zeros(), zeros()],
            torque: zeros(),
            kinematics: Some([Kinematics::new(robot), Kinematics::new(robot)]),
            ..Self::default()
        }
    }

    pub(super) fn clear(&mut self) {
        self.count = 0.0;
        self.position_sum.fill(0.0);
        self.torque_sum.fill(0.0);
    }

    pub(super) fn add(&mut self, stamp_ns: i64, position: &[f64], torque: &[f64]) {
        self.last_ns = stamp_ns;
        self.count += 1.0;
        for (sum, value) in self.position_sum.iter_mut().zip(position) {
            *sum += value;
        }
        for (sum, value) in self.torque_sum.iter_mut().zip(torque) {
            *sum += value;
        }
    }

    /// Whether a step is due for this many a second, to the nearest sample.
    pub(super) fn is_full(&self, rate_hz: f64) -> bool {
        let span_secs = self.last_ns.saturating_sub(self.closed_ns) as f64 * 1e-9;
        let half_period_secs = 0.5 * span_secs / self.count.max(1.0);
        span_secs + half_period_secs >= 1.0 / rate_hz
    }

    /// Makes the mean of the samples the present, and the present the past; at the first step both are the same.
    pub(super) fn close(&mut self, robot: &Robot, is_first: bool) {
        let count = self.count.max(1.0);
        let mean = |mean: &mut [f64], sum: &[f64]| {
            for (mean, sum) in mean.iter_mut().zip(sum) {
                *mean = sum / count;
            }
        };
        self.position.swap(0, 1);
        mean(&mut self.position[1], &self.position_sum);
        mean(&mut self.torque, &self.torque_sum);
        if let Some([before, now]) = &mut self.kinematics {
            std::mem::swap(before, now);
            now.update(robot, &self.position[1]);
            if is_first {
                before.update(robot, &self.position[1]);
            }
        }
        if is_first {
            let [before, now] = &mut self.position;
            before.copy_from_slice(now);
        }
        self.closed_ns = self.last_ns;
        self.clear();
    }

    /// The step from the past to the present.
    pub(super) fn step<'a>(&'a self, sample: &Step<'a>) -> Step<'a> {
        let (before, now) = match &self.kinematics {
            Some([before, now]) => (before, now),
            None => (sample.before, sample.now),
        };
        Step {
            before,
            now,
            position_before: &self.position[0],
            position: &self.position[1],
            torque: &self.torque,
            ..*sample
        }
    }
}
