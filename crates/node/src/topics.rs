//! The node at work: its topics, services and threads.

use std::sync::atomic::AtomicBool;
use std::sync::mpsc::{self, Sender};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use anyhow::Context as _;
use palpate_filter::{Filter, Settings};
use palpate_model::Robot;
use palpate_node::{Newest, TimedSample, realtime};
use r2r::QosProfile;

use crate::clock::Clock;
use crate::description::Descriptions;
use crate::diagnostics::{Diagnostics, Observed};
use crate::drawing::{Easel, Pictures};
use crate::estimation::{Estimation, Outputs, Progress};
use crate::order::{Asked, Order};
use crate::parameter_services::ParameterServices;
use crate::reader::Reader;
use crate::services::Services;
use palpate_node::process::stopped;

/// Samples that wait for the filter at most, however young they are.
const MOST_WAITING: usize = 10_000;

/// Works until asked to stop: with `robot`, or where there is none, with those that the topic `robot_description` brings.
pub fn run(
    node: &mut r2r::Node,
    robot: Option<Robot>,
    settings: Settings,
    stop: &AtomicBool,
) -> anyhow::Result<()> {
    let publishers = Publishers::new(node)?;
    let mut services = Services::new(node)?;
    let mut diagnostics = Diagnostics::new(node)?;
    let mut clock = Clock::new(node, &settings)?;
    let mut descriptions = None;
    let mut at_work = match robot {
        Some(robot) => Some(AtWork::begin(node, robot, &settings, publishers.clone())?),
        None => {
            descriptions = Some(Descriptions::new(node)?);
            None
        }
    };
    let mut parameters = ParameterServices::new(node, settings, clock.now())?;
    while !stopped(stop) && at_work.as_ref().is_none_or(AtWork::goes_on) {
        node.spin_once(Duration::from_millis(20));
        if let Some(at_work) = &mut at_work {
            at_work.reader.drain(clock.now_ns());
        }
        let now = clock.now();
        if parameters.serve(&now)?
            && let Some(at_work) = &mut at_work
        {
            at_work.change(parameters.settings());
        }
        let settings = parameters.settings();
        let begun = descriptions.as_mut().and_then(|descriptions| {
            descriptions.next(settings, |robot| {
                AtWork::begin(node, robot, settings, publishers.clone())
            })
        });
        if let Some(begun) = begun
            && let Some(before) = at_work.replace(begun)
            && let Some(at_work) = &at_work
        {
            at_work.order(Order::Enable(before.is_enabled()));
            before.finish()?;
        }
        let orders = at_work.as_ref().map(|at_work| &at_work.orders);
        services.serve(orders, settings.input.tare_secs);
        let refusal = descriptions.as_ref().and_then(Descriptions::refusal);
        let observed = at_work.as_ref().map(AtWork::observed);
        diagnostics.tell(&now, settings, observed, refusal)?;
    }
    at_work.map_or(Ok(()), AtWork::finish)
}

/// They outlive the robot, as nobody is to lose sight of a topic because the description changed.
#[derive(Clone)]
struct Publishers {
    outputs: Outputs,
    pictures: Pictures,
}

impl Publishers {
    fn new(node: &mut r2r::Node) -> r2r::Result<Self> {
        let reliable = QosProfile::default;
        let latched = reliable().transient_local().keep_last(1);
        Ok(Self {
            outputs: Outputs {
                pose: node.create_publisher("~/contact_pose", reliable())?,
                wrench: node.create_publisher("~/contact_wrench", reliable())?,
                detected: node.create_publisher("~/contact_detected", latched)?,
                residual: node.create_publisher("~/residual", reliable())?,
                link_probabilities: node.create_publisher("~/link_probabilities", reliable())?,
            },
            pictures: Pictures {
                cloud: node.create_publisher("~/particles", reliable().keep_last(2))?,
                markers: node.create_publisher("~/markers", reliable().keep_last(2))?,
            },
        })
    }
}

/// What there is only once the robot is known.
struct AtWork {
    robot: Arc<Robot>,
    reader: Reader,
    samples: Arc<Newest<TimedSample>>,
    easel: Arc<Easel>,
    progress: Arc<Mutex<Progress>>,
    orders: Sender<Asked>,
    estimating: Work,
    drawing: Work,
}

impl AtWork {
    fn begin(
        node: &mut r2r::Node,
        robot: Robot,
        settings: &Settings,
        Publishers { outputs, pictures }: Publishers,
    ) -> anyhow::Result<Self> {
        let robot = Arc::new(robot);
        let external = settings.torque.external_torque(&robot)?;
        let filter = Filter::new(&robot, &settings.filter, settings.seed)?;
        let samples = Arc::new(Newest::new(MOST_WAITING));
        let easel = Arc::new(Easel::new(settings.viz.rate));
        let progress = Arc::new(Mutex::new(Progress::default()));
        let reader = Reader::new(
            node,
            Arc::clone(&robot),
            &settings.input,
            external,
            Arc::clone(&samples),
        )?;
        let estimation = Estimation::new(
            Arc::clone(&robot),
            filter,
            outputs,
            Arc::clone(&easel),
            Arc::clone(&progress),
        );
        let (orders, asked) = mpsc::channel();
        let estimating = spawn("estimation", {
            let samples = Arc::clone(&samples);
            move || estimation.run(&samples, &asked)
        })?;
        let drawing = spawn("drawing", {
            let (robot, easel) = (Arc::clone(&robot), Arc::clone(&easel));
            let was_raised = settings.realtime.priority > 0;
            move || {
                if was_raised && let Err(refusal) = realtime::step_down() {
                    tracing::warn!("drawing keeps its priority: {refusal}");
                }
                pictures.run(&robot, &easel)
            }
        })?;
        Ok(Self {
            robot,
            reader,
            samples,
            easel,
            progress,
            orders,
            estimating,
            drawing,
        })
    }

    fn goes_on(&self) -> bool {
        !self.estimating.is_finished() && !self.drawing.is_finished()
    }

    /// Takes settings over that changed.
    fn change(&mut self, settings: &Settings) {
        self.reader.set_times(&settings.input);
        self.easel.set_rate(settings.viz.rate);
        self.order(Order::Parameters(Box::new(settings.filter.clone())));
    }

    /// Gives an order whose outcome nobody waits for.
    fn order(&self, order: Order) {
        let (reply, _) = mpsc::channel();
        let _ = self.orders.send(Asked { order, reply });
    }

    fn observed(&self) -> Observed<'_> {
        Observed {
            robot: &self.robot,
            input: &self.reader.input,
            lost: self.samples.lost(),
            progress: &self.progress,
        }
    }

    fn is_enabled(&self) -> bool {
        let progress = self.progress.lock().unwrap_or_else(PoisonError::into_inner);
        !progress.is_disabled
    }

    fn finish(self) -> anyhow::Result<()> {
        self.samples.close();
        self.easel.close();
        finish(self.estimating, "estimation")?;
        finish(self.drawing, "drawing")
    }
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
