//! Motion without contact: how often a contact is told all the same.

use anyhow::Result;
use indicatif::ProgressBar;
use palpate_filter::DetectorParameters;

use super::situation::{SITUATIONS, Situation, Source};
use super::watch::{Lane, Watched, watch};
use super::{Plan, RATES};
use crate::evaluate::campaign::in_parallel;
use crate::evaluate::seed::mixed;
use crate::evaluate::table::{heads, markdown};

/// The time is divided among so many motions, each from the start on.
const RUNS: usize = 6;

/// How many runs there are.
pub fn count(_: &Plan) -> usize {
    RATES.len() * SITUATIONS.len() * RUNS
}

/// All situations at all rates: a table, and the same as CSV.
pub fn run(plan: &Plan, bar: &ProgressBar) -> Result<(String, String)> {
    let work: Vec<_> = (RATES.into_iter())
        .flat_map(|rate| SITUATIONS.iter().map(move |situation| (rate, situation)))
        .flat_map(|(rate, situation)| (0..RUNS).map(move |run| (rate, situation, run)))
        .collect();
    let watched = in_parallel(plan.threads, work.len(), |index| {
        let (rate_hz, situation, run) = work[index];
        let watched = run_one(plan, rate_hz, situation, run)?;
        bar.inc(1);
        Ok(watched)
    })?;
    let mut rows = Vec::new();
    let mut csv = String::from("rate_hz,situation,source,secs,false_alarms,contact_secs\n");
    for (work, watched) in work.chunks(RUNS).zip(watched.chunks(RUNS)) {
        let (rate_hz, situation, _) = work[0];
        for (lane, source) in Source::ALL.iter().enumerate() {
            let of = |value: fn(&Watched) -> f64| -> f64 {
                watched.iter().map(|lanes| value(&lanes[lane])).sum()
            };
            let (secs, contact_secs) = (of(|w| w.secs), of(|w| w.contact_secs));
            let alarms = of(|w| w.starts.len() as f64);
            rows.push(vec![
                situation.name.to_owned(),
                source.name().to_owned(),
                format!("{rate_hz:.0}"),
                format!("{alarms:.0}"),
                format!("{:.1}", alarms / secs * 3600.0),
                format!("{:.2}", 100.0 * contact_secs / secs),
            ]);
            let (situation, source) = (situation.name.replace(',', ";"), source.name());
            csv += &format!("{rate_hz},{situation},{source},{secs},{alarms},{contact_secs}\n");
        }
    }
    let columns = heads(&[
        "situation",
        "external torque from",
        "rate Hz",
        "false alarms",
        "an hour",
        "in contact %",
    ]);
    let text = format!(
        "## False alarms\n\n{:.0} s without contact for each row, in {RUNS} motions.\n\n{}",
        plan.free_secs,
        markdown(&columns, &rows, 2)
    );
    Ok((text, csv))
}

fn run_one(plan: &Plan, rate_hz: f64, situation: &Situation, run: usize) -> Result<Vec<Watched>> {
    let place = SITUATIONS.iter().position(|other| other == situation);
    let seed = mixed(&[plan.seed, place.unwrap_or(0) as u64, run as u64]);
    let secs = plan.free_secs / RUNS as f64;
    let scenario = situation.scenario(plan.robot, seed, rate_hz, secs);
    let lanes = Source::ALL.map(|source| Lane {
        source,
        detector: DetectorParameters::default(),
    });
    watch(plan.robot, situation, &scenario, &lanes)
}
