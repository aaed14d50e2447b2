//! What the sensors add to the torque.

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::Scenario;

/// The torques (samples × joints) as measured: white noise, a constant bias and a slow walk of it. `in_contact` tells the
/// samples that make the signal's rms.
pub(crate) fn measured(
    clean: &[Vec<f64>],
    in_contact: &[bool],
    scenario: &Scenario,
    rng: &mut impl Rng,
) -> Vec<Vec<f64>> {
    let joints = clean.first().map_or(0, Vec::len);
    let mut gaussian = || -> f64 { StandardNormal.sample(rng) };
    let mut bias: Vec<f64> = (0..joints)
        .map(|joint| scenario.bias.get(joint).unwrap_or(&0.0) + scenario.bias_sigma * gaussian())
        .collect();
    let sigma: Vec<f64> = (0..joints)
        .map(|joint| {
            let proportional = scenario.noise_fraction * rms(clean, in_contact, joint);
            proportional.hypot(scenario.noise_floor)
        })
        .collect();
    let walk = scenario.bias_walk / scenario.rate_hz.sqrt();
    (clean.iter())
        .map(|torques| {
            let add = |joint: usize| {
                bias[joint] += walk * gaussian();
                torques[joint] + bias[joint] + sigma[joint] * gaussian()
            };
            (0..joints).map(add).collect()
        })
        .collect()
}

fn rms(clean: &[Vec<f64>], in_contact: &[bool], joint: usize) -> f64 {
    let squares: Vec<f64> = (clean.iter().zip(in_contact))
        .filter(|(_, contact)| **contact)
        .map(|(torques, _)| torques[joint] * torques[joint])
        .collect();
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}
