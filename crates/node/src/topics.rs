//! The node at work: its topics and threads.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use anyhow::Context as _;
use palpate_filter::{Filter, Settings};
use palpate_model::Robot;
use palpate_node::Newest;
use r2r::QosProfile;

use crate::diagnostics::Diagnostics;
use crate::drawing::{Easel, Pictures};
use crate::estimation::{Estimation, Outputs, Progress};
use crate::reader::Reader;
use crate::stopped;

/// Samples that wait for the filter at most, however young they are.
const MOST_WAITING: usize = 10_000;

/// Works until asked to stop.
pub fn run(
    node: &mut r2r::Node,
    robot: Robot,
    settings: &Settings,
    stop: &AtomicBool,
) -> anyhow::Result<()> {
    let robot = Arc::new(robot);
    let filter = Filter::new(&robot, &settings.filter, settings.seed)?;
    let samples = Arc::new(Newest::new(MOST_WAITING));
    let easel = Arc::new(Easel::new());
    let progress = Arc::new(Mutex::new(Progress::default()));

    let estimation = Estimation::new(
        Arc::clone(&robot),
        filter,
        create_outputs(node)?,
        Arc::clone(&easel),
        Arc::clone(&progress),
    );
    let pictures = create_pictures(node)?;
    let estimating = spawn("estimation", {
        let samples = Arc::clone(&samples);
        move || estimation.run(&samples)
    })?;
    let drawing = spawn("drawing", {
        let (robot, easel) = (Arc::clone(&robot), Arc::clone(&easel));
        let period = Duration::from_secs_f64(1.0 / settings.viz.rate);
        move || pictures.run(&robot, &easel, period)
    })?;

    let mut diagnostics = Diagnostics::new(node, &robot, settings, progress)?;
    let mut reader = Reader::new(node, robot, &settings.input, Arc::clone(&samples))?;
    while !stopped(stop) && !estimating.is_finished() && !drawing.is_finished() {
        node.spin_once(Duration::from_millis(20));
        reader.drain();
        diagnostics.tell(&reader.input, &samples)?;
    }
    samples.close();
    easel.close();
    finish(estimating, "estimation")?;
    finish(drawing, "drawing")
}

fn create_outputs(node: &mut r2r::Node) -> r2r::Result<Outputs> {
    let latched = QosProfile::default().transient_local().keep_last(1);
    Ok(Outputs {
        pose: node.create_publisher("~/contact_pose", QosProfile::default())?,
        wrench: node.create_publisher("~/contact_wrench", QosProfile::default())?,
        detected: node.create_publisher("~/contact_detected", latched)?,
    })
}

fn create_pictures(node: &mut r2r::Node) -> r2r::Result<Pictures> {
    Ok(Pictures {
        cloud: node.create_publisher("~/particles", QosProfile::default().keep_last(2))?,
        markers: node.create_publisher("~/markers", QosProfile::default().keep_last(2))?,
    })
}

type Work = JoinHandle<r2r::Result<()>>;

fn spawn(
    name: &str,
    work: impl FnOnce() -> r2r::Result<()> + Send + 'static,
) -> anyhow::Result<Work> {
    let thread = thread::Builder::new().name(name.to_owned());
    thread.spawn(work).context("cannot start a thread")
}

fn finish(work: Work, name: &'static str) -> anyhow::Result<()> {
    match work.join() {
        Ok(result) => result.with_context(|| format!("{name} cannot publish")),
        Err(_) => anyhow::bail!("{name} ended early, which is a fault of this program"),
    }
}
