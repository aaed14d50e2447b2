//! What the sensors' noise allows: how surely the best of all detectors would notice the same pushes.
//!
//! By the lemma of Neyman and Pearson (*On the Problem of the Most Efficient Tests of Statistical Hypotheses*, 1933) no test
//! with as many false alarms beats the matched filter, which knows what it looks for. Here it knows the torques that the
//! push makes and when it begins, the mass matrix, biases, friction, payload and the links' masses: noise alone is in its
//! way. So no detector that knows less can be better.

use anyhow::Result;
use indicatif::ProgressBar;
use nalgebra::{DMatrix, DVector};
use palpate_filter::DetectorParameters;
use palpate_model::{Dynamics, Robot};
use palpate_sim::{Drive, DriveScenario};

use super::pushes::{FORCES, Pushed, limit_secs, push_scenario};
use super::situation::{SITUATIONS, Situation, Source};
use super::{Plan, RATES};
use crate::evaluate::campaign::in_parallel;
use crate::evaluate::table::{heads, markdown};

/// Force for which the torques are simulated, N: what is sure grows with it.
const FORCE: f64 = 10.0;
/// Steps after which the filter that predicts the noise is steady.
const STEADY_STEPS: usize = 500;

/// Situations whose errors are noise, or nearly so.
fn situations() -> impl Iterator<Item = &'static Situation> {
    SITUATIONS
        .iter()
        .filter(|situation| !situation.has_payload && !situation.has_friction)
}

/// How many runs there are.
pub fn count(plan: &Plan) -> usize {
    RATES.len() * situations().count() * plan.links.len()
}

/// A table with what the detector notices in time beside what noise allows.
pub fn run(plan: &Plan, pushed: &Pushed, bar: &ProgressBar) -> Result<String> {
    let work: Vec<_> = (RATES.into_iter())
        .flat_map(|rate| situations().map(move |situation| (rate, situation)))
        .flat_map(|(rate, situation)| plan.links.iter().map(move |link| (rate, situation, *link)))
        .collect();
    let distances = in_parallel(plan.threads, work.len(), |index| {
        let (rate_hz, situation, link) = work[index];
        let scenario = push_scenario(plan, rate_hz, situation, FORCE, link);
        let distances = scenario.map(|scenario| distances(plan.robot, &scenario));
        bar.inc(1);
        distances.transpose()
    })?;
    let mut rows = Vec::new();
    for (work, distances) in (work.chunks(plan.links.len())).zip(distances.chunks(plan.links.len()))
    {
        let (rate_hz, situation, _) = work[0];
        for force in FORCES {
            let mut row = vec![situation.name.to_owned(), format!("{rate_hz:.0}")];
            row.push(format!("{force}"));
            for (&(.., link), distances) in work.iter().zip(distances) {
                let allowed = (distances.iter().flatten())
                    .map(|distance| power(distance * force / FORCE, rate_hz))
                    .sum::<f64>();
                let pushes = distances.as_ref().map_or(0, Vec::len).max(1) as f64;
                let found = pushed.in_time(situation, Source::Observer, rate_hz, force, link);
                row.push(format!(
                    "{:.0} / {:.0}",
                    100.0 * found,
                    100.0 * allowed / pushes
                ));
            }
            rows.push(row);
        }
    }
    let mut columns = heads(&["situation", "rate Hz", "N"]);
    columns.extend(plan.links.iter().map(|link| format!("link {link}")));
    Ok(format!(
        "## What noise allows\n\nFor each link: pushes noticed within 20 ms (at 1000 Hz) or 100 ms (at 100 Hz) with the momentum \
         observer, % / the most that any detector with this rate of false alarms can notice by then, %, by the lemma of Neyman and \
         Pearson: one that knows the torques that it looks for, their begin, the mass matrix, and all that the torques are wrong \
         by but the white noise of torques and speeds.\n\n{}",
        markdown(&columns, &rows, 3)
    ))
}

/// Probability of a matched filter's output, of mean `distance` and deviation 1, to exceed what noise exceeds as rarely as
/// stated, looked at with every sample.
fn power(distance: f64, rate_hz: f64) -> f64 {
    let share = DetectorParameters::default().false_alarms_per_hour / (3600.0 * rate_hz);
    let exceeds = |z: f64| 0.5 * libm::erfc(z / std::f64::consts::SQRT_2);
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        match exceeds(middle) > share {
            true => low = middle,
            false => high = middle,
        }
    }
    exceeds(high - distance)
}

/// For each push, how many standard deviations the matched filter's output is off zero when the time is over.
fn distances(robot: &Robot, scenario: &DriveScenario) -> Result<Vec<f64>> {
    let dynamics = Dynamics::new(robot, Dynamics::UPRIGHT, None)?;
    let mut workspace = dynamics.workspace();
    let limit = limit_secs(scenario.rate_hz);
    let mut innovations: Vec<Option<Innovations>> = scenario.pushes.iter().map(|_| None).collect();
    for moment in Drive::new(robot, scenario)? {
        let secs = moment.measured.stamp_ns as f64 * 1e-9;
        let begun = |start: f64| (0.0..=limit).contains(&(secs - start));
        let Some(index) = (scenario.pushes.iter()).position(|push| begun(push.start_secs)) else {
            continue;
        };
        let mass = dynamics.mass_matrix(&mut workspace, &moment.position);
        let of_push = innovations[index].get_or_insert_with(|| Innovations::new(scenario, mass));
        of_push.take(&DVector::from_vec(moment.external_torque));
    }
    let distance = |of_push: Option<Innovations>| of_push.map_or(0.0, |push| push.squared.sqrt());
    Ok(innovations.into_iter().map(distance).collect())
}

/// The Kalman filter that whitens the noise, and what a push does to its innovations.
///
/// What is measured is the momentum that the arm's dynamics do not explain, which is all that the observer makes its torque
/// of: the integral of the torques, of which white noise makes a random walk, plus the mass matrix times the noise of the
/// speeds.
struct Innovations {
    step_secs: f64,
    /// The filter's gain, and the inverse of its innovations' covariance.
    gain: DMatrix<f64>,
    precision: DMatrix<f64>,
    /// The push's momentum that the filter did not follow, Nm s.
    missed: DVector<f64>,
    /// Squared length of the innovations' means, in standard deviations.
    squared: f64,
}

impl Innovations {
    fn new(scenario: &DriveScenario, mass: &DMatrix<f64>) -> Self {
        let dof = mass.nrows();
        let step_secs = 1.0 / scenario.rate_hz;
        let walk = DMatrix::identity(dof, dof) * (step_secs * scenario.torque_noise).powi(2);
        let measured = mass * mass.transpose() * scenario.velocity_noise.powi(2);
        let mut variance = measured.clone() + &walk;
        let (mut gain, mut precision) = (DMatrix::zeros(dof, dof), DMatrix::zeros(dof, dof));
        for _ in 0..STEADY_STEPS {
            precision = (&variance + &measured).try_inverse().unwrap_or(precision);
            gain = &variance * &precision;
            variance = &variance - &gain * &variance + &walk;
        }
        Self {
            step_secs,
            gain,
            precision,
            missed: DVector::zeros(dof),
            squared: 0.0,
        }
    }

    /// Takes the torques that the push makes in, Nm.
    fn take(&mut self, torque: &DVector<f64>) {
        self.missed += torque * self.step_secs;
        self.squared += self.missed.dot(&(&self.precision * &self.missed));
        self.missed -= &self.gain * &self.missed;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_push_is_as_sure_as_the_false_alarms_allow() {
        // One look at 1 kHz may alarm with 2.8e-8: 5.43 standard deviations.
        assert!((power(5.43, 1000.0) - 0.5).abs() < 0.01);
        assert!(power(9.0, 1000.0) > 0.999 && power(2.0, 1000.0) < 0.001);
    }

    #[test]
    fn without_noise_of_the_torques_a_step_is_fitted_as_a_ramp_of_the_momentum() {
        let mass = DMatrix::identity(1, 1) * 3.0;
        let scenario = DriveScenario {
            torque_noise: 1e-6,
            ..DriveScenario::slow(1)
        };
        let mut push = Innovations::new(&scenario, &mass);
        (0..20).for_each(|_| push.take(&DVector::from_element(1, 1.0)));
        // Σ (t τ)² / (M σ)², t in ms; what came before is known.
        let expected = (1..=20).map(|ms| f64::from(ms * ms)).sum::<f64>() / 9.0;
        // After 500 samples the filter still follows a new one by a 500th.
        assert!(
            (push.squared / expected - 1.0).abs() < 0.04,
            "{}",
            push.squared
        );
    }
}
