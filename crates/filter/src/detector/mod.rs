//! Is anything touching? A bank of control charts a joint, on what the torque is off its learned bias.
//!
//! Each joint's residual is smoothed exponentially with several time constants (Roberts 1959), short ones for hard pushes
//! and long ones for soft ones. A smoothed residual that with two samples in a row exceeds so many of its standard
//! deviations that noise does it at most at the stated rate ([`alarm`]) is a contact. The standard deviation is learned
//! while nothing touches ([`noise`]): white noise from second differences, what does not average out from the smoothed
//! residuals themselves, so that noise may be correlated or quantised, and what grows with motion or comes where a joint
//! turns back ([`motion`]), as friction does ([`turns`]). Beside these are charts of sudden changes, of what the joints
//! beyond do not explain of a joint's torque ([`onset`]), and of all joints together ([`joined`]): they notice pushes
//! soonest, in fast motion too. The bias is a slow random walk ([`bias`]), faster in motion. What was learned shortly before
//! a contact is taken back ([`blocks`]), and nothing is learned during one ([`touch`]).

mod alarm;
mod bias;
mod blocks;
mod cells;
mod covariance;
mod joined;
mod joint;
mod motion;
mod noise;
mod onset;
mod parameters;
mod reach;
mod scale;
mod touch;
mod turns;

use palpate_model::{JointSample, Robot};

use crate::{Admitted, ContactChange, ContactEvent, Detection, ParameterError};

use bias::Forgetting;
pub use bias::JointBias;
use blocks::Blocks;
use joined::Joined;
use joint::{Charts, JointDetector, Weighing};
use motion::Motion;
use onset::Onset;
pub use parameters::DetectorParameters;
use reach::Reach;
use touch::Touch;
use turns::Turns;

/// After so long without sample, or a leap to another position, the smoothed residuals begin anew, s.
const GAP_SECS: f64 = 0.5;
/// Time over which the time between samples is learned, in samples.
const PERIOD_SAMPLES: f64 = 50.0;
/// A contact within this time of the stream's begin was not seen to begin, s.
const BEGIN_SECS: f64 = 0.3;

/// Decides between contact and no contact, and learns each joint's bias. Part of [`Filter`](crate::Filter); alone it is
/// for those who need no place. Deterministic; allocates nothing after construction.
#[derive(Clone, Debug)]
pub struct Detector {
    parameters: DetectorParameters,
    joints: Vec<JointDetector>,
    charts: Charts,
    onset: Onset,
    joined: Joined,
    motion: Motion,
    blocks: Blocks,
    /// First stamp of the stream, and of what came after the last time that a contact was forgotten.
    begin_ns: Option<i64>,
    last_ns: Option<i64>,
    period_secs: f64,
    weighing: Weighing,
    touch: Touch,
    reach: Reach,
    bias: Vec<JointBias>,
    detection: Detection,
}

impl Detector {
    /// A detector for `robot`.
    ///
    /// # Errors
    /// If a parameter is out of range.
    pub fn new(robot: &Robot, parameters: &DetectorParameters) -> Result<Self, ParameterError> {
        parameters.check()?;
        let dof = robot.dof();
        let joint = JointDetector::new(parameters);
        Ok(Self {
            joints: vec![joint; dof],
            charts: Charts::default(),
            onset: Onset::new(robot),
            joined: Joined::new(dof),
            motion: Motion::new(dof),
            blocks: Blocks::new(dof),
            begin_ns: None,
            last_ns: None,
            period_secs: 0.01,
            weighing: Weighing::default(),
            touch: Touch::new(dof),
            reach: Reach::new(robot),
            bias: vec![JointBias::default(); dof],
            detection: Detection {
                joints: vec![false; dof],
                ..Detection::default()
            },
            parameters: parameters.clone(),
        })
    }

    /// What the last update found.
    pub fn detection(&self) -> &Detection {
        &self.detection
    }

    /// The bias of each joint, as of the last update.
    pub fn bias(&self) -> &[JointBias] {
        &self.bias
    }

    /// Whether the present contact may only be a bias: it was there when the stream began.
    pub(crate) fn has_unseen_begin(&self) -> bool {
        let begin_ns = self.begin_ns.unwrap_or(i64::MAX);
        let since_ns = self.detection.since_ns;
        since_ns.is_some_and(|since_ns| secs_between(begin_ns, since_ns) < BEGIN_SECS)
    }

    /// Takes other parameters over and forgets the present contact; bias and noise stay.
    ///
    /// # Errors
    /// If a parameter is out of range; then all stays as it was.
    pub fn set_parameters(
        &mut self,
        parameters: &DetectorParameters,
    ) -> Result<(), ParameterError> {
        parameters.check()?;
        self.parameters = parameters.clone();
        (self.joints.iter_mut()).for_each(|joint| joint.set_least_torque(parameters.least_torque));
        self.forget_contact();
        Ok(())
    }

    /// Sets the biases, as after a tare; ends what seemed a contact.
    pub(crate) fn set_bias(&mut self, bias: impl Fn(usize) -> JointBias) {
        for (index, joint) in self.joints.iter_mut().enumerate() {
            joint.set_bias(bias(index));
        }
        self.blocks.clear();
        if self.detection.in_contact {
            self.end(self.last_ns.unwrap_or_default());
        }
        self.tell_bias();
    }

    /// Takes one sample in.
    pub fn update(&mut self, sample: Admitted<'_>) -> &Detection {
        let JointSample {
            stamp_ns,
            position,
            external_torque,
        } = sample.sample();
        let stamp_ns = *stamp_ns;
        let step_secs = self.advance(stamp_ns, position);
        self.weighing = self.weighing_at(stamp_ns, position);
        let weighing = self.weighing;
        for (joint, &torque) in self.joints.iter_mut().zip(external_torque) {
            joint.look(torque, step_secs, &self.charts);
        }
        let torques = self.joints.iter().map(JointDetector::torque);
        let (joints, turning) = (&self.joints, self.motion.turning());
        let pooled = Turns::pooled(joints.iter().map(|joint| &joint.turns));
        let jump = |joint: usize, chart: usize| {
            (joints[joint].turns).at(chart, turning[joint].narrow, &pooled)
        };
        self.onset.look(position, torques, step_secs, jump);
        let found = self.motion.turning().iter().zip(self.onset.partials());
        for (joint, (&turning, partial)) in self.joints.iter_mut().zip(found) {
            joint.weigh(stamp_ns, turning, &self.charts, partial, &weighing);
        }
        (self.joined).weigh(
            &self.onset,
            weighing.threshold,
            self.parameters.least_torque,
        );
        self.detection.event = None;
        match self.detection.in_contact {
            true => self.watch_for_end(stamp_ns, step_secs),
            false => self.watch_for_start(stamp_ns, position, step_secs),
        }
        self.tell_joints();
        self.tell_bias();
        &self.detection
    }

    /// Takes the stamp and position in; tells the time since the last sample, s, which is above zero.
    fn advance(&mut self, stamp_ns: i64, position: &[f64]) -> f64 {
        let last_ns = self.last_ns.replace(stamp_ns);
        let step_secs = last_ns.map_or(0.0, |last_ns| secs_between(last_ns, stamp_ns));
        let is_next = step_secs > 0.0 && step_secs <= GAP_SECS;
        let goes_on = is_next && !self.motion.leaps(position, step_secs);
        self.begin_ns.get_or_insert(stamp_ns);
        if !goes_on {
            self.charts.begin();
            self.onset.begin();
            self.motion.begin(position);
            self.blocks.clear();
            self.joints.iter_mut().for_each(JointDetector::begin);
            return self.period_secs;
        }
        self.period_secs += (step_secs - self.period_secs) / PERIOD_SAMPLES;
        self.charts.advance(step_secs);
        let begins = self.motion.has_begun();
        self.motion.update(position, step_secs);
        if begins {
            // What motion gets wrong is not yet part of the bias.
            let unknown = self.parameters.motion_std * self.motion.quickness();
            (self.joints.iter_mut()).for_each(|joint| joint.bias.variance += unknown * unknown);
        }
        step_secs
    }

    fn weighing_at(&self, stamp_ns: i64, position: &[f64]) -> Weighing {
        let looks = 3600.0 / self.period_secs
            * (self.joints.len() * (joint::CHARTS + 2 * onset::ONSETS)) as f64;
        let frozen_variance = self.detection.since_ns.map_or(0.0, |since_ns| {
            let secs = secs_between(since_ns, stamp_ns).max(0.0);
            self.touch.frozen_variance(position, secs)
        });
        let threshold = alarm::threshold(self.parameters.false_alarms_per_hour, looks);
        let quickness = self.motion.quickness();
        Weighing {
            threshold,
            lasting: touch::lasting(threshold, quickness),
            x2: quickness * quickness,
            frozen_variance,
        }
    }

    /// How far the chart that speaks most for a contact is beyond its threshold: 1 is at it.
    fn ratio(&self) -> f64 {
        (self.joints.iter()).fold(self.joined.ratio, |most, joint| most.max(joint.ratio))
    }

    /// The joint that speaks most for a contact.
    fn strongest(&self) -> Option<usize> {
        let ratio = |joint: usize| self.joints[joint].ratio;
        (0..self.joints.len()).max_by(|&a, &b| ratio(a).total_cmp(&ratio(b)))
    }

    fn watch_for_start(&mut self, stamp_ns: i64, position: &[f64], step_secs: f64) {
        let newest = self.joints.iter().map(|joint| joint.newest_ratio);
        let newest = newest.fold(self.joined.newest_ratio, f64::max);
        if newest < 1.0 {
            return self.learn(stamp_ns, step_secs, newest);
        }
        if self.ratio() < 1.0 {
            return;
        }
        let strongest = self.strongest().map(|joint| &self.joints[joint]);
        let Some(since_ns) = strongest.and_then(|joint| joint.stirred_ns) else {
            return;
        };
        let lasted_secs = secs_between(since_ns, stamp_ns);
        // One sample alone is no contact.
        if lasted_secs > 0.0 && lasted_secs + 1e-9 >= self.parameters.min_secs {
            self.start(stamp_ns, since_ns, position);
        }
    }

    /// Learns noise and bias from a sample without contact.
    fn learn(&mut self, stamp_ns: i64, step_secs: f64, ratio: f64) {
        // What may be a contact's begin counts less (Tukey's biweight).
        let trust = (1.0 - ratio * ratio).powi(2);
        let forgetting = Forgetting::new(&self.parameters, step_secs, self.motion.speed());
        let (motion, motion_std) = (&self.motion, self.parameters.motion_std);
        (self.blocks).take(stamp_ns, step_secs, motion, &mut self.joints, motion_std);
        for (joint, turning) in self.joints.iter_mut().zip(motion.turning()) {
            joint.learn_bias(trust, turning.wide, forgetting);
        }
        self.onset.learn(trust);
    }

    fn start(&mut self, stamp_ns: i64, since_ns: i64, position: &[f64]) {
        self.blocks.restore(since_ns, &mut self.joints);
        self.touch.begin(position, &self.joints, &self.motion);
        self.detection.in_contact = true;
        self.detection.since_ns = Some(since_ns);
        self.detection.first_link = None;
        self.detection.event = Some(ContactEvent {
            change: ContactChange::Start,
            stamp_ns: since_ns,
            noticed_ns: stamp_ns,
            confidence: self.confidence(),
        });
    }

    fn watch_for_end(&mut self, stamp_ns: i64, step_secs: f64) {
        let x2 = self.weighing.x2;
        for (joint, turning) in self.joints.iter_mut().zip(self.motion.turning()) {
            joint.doubt(step_secs, x2, *turning);
        }
        let (ratio, share) = (self.ratio(), self.parameters.release_share);
        self.touch.watch(&self.joints, ratio, share, step_secs);
        // An end is a sudden change, too, and none that begins a contact.
        if self.touch.quiet_secs > self.parameters.release_secs && ratio < 1.0 {
            self.end(stamp_ns);
        }
    }

    fn end(&mut self, stamp_ns: i64) {
        let quiet_ns = (self.touch.quiet_secs * 1e9) as i64;
        let since_ns = self.detection.since_ns.unwrap_or(stamp_ns);
        let ended = self.touch.ended(secs_between(since_ns, stamp_ns));
        self.detection.in_contact = false;
        self.detection.since_ns = None;
        self.detection.first_link = None;
        self.detection.event = Some(ContactEvent {
            change: ContactChange::End,
            stamp_ns: stamp_ns.saturating_sub(quiet_ns),
            noticed_ns: stamp_ns,
            confidence: (self.joints.iter())
                .map(JointDetector::freedom)
                .fold(1.0, f64::min),
        });
        self.blocks.clear();
        for joint in &mut self.joints {
            joint.thaw(self.weighing.frozen_variance);
            joint.settle(ended, self.parameters.motion_std);
        }
    }

    fn confidence(&self) -> f64 {
        let z = self.weighing.threshold;
        alarm::confidence(self.parameters.false_alarms_per_hour, z, self.ratio())
    }

    fn tell_joints(&mut self) {
        let in_contact = self.detection.in_contact;
        self.detection.confidence = match in_contact {
            true => self.detection.confidence.max(self.confidence()),
            false => 0.0,
        };
        for (feels, joint) in self.detection.joints.iter_mut().zip(&self.joints) {
            *feels = in_contact && joint.ratio >= 1.0;
        }
        let known = self.detection.first_link;
        self.detection.first_link = self.reach.first_link(&self.detection.joints, known);
    }

    fn tell_bias(&mut self) {
        for (bias, joint) in self.bias.iter_mut().zip(&self.joints) {
            *bias = joint.bias(&self.charts, &self.weighing);
        }
    }

    /// Forgets everything learned.
    pub fn reset(&mut self) {
        self.joints.fill(JointDetector::new(&self.parameters));
        self.charts.begin();
        self.onset.forget();
        self.joined = Joined::new(self.joints.len());
        self.blocks.clear();
        self.last_ns = None;
        self.bias.fill(JointBias::default());
        self.forget_contact();
    }

    /// Forgets the present contact; bias and noise stay.
    pub fn forget_contact(&mut self) {
        self.begin_ns = None;
        self.detection.joints.fill(false);
        self.detection = Detection {
            joints: std::mem::take(&mut self.detection.joints),
            ..Detection::default()
        };
    }
}

/// Time from one stamp to another, s.
fn secs_between(from_ns: i64, to_ns: i64) -> f64 {
    to_ns.saturating_sub(from_ns) as f64 * 1e-9
}
