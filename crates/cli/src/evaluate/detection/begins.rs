//! Where the detector sees the contact of recorded trials begin.

use std::path::Path;

use anyhow::{Context, Result};
use palpate_filter::{ContactChange, Detector, DetectorParameters, Intake};
use palpate_model::Robot;

use crate::evaluate::bags::{self, Recorded};
use crate::evaluate::table::{heads, markdown};

/// A table with a row for each trial below a folder.
pub fn run(robot: &Robot, folder: &Path) -> Result<String> {
    let mut rows = Vec::new();
    for trial in bags::find(folder)? {
        let row = row(robot, &trial).with_context(|| format!("trial {}", trial.name));
        rows.push(row?);
    }
    let columns = heads(&[
        "trial",
        "link",
        "contact from s",
        "noticed after ms",
        "at N",
        "false alarms before",
        "starts in all",
        "first link told",
    ]);
    Ok(format!(
        "## Begin of recorded contacts\n\nThe whole recording is played; times count from its first sample.\n\n{}",
        markdown(&columns, &rows, 1)
    ))
}

fn row(robot: &Robot, trial: &Recorded) -> Result<Vec<String>> {
    let (samples, truth) = bags::load(robot, trial)?;
    let first_ns = samples.first().map_or(0, |sample| sample.stamp_ns);
    let begin_ns = truth.first().map_or(i64::MAX, |known| known.stamp_ns);
    let mut detector = Detector::new(robot, &DetectorParameters::default())?;
    let mut intake = Intake::new(robot.dof());
    let (mut starts, mut first_link) = (Vec::new(), 0);
    for sample in &samples {
        let detection = detector.update(intake.admit(sample)?);
        let event = detection
            .event
            .filter(|event| event.change == ContactChange::Start);
        starts.extend(event.map(|event| event.noticed_ns));
        if let Some(link) = detection.first_link.filter(|_| sample.stamp_ns >= begin_ns) {
            first_link = first_link.max(robot.links[link].path.len());
        }
    }
    let secs = |from_ns: i64, to_ns: i64| (to_ns - from_ns) as f64 * 1e-9;
    let noticed_ns = starts.iter().find(|stamp_ns| **stamp_ns >= begin_ns);
    let before = starts
        .iter()
        .filter(|stamp_ns| **stamp_ns < begin_ns)
        .count();
    let none = || "never".to_owned();
    let force = noticed_ns.and_then(|ns| truth.iter().find(|known| known.stamp_ns >= *ns));
    Ok(vec![
        trial.name.clone(),
        trial.link.to_string(),
        format!("{:.2}", secs(first_ns, begin_ns)),
        noticed_ns.map_or_else(none, |ns| format!("{:.0}", 1e3 * secs(begin_ns, *ns))),
        force.map_or_else(none, |known| format!("{:.1}", known.force)),
        before.to_string(),
        starts.len().to_string(),
        first_link.to_string(),
    ])
}
