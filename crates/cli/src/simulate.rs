//! `palpate simulate`: a scenario into a bag and its truth.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use palpate_filter::{RobotSettings, VizSettings};
use palpate_model::{IIWA14_URDF, Kinematics, Robot, iiwa14};
use palpate_sim::{Scenario, Trial, write_truth_csv};

use crate::last_second::median;
use crate::recorder::Recorder;
use crate::robot_args::RobotArgs;
use crate::{progress, read_text, table};

/// Stamp of a simulation's first sample, ns: ROS takes the stamp zero for "no time".
pub const START_NS: i64 = 1_700_000_000_000_000_000;

/// Simulate a contact: joint positions and torques as a bag, and the truth beside it
///
/// SCENARIO.yaml needs one key, `link`, the touched link's name. The others, with their defaults: seed 1; obstacle
/// {kind: sphere, radius: 0.03} (m; or cylinder {radius, half_length, axis}, box {half_extents, fillet}, plane {});
/// stiffness 8000 (N/m); max_force 30 (N); friction 0 (coefficient); drift [0, 0, 0] (m/s); travel 0.012 (m);
/// joint_speed 0.05 (rad/s); rate_hz 100; duration_secs 10; lead_in_secs 0; noise_fraction 0 (of each joint's rms
/// torque); noise_floor 0 (Nm); bias_sigma 0 (Nm); bias [] (Nm a joint); bias_walk 0 (Nm/√s); refine_levels 1.
#[derive(Args)]
pub struct Simulate {
    /// The scenario
    scenario: PathBuf,
    #[command(flatten)]
    robot: RobotArgs,
    /// Folder for bag/ (rosbag2, MCAP), truth.csv and scenario.yaml; new or empty
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Print no table and no progress
    #[arg(short, long)]
    quiet: bool,
}

impl Simulate {
    /// Runs the command.
    pub fn run(&self) -> Result<()> {
        let text = read_text(&self.scenario)?;
        let told = || format!("scenario {}", self.scenario.display());
        let scenario = Scenario::from_yaml(&text).with_context(told)?;
        refuse_if_used(&self.out)?;
        let (robot, urdf) = robot_or_shipped(&self.robot)?;
        let spinner = progress::spinner("simulate", self.quiet);
        let trial = simulate_from_start(&robot, &scenario).with_context(told)?;
        spinner.finish_and_clear();
        fs::create_dir_all(&self.out)
            .with_context(|| format!("cannot make {}", self.out.display()))?;
        write_bag(&self.out.join("bag"), &robot, &urdf, &trial)?;
        write_truth(&self.out.join("truth.csv"), &trial)?;
        let copy = self.out.join("scenario.yaml");
        fs::write(&copy, text).with_context(|| format!("cannot write {}", copy.display()))?;
        if !self.quiet {
            table::print(&table::facts(&facts(&scenario, &trial, &self.out)))?;
        }
        Ok(())
    }
}

/// Simulates, with stamps from [`START_NS`] on in the samples; those of the truth start at zero.
pub fn simulate_from_start(robot: &Robot, scenario: &Scenario) -> Result<Trial> {
    let mut trial = palpate_sim::simulate(robot, scenario)?;
    for sample in &mut trial.samples {
        sample.stamp_ns += START_NS;
    }
    Ok(trial)
}

/// The robot of the options, else the iiwa that ships; and its URDF.
fn robot_or_shipped(args: &RobotArgs) -> Result<(Robot, String)> {
    let settings = RobotSettings::default();
    let options = settings.load_options();
    match &args.urdf {
        None => Ok((iiwa14(&options)?, IIWA14_URDF.to_owned())),
        Some(path) => {
            let (robot, _) = args.load(&settings, &options)?;
            Ok((robot, read_text(path)?))
        }
    }
}

fn refuse_if_used(folder: &Path) -> Result<()> {
    let used = match fs::read_dir(folder) {
        Ok(mut entries) => entries.next().is_some(),
        Err(_) => folder.exists(),
    };
    if used {
        bail!(
            "{} is not an empty folder: nothing is overwritten, name another with --out",
            folder.display()
        );
    }
    Ok(())
}

fn write_bag(path: &Path, robot: &Robot, urdf: &str, trial: &Trial) -> Result<()> {
    let rate = VizSettings::default().rate;
    let mut recorder = Recorder::create(path, urdf, START_NS, rate)?;
    let mut kinematics = Kinematics::new(robot);
    for (sample, truth) in trial.samples.iter().zip(&trial.truth) {
        kinematics.update(robot, &sample.position);
        recorder.sample(robot, &kinematics, sample)?;
        recorder.truth(robot, sample.stamp_ns, truth)?;
    }
    Ok(recorder.finish()?)
}

fn write_truth(path: &Path, trial: &Trial) -> Result<()> {
    let write = || {
        let mut file = std::io::BufWriter::new(fs::File::create(path)?);
        write_truth_csv(&trial.truth, &mut file)?;
        file.flush()
    };
    write().with_context(|| format!("cannot write {}", path.display()))
}

fn facts(scenario: &Scenario, trial: &Trial, out: &Path) -> Vec<(&'static str, String)> {
    let contacts: Vec<_> = trial.truth.iter().filter_map(|row| row.contact).collect();
    let forces: Vec<_> = (contacts.iter().map(|contact| contact.force_in_root.norm())).collect();
    let most = forces.iter().copied().fold(0.0, f64::max);
    let travel = (contacts.windows(2))
        .map(|pair| (pair[1].point_in_root - pair[0].point_in_root).norm())
        .sum::<f64>();
    vec![
        (
            "touched",
            format!("{} by a {}", scenario.link, scenario.obstacle.name()),
        ),
        (
            "samples",
            format!(
                "{} at {} Hz, {} in contact",
                trial.samples.len(),
                trial.rate_hz,
                contacts.len()
            ),
        ),
        (
            "force",
            format!(
                "median {:.1} N, at most {most:.1} N",
                median(forces.into_iter())
            ),
        ),
        ("path of the contact", format!("{:.1} mm", 1e3 * travel)),
        ("written", out.display().to_string()),
    ]
}
