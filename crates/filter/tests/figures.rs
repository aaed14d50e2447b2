//! What a filter tells of itself beside the estimate, and what becomes of it when its parameters change.

#![allow(clippy::unwrap_used)]

mod play;

use palpate_filter::{Filter, Method, TareState};
use palpate_model::{JointSample, LoadOptions, iiwa14};
use palpate_sim::{Scenario, simulate};
use play::{play, small};

fn norm(torque: &[f64]) -> f64 {
    torque
        .iter()
        .map(|torque| torque * torque)
        .sum::<f64>()
        .sqrt()
}

fn at_rest(count: i64, torque: f64) -> Vec<JointSample> {
    let sample = |index: i64| JointSample {
        stamp_ns: index * 10_000_000,
        position: vec![0.3; 7],
        external_torque: vec![torque; 7],
    };
    (1..=count).map(sample).collect()
}

#[test]
fn a_found_contact_explains_the_torques_and_gathers_the_particles() {
    let robot = iiwa14(&LoadOptions::default()).unwrap();
    let scenario = Scenario {
        seed: 1,
        rate_hz: 50.0,
        duration_secs: 2.0,
        noise_fraction: 0.0,
        refine_levels: 0,
        ..Scenario::new("lbr_link_5")
    };
    let trial = simulate(&robot, &scenario).unwrap();
    let mut filter = Filter::new(&robot, &small(Method::Palpate), 1).unwrap();
    assert_eq!(
        (filter.effective_sample_size(), filter.spread()),
        (0.0, 0.0)
    );
    play(&mut filter, &trial.samples);
    let measured = &trial.samples.last().unwrap().external_torque;
    let share = norm(&filter.residual()) / norm(measured);
    assert!(share < 0.2, "{share}");
    let effective = filter.effective_sample_size();
    assert!((1.0..=150.0 + 1e-6).contains(&effective), "{effective}");
    assert!(filter.spread() > 0.0 && filter.spread() < 0.3);
}

#[test]
fn without_contact_all_but_the_bias_is_residual() {
    let robot = iiwa14(&LoadOptions::default()).unwrap();
    let mut filter = Filter::new(&robot, &small(Method::Paper), 1).unwrap();
    play(&mut filter, &at_rest(10, 0.1));
    for (residual, bias) in filter.residual().iter().zip(filter.bias()) {
        assert_eq!(*residual, 0.1 - bias.mean);
    }
}

#[test]
fn other_parameters_keep_the_bias_and_forget_the_contact() {
    let robot = iiwa14(&LoadOptions::default()).unwrap();
    let mut parameters = small(Method::Paper);
    let mut filter = Filter::new(&robot, &parameters, 1).unwrap();
    filter.start_tare(0.5).unwrap();
    let (rest, touch) = (at_rest(60, 0.1), at_rest(80, 5.0));
    play(&mut filter, &rest);
    assert_eq!(filter.tare_state(), TareState::Done);
    let estimates = play(&mut filter, &touch[60..70]);
    assert!(estimates.last().unwrap().best().is_some());

    parameters.detector.release_share = 2.0;
    assert!(filter.set_parameters(&parameters).is_err());
    assert!(filter.estimate().best().is_some());
    parameters.detector.release_share = 0.6;
    parameters.detector.least_torque = 6.0;
    filter.set_parameters(&parameters).unwrap();
    assert!(filter.estimate().best().is_none() && filter.particles().is_empty());
    let estimates = play(&mut filter, &touch[70..80]);
    assert!(estimates.iter().all(|estimate| estimate.best().is_none()));
    assert!((filter.residual()[0] - 4.9).abs() < 0.05);
}
