//! `palpate replay`: a bag through the filter.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result};
use clap::Args;
use palpate_bag::{Bag, Recording, TopicChoice, TopicReport, read_measured, read_samples};
use palpate_filter::{ContactStatus, Filter, Settings};
use palpate_model::{ExternalTorque, JointSample, Robot, Source};

use crate::estimates_csv::EstimatesCsv;
use crate::last_second::LastSecond;
use crate::recorder::Recorder;
use crate::robot_args::RobotArgs;
use crate::track::{Track, track};
use crate::{Usage, measured, progress, read_text, table};

/// Estimate the contacts of a recorded bag
///
/// Reads a rosbag2 folder (MCAP or sqlite3), a lone .mcap or a lone .db3, pairs joint positions with external joint
/// torques (JointState, Float64MultiArray, LBRState, FrankaRobotState or DynamicJointState), and runs the filter on
/// every pair. The same bag, parameters and seed give the same estimates, whatever the number of threads.
#[derive(Args)]
pub struct Replay {
    /// The bag: a rosbag2 folder, an .mcap or a .db3
    bag: PathBuf,
    #[command(flatten)]
    robot: RobotArgs,
    /// Parameters, as a ROS 2 parameter file; unknown keys are refused [default: built-in parameters]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Seed of the random streams [default: `seed` of the parameters, 1]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Write one row a sample: stamp in ns, status, link, point (m) and normal in the root frame, force (N), stiffness
    /// (N/m), standard deviation of the point (m), probability of the mode [default: not written]
    #[arg(long, value_name = "FILE.csv")]
    estimates: Option<PathBuf>,
    /// Write a bag with samples and estimates, for Foxglove, Rerun or RViz [default: not written]
    #[arg(long, value_name = "FILE.mcap")]
    out: Option<PathBuf>,
    /// Topic of the joint positions [default: the only one that fits]
    #[arg(long, value_name = "TOPIC")]
    positions: Option<String>,
    /// Topic of the external joint torques, gravity removed [default: the only one that fits]. With `torque.source` other
    /// than external, measured torques are taken from the topic of the positions instead
    #[arg(long, value_name = "TOPIC")]
    torques: Option<String>,
    /// Number of threads; 0 for one a core
    #[arg(long, value_name = "N", default_value_t = 0)]
    threads: usize,
    /// Print no table and no progress
    #[arg(short, long)]
    quiet: bool,
}

impl Replay {
    /// Runs the command.
    pub fn run(&self) -> Result<()> {
        let start = Instant::now();
        self.keep_the_bag()?;
        let mut settings = match &self.config {
            Some(path) => Settings::read(path).with_context(|| path.display().to_string())?,
            None => Settings::default(),
        };
        settings.seed = self.seed.unwrap_or(settings.seed);
        set_threads(self.threads)?;
        let (robot, _) = (self.robot).load(&settings.robot, &settings.robot.load_options())?;
        let mut external = settings.torque.external_torque(&robot)?;
        let recording = self.read(&robot, &settings, external.as_mut())?;
        let csv = self
            .estimates
            .as_deref()
            .map(EstimatesCsv::create)
            .transpose()?;
        let mut filter = Filter::new(&robot, &settings.filter, settings.seed)?;
        let bar = progress::bar(recording.samples.len(), "replay", self.quiet);
        let jump_secs = settings.input.time_jump_secs;
        let mut recorder = self.recorder(&settings, &recording)?;
        let see = |sample: &JointSample, filter: &Filter| {
            bar.inc(1);
            if let Some(recorder) = &mut recorder {
                recorder.sample(&robot, filter.kinematics(), sample)?;
                recorder.estimate(&robot, filter)?;
            }
            Ok(())
        };
        let track = track(&mut filter, robot.dof(), &recording.samples, jump_secs, see)?;
        recorder.map(Recorder::finish).transpose()?;
        bar.finish_and_clear();
        if let Some(csv) = csv {
            csv.write(&robot, &track.estimates)?;
        }
        if !self.quiet {
            let wall_secs = start.elapsed().as_secs_f64();
            let facts = facts(&robot, &recording, external.as_ref(), &track, wall_secs);
            table::print(&table::facts(&facts))?;
        }
        Ok(())
    }

    /// Refuses to write over the bag that is read.
    fn keep_the_bag(&self) -> Result<()> {
        let Ok(bag) = self.bag.canonicalize() else {
            return Ok(());
        };
        for path in [&self.out, &self.estimates].into_iter().flatten() {
            if path.canonicalize().is_ok_and(|path| path.starts_with(&bag)) {
                let path = path.display();
                let said = format!("{path} belongs to the bag that is read: name another file");
                return Err(Usage(said).into());
            }
        }
        Ok(())
    }

    /// The bag to write, if one is asked for.
    fn recorder(&self, settings: &Settings, recording: &Recording) -> Result<Option<Recorder>> {
        let (Some(path), Some(first)) = (&self.out, recording.samples.first()) else {
            return Ok(None);
        };
        let urdf = read_text(&self.robot.urdf(&settings.robot)?)?;
        let rate = settings.viz.rate;
        let recorder = Recorder::create(path, &urdf, first.stamp_ns, rate)?;
        Ok(Some(recorder))
    }

    /// The bag's samples, with external torques as they are in it, or made of measured ones by `external`.
    fn read(
        &self,
        robot: &Robot,
        settings: &Settings,
        external: Option<&mut ExternalTorque>,
    ) -> Result<Recording> {
        let whose = || format!("bag {}", self.bag.display());
        let bag = Bag::open(&self.bag)?;
        let choice = TopicChoice {
            positions: self.positions.clone(),
            torques: self.torques.clone(),
            // The default says nothing of this bag.
            source: Some(settings.input.source).filter(|source| *source != Source::default()),
            joint_names: settings.input.unnamed_joints(),
        };
        let tolerance_ns = (settings.input.pairing_tolerance_secs * 1e9).round() as i64;
        let recording = match external {
            None => read_samples(&bag, robot, &choice, tolerance_ns),
            Some(external) => read_measured(&bag, robot, &choice).and_then(|measured| {
                measured::recording(external, measured, settings.input.time_jump_secs)
            }),
        }
        .with_context(whose)?;
        for topic in [&recording.positions, &recording.torques] {
            if let Some(reason) = &topic.unusable.first_reason {
                let count = topic.unusable.total();
                tracing::warn!(
                    "{}: {count} messages unusable, the first: {reason}",
                    topic.topic
                );
            }
        }
        Ok(recording)
    }
}

/// Sets the number of threads of everything that follows; 0 for one a core.
pub fn set_threads(threads: usize) -> Result<()> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build_global()
        .context("cannot start threads")
}

fn facts(
    robot: &Robot,
    recording: &Recording,
    external: Option<&ExternalTorque>,
    track: &Track,
    wall_secs: f64,
) -> Vec<(&'static str, String)> {
    let counts = track.counts;
    let share = |status| {
        format!(
            "{} {:.1} %",
            ContactStatus::word(status),
            100.0 * track.share(status)
        )
    };
    let span_secs = track.span_secs();
    let mut facts = vec![("joint positions", told(&recording.positions))];
    facts.extend(torque_facts(recording, external));
    facts.extend([
        (
            "samples",
            format!(
                "{} used, {span_secs:.2} s; refused: {} for their stamp, {} not finite, {} too large, {} of wrong length",
                counts.admitted,
                counts.stamp_not_after,
                counts.not_finite,
                counts.too_large,
                counts.wrong_length
            ),
        ),
        (
            "status",
            [
                ContactStatus::NoContact,
                ContactStatus::Ambiguous,
                ContactStatus::Located,
            ]
            .map(share)
            .join(", "),
        ),
    ]);
    if track.restarts > 0 {
        facts.push(("time started anew", format!("{} times", track.restarts)));
    }
    facts.extend(last_second_facts(robot, track));
    let filter_secs = track.filter_time.as_secs_f64();
    facts.push((
        "time taken",
        format!(
            "{wall_secs:.2} s in all; filter {filter_secs:.2} s, {:.1} × real time",
            span_secs / filter_secs.max(1e-9)
        ),
    ));
    facts
}

/// Where the torques came from.
fn torque_facts(
    recording: &Recording,
    external: Option<&ExternalTorque>,
) -> Vec<(&'static str, String)> {
    if let Some(external) = external {
        return vec![("measured torques", measured::told(external))];
    }
    let losses = recording.losses;
    let unpaired = format!(
        "{} torques without position, {} positions without torque",
        losses.torque_without_position, losses.position_without_torque
    );
    vec![
        ("external torques", told(&recording.torques)),
        ("unpaired", unpaired),
    ]
}

fn told(topic: &TopicReport) -> String {
    let unusable = &topic.unusable;
    let mut told = format!("{}, {} messages", topic.topic, topic.messages);
    let causes = [
        (unusable.undecodable, "undecodable"),
        (unusable.names_missing, "without all joints"),
        (unusable.wrong_length, "of wrong length"),
        (unusable.not_finite, "not finite"),
    ];
    for (count, cause) in causes.iter().filter(|(count, _)| *count > 0) {
        told += &format!(", {count} {cause}");
    }
    told
}

fn last_second_facts(robot: &Robot, track: &Track) -> Vec<(&'static str, String)> {
    let Some(last) = LastSecond::of(&track.estimates) else {
        return vec![("last second", "no contact".to_owned())];
    };
    let p = last.point_in_root;
    vec![
        (
            "last second: link",
            format!(
                "{} ({:.0} % of estimates)",
                robot.links[last.link].name,
                100.0 * last.share
            ),
        ),
        (
            "position",
            format!("{:.4}, {:.4}, {:.4} m in {}", p.x, p.y, p.z, robot.root()),
        ),
        ("standard deviation", format!("{:.1} mm", 1e3 * last.std)),
        ("force", format!("{:.2} N", last.force)),
    ]
}
