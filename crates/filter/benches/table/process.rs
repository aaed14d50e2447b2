//! What a process of its own needs: time from files to the first step, and memory at its peak.

use std::path::Path;
use std::process::Command;
use std::time::Instant;

use palpate_filter::{Filter, Intake, Method, Parameters};
use palpate_model::{JointSample, LoadOptions, Robot};

use crate::paper;

/// Set for the child process: the method's name.
const CHILD: &str = "PALPATE_TABLE_CHILD";

/// What the child told.
pub struct Told {
    pub start_secs: f64,
    /// Largest resident set.
    pub peak_mb: f64,
}

/// Runs this program again as a child that only starts and steps by one method.
pub fn measure(method: &str) -> Told {
    let program = std::env::current_exe().unwrap();
    let output = Command::new(program).env(CHILD, method).output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).unwrap();
    let mut numbers = text
        .split_whitespace()
        .map(|number| number.parse().unwrap());
    Told {
        start_secs: numbers.next().unwrap(),
        peak_mb: numbers.next().unwrap(),
    }
}

/// Whether this is the child process; if so, its work is done.
pub fn is_child() -> bool {
    let Ok(method) = std::env::var(CHILD) else {
        return false;
    };
    let begin = Instant::now();
    let parameters = match method.as_str() {
        "paper" => paper(10_000),
        _ => Parameters {
            method: Method::Palpate,
            ..Parameters::default()
        },
    };
    let urdf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../urdf/iiwa14.urdf");
    let options = LoadOptions::default();
    let (robot, _) = Robot::from_urdf_file(urdf, &[], &[], &options).unwrap();
    let mut filter = Filter::new(&robot, &parameters, 1).unwrap();
    let mut intake = Intake::new(robot.dof());
    let mut start_secs = 0.0;
    for index in 0..500 {
        // Bent by 0.3 rad and swinging a little, pushed from the fifth sample on.
        let swing = 0.3 + 0.02 * f64::from(index) * 0.01;
        let push = if index < 5 { 0.0 } else { 5.0 };
        let sample = JointSample {
            stamp_ns: i64::from(index) * 1_000_000,
            position: vec![swing; robot.dof()],
            external_torque: vec![push; robot.dof()],
        };
        let in_contact = filter
            .update(intake.admit(&sample).unwrap())
            .best()
            .is_some();
        if in_contact && start_secs == 0.0 {
            start_secs = begin.elapsed().as_secs_f64();
        }
    }
    println!("{start_secs} {}", peak_mb());
    true
}

fn peak_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kb = line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
    kb.map_or(f64::NAN, |kb| kb / 1e3)
}
