//! `palpate demo`: a simulated contact found again, with nothing but this program.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::{Args, ValueEnum};
use palpate_filter::{Filter, Settings};
use palpate_model::{IIWA14_URDF, JointSample, LoadOptions, Robot, iiwa14};
use palpate_sim::{ObstacleKind, Scenario, Trial};

use crate::estimates_csv::EstimatesCsv;
use crate::picture::Picture;
use crate::recorder::Recorder;
use crate::replay::set_threads;
use crate::simulate::{START_NS, simulate_from_start};
use crate::told::{LINE_HEAD, Told, line};
pub use crate::told::{instant, moment};
use crate::track::track;
use crate::{Usage, progress, table};

/// Simulate a contact on an iiwa arm and find it from joint positions and torques alone
///
/// Needs no ROS and no files. Prints the estimate against the truth as it converges, and leaves a picture (demo.svg), a
/// bag for Foxglove, Rerun or RViz (demo.mcap) and the estimates (estimates.csv).
#[derive(Args)]
pub struct Demo {
    /// The touched link: the number of joints that move it, 1 to 7, or its name
    #[arg(long, value_name = "LINK", default_value = "3")]
    link: String,
    /// What touches it
    #[arg(long, value_enum, default_value_t = Touching::Cylinder)]
    obstacle: Touching,
    /// White noise on the torques, in percent of each joint's rms torque
    #[arg(long, value_name = "PERCENT", default_value_t = 5.0)]
    noise: f64,
    /// Seed of the simulation and of the filter
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Number of particles [default: the parameters' default, 400]
    #[arg(long, value_name = "N")]
    particles: Option<usize>,
    /// Length of the contact, s
    #[arg(long, value_name = "SECS", default_value_t = 8.0)]
    secs: f64,
    /// Number of threads; 0 for one a core
    #[arg(long, value_name = "N", default_value_t = 0)]
    threads: usize,
    /// Folder for the results; made if it is not there, earlier results in it are replaced
    #[arg(long, value_name = "DIR", default_value = "palpate-demo")]
    out: PathBuf,
}

/// Obstacles of the demo.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Touching {
    /// A ball of 30 mm radius
    Sphere,
    /// An upright pole of 25 mm radius
    Cylinder,
    /// The edge of a cube of 100 mm, rounded by 5 mm
    Box,
    /// A flat surface without end
    Plane,
}

impl Touching {
    /// The shape; none for the demo's own.
    fn kind(self) -> Option<ObstacleKind> {
        match self {
            Self::Cylinder => None,
            Self::Sphere => Some(ObstacleKind::Sphere { radius: 0.03 }),
            Self::Box => Some(ObstacleKind::Box {
                half_extents: [0.05; 3],
                fillet: 0.005,
            }),
            Self::Plane => Some(ObstacleKind::Plane {}),
        }
    }

    fn word(self) -> &'static str {
        match self {
            Self::Sphere => "ball",
            Self::Cylinder => "pole",
            Self::Box => "cube's edge",
            Self::Plane => "plane",
        }
    }
}

impl Demo {
    /// Runs the command.
    pub fn run(&self) -> Result<()> {
        set_threads(self.threads)?;
        let robot = iiwa14(&LoadOptions::default())?;
        let scenario = self.scenario(&robot)?;
        let spinner = progress::spinner("simulate", false);
        let trial = simulate_from_start(&robot, &scenario)?;
        spinner.finish_and_clear();
        fs::create_dir_all(&self.out)
            .with_context(|| format!("cannot make the folder {}", self.out.display()))?;
        let mut settings = Settings::default();
        let hypotheses = &mut settings.filter.palpate.hypotheses;
        *hypotheses = self.particles.unwrap_or(*hypotheses);
        table::print(&format!(
            "A simulated {} touches {} of an iiwa 14; torques with {} % noise, {} particles.\n",
            self.obstacle.word(),
            scenario.link,
            self.noise,
            settings.filter.palpate.hypotheses
        ))?;
        let told = self.follow(&robot, &trial, &settings)?;
        self.write(&robot, &trial, &told, &settings)?;
        table::print(&told.table(&robot, &trial))?;
        table::print(&format!(
            "Written to {0}: demo.svg (the picture), demo.mcap (open it in Foxglove, Rerun or RViz), estimates.csv",
            self.out.display()
        ))?;
        Ok(())
    }

    fn scenario(&self, robot: &Robot) -> Result<Scenario> {
        let demo = Scenario::demo(robot)?;
        let link = robot.links.iter().find(|link| {
            let number = link.path.len().to_string();
            link.name == self.link || (number == self.link && link.mesh.is_some())
        });
        let link = link.filter(|link| link.mesh.is_some() && !link.path.is_empty());
        let names = || {
            let touchable = robot
                .links
                .iter()
                .filter(|l| l.mesh.is_some() && !l.path.is_empty());
            touchable
                .map(|link| link.name.as_str())
                .collect::<Vec<_>>()
                .join(", ")
        };
        let wrong = || {
            Usage(format!(
                "--link {}: expected 1 to 7 or one of {}",
                self.link,
                names()
            ))
        };
        Ok(Scenario {
            link: link.ok_or_else(wrong)?.name.clone(),
            obstacle: self.obstacle.kind().unwrap_or(demo.obstacle.clone()),
            noise_fraction: self.noise / 100.0,
            duration_secs: self.secs,
            seed: self.seed,
            ..demo
        })
    }

    /// Runs the filter over the trial, prints how it gets on, and records.
    fn follow(&self, robot: &Robot, trial: &Trial, settings: &Settings) -> Result<Told> {
        let path = self.out.join("demo.mcap");
        let mut recorder = Recorder::create(&path, IIWA14_URDF, START_NS, settings.viz.rate)?;
        let mut filter = Filter::new(robot, &settings.filter, self.seed)?;
        let mut told = Told::default();
        table::print(&LINE_HEAD)?;
        let bar = progress::bar(trial.samples.len(), "estimate", false);
        let mut truths = trial.truth.iter();
        let every = ((0.5 * trial.rate_hz).round() as usize).max(1);
        let middle = (trial.rate_hz.min(trial.samples.len() as f64 / 4.0)) as usize;
        let see = |sample: &JointSample, filter: &Filter| {
            let Some(truth) = truths.next() else {
                return Ok(());
            };
            recorder.sample(robot, filter.kinematics(), sample)?;
            recorder.estimate(robot, filter)?;
            recorder.truth(robot, sample.stamp_ns, truth)?;
            let index = told.history.len();
            let last = index + 1 == trial.samples.len();
            let instant = instant(filter, truth);
            let first_cloud = told.moments.is_empty() && !filter.particles().is_empty();
            if first_cloud || index == middle || last {
                told.moments
                    .push(moment(robot, filter, truth, instant.secs));
            }
            if index % every == 0 || last {
                let line = line(robot, filter, truth, &instant);
                bar.suspend(|| table::print(&line))?;
            }
            told.history.push(instant);
            bar.inc(1);
            Ok(())
        };
        let jump_secs = settings.input.time_jump_secs;
        let track = track(&mut filter, robot.dof(), &trial.samples, jump_secs, see)?;
        bar.finish_and_clear();
        recorder.finish()?;
        told.track = Some(track);
        Ok(told)
    }

    fn write(&self, robot: &Robot, trial: &Trial, told: &Told, settings: &Settings) -> Result<()> {
        if let Some(track) = &told.track {
            let csv = EstimatesCsv::create(&self.out.join("estimates.csv"))?;
            csv.write(robot, &track.estimates)?;
        }
        let link = &robot.links[trial.link].name;
        let picture = Picture {
            title: "palpate: where is the arm touched?".to_owned(),
            subtitle: format!(
                "Simulated iiwa 14, a {} at {link}, {} % torque noise, {} particles, seed {}. {}",
                self.obstacle.word(),
                self.noise,
                settings.filter.palpate.hypotheses,
                self.seed,
                told.summary()
            ),
            robot,
            touched: trial.link,
            obstacle: &trial.obstacle,
            moments: &told.moments,
            history: &told.history,
        };
        match picture.draw() {
            Some(svg) => write_file(&self.out.join("demo.svg"), &svg),
            None => Ok(()),
        }
    }
}

fn write_file(path: &Path, text: &str) -> Result<()> {
    fs::write(path, text).with_context(|| format!("cannot write {}", path.display()))
}
