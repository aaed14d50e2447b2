//! What each stage of a step costs: `cargo bench -p palpate-filter --bench stages`; a part of a case's name after it
//! picks cases.

#![allow(clippy::unwrap_used, missing_docs)]

#[path = "table/stream.rs"]
mod stream;

use std::fmt;
use std::sync::OnceLock;

use divan::Bencher;
use nalgebra::{Point3, Vector3};
use palpate_filter::{Detector, DetectorParameters, Filter, Intake, Method, Parameters, Stage};
use palpate_model::{Dynamics, Kinematics, LoadOptions, Robot, Surface, iiwa14};
use rayon::ThreadPoolBuilder;

use stream::{Cloud, Stream};

struct Case {
    particles: usize,
    threads: usize,
    cloud: Cloud,
}

impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            particles,
            threads,
            cloud,
        } = self;
        write!(f, "{particles} {cloud:?} {threads} threads")
    }
}

fn cases() -> impl Iterator<Item = Case> {
    let sizes = [1_000, 10_000, 100_000, 1_000_000].into_iter();
    let clouds = |particles| [Cloud::Converged, Cloud::Ambiguous].map(|cloud| (particles, cloud));
    sizes.flat_map(clouds).flat_map(|(particles, cloud)| {
        [1, 2].map(|threads| Case {
            particles,
            threads,
            cloud,
        })
    })
}

fn robot() -> &'static Robot {
    static ROBOT: OnceLock<Robot> = OnceLock::new();
    ROBOT.get_or_init(|| iiwa14(&LoadOptions::default()).unwrap())
}

fn run(bencher: Bencher, case: &Case, stage: Stage) {
    let mut parameters = Parameters {
        method: Method::Paper,
        particles: case.particles,
        ..Parameters::default()
    };
    parameters.paper.rate_hz = 1000.0;
    let stream = Stream::new(robot(), case.cloud, 1);
    let mut filter = Filter::new(robot(), &parameters, 1).unwrap();
    let mut intake = Intake::new(robot().dof());
    let pool = ThreadPoolBuilder::new().num_threads(case.threads).build();
    let pool = pool.unwrap();
    pool.install(|| {
        for sample in &stream.lead {
            filter.update(intake.admit(sample).unwrap());
        }
    });
    let admitted = intake.admit(&stream.measured[0]).unwrap();
    // The way into the pool and back is a part of it: some microseconds.
    bencher.bench_local(|| pool.install(|| filter.run_stage(stage, admitted)));
}

#[divan::bench(args = cases(), max_time = 1)]
fn draws(bencher: Bencher, case: &Case) {
    run(bencher, case, Stage::Draws);
}

#[divan::bench(args = cases(), max_time = 1)]
fn likelihood(bencher: Bencher, case: &Case) {
    run(bencher, case, Stage::Likelihood);
}

#[divan::bench(args = cases(), max_time = 1)]
fn propagate_and_reweight(bencher: Bencher, case: &Case) {
    run(bencher, case, Stage::PropagateAndReweight);
}

#[divan::bench(args = cases(), max_time = 1)]
fn normalise(bencher: Bencher, case: &Case) {
    run(bencher, case, Stage::Normalise);
}

#[divan::bench(args = cases(), max_time = 1)]
fn resample(bencher: Bencher, case: &Case) {
    run(bencher, case, Stage::Resample);
}

#[divan::bench(args = cases(), max_time = 1)]
fn modes(bencher: Bencher, case: &Case) {
    run(bencher, case, Stage::Modes);
}

/// Link 5, and points with the triangles that they were on before they moved by up to a millimetre.
fn moved_points() -> (Surface, Vec<(Vector3<f64>, u32)>) {
    let surface = Surface::new(robot().links[5].mesh.as_ref().unwrap()).unwrap();
    // Multiples of the plastic number's powers.
    let uniform = |index: u32| {
        [0.819_172_5, 0.671_043_6, 0.549_700_5].map(|step| (0.5 + step * f64::from(index)).fract())
    };
    let moved = |index| {
        let place = surface.sample(uniform(index));
        let away = Vector3::from(uniform(index + 1).map(|u| (u - 0.5) * 2e-3));
        (place.point.coords + away, place.triangle)
    };
    let points = (0..1000).map(moved).collect();
    (surface, points)
}

#[divan::bench]
fn a_thousand_projections_warm(bencher: Bencher) {
    let (surface, points) = moved_points();
    bencher.bench_local(|| {
        for (point, start) in &points {
            divan::black_box(surface.land(&point.cast(), *start));
        }
    });
}

#[divan::bench]
fn a_thousand_projections_warm_in_double_precision(bencher: Bencher) {
    let (surface, points) = moved_points();
    bencher.bench_local(|| {
        for (point, start) in &points {
            divan::black_box(surface.closest_point_from(&Point3::from(*point), *start));
        }
    });
}

#[divan::bench]
fn a_thousand_projections_by_tree(bencher: Bencher) {
    let (surface, points) = moved_points();
    bencher.bench_local(|| {
        for (point, _) in &points {
            divan::black_box(surface.land_anew(&point.cast()));
        }
    });
}

#[divan::bench]
fn kinematics(bencher: Bencher) {
    let mut kinematics = Kinematics::new(robot());
    bencher.bench_local(|| kinematics.update(robot(), &JOINTS));
}

#[divan::bench]
fn a_thousand_samples_through_the_detector(bencher: Bencher) {
    let samples = Stream::steady(robot(), 1000.0, 1.2).measured;
    let mut detector = Detector::new(robot(), &DetectorParameters::default()).unwrap();
    bencher.bench_local(|| {
        let mut intake = Intake::new(robot().dof());
        for sample in &samples[..1000] {
            divan::black_box(detector.update(intake.admit(sample).unwrap()));
        }
    });
}

const JOINTS: [f64; 7] = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7];

fn dynamics() -> Dynamics {
    Dynamics::new(robot(), Dynamics::UPRIGHT, None).unwrap()
}

/// The recursive Newton-Euler algorithm for the seven joints, once.
#[divan::bench]
fn inverse_dynamics(bencher: Bencher) {
    let dynamics = dynamics();
    let mut workspace = dynamics.workspace();
    bencher.bench_local(move || {
        let joints = divan::black_box(&JOINTS);
        dynamics.inverse_dynamics(&mut workspace, joints, joints, joints)[0]
    });
}

/// The composite-rigid-body algorithm for them, once.
#[divan::bench]
fn mass_matrix(bencher: Bencher) {
    let dynamics = dynamics();
    let mut workspace = dynamics.workspace();
    bencher.bench_local(move || {
        dynamics.mass_matrix(&mut workspace, divan::black_box(&JOINTS))[(0, 0)]
    });
}

fn main() {
    divan::main();
}
