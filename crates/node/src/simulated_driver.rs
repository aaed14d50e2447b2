//! A driver without a robot: the iiwa that ships with the project moves, touches something and reports positions and
//! external torques, with the truth as markers. A simulated trial is played forth and back for ever, so that nothing
//! jumps. With the parameter `samples`, so many are sent, as soon as somebody listens to both topics.

mod truth_markers;

use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::thread;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use anyhow::{Context as _, bail};
use palpate_model::{JointSample, LoadOptions, Robot, iiwa14};
use palpate_node::{messages, process};
use palpate_sim::{Scenario, Trial, simulate};
use r2r::sensor_msgs::msg::JointState;
use r2r::visualization_msgs::msg::MarkerArray;
use r2r::{Publisher, QosProfile};

const MOST_RATE_HZ: f64 = 1000.0;
const TRUTH_PERIOD: Duration = Duration::from_millis(33);
/// From the first listener on, until the middleware on both sides knows the other.
const MATCHING: Duration = Duration::from_millis(500);

fn main() -> ExitCode {
    process::log();
    let started = start().map_err(|error| (error, 2));
    match started.and_then(|(driver, stop)| driver.run(&stop).map_err(|error| (error, 1))) {
        Ok(()) => ExitCode::SUCCESS,
        Err((error, code)) => {
            eprintln!("palpate_simulated_driver: {error:#}");
            ExitCode::from(code)
        }
    }
}

fn start() -> anyhow::Result<(Driver, Arc<AtomicBool>)> {
    let stop = process::watch_signals()?;
    let mut node = process::create_node("simulated_driver")?;
    let scenario = read_scenario(&node)?;
    let samples = read_samples(&node)?;
    let robot = iiwa14(&LoadOptions::default())?;
    let trial = simulate(&robot, &scenario)?;
    tracing::info!(
        "{} touches {}: {} samples at {} Hz",
        scenario.obstacle.name(),
        scenario.link,
        trial.samples.len(),
        trial.rate_hz
    );
    let reliable = QosProfile::default;
    let driver = Driver {
        positions: node.create_publisher("joint_states", reliable())?,
        torques: node.create_publisher("external_torque", reliable())?,
        truth: node.create_publisher("~/truth", reliable().keep_last(2))?,
        names: robot.joints.iter().map(|at| at.name.clone()).collect(),
        _node: node,
        robot,
        trial,
        samples,
    };
    Ok((driver, stop))
}

/// The scenario of the file that the parameter `scenario` names, else a ball on link 4.
fn read_scenario(node: &r2r::Node) -> anyhow::Result<Scenario> {
    let file = match node.get_parameter::<Option<String>>("scenario") {
        Ok(file) => file.filter(|file| !file.is_empty()),
        Err(error) => bail!("parameter scenario: expected the name of a file: {error}"),
    };
    let scenario = match file {
        None => Scenario::new("lbr_link_4"),
        Some(file) => {
            let told = || format!("parameter scenario: {file}");
            let text = std::fs::read_to_string(Path::new(&file)).with_context(told)?;
            Scenario::from_yaml(&text).with_context(told)?
        }
    };
    if scenario.rate_hz > MOST_RATE_HZ {
        let found = scenario.rate_hz;
        bail!("scenario: rate_hz must be at most {MOST_RATE_HZ} Hz here, found {found}");
    }
    Ok(scenario)
}

/// How many samples to send; none: without end.
fn read_samples(node: &r2r::Node) -> anyhow::Result<Option<usize>> {
    let told = "parameter samples: expected a whole number, at least 0";
    let samples = node.get_parameter::<Option<i64>>("samples").context(told)?;
    let samples = usize::try_from(samples.unwrap_or(0)).context(told)?;
    Ok((samples > 0).then_some(samples))
}

struct Driver {
    positions: Publisher<JointState>,
    torques: Publisher<JointState>,
    truth: Publisher<MarkerArray>,
    names: Vec<String>,
    /// Owns what the publishers write to.
    _node: r2r::Node,
    robot: Robot,
    trial: Trial,
    /// None: without end, whoever listens.
    samples: Option<usize>,
}

impl Driver {
    /// Reports until asked to stop, or all samples are sent.
    fn run(&self, stop: &AtomicBool) -> anyhow::Result<()> {
        if self.samples.is_some() {
            self.wait_for_listeners(stop)?;
        }
        let period = Duration::from_secs_f64(1.0 / self.trial.rate_hz);
        let mut due = Instant::now();
        let mut truth_due = due;
        let most = self.samples.unwrap_or(usize::MAX);
        for index in forth_and_back(self.trial.samples.len()).take(most) {
            if process::stopped(stop) {
                break;
            }
            let stamp_ns = now_ns()?;
            self.report(&self.trial.samples[index], stamp_ns)?;
            if due >= truth_due {
                truth_due = due + TRUTH_PERIOD;
                let header = messages::header(stamp_ns, self.robot.root());
                let truth = truth_markers::draw(&self.trial, index, &header);
                self.truth.publish(&truth)?;
            }
            due += period;
            match due.checked_duration_since(Instant::now()) {
                Some(left) => thread::sleep(left),
                // Too slow: samples follow each other at once, but what was missed is not made up for.
                None => due = Instant::now(),
            }
        }
        Ok(())
    }

    fn wait_for_listeners(&self, stop: &AtomicBool) -> r2r::Result<()> {
        let is_heard = |topic: &Publisher<JointState>| {
            let listeners = topic.get_inter_process_subscription_count()?;
            Ok::<_, r2r::Error>(listeners > 0)
        };
        while !(process::stopped(stop) || is_heard(&self.positions)? && is_heard(&self.torques)?) {
            thread::sleep(Duration::from_millis(10));
        }
        thread::sleep(MATCHING);
        Ok(())
    }

    fn report(&self, sample: &JointSample, stamp_ns: i64) -> r2r::Result<()> {
        let state = JointState {
            header: messages::header(stamp_ns, ""),
            name: self.names.clone(),
            ..JointState::default()
        };
        self.positions.publish(&JointState {
            position: sample.position.clone(),
            ..state.clone()
        })?;
        self.torques.publish(&JointState {
            effort: sample.external_torque.clone(),
            ..state
        })
    }
}

/// 0, 1 … count − 1, count − 2 … 1, 0, 1 …
fn forth_and_back(count: usize) -> impl Iterator<Item = usize> {
    (0..count).chain((1..count.saturating_sub(1)).rev()).cycle()
}

fn now_ns() -> anyhow::Result<i64> {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    let since = since.context("the machine's clock is before 1970")?;
    Ok(i64::try_from(since.as_nanos())?)
}
