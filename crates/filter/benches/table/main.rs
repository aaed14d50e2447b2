//! Prints what the whole step costs beside what it should, and the ratio to a plain version in the same run:
//! `cargo bench -p palpate-filter --bench table`. Takes some minutes; wants a quiet machine.

#![allow(clippy::unwrap_used, missing_docs)]

mod plain;
mod process;
mod stream;

use std::time::Instant;

use palpate_filter::{Filter, Intake, Method, Parameters};
use palpate_model::{JointSample, LoadOptions, Robot, iiwa14};
use rayon::{ThreadPool, ThreadPoolBuilder};

use plain::Plain;
use stream::{Cloud, Stream};

/// Median and 99th percentile of the time of a step, ms.
#[derive(Clone, Copy)]
struct Times {
    median: f64,
    p99: f64,
}

impl Times {
    /// Of `update`, for each sample after the stream's lead.
    fn of(stream: &Stream, mut update: impl FnMut(&JointSample)) -> Self {
        stream.lead.iter().for_each(&mut update);
        let time = |sample| {
            let begin = Instant::now();
            update(sample);
            begin.elapsed().as_secs_f64() * 1e3
        };
        let mut times: Vec<f64> = stream.measured.iter().map(time).collect();
        times.sort_by(f64::total_cmp);
        let at = |share: f64| times[((times.len() - 1) as f64 * share).round() as usize];
        Self {
            median: at(0.5),
            p99: at(0.99),
        }
    }
}

fn pool(threads: usize) -> ThreadPool {
    let builder = ThreadPoolBuilder::new().num_threads(threads);
    builder.build().unwrap()
}

/// Parameters of the paper's method with a step for every sample.
fn paper(particles: usize) -> Parameters {
    let mut parameters = Parameters {
        method: Method::Paper,
        particles,
        ..Parameters::default()
    };
    parameters.paper.rate_hz = 1000.0;
    parameters
}

fn steps(robot: &Robot, parameters: &Parameters, stream: &Stream, threads: usize) -> Times {
    let mut filter = Filter::new(robot, parameters, 1).unwrap();
    let mut intake = Intake::new(robot.dof());
    let update = |sample: &JointSample| {
        filter.update(intake.admit(sample).unwrap());
    };
    pool(threads).install(|| Times::of(stream, update))
}

fn plain_steps(robot: &Robot, particles: usize, stream: &Stream) -> Times {
    let mut plain = Plain::new(robot, paper(particles).paper, particles);
    Times::of(stream, |sample| {
        std::hint::black_box(plain.update(sample));
    })
}

fn line(what: &str, reach: &str, reached: &str, ratio: &str) {
    println!("| {what:<56} | {reach:>16} | {reached:>20} | {ratio:>16} |");
}

fn step_lines(robot: &Robot) {
    // Particles, most steps measured, and what is to be reached with one thread and with two.
    let sizes = [
        (1_000, 500, "", ""),
        (10_000, 500, "0.5", "0.3 · 0.8"),
        (100_000, 100, "", "4"),
        (1_000_000, 20, "", ""),
    ];
    for cloud in [Cloud::Converged, Cloud::Ambiguous] {
        let mut reached = Vec::new();
        for (particles, most, one, two) in sizes {
            let stream = Stream::new(robot, cloud, most);
            // The plain version would take minutes.
            let plain = (particles < 1_000_000)
                .then(|| plain_steps(robot, particles, &Stream::new(robot, cloud, most / 10)));
            for (threads, reach) in [(1, one), (2, two)] {
                let times = steps(robot, &paper(particles), &stream, threads);
                let ratio = plain.map_or_else(String::new, |plain| {
                    format!("{:.0} × plain", plain.median / times.median)
                });
                let what = format!("{particles} particles, {cloud:?}, {threads} threads");
                line(&what, reach, &told(times), &ratio);
                reached.push(times.median);
            }
        }
        for (threads, offset) in [(1, 0), (2, 1)] {
            let growth = reached[6 + offset] / reached[2 + offset] / 100.0;
            let what = format!("growth 10k to 1M against linear, {cloud:?}, {threads} threads");
            line(&what, "1.3", &format!("{growth:.2}"), "");
        }
    }
}

fn told(times: Times) -> String {
    format!("{:.3} · {:.3}", times.median, times.p99)
}

fn palpate_lines(robot: &Robot) {
    for rate_hz in [1000.0, 100.0] {
        let stream = Stream::steady(robot, rate_hz, 4.0);
        for threads in [1, 2] {
            let times = steps(robot, &Parameters::default(), &stream, threads);
            let what = format!("palpate, every sample of {rate_hz} Hz, {threads} threads");
            line(&what, "", &told(times), "");
        }
    }
}

/// How many times faster than they came samples of 10 s at 100 Hz are replayed.
fn replay_lines(robot: &Robot) {
    let stream = Stream::steady(robot, 100.0, 10.0);
    let samples = [stream.lead, stream.measured].concat();
    let by = |method, rate_hz| {
        let mut parameters = Parameters {
            method,
            ..Parameters::default()
        };
        parameters.paper.rate_hz = rate_hz;
        parameters
    };
    let cases = [
        (
            "paper at 10,000, 10 steps a second",
            "30",
            by(Method::Paper, 10.0),
        ),
        (
            "paper at 10,000, every sample",
            "30",
            by(Method::Paper, 1000.0),
        ),
        ("palpate", "", by(Method::Palpate, 10.0)),
    ];
    for (name, reach, parameters) in cases {
        for threads in [1, 2] {
            let mut filter = Filter::new(robot, &parameters, 1).unwrap();
            let mut intake = Intake::new(robot.dof());
            let begin = Instant::now();
            pool(threads).install(|| {
                for sample in &samples {
                    filter.update(intake.admit(sample).unwrap());
                }
            });
            let speed = 10.0 / begin.elapsed().as_secs_f64();
            let what = format!("replay of 10 s at 100 Hz, {name}, {threads} threads");
            line(&what, reach, &format!("{speed:.0} × real time"), "");
        }
    }
}

fn main() {
    if process::is_child() {
        return;
    }
    let robot = iiwa14(&LoadOptions::default()).unwrap();
    line("what", "reach", "reached", "ratio");
    line(
        &"-".repeat(56),
        &"-".repeat(16),
        &"-".repeat(20),
        &"-".repeat(16),
    );
    for method in ["paper", "palpate"] {
        let told = process::measure(method);
        let what = format!("{method}: URDF and meshes to first step, s");
        line(&what, "0.5", &format!("{:.3}", told.start_secs), "");
        line(
            &format!("{method}: peak memory, MB"),
            "100",
            &format!("{:.0}", told.peak_mb),
            "",
        );
    }
    replay_lines(&robot);
    palpate_lines(&robot);
    line("whole step: median · 99th percentile, ms", "", "", "");
    step_lines(&robot);
}
