//! Plays samples to a filter, as every program of the project does.

use palpate_filter::{ContactEstimate, Filter, Intake, Method, PalpateParameters, Parameters};
use palpate_model::JointSample;

/// A filter small enough for many trials.
pub fn small(method: Method) -> Parameters {
    Parameters {
        method,
        particles: 2000,
        palpate: PalpateParameters {
            hypotheses: 150,
            rounds: 2,
            ..PalpateParameters::default()
        },
        ..Parameters::default()
    }
}

/// The estimates that follow from some samples, one a sample.
pub fn play(filter: &mut Filter, samples: &[JointSample]) -> Vec<ContactEstimate> {
    let mut intake = Intake::new(samples.first().map_or(0, |sample| sample.position.len()));
    let admitted = samples.iter().map(|sample| intake.admit(sample).unwrap());
    let estimates = admitted.map(|sample| filter.update(sample).clone());
    estimates.collect()
}
