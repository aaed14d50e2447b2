//! The particles as a contact is found: a picture of one trial for each link and estimator.

use anyhow::Result;
use indicatif::ProgressBar;
use palpate_filter::Filter;
use palpate_model::JointSample;
use palpate_sim::{Trial, Truth};

use super::campaign::{Campaign, in_parallel};
use super::condition;
use super::estimator::Estimator;
use super::experiment::Experiment;
use super::report::Report;
use super::score::Score;
use super::table::{heads, markdown, millimetres};
use super::trial::{Cell, Setup};
use crate::picture::{Instant, Moment, Picture};
use crate::told;

/// Times from the begin of contact at which the particles are shown, s; the last one is the end.
const SHOWN_SECS: [f64; 2] = [0.0, 0.5];

/// Runs the first trial of each link and adds its pictures to the report.
pub fn run(
    campaign: &Campaign,
    experiment: &Experiment,
    links: &[usize],
    estimators: &[Estimator],
    bar: &ProgressBar,
    report: &mut Report,
) -> Result<String> {
    let condition = experiment.conditions.first().copied().unwrap_or_default();
    let cells: Vec<_> = (links.iter())
        .flat_map(|&link| {
            estimators.iter().map(move |&estimator| Cell {
                condition,
                estimator,
                link,
            })
        })
        .collect();
    let watched = in_parallel(campaign.threads(), cells.len(), |index| {
        let watched = watch(&campaign.setup, &cells[index]);
        bar.inc(1);
        watched
    })?;
    let mut rows = Vec::new();
    let mut pictures = Vec::new();
    for (cell, watched) in cells.iter().zip(watched) {
        let error = match watched {
            Ok((score, picture)) => {
                let name = format!("progress_link{}_{}", cell.link, cell.estimator.name());
                pictures.extend(picture.map(|svg| (name, svg)));
                millimetres(score.error)
            }
            Err(reason) => reason,
        };
        rows.push(vec![
            cell.link.to_string(),
            cell.estimator.title().to_owned(),
            error,
        ]);
    }
    let table = markdown(&heads(&["link", "method", "error mm"]), &rows, 2);
    let text = format!(
        "## {}: {}\n\nThe first trial of each link.\n\n{table}",
        experiment.name, experiment.title
    );
    report.add(text.clone());
    for (name, svg) in pictures {
        report.plot(&name, &svg)?;
    }
    Ok(text)
}

/// Score and picture of a trial, or why there is none.
type Watched = Result<(Score, Option<String>), String>;

fn watch(setup: &Setup, cell: &Cell) -> Result<Watched> {
    let Some(condition) = condition::named(cell.condition) else {
        anyhow::bail!("there is no condition {}", cell.condition);
    };
    let trial = match setup.play(condition, cell.link, 0)? {
        Ok(trial) => trial,
        Err(reason) => return Ok(Err(reason)),
    };
    let mut album = Album::new(setup, &trial);
    let see = |_: &JointSample, filter: &Filter| album.see(filter);
    let score = setup.estimate(condition, cell, 0, &trial, see)?;
    Ok(score
        .map(|score| {
            let picture = album.picture(cell, condition.title, &score);
            (score, picture)
        })
        .ok_or_else(|| "no contact".to_owned()))
}

/// What is kept of a trial for its picture.
struct Album<'a> {
    setup: &'a Setup,
    trial: &'a Trial,
    /// Samples taken in.
    seen: usize,
    moments: Vec<Moment>,
    /// From the begin of contact on.
    history: Vec<Instant>,
}

impl<'a> Album<'a> {
    fn new(setup: &'a Setup, trial: &'a Trial) -> Self {
        Self {
            setup,
            trial,
            seen: 0,
            moments: Vec::new(),
            history: Vec::new(),
        }
    }

    fn see(&mut self, filter: &Filter) {
        let Some(truth) = self.trial.truth.get(self.seen) else {
            return;
        };
        self.seen += 1;
        let touches = |truth: &&Truth| truth.contact.is_some();
        let Some(first) = self.trial.truth[..self.seen].iter().find(touches) else {
            return;
        };
        let secs = (truth.stamp_ns - first.stamp_ns) as f64 * 1e-9;
        self.history.push(Instant {
            secs,
            ..told::instant(filter, truth)
        });
        let is_last = self.seen == self.trial.truth.len();
        let due = SHOWN_SECS.get(self.moments.len());
        let is_due = due.is_some_and(|due| secs >= *due) && !filter.particles().is_empty();
        if is_due || is_last {
            let moment = told::moment(&self.setup.robot, filter, truth, secs);
            self.moments.push(moment);
        }
    }

    fn picture(&self, cell: &Cell, condition: &str, score: &Score) -> Option<String> {
        let robot = &self.setup.robot;
        let link = &robot.links[self.trial.link].name;
        Picture {
            title: format!("{link} is touched; method: {}", cell.estimator.title()),
            subtitle: format!(
                "{condition}. Last second: {} mm from the truth.",
                millimetres(score.error)
            ),
            robot,
            touched: self.trial.link,
            obstacle: &self.trial.obstacle,
            moments: &self.moments,
            history: &self.history,
        }
        .draw()
    }
}
