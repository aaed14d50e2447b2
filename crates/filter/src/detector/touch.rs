//! The present contact: where it began, whether it may be none, and for how long it has been quiet.

use super::bias;
use super::joint::{self, JointDetector};
use super::motion::Motion;

/// A short contact that hardly stood out may have been none, and teaches: noise while little is known of it, else what
/// happened on joints that turned back, if no other one felt it. In s and in thresholds.
const DOUBTFUL_SECS: f64 = 3.0;
const DOUBTFUL_RATIO: f64 = 1.5;

/// Standard deviations of a torque that say that a contact goes on while the arm is at rest, and how quick it is where as
/// many are needed as begin one, 0 to 1.
const LASTING: f64 = 4.0;
const QUICK: f64 = 0.5;

/// Standard deviations that say that a contact goes on, with all that the frozen bias may have become among them, given
/// those that begin one. While the arm explores slowly, they are fewer: it was there, and nothing says that it went. In
/// fast motion a torque that lasts may be a bias that became wrong.
pub(super) fn lasting(threshold: f64, quickness: f64) -> f64 {
    LASTING + (threshold - LASTING) * (quickness / QUICK).min(1.0)
}

/// What is known of the present contact; without one, of the last.
#[derive(Clone, Debug)]
pub(super) struct Touch {
    /// Where the robot was when it began, rad.
    position: Vec<f64>,
    /// Whether it stands out well, and whether a joint feels it that does not turn.
    stands_out: bool,
    is_off_turns: bool,
    /// The joint that alone feels it, if that turned when it began to.
    turned: Option<usize>,
    /// Time since a joint last said that it goes on, s.
    pub(super) quiet_secs: f64,
}

/// A contact that ended.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ended {
    /// Whether it was short and hardly stood out.
    pub(super) is_doubtful: bool,
    /// Whether it was short and began where nothing but turning joints felt it.
    pub(super) was_turn: bool,
    /// Whether a joint felt it that did not turn.
    pub(super) off_turns: bool,
}

impl Touch {
    pub(super) fn new(dof: usize) -> Self {
        Self {
            position: vec![0.0; dof],
            stands_out: false,
            is_off_turns: false,
            turned: None,
            quiet_secs: 0.0,
        }
    }

    pub(super) fn begin(&mut self, position: &[f64], joints: &[JointDetector], motion: &Motion) {
        self.position.copy_from_slice(position);
        self.stands_out = false;
        self.is_off_turns = false;
        self.turned = turned_alone(joints, motion);
        self.quiet_secs = 0.0;
    }

    /// Takes in what the joints say of one more sample, and how far the chart that speaks most is beyond its threshold.
    /// Joints that read less than `share` of what says that a contact goes on are quiet.
    pub(super) fn watch(&mut self, joints: &[JointDetector], ratio: f64, share: f64, secs: f64) {
        self.stands_out |= ratio >= DOUBTFUL_RATIO;
        self.is_off_turns |= joints.iter().any(|joint| joint.is_off_turns);
        let felt_beside = |turned: &usize| {
            let mut others = joints.iter().enumerate();
            others.any(|(joint, other)| joint != *turned && other.ratio >= 1.0)
        };
        self.turned = self.turned.filter(|turned| !felt_beside(turned));
        let is_quiet = joints.iter().all(|joint| joint.release_ratio < share);
        self.quiet_secs = if is_quiet {
            self.quiet_secs + secs
        } else {
            0.0
        };
    }

    /// By how much the biases became more uncertain since it began, Nm²: `secs` ago, at a position, rad.
    pub(super) fn frozen_variance(&self, position: &[f64], secs: f64) -> f64 {
        let squares = (position.iter().zip(&self.position)).map(|(now, then)| (now - then).powi(2));
        bias::frozen_variance(squares.sum::<f64>().sqrt(), secs)
    }

    /// What it was, now that it ended after such a time, s.
    pub(super) fn ended(&self, lasted_secs: f64) -> Ended {
        let was_short = lasted_secs < DOUBTFUL_SECS;
        Ended {
            was_turn: was_short && self.turned.is_some(),
            is_doubtful: was_short && !self.stands_out,
            off_turns: self.is_off_turns,
        }
    }
}

/// The joint that alone feels something, while it turns.
fn turned_alone(joints: &[JointDetector], motion: &Motion) -> Option<usize> {
    let mut loud = (0..joints.len()).filter(|&joint| joints[joint].ratio >= 1.0);
    let (first, other) = (loud.next(), loud.next());
    let turns = |joint: &usize| motion.turning()[*joint].narrow >= joint::DOUBTFUL_TURN;
    first.filter(turns).filter(|_| other.is_none())
}
