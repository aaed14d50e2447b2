//! `palpate evaluate detection`: how surely and how soon pushes are noticed, and how often something else is.

mod begins;
mod bound;
mod free;
mod plot;
mod pushes;
mod roc;
mod situation;
mod watch;

use std::time::Instant;

use anyhow::Result;
use palpate_filter::DetectorParameters;
use palpate_model::Robot;

use super::Evaluate;
use super::campaign::threads;
use super::machine;
use super::report::{Report, wall_time};
use crate::{Usage, progress, table as terminal};

/// Rates of the samples that everything is tried at, Hz.
const RATES: [f64; 2] = [1000.0, 100.0];

/// How everything is made.
struct Plan<'a> {
    robot: &'a Robot,
    seed: u64,
    threads: usize,
    /// Pushes for each link, force and situation.
    pushes: usize,
    /// Length of each motion without contact, s.
    free_secs: f64,
    /// Numbers of the links to push.
    links: Vec<usize>,
}

/// Runs it all; with `--bags` also the recorded trials.
pub fn run(evaluate: &Evaluate) -> Result<()> {
    if evaluate.experiments.len() > 1 {
        let told = "detection: give no other experiment beside it";
        return Err(Usage(told.to_owned()).into());
    }
    let start = Instant::now();
    let robot = evaluate.load_robot()?;
    let plan = Plan {
        robot: &robot,
        seed: evaluate.seed,
        threads: threads(evaluate.threads),
        pushes: evaluate.trials as usize,
        free_secs: evaluate.free_secs,
        links: evaluate.link_numbers(&robot)?,
    };
    let mut report = Report::new(evaluate.out.clone())?;
    let work = free::count(&plan) + pushes::count(&plan) + bound::count(&plan) + roc::count(&plan);
    let bar = progress::bar(work, "evaluate", evaluate.quiet);
    let add = |report: &mut Report, text: String| -> Result<()> {
        bar.suspend(|| terminal::print(&text))?;
        report.add(text);
        Ok(())
    };
    let (text, csv) = free::run(&plan, &bar)?;
    add(&mut report, text)?;
    report.file("free.csv", &csv)?;
    let pushed = pushes::run(&plan, &bar)?;
    add(&mut report, pushed.table(&plan))?;
    add(&mut report, bound::run(&plan, &pushed, &bar)?)?;
    report.file("pushes.csv", &pushed.csv())?;
    report.plot("detection", &plot::of_pushes(&plan, &pushed))?;
    let curves = roc::run(&plan, &bar)?;
    add(&mut report, roc::table(&plan, &curves))?;
    report.plot("roc", &plot::of_curves(&curves))?;
    if let Some(folder) = &evaluate.bags {
        add(&mut report, begins::run(&robot, folder)?)?;
    }
    bar.finish_and_clear();
    let mut facts = machine::facts();
    facts.extend([
        ("robot", robot.name.clone()),
        ("seed", plan.seed.to_string()),
        ("wall time", wall_time(start.elapsed(), plan.threads)),
    ]);
    let parameters = serde_yaml_ng::to_string(&DetectorParameters::default())?;
    let parameters = format!("## Parameters of the detector\n\n```yaml\n{parameters}```\n");
    let situations = format!("## Situations\n\n{}\n", situation::told());
    report.write_text(&facts, &[situations, parameters])?;
    report.tell()
}
