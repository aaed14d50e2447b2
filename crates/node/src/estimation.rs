//! The thread that estimates.

use std::sync::mpsc::{Receiver, Sender};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use palpate_filter::{ContactEstimate, ContactPose, Filter, Intake, IntakeCounts, TareState};
use palpate_model::{JointSample, Kinematics, Robot};
use palpate_node::{Newest, Pacing, Throttle, TimedSample};
use r2r::Publisher;
use r2r::geometry_msgs::msg::{PoseWithCovarianceStamped, WrenchStamped};
use r2r::sensor_msgs::msg::JointState;
use r2r::std_msgs::msg::Bool;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::drawing::{Drawing, Easel};
use crate::order::{Asked, Order, Outcome};
use palpate_node::messages;

/// How long to wait for a sample before looking for orders.
const PATIENCE: Duration = Duration::from_millis(20);

/// Where the estimate goes.
#[derive(Clone)]
pub struct Outputs {
    pub pose: Publisher<PoseWithCovarianceStamped>,
    pub wrench: Publisher<WrenchStamped>,
    /// Latched, and published when it changes.
    pub detected: Publisher<Bool>,
    pub residual: Publisher<JointState>,
    pub link_probabilities: Publisher<JointState>,
}

/// What the estimating thread tells about itself.
#[derive(Clone, Debug, Default)]
pub struct Progress {
    pub intake: IntakeCounts,
    pub is_disabled: bool,
    pub status: &'static str,
    pub last_stamp_ns: Option<i64>,
    /// Stamp of the sample with which the last tare was done.
    pub tared_ns: Option<i64>,
    /// Most particles, or hypotheses, that there may be now.
    pub particles: usize,
    pub effective_sample_size: f64,
    /// Standard deviation of the particles' points, m.
    pub spread: f64,
    /// How long the updates took since this was last looked at.
    pub steps: Vec<Duration>,
}

/// Updates the filter with each sample.
pub struct Estimation {
    robot: Arc<Robot>,
    filter: Filter,
    intake: Intake,
    pacing: Pacing,
    outputs: Outputs,
    easel: Arc<Easel>,
    progress: Arc<Mutex<Progress>>,
    epoch: u64,
    enabled: bool,
    detected: Option<bool>,
    /// Who waits for the tare that is running, and until when.
    taring: Option<(Sender<Outcome>, Instant)>,
    complaints: Throttle,
}

impl Estimation {
    pub fn new(
        robot: Arc<Robot>,
        filter: Filter,
        outputs: Outputs,
        easel: Arc<Easel>,
        progress: Arc<Mutex<Progress>>,
    ) -> Self {
        Self {
            intake: Intake::new(robot.dof()),
            pacing: Pacing::new(filter.parameters().particle_range()),
            robot,
            filter,
            outputs,
            easel,
            progress,
            epoch: 0,
            enabled: true,
            detected: None,
            taring: None,
            complaints: Throttle::new(Duration::from_secs(5)),
        }
    }

    /// Works until `samples` is closed.
    ///
    /// # Errors
    /// If ROS 2 refuses to publish.
    pub fn run(
        mut self,
        samples: &Newest<TimedSample>,
        orders: &Receiver<Asked>,
    ) -> r2r::Result<()> {
        let _pool = join_pool();
        self.tell_detected(false)?;
        while !samples.is_closed() {
            for asked in orders.try_iter() {
                self.obey(asked)?;
            }
            if let Some(timed) = samples.pop_within(PATIENCE) {
                self.follow_time(&timed);
                if self.enabled {
                    self.take(&timed.sample, samples.len())?;
                }
            }
            self.watch_tare();
        }
        Ok(())
    }

    fn follow_time(&mut self, timed: &TimedSample) {
        if timed.epoch != self.epoch {
            let stamp_ns = timed.sample.stamp_ns;
            tracing::warn!("time went back to {stamp_ns} ns: starting anew");
            self.epoch = timed.epoch;
            self.intake.restart();
            self.filter.reset();
            self.lock_progress().tared_ns = None;
        }
    }

    fn obey(&mut self, Asked { order, reply }: Asked) -> r2r::Result<()> {
        let outcome = match order {
            Order::Reset => {
                self.filter.forget_contact();
                self.tell_detected(false)?;
                Outcome::done("the contact is forgotten")
            }
            Order::Tare(secs) => match self.start_tare(secs) {
                Ok(()) => {
                    // A tare takes the samples' time, which may be slower than this clock.
                    let until = Instant::now() + Duration::from_secs_f64(5.0 + 2.0 * secs);
                    self.taring = Some((reply, until));
                    return Ok(());
                }
                Err(refusal) => refusal,
            },
            Order::ClearTare => {
                self.filter.clear_tare();
                self.lock_progress().tared_ns = None;
                Outcome::done("the torques count as they are measured")
            }
            Order::Enable(enabled) => {
                self.enable(enabled)?;
                Outcome::done(if enabled { "enabled" } else { "disabled" })
            }
            Order::Parameters(parameters) => match self.filter.set_parameters(&parameters) {
                Ok(()) => {
                    self.pacing = Pacing::new(self.filter.parameters().particle_range());
                    self.tell_detected(self.filter.estimate().best().is_some())?;
                    Outcome::done("parameters changed")
                }
                Err(refusal) => Outcome::refused(refusal),
            },
        };
        Asked::tell(&reply, outcome);
        Ok(())
    }

    fn enable(&mut self, enabled: bool) -> r2r::Result<()> {
        self.enabled = enabled;
        self.lock_progress().is_disabled = !enabled;
        self.filter.forget_contact();
        self.tell_detected(false)
    }

    fn start_tare(&mut self, secs: f64) -> Result<(), Outcome> {
        if !self.enabled {
            return Err(Outcome::refused("disabled: enable before the tare"));
        }
        self.filter.start_tare(secs).map_err(Outcome::refused)?;
        if let Some((earlier, _)) = self.taring.take() {
            Asked::tell(&earlier, Outcome::refused("another tare began"));
        }
        Ok(())
    }

    /// Tells who asked for a tare when it is over.
    fn watch_tare(&mut self) {
        let Some((reply, until)) = self.taring.take() else {
            return;
        };
        let outcome = match self.filter.tare_state() {
            TareState::Running { .. } if Instant::now() < until => {
                self.taring = Some((reply, until));
                return;
            }
            TareState::Running { .. } => {
                self.filter.stop_tare();
                Outcome::refused("too few samples came for a tare")
            }
            TareState::Done => {
                let mut progress = self.lock_progress();
                progress.tared_ns = progress.last_stamp_ns;
                Outcome::done(format!("bias: {}", self.bias_in_words()))
            }
            TareState::Interrupted => {
                Outcome::refused("something touched: the bias is as it was before")
            }
            TareState::None => Outcome::refused("the tare was cleared"),
        };
        Asked::tell(&reply, outcome);
    }

    fn bias_in_words(&self) -> String {
        let joints = self.robot.joints.iter().zip(self.filter.bias());
        let words = joints.map(|(joint, bias)| format!("{} {:.3} Nm", joint.name, bias.mean));
        words.collect::<Vec<_>>().join(", ")
    }

    /// Takes a sample, for which so many others are `waiting`.
    fn take(&mut self, sample: &JointSample, waiting: usize) -> r2r::Result<()> {
        let begin = Instant::now();
        match self.intake.admit(sample) {
            Ok(admitted) => {
                self.filter.limit_particles(self.pacing.particles());
                let estimate = self.filter.update(admitted).clone();
                let step = begin.elapsed();
                self.publish(&estimate)?;
                self.publish_details(&estimate)?;
                self.pacing.see_sample(sample.stamp_ns);
                let moved = self.filter.moved_particles();
                (self.pacing).see_step(moved, begin.elapsed(), waiting);
                self.note(&estimate, step);
                if self.easel.is_waiting() {
                    self.draw(sample, estimate);
                }
            }
            Err(refusal) => {
                self.lock_progress().intake = self.intake.counts();
                if let Some(more) = self.complaints.pass(begin) {
                    tracing::warn!("sample refused (and {more} before): {refusal}");
                }
            }
        }
        Ok(())
    }

    fn publish(&mut self, estimate: &ContactEstimate) -> r2r::Result<()> {
        self.tell_detected(!estimate.modes.is_empty())?;
        let Some(mode) = estimate.best() else {
            return Ok(());
        };
        let header = messages::header(estimate.stamp_ns, self.robot.root());
        // Other nodes are not to meet a NaN.
        let force_is_finite = mode.force_in_root.iter().all(|value| value.is_finite());
        if let Some(pose) = ContactPose::new(mode).filter(|_| force_is_finite) {
            self.outputs
                .pose
                .publish(&messages::pose(&pose, header.clone()))?;
            self.outputs
                .wrench
                .publish(&messages::wrench(mode, header))?;
        }
        Ok(())
    }

    /// For those who look.
    fn publish_details(&self, estimate: &ContactEstimate) -> r2r::Result<()> {
        let header = || messages::header(estimate.stamp_ns, self.robot.root());
        let outputs = &self.outputs;
        if outputs.residual.get_inter_process_subscription_count()? > 0 {
            outputs.residual.publish(&JointState {
                header: header(),
                name: self.robot.joints.iter().map(|at| at.name.clone()).collect(),
                effort: self.filter.residual(),
                ..JointState::default()
            })?;
        }
        let probabilities = &outputs.link_probabilities;
        if probabilities.get_inter_process_subscription_count()? > 0 {
            let links = self.robot.links.iter().enumerate();
            let (name, position) = links
                .map(|(index, link)| (link.name.clone(), estimate.link_probability(index)))
                .unzip();
            probabilities.publish(&JointState {
                header: header(),
                name,
                position,
                ..JointState::default()
            })?;
        }
        Ok(())
    }

    fn tell_detected(&mut self, detected: bool) -> r2r::Result<()> {
        if self.detected == Some(detected) {
            return Ok(());
        }
        self.detected = Some(detected);
        self.outputs.detected.publish(&Bool { data: detected })
    }

    fn draw(&self, sample: &JointSample, estimate: ContactEstimate) {
        let mut kinematics = Kinematics::new(&self.robot);
        kinematics.update(&self.robot, &sample.position);
        self.easel.put(Drawing {
            estimate,
            particles: self.filter.particles().to_vec(),
            kinematics,
        });
    }

    fn note(&self, estimate: &ContactEstimate, step: Duration) {
        // Figures are for somebody who looks once a second; who looks is not to wait for them.
        let is_time = self.lock_progress().steps.is_empty();
        let figures = is_time.then(|| (self.filter.effective_sample_size(), self.filter.spread()));
        let mut progress = self.lock_progress();
        progress.intake = self.intake.counts();
        progress.status = estimate.status.word();
        progress.last_stamp_ns = Some(estimate.stamp_ns);
        progress.particles = self.filter.most_particles();
        if let Some(figures) = figures {
            (progress.effective_sample_size, progress.spread) = figures;
        }
        progress.steps.push(step);
    }

    fn lock_progress(&self) -> std::sync::MutexGuard<'_, Progress> {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A pool with this thread in it, for as long as it is kept: one outside it would hand each step over and wait to be
/// woken.
fn join_pool() -> Option<ThreadPool> {
    let pool = ThreadPoolBuilder::new().use_current_thread().build();
    pool.inspect_err(|refusal| tracing::warn!("estimating outside the pool: {refusal}"))
        .ok()
}
