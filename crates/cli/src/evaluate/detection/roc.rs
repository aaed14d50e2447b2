//! Receiver operating curves: pushes noticed against false alarms, for stricter and looser detectors.

use anyhow::Result;
use indicatif::ProgressBar;
use palpate_filter::DetectorParameters;
use palpate_sim::Push;

use super::Plan;
use super::situation::{SITUATIONS, Situation, Source};
use super::watch::{Lane, watch};
use crate::evaluate::campaign::in_parallel;
use crate::evaluate::seed::{mixed, share};
use crate::evaluate::table::{heads, markdown};

/// Stated rates of false alarms, 1/h.
const STATED: [f64; 6] = [1e-5, 1e-2, 0.1, 1.0, 30.0, 1000.0];
const NAMES: [&str; 3] = ["slow", "fast", "fast, payload 10 % wrong"];
/// A push on a link that so many joints move, N; every so many s.
const LINK: usize = 5;
const FORCE: f64 = 1.5;
const EVERY_SECS: f64 = 3.0;
const RATE_HZ: f64 = 1000.0;
/// The pushes are divided among so many runs.
const RUNS: usize = 2;

/// One point of a curve.
pub struct Point {
    /// False alarms an hour, measured outside of pushes.
    pub alarms: f64,
    /// Share of the pushes that were noticed.
    pub found: f64,
}

/// A situation's curve for one source.
pub struct Curve {
    pub situation: &'static str,
    pub source: Source,
    pub points: Vec<Point>,
}

/// How many runs there are.
pub fn count(_: &Plan) -> usize {
    NAMES.len() * RUNS
}

/// The curves of all situations and sources.
pub fn run(plan: &Plan, bar: &ProgressBar) -> Result<Vec<Curve>> {
    let situations: Vec<_> = SITUATIONS
        .iter()
        .filter(|situation| NAMES.contains(&situation.name))
        .collect();
    let runs = in_parallel(plan.threads, situations.len() * RUNS, |index| {
        let seed = mixed(&[plan.seed, 200 + (index % RUNS) as u64]);
        let sums = run_one(plan, situations[index / RUNS], seed)?;
        bar.inc(1);
        Ok(sums)
    })?;
    let mut curves = Vec::new();
    for (situation, runs) in situations.iter().zip(runs.chunks(RUNS)) {
        for (place, source) in Source::ALL.into_iter().enumerate() {
            let point = |index: usize| {
                let lane = place * STATED.len() + index;
                let of = |part: usize| runs.iter().map(|sums| sums[lane][part]).sum::<f64>();
                Point {
                    alarms: of(0) / of(2) * 3600.0,
                    found: of(1) / of(3).max(1.0),
                }
            };
            curves.push(Curve {
                situation: situation.name,
                source,
                points: (0..STATED.len()).map(point).collect(),
            });
        }
    }
    Ok(curves)
}

/// For each lane: false alarms, pushes noticed, time without push, pushes.
fn run_one(plan: &Plan, situation: &Situation, seed: u64) -> Result<Vec<[f64; 4]>> {
    let robot = plan.robot;
    let is_it = |other: &&palpate_model::Link| {
        other.path.len() == LINK.min(robot.dof()) && other.mesh.is_some()
    };
    let name = robot.links.iter().find(is_it).map_or("", |link| &link.name);
    let push = |number: usize| {
        let jitter = share(&[seed, number as u64]);
        Push::new(name, FORCE, 4.0 + EVERY_SECS * number as f64 + jitter)
    };
    let pushes = plan.pushes;
    let secs = 4.0 + EVERY_SECS * pushes as f64;
    let mut scenario = situation.scenario(robot, seed, RATE_HZ, secs);
    scenario.pushes = (0..pushes).map(push).collect();
    let lanes: Vec<_> = (Source::ALL.into_iter())
        .flat_map(|source| STATED.map(|stated| lane(source, stated)))
        .collect();
    let watched = watch(robot, situation, &scenario, &lanes)?;
    let pushed = |secs: f64| {
        let mut pushes = scenario.pushes.iter();
        // What begins within a push's end may be the end.
        pushes.position(|push| (0.0..push.duration_secs + 0.1).contains(&(secs - push.start_secs)))
    };
    let sums = watched.iter().map(|watched| {
        let mut found = vec![false; pushes];
        let mut alarms = 0.0;
        for start in &watched.starts {
            match pushed(start.noticed_secs) {
                Some(number) => found[number] = true,
                None => alarms += 1.0,
            }
        }
        let free_secs = watched.secs - 0.6 * pushes as f64;
        let found = found.iter().filter(|found| **found).count();
        [alarms, found as f64, free_secs, pushes as f64]
    });
    Ok(sums.collect())
}

fn lane(source: Source, stated: f64) -> Lane {
    Lane {
        source,
        detector: DetectorParameters {
            false_alarms_per_hour: stated,
            // Noise alone decides.
            least_torque: 0.01,
            ..DetectorParameters::default()
        },
    }
}

/// The curves as a table.
pub fn table(plan: &Plan, curves: &[Curve]) -> String {
    let mut columns = heads(&["situation", "external torque from"]);
    columns.extend(STATED.iter().map(|stated| format!("{stated}/h")));
    let told = |point: &Point| format!("{:.0} % / {:.0}", 100.0 * point.found, point.alarms);
    let row = |curve: &Curve| {
        let mut row = vec![curve.situation.to_owned(), curve.source.name().to_owned()];
        row.extend(curve.points.iter().map(told));
        row
    };
    let rows: Vec<_> = curves.iter().map(row).collect();
    format!(
        "## Receiver operating curves\n\nPushes of {FORCE} N on link {LINK} that are noticed / false alarms an hour, for rates of \
         false alarms as stated to the detector ({} pushes a cell, {RATE_HZ:.0} Hz, no least torque).\n\n{}",
        plan.pushes * RUNS,
        markdown(&columns, &rows, 2)
    )
}
