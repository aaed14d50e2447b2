//! Dynamics and external torque allocate nothing once they are made. Alone in its program, as it counts what the whole
//! program does.

#![allow(clippy::unwrap_used)]

use std::alloc::System;

use palpate_model::{
    Dynamics, ExternalTorque, ExternalTorqueOptions, JointFriction, LoadOptions, MeasuredSample,
    TorqueMethod, VelocitySource, iiwa14,
};
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Allocations and reallocations of some work.
fn allocations(work: impl FnOnce()) -> usize {
    let region = Region::new(ALLOCATOR);
    work();
    let change = region.change();
    change.allocations + change.reallocations
}

#[test]
fn dynamics_and_external_torque_allocate_nothing_once_they_are_made() {
    let robot = iiwa14(&LoadOptions::default()).unwrap();
    let dynamics = Dynamics::new(&robot, Dynamics::UPRIGHT, None).unwrap();
    let mut workspace = dynamics.workspace();
    let (q, v, a) = ([0.3; 7], [0.5; 7], [-1.0; 7]);
    let by_dynamics = allocations(|| {
        dynamics.mass_matrix(&mut workspace, &q);
        dynamics.inverse_dynamics(&mut workspace, &q, &v, &a);
        dynamics.gravity_torque(&mut workspace, &q);
        dynamics.coriolis_torque(&mut workspace, &q, &v);
        dynamics.momentum(&mut workspace, &q, &v);
    });
    assert_eq!(by_dynamics, 0);

    let gain = vec![25.0; 7];
    for method in [
        TorqueMethod::Static,
        TorqueMethod::MomentumObserver { gain },
    ] {
        let options = ExternalTorqueOptions {
            method,
            gravity_in_root: Dynamics::UPRIGHT,
            payload: None,
            friction: vec![JointFriction::default(); 7],
            velocity: VelocitySource::Differentiated { cutoff_hz: 20.0 },
        };
        let mut external = ExternalTorque::new(&robot, &options).unwrap();
        let mut sample = MeasuredSample {
            stamp_ns: 0,
            position: q.to_vec(),
            velocity: Vec::new(),
            torque: vec![3.0; 7],
        };
        let by_torque = allocations(|| {
            for _ in 0..100 {
                sample.stamp_ns += 1_000_000;
                sample.position[2] += 1e-4;
                assert!(external.update(&sample).is_ok());
            }
        });
        assert_eq!(by_torque, 0);
    }
    assert!(allocations(|| drop(std::hint::black_box(dynamics.workspace()))) > 0);
}
