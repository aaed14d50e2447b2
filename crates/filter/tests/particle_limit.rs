//! The number of particles of the paper's method follows the limit that is set, and nothing else does.

#![allow(clippy::unwrap_used)]

mod play;

use palpate_filter::{ContactStatus, Filter, Method, Parameters};
use palpate_model::{JointSample, LoadOptions, Robot, iiwa14};
use palpate_sim::{Scenario, simulate};
use play::{play, small};

/// A ball on link 5, at 100 Hz.
fn samples(robot: &Robot) -> Vec<JointSample> {
    let scenario = Scenario {
        duration_secs: 1.0,
        noise_fraction: 0.05,
        ..Scenario::new("lbr_link_5")
    };
    simulate(robot, &scenario).unwrap().samples
}

/// A step for every sample.
fn parameters(method: Method) -> Parameters {
    let mut parameters = small(method);
    parameters.paper.rate_hz = 100.0;
    parameters
}

fn filter(robot: &Robot) -> Filter {
    Filter::new(robot, &parameters(Method::Paper), 1).unwrap()
}

#[test]
fn a_step_leaves_as_many_as_the_limit_allows() {
    let robot = iiwa14(&LoadOptions::default()).unwrap();
    let mut filter = filter(&robot);
    let samples = samples(&robot);
    let (lead, rest) = samples.split_at(30);
    play(&mut filter, lead);
    assert_eq!(filter.particles().len(), 2000);
    // More than there are at all, fewer, twice as many, none.
    for (sample, [limit, count]) in rest.iter().zip([
        [3000, 2000],
        [1999, 1999],
        [257, 257],
        [600, 600],
        [usize::MAX, 2000],
        [0, 1],
        [2000, 2000],
    ]) {
        let before = filter.particles().len();
        filter.limit_particles(limit);
        play(&mut filter, std::slice::from_ref(sample));
        assert_eq!(filter.particles().len(), count, "{limit}");
        assert_eq!(filter.moved_particles(), before, "{limit}");
        let weights = filter.particles().iter().map(|particle| particle.weight);
        assert!((weights.sum::<f64>() - 1.0).abs() < 1e-5, "{limit}");
    }
}

#[test]
fn a_contact_begins_with_as_many_as_the_limit_allows() {
    let robot = iiwa14(&LoadOptions::default()).unwrap();
    let mut filter = filter(&robot);
    filter.limit_particles(700);
    let mut moved = Vec::new();
    for sample in samples(&robot) {
        let estimates = play(&mut filter, &[sample]);
        match estimates[0].status {
            ContactStatus::NoContact => assert_eq!(filter.moved_particles(), 0),
            _ => moved.push(filter.moved_particles()),
        }
    }
    assert!(
        moved.len() > 50 && moved.iter().all(|&count| count == 700),
        "{moved:?}"
    );
}

/// As a resampling draws without bias, estimates before and after agree.
#[test]
fn fewer_particles_tell_of_the_same_place() {
    let robot = iiwa14(&LoadOptions::default()).unwrap();
    let mut filter = filter(&robot);
    let samples = samples(&robot);
    let before = play(&mut filter, &samples[..98]);
    let before = before.last().unwrap().best().unwrap();
    filter.limit_particles(500);
    let after = play(&mut filter, &samples[98..]);
    let after = after.last().unwrap().best().unwrap();
    assert_eq!(before.link, after.link);
    let moved = (before.point_in_link - after.point_in_link).norm();
    assert!(moved < before.std(), "{moved} {}", before.std());
}

#[test]
fn without_need_the_limit_changes_nothing() {
    let robot = iiwa14(&LoadOptions::default()).unwrap();
    for (method, limit) in [(Method::Paper, 2000), (Method::Palpate, 1)] {
        let told = |limit| {
            let mut filter = Filter::new(&robot, &parameters(method), 1).unwrap();
            if let Some(limit) = limit {
                filter.limit_particles(limit);
            }
            format!("{:?}", play(&mut filter, &samples(&robot)))
        };
        assert!(told(Some(limit)) == told(None), "{method:?}");
    }
}
