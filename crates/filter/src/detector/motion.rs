//! How fast the robot moves, as far as the detector needs to know.

use super::joint::Turning;

/// Time constant of the smoothing of joint speeds, s.
const SMOOTHING_SECS: f64 = 0.02;
/// How long motion goes on to count after it ended: what it left wrong is learned meanwhile, s.
const LINGER_SECS: f64 = 0.3;
/// Speed that counts as half of a fast motion, rad/s.
const HALF_SPEED: f64 = 1.0;
/// Time constant of the smoothing of joint accelerations, s.
const ACCELERATION_SECS: f64 = 0.05;
/// A joint turns this long before and after its speed changes its sign, s, if it moved at least this fast, rad/s, within
/// this time, s.
const TURN_SECS: f64 = 0.3;
const MOVING_SPEED: f64 = 0.03;
const MOVED_SECS: f64 = 0.5;
/// Speed below which friction jumps, rad/s, if the joint moved at least this fast, rad/s, and how long the charts of sudden
/// changes show it, s.
const JUMP_SPEED: f64 = 0.05;
const CREEPING_SPEED: f64 = 0.003;
const JUMP_SECS: f64 = 0.12;
/// No joint moves faster, rad/s; nor is a change within a time as short as this, s, told from what stamps are wrong by.
const FASTEST_SPEED: f64 = 20.0;
const SHORT_SECS: f64 = 0.01;

/// One joint's motion, in rad/s and rad/s².
#[derive(Clone, Copy, Debug, Default)]
struct JointMotion {
    position: f64,
    velocity: f64,
    acceleration: f64,
    /// Its speed; it falls slowly.
    peak: f64,
    /// How lately its speed changed its sign, 0 to 1.
    turned: f64,
    /// How lately its speed was about zero, 0 to 1.
    stood: f64,
}

impl JointMotion {
    /// Takes the second position of a stream in, the first that tells a speed.
    fn begin(&mut self, position: f64, step_secs: f64) {
        self.velocity = (position - self.position) / step_secs;
        self.peak = self.velocity.abs();
        self.position = position;
    }

    fn update(&mut self, position: f64, step_secs: f64) {
        let before = self.velocity;
        let follow = |secs: f64| 1.0 - (-step_secs / secs).exp();
        let velocity = (position - self.position) / step_secs;
        self.position = position;
        self.velocity += follow(SMOOTHING_SECS) * (velocity - before);
        let acceleration = (self.velocity - before) / step_secs;
        self.acceleration += follow(ACCELERATION_SECS) * (acceleration - self.acceleration);
        let lingering = self.peak * (-step_secs / MOVED_SECS).exp();
        self.peak = self.velocity.abs().max(lingering);
        self.turned = match before * self.velocity < 0.0 {
            true => 1.0,
            false => self.turned * (-step_secs / TURN_SECS).exp(),
        };
        // The smoothed speed lags.
        let speed = self.velocity + SMOOTHING_SECS * self.acceleration;
        let stands = (-(speed / JUMP_SPEED).powi(2)).exp();
        self.stood = stands.max(self.stood * (-step_secs / JUMP_SECS).exp());
    }

    /// Whether the joint lately moved at this speed, rad/s, 0 to 1.
    fn has_moved(&self, speed: f64) -> f64 {
        (self.peak / speed).min(1.0).powi(2)
    }

    fn turning(&self) -> f64 {
        let slows = self.velocity * self.acceleration < 0.0;
        let will_turn = match slows {
            true => (-(self.velocity / (self.acceleration * TURN_SECS)).powi(2)).exp(),
            false => 0.0,
        };
        self.has_moved(MOVING_SPEED) * will_turn.max(self.turned)
    }
}

/// The motion of all joints.
#[derive(Clone, Debug)]
pub(super) struct Motion {
    joints: Vec<JointMotion>,
    turning: Vec<Turning>,
    speed: f64,
    /// Whether there is only one position yet.
    has_begun: bool,
}

impl Motion {
    pub(super) fn new(dof: usize) -> Self {
        Self {
            joints: vec![JointMotion::default(); dof],
            turning: vec![Turning::default(); dof],
            speed: 0.0,
            has_begun: true,
        }
    }

    /// Begins at a position, at rest.
    pub(super) fn begin(&mut self, position: &[f64]) {
        for (joint, &position) in self.joints.iter_mut().zip(position) {
            *joint = JointMotion {
                position,
                ..JointMotion::default()
            };
        }
        self.turning.fill(Turning::default());
        self.speed = 0.0;
        self.has_begun = true;
    }

    /// Whether only one position is known yet, and no speed.
    pub(super) fn has_begun(&self) -> bool {
        self.has_begun
    }

    /// Whether a joint cannot have moved to this position: another recording goes on, or the angle was wrapped.
    pub(super) fn leaps(&self, position: &[f64], step_secs: f64) -> bool {
        let furthest = FASTEST_SPEED * step_secs.max(SHORT_SECS);
        let mut joints = self.joints.iter().zip(position);
        joints.any(|(joint, position)| (position - joint.position).abs() > furthest)
    }

    /// Takes a position in.
    pub(super) fn update(&mut self, position: &[f64], step_secs: f64) {
        let mut squares = 0.0;
        for (joint, &position) in self.joints.iter_mut().zip(position) {
            match self.has_begun {
                true => joint.begin(position, step_secs),
                false => joint.update(position, step_secs),
            }
            squares += joint.velocity * joint.velocity;
        }
        self.has_begun = false;
        for (turning, joint) in self.turning.iter_mut().zip(&self.joints) {
            *turning = Turning {
                wide: joint.turning(),
                narrow: joint.has_moved(CREEPING_SPEED) * joint.stood,
            };
        }
        let lingering = self.speed * (-step_secs / LINGER_SECS).exp();
        self.speed = squares.sqrt().max(lingering);
    }

    /// Euclidean norm of the joints' speeds, rad/s; it falls slowly.
    pub(super) fn speed(&self) -> f64 {
        self.speed
    }

    /// How fast the motion is: 0 at rest, towards 1 in fast motion.
    pub(super) fn quickness(&self) -> f64 {
        self.speed / (self.speed + HALF_SPEED)
    }

    /// Whether each joint turns back or stops: there friction jumps, and what is known of it is wrong.
    pub(super) fn turning(&self) -> &[Turning] {
        &self.turning
    }
}
