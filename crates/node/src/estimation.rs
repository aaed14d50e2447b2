//! The thread that estimates.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use palpate_filter::{ContactEstimate, ContactPose, Filter, Intake, IntakeCounts};
use palpate_model::{JointSample, Kinematics, Robot};
use palpate_node::{Newest, Throttle, TimedSample};
use r2r::Publisher;
use r2r::geometry_msgs::msg::{PoseWithCovarianceStamped, WrenchStamped};
use r2r::std_msgs::msg::Bool;

use crate::drawing::{Drawing, Easel};
use crate::messages;

/// Where the estimate goes.
pub struct Outputs {
    pub pose: Publisher<PoseWithCovarianceStamped>,
    pub wrench: Publisher<WrenchStamped>,
    /// Latched, and published when it changes.
    pub detected: Publisher<Bool>,
}

/// What the estimating thread tells about itself.
#[derive(Clone, Debug, Default)]
pub struct Progress {
    pub intake: IntakeCounts,
    pub status: &'static str,
    pub last_stamp_ns: i64,
    /// How long the updates took since this was last looked at.
    pub steps: Vec<Duration>,
}

/// Updates the filter with each sample.
pub struct Estimation {
    robot: Arc<Robot>,
    filter: Filter,
    intake: Intake,
    outputs: Outputs,
    easel: Arc<Easel>,
    progress: Arc<Mutex<Progress>>,
    epoch: u64,
    detected: Option<bool>,
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
            robot,
            filter,
            outputs,
            easel,
            progress,
            epoch: 0,
            detected: None,
            complaints: Throttle::new(Duration::from_secs(5)),
        }
    }

    /// Works until `samples` is closed.
    ///
    /// # Errors
    /// If ROS 2 refuses to publish.
    pub fn run(mut self, samples: &Newest<TimedSample>) -> r2r::Result<()> {
        self.tell_detected(false)?;
        while let Some(timed) = samples.pop() {
            if timed.epoch != self.epoch {
                tracing::warn!(
                    "time went back to {} ns: starting anew",
                    timed.sample.stamp_ns
                );
                self.epoch = timed.epoch;
                self.intake.restart();
                self.filter.reset();
            }
            self.take(&timed.sample)?;
        }
        Ok(())
    }

    fn take(&mut self, sample: &JointSample) -> r2r::Result<()> {
        let begin = Instant::now();
        match self.intake.admit(sample) {
            Ok(admitted) => {
                let estimate = self.filter.update(admitted).clone();
                self.note(&estimate, begin.elapsed());
                self.publish(&estimate)?;
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
        let mut progress = self.lock_progress();
        progress.intake = self.intake.counts();
        progress.status = estimate.status.word();
        progress.last_stamp_ns = estimate.stamp_ns;
        progress.steps.push(step);
    }

    fn lock_progress(&self) -> std::sync::MutexGuard<'_, Progress> {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
