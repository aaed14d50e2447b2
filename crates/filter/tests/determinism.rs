//! The same seed, samples and parameters give the same bits, whatever the number of threads.

#![allow(clippy::unwrap_used)]

mod play;

use palpate_filter::{Filter, Method, Parameters};
use palpate_model::{JointSample, LoadOptions, Robot, iiwa14};
use palpate_sim::{Scenario, simulate};
use play::{play, small};
use rayon::ThreadPoolBuilder;

/// A second on link 5, of which the last 0.3 s are quiet.
fn samples(robot: &Robot) -> Vec<JointSample> {
    let scenario = Scenario {
        duration_secs: 1.0,
        noise_fraction: 0.1,
        ..Scenario::new("lbr_link_5")
    };
    let mut samples = simulate(robot, &scenario).unwrap().samples;
    for sample in &mut samples[70..] {
        sample.external_torque.fill(0.0);
    }
    samples
}

/// Most particles, one part of the samples after the other.
const LIMITS: [usize; 4] = [usize::MAX, usize::MAX, 300, 1500];

/// All that a filter says, as text that tells every bit of every number.
fn told(filter: &mut Filter, samples: &[JointSample]) -> String {
    let mut text = String::new();
    for (part, &limit) in samples.chunks(10).zip(LIMITS.iter().cycle()) {
        filter.limit_particles(limit);
        text += &format!("{:?}\n{:?}\n", play(filter, part), filter.particles());
    }
    text
}

fn told_by_new(robot: &Robot, parameters: &Parameters, seed: u64) -> String {
    told(
        &mut Filter::new(robot, parameters, seed).unwrap(),
        &samples(robot),
    )
}

fn told_with_threads(robot: &Robot, parameters: &Parameters, threads: usize) -> String {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    pool.unwrap().install(|| told_by_new(robot, parameters, 7))
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let robot = iiwa14(&LoadOptions::default()).unwrap();
    for method in [Method::Paper, Method::Palpate] {
        let one = told_with_threads(&robot, &small(method), 1);
        assert!(one.contains("Mode {") && one.contains("Particle {"));
        for threads in [2, 3] {
            let several = told_with_threads(&robot, &small(method), threads);
            assert!(one == several, "{method:?}, {threads} threads");
        }
    }
}

#[test]
fn another_seed_differs() {
    let robot = iiwa14(&LoadOptions::default()).unwrap();
    for method in [Method::Paper, Method::Palpate] {
        let [one, other] = [7, 8].map(|seed| told_by_new(&robot, &small(method), seed));
        assert!(one != other, "{method:?}");
    }
}
#[test]
fn after_a_reset_a_filter_is_as_new() {
    let robot = iiwa14(&LoadOptions::default()).unwrap();
    for method in [Method::Paper, Method::Palpate] {
        let mut filter = Filter::new(&robot, &small(method), 7).unwrap();
        let first = told(&mut filter, &samples(&robot));
        filter.reset();
        let again = told(&mut filter, &samples(&robot));
        assert!(first == again, "{method:?}");
    }
}
