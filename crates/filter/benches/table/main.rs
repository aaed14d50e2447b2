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
    const NEVER: Self = Self {
        median: f64::INFINITY,
        p99: f64::INFINITY,
    };

    /// The ones with the smaller median.
    fn quieter(self, other: Self) -> Self {
        match other.median < self.median {
            true => other,
            false => self,
        }
    }

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

/// Times of the whole step of one kind of cloud: of the plain version, and with one thread and with two.
struct Cell {
    cloud: Cloud,
    particles: usize,
    /// Most steps that are measured at a time.
    most: usize,
    /// What is to be reached with one thread and with two.
    reach: [&'static str; 2],
    plain: Times,
    fast: [Times; 2],
}

impl Cell {
    fn all() -> Vec<Self> {
        let sizes = [
            (1_000, 500, ["", ""]),
            (10_000, 500, ["0.5", "0.3 · 0.8"]),
            (100_000, 100, ["", "4"]),
            (1_000_000, 20, ["", ""]),
        ];
        let clouds = [Cloud::Converged, Cloud::Ambiguous];
        let of_cloud = |cloud| {
            sizes.map(|(particles, most, reach)| Self {
                cloud,
                particles,
                most,
                reach,
                plain: Times::NEVER,
                fast: [Times::NEVER; 2],
            })
        };
        clouds.into_iter().flat_map(of_cloud).collect()
    }

    /// Measures once more, the plain version where that does not take minutes, and keeps what was quieter.
    fn measure(&mut self, robot: &Robot, round: usize) {
        let plain_rounds = match self.particles {
            ..100_000 => ROUNDS,
            100_000..1_000_000 => 2,
            _ => 0,
        };
        if round < plain_rounds {
            let stream = Stream::new(robot, self.cloud, self.most / 10);
            let times = plain_steps(robot, self.particles, &stream);
            self.plain = self.plain.quieter(times);
        }
        let stream = Stream::new(robot, self.cloud, self.most);
        for (threads, fast) in (1..).zip(&mut self.fast) {
            let times = steps(robot, &paper(self.particles), &stream, threads);
            *fast = fast.quieter(times);
        }
    }

    fn lines(&self) {
        for (threads, (times, reach)) in (1..).zip(self.fast.iter().zip(self.reach)) {
            let ratio = match self.plain.median.is_finite() {
                true => format!("{:.0} × plain", self.plain.median / times.median),
                false => String::new(),
            };
            let what = format!(
                "{} particles, {:?}, {threads} threads",
                self.particles, self.cloud
            );
            line(&what, reach, &told(*times), &ratio);
        }
    }
}

/// So often all is measured, in turns: what else a machine does slows it for seconds and minutes.
const ROUNDS: usize = 6;

fn step_lines(robot: &Robot) {
    let mut cells = Cell::all();
    for round in 0..ROUNDS {
        for cell in &mut cells {
            cell.measure(robot, round);
        }
    }
    for sizes in cells.chunk_by(|one, other| one.cloud == other.cloud) {
        sizes.iter().for_each(Cell::lines);
        let median = |particles: usize, threads: usize| {
            let cell = sizes.iter().find(|cell| cell.particles == particles);
            cell.unwrap().fast[threads - 1].median
        };
        for threads in [1, 2] {
            let growth = median(1_000_000, threads) / median(10_000, threads) / 100.0;
            let cloud = sizes[0].cloud;
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
    let what = format!("whole step, quietest of {ROUNDS} rounds: median · p99, ms");
    line(&what, "", "", "");
    step_lines(&robot);
}
