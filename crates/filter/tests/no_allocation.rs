//! In steady state the paper's method allocates nothing. Alone in its program, as it counts what the whole program does.

#![allow(clippy::unwrap_used)]

use std::alloc::System;

use palpate_filter::{ContactStatus, Filter, Intake, Method, Parameters};
use palpate_model::{JointSample, LoadOptions, Robot, iiwa14};
use palpate_sim::{Scenario, simulate};
use rayon::ThreadPoolBuilder;
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Contacts of a second on link 5, all alike, each with half a second of rest.
fn contacts(robot: &Robot, count: usize) -> Vec<JointSample> {
    let scenario = Scenario {
        duration_secs: 1.5,
        noise_fraction: 0.05,
        ..Scenario::new("lbr_link_5")
    };
    let mut contact = simulate(robot, &scenario).unwrap().samples;
    for sample in &mut contact[100..] {
        sample.external_torque.fill(0.0);
    }
    let mut samples = vec![contact; count].concat();
    for (index, sample) in (0..).zip(&mut samples) {
        sample.stamp_ns = index * 10_000_000;
    }
    samples
}

fn parameters(rate_hz: f64) -> Parameters {
    let mut parameters = Parameters {
        method: Method::Paper,
        particles: 1000,
        ..Parameters::default()
    };
    parameters.paper.rate_hz = rate_hz;
    parameters
}

/// Feeds samples, with another limit on the particles for each; tells how many had a contact.
fn feed(filter: &mut Filter, intake: &mut Intake, samples: &[JointSample]) -> usize {
    let mut in_contact = 0;
    for (sample, limit) in samples
        .iter()
        .zip([2000, 1000, 300, 700].into_iter().cycle())
    {
        filter.limit_particles(limit);
        let status = filter.update(intake.admit(sample).unwrap()).status;
        in_contact += usize::from(status != ContactStatus::NoContact);
    }
    in_contact
}

/// Allocations and reallocations in the last of some contacts, from its 20th sample until after its end.
fn allocations(robot: &Robot, rate_hz: f64) -> usize {
    let samples = contacts(robot, 4);
    let (before, counted) = samples.split_at(3 * 150 + 20);
    let mut filter = Filter::new(robot, &parameters(rate_hz), 1).unwrap();
    let mut intake = Intake::new(robot.dof());
    feed(&mut filter, &mut intake, before);
    let region = Region::new(ALLOCATOR);
    let in_contact = feed(&mut filter, &mut intake, counted);
    let change = region.change();
    assert!((80..120).contains(&in_contact), "{in_contact}");
    change.allocations + change.reallocations
}

#[test]
fn a_contact_in_steady_state_allocates_nothing() {
    let robot = iiwa14(&LoadOptions::default()).unwrap();
    // One thread, the pool's own: several would also count what the pool does for itself.
    let pool = ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    // A step for every tenth sample, and for each.
    for rate_hz in [10.0, 1000.0] {
        assert_eq!(
            pool.install(|| allocations(&robot, rate_hz)),
            0,
            "{rate_hz}"
        );
    }
}
