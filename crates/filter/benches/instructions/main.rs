//! Some steps on one thread, for `tests/instructions.sh` to count: it collects what happens within [`counted`] only.

#![allow(clippy::unwrap_used, missing_docs)]

#[path = "../table/stream.rs"]
mod stream;

use palpate_filter::{Filter, Intake, Method, Parameters};
use palpate_model::{JointSample, LoadOptions, iiwa14};
use rayon::ThreadPoolBuilder;

use stream::{Cloud, Stream};

/// Steps counted in each case.
const STEPS: usize = 40;

fn update(filter: &mut Filter, intake: &mut Intake, samples: &[JointSample]) {
    for sample in samples {
        filter.update(intake.admit(sample).unwrap());
    }
}

#[inline(never)]
fn counted(filter: &mut Filter, intake: &mut Intake, samples: &[JointSample]) {
    update(filter, intake, samples);
}

fn main() {
    let robot = iiwa14(&LoadOptions::default()).unwrap();
    let mut parameters = Parameters::default();
    parameters.paper.rate_hz = 1000.0;
    let stream = match std::env::args().nth(1).as_deref() {
        Some("paper-converged") => {
            parameters.method = Method::Paper;
            Stream::new(&robot, Cloud::Converged, STEPS)
        }
        Some("paper-ambiguous") => {
            parameters.method = Method::Paper;
            Stream::new(&robot, Cloud::Ambiguous, STEPS)
        }
        // Ten times as many: a keyframe's work is spread over many samples.
        Some("palpate") => Stream::steady(&robot, 1000.0, 0.01 * STEPS as f64),
        // As `cargo bench` runs it.
        _ => {
            println!("run tests/instructions.sh");
            return;
        }
    };
    let mut filter = Filter::new(&robot, &parameters, 1).unwrap();
    let mut intake = Intake::new(robot.dof());
    // On this very thread, as only its instructions are counted.
    let one = ThreadPoolBuilder::new().num_threads(1).use_current_thread();
    one.build().unwrap().install(|| {
        update(&mut filter, &mut intake, &stream.lead);
        counted(&mut filter, &mut intake, &stream.measured);
    });
    println!("{}", stream.measured.len());
}
