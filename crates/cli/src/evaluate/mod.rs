//! `palpate evaluate`: how good the estimates are, on simulated contacts and on recorded ones.

mod bags;
mod campaign;
mod condition;
mod csv;
mod detection;
mod estimator;
mod experiment;
mod machine;
mod particles;
mod plot;
mod region;
mod report;
mod score;
mod seed;
mod summary;
mod table;
mod targets;
mod trial;

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result};
use clap::Args;
use palpate_filter::RobotSettings;
use palpate_model::{Robot, iiwa14};

use crate::robot_args::RobotArgs;
use crate::{Usage, progress, table as terminal};

use campaign::Campaign;
use estimator::Estimator;
use experiment::{EXPERIMENTS, Experiment, View};
use report::Report;
use trial::{Cell, Setup, TrueRobots};

/// Measure how good the estimates are, on simulated contacts or on recorded ones
///
/// Without EXPERIMENT every experiment of --list is run; `targets` alone prints the table of measured values beside those
/// to reach, and `bags` scores a folder of recorded trials, and `detection` tells how surely and soon contacts are noticed. Trials last 10 s at 100 Hz, after 2 s without contact.
/// Errors are position errors, the median over the last second. No trial runs twice, though several experiments use it;
/// scenes and motions follow from seed, link and number of the trial, so that all conditions and methods are tried on the
/// same ones. Results do not depend on the number of threads.
#[derive(Args)]
pub struct Evaluate {
    /// What to measure: names from --list, `bags` or `detection`
    #[arg(value_name = "EXPERIMENT")]
    experiments: Vec<String>,
    /// List the experiments and their conditions
    #[arg(long)]
    list: bool,
    /// Trials for each condition, method and link
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    trials: u32,
    /// Seed of everything
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Numbers of the links to touch: how many joints move them [default: all]
    #[arg(long, value_name = "N,…", value_delimiter = ',')]
    links: Vec<usize>,
    /// The methods to measure: curvature, link, world (the paper's, by motion model), palpate [default: the experiment's]
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    methods: Vec<String>,
    /// Number of the paper's particles and of palpate's hypotheses [default: the parameters' defaults, 10000 and 400]
    #[arg(long, value_name = "N")]
    particles: Option<usize>,
    /// Length of a simulated trial, s
    #[arg(long, value_name = "SECS", default_value_t = 10.0)]
    secs: f64,
    /// Number of trials at the same time; 0 for one a core
    #[arg(long, value_name = "N", default_value_t = 0)]
    threads: usize,
    /// Folder for report.md, CSV and plots; made if it is not there, earlier results in it are replaced [default: none]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// For `detection`: length of each motion without contact, s
    #[arg(long, value_name = "SECS", default_value_t = 3600.0)]
    free_secs: f64,
    /// For `bags`, and if it is given for `detection`: folder of trials, each with truth.csv beside bag/, at any depth
    #[arg(long, value_name = "DIR")]
    bags: Option<PathBuf>,
    /// The robot [default: the iiwa that ships]
    #[command(flatten)]
    robot: RobotArgs,
    /// Print no progress
    #[arg(short, long)]
    quiet: bool,
}

impl Evaluate {
    /// Runs the command.
    pub fn run(&self) -> Result<()> {
        if self.list {
            return Ok(terminal::print(&list())?);
        }
        if self.experiments.iter().any(|name| name == "bags") {
            return bags::run(self);
        }
        if self.experiments.iter().any(|name| name == "detection") {
            return detection::run(self);
        }
        let experiments = self.chosen()?;
        let setup = Setup {
            robot: self.load_robot()?,
            seed: self.seed,
            trials: self.trials as usize,
            secs: self.secs,
            particles: self.particles,
            true_robots: TrueRobots::default(),
        };
        let links = self.link_numbers(&setup.robot)?;
        let mut campaign = Campaign::new(setup, self.threads);
        let mut report = Report::new(self.out.clone())?;
        let start = Instant::now();
        let bar = progress::bar(
            self.total(&campaign, &experiments, &links)?,
            "evaluate",
            self.quiet,
        );
        for experiment in experiments {
            let estimators = self.estimators(experiment)?;
            if experiment.view == View::Progress {
                let text = particles::run(
                    &campaign,
                    experiment,
                    &links,
                    &estimators,
                    &bar,
                    &mut report,
                )?;
                bar.suspend(|| terminal::print(&text))?;
                continue;
            }
            campaign.run(&cells(experiment, &estimators, &links), &bar)?;
            let text = told(&campaign, experiment, &links, &estimators);
            bar.suspend(|| terminal::print(&text))?;
            report.add(text);
            for (name, svg) in plot::of_experiment(&campaign, experiment, &links, &estimators) {
                report.plot(&name, &svg)?;
            }
            report.write_simulated(&campaign, start.elapsed())?;
        }
        report.write_simulated(&campaign, start.elapsed())?;
        bar.finish_and_clear();
        report.tell()
    }

    /// The experiments named; all of them if none is.
    fn chosen(&self) -> Result<Vec<&'static Experiment>> {
        if self.experiments.is_empty() {
            return Ok(EXPERIMENTS.iter().collect());
        }
        let named = |name: &String| {
            let known = EXPERIMENTS
                .iter()
                .find(|experiment| experiment.name == name);
            known.ok_or_else(|| {
                let names: Vec<_> = EXPERIMENTS.iter().map(|e| e.name).collect();
                Usage(format!(
                    "there is no experiment {name}; there are {}, bags and detection",
                    names.join(", ")
                ))
            })
        };
        Ok(self
            .experiments
            .iter()
            .map(named)
            .collect::<Result<_, _>>()?)
    }

    /// The estimators asked for, else the experiment's own.
    fn estimators(&self, experiment: &Experiment) -> Result<Vec<Estimator>> {
        match self.methods.is_empty() || experiment.view == View::Targets {
            true => Ok(experiment.estimators.to_vec()),
            false => self.asked_estimators(),
        }
    }

    fn asked_estimators(&self) -> Result<Vec<Estimator>> {
        let named = |name: &String| {
            let known = (Estimator::ALL.into_iter()).find(|estimator| estimator.name() == name);
            known.ok_or_else(|| {
                let names = Estimator::ALL.map(Estimator::name).join(", ");
                Usage(format!("--methods {name}: expected some of {names}"))
            })
        };
        Ok(self.methods.iter().map(named).collect::<Result<_, _>>()?)
    }

    fn load_robot(&self) -> Result<Robot> {
        let settings = RobotSettings::default();
        let options = settings.load_options();
        match self.robot.urdf {
            None => Ok(iiwa14(&options)?),
            Some(_) => Ok(self.robot.load(&settings, &options)?.0),
        }
    }

    /// Numbers of the links to touch, all of which exist.
    fn link_numbers(&self, robot: &Robot) -> Result<Vec<usize>> {
        let has_mesh = |number: &usize| {
            let mut links = robot.links.iter();
            links.any(|link| link.path.len() == *number && link.mesh.is_some())
        };
        let all: Vec<_> = (1..=robot.dof()).filter(has_mesh).collect();
        if self.links.is_empty() {
            return Ok(all);
        }
        if let Some(wrong) = self.links.iter().find(|number| !all.contains(number)) {
            return Err(Usage(format!("--links {wrong}: expected some of {all:?}")).into());
        }
        Ok(all.into_iter().filter(|n| self.links.contains(n)).collect())
    }

    /// The links whose particles are shown: those asked for, else the third as in the paper.
    fn shown(&self, links: &[usize]) -> Vec<usize> {
        let is_shown = |link: &&usize| !self.links.is_empty() || **link == 3;
        links.iter().filter(is_shown).copied().collect()
    }

    /// How many trials there are to run.
    fn total(
        &self,
        campaign: &Campaign,
        experiments: &[&Experiment],
        links: &[usize],
    ) -> Result<usize> {
        let (mut all, mut watched) = (Vec::new(), 0);
        for experiment in experiments {
            let estimators = self.estimators(experiment)?;
            match experiment.view {
                View::Progress => watched += estimators.len() * self.shown(links).len(),
                _ => all.extend(cells(experiment, &estimators, links)),
            }
        }
        Ok(campaign.missing(&all).len() + watched)
    }
}

/// The cells of an experiment.
fn cells(experiment: &Experiment, estimators: &[Estimator], links: &[usize]) -> Vec<Cell> {
    let mut cells = Vec::new();
    for &condition in experiment.conditions {
        for &estimator in estimators {
            cells.extend(links.iter().map(|&link| Cell {
                condition,
                estimator,
                link,
            }));
        }
    }
    cells
}

/// An experiment's section of the report.
fn told(
    campaign: &Campaign,
    experiment: &Experiment,
    links: &[usize],
    estimators: &[Estimator],
) -> String {
    let table = match experiment.view {
        View::Targets => targets::table(&targets::SIMULATED, targets::simulated(campaign, links)),
        _ => table::of_experiment(campaign, experiment, links, estimators),
    };
    format!("## {}: {}\n\n{table}", experiment.name, experiment.title)
}

/// Every experiment and condition, in words.
fn list() -> String {
    let mut text = String::from("Experiments:\n");
    for Experiment {
        name,
        title,
        conditions,
        ..
    } in &EXPERIMENTS
    {
        text += &format!("  {name:12} {title} [{}]\n", conditions.join(", "));
    }
    text += "  bags         Recorded trials in the folder --bags\n  detection    Pushes noticed, false alarms, receiver operating curves\n\nConditions:\n";
    for condition in &condition::CONDITIONS {
        text += &format!("  {:12} {}\n", condition.name, condition.title);
    }
    text.trim_end().to_owned()
}

/// Writes a file and says which one could not be written.
fn write(path: &Path, text: &str) -> Result<()> {
    std::fs::write(path, text).with_context(|| format!("cannot write {}", path.display()))
}
