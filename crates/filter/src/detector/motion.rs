//! How fast the robot moves, as far as the detector needs to know.

/// Time constant of the smoothing of joint speeds, s.
const SMOOTHING_SECS: f64 = 0.02;
/// How long motion goes on to count after it ended: what it left wrong is learned meanwhile, s.
const LINGER_SECS: f64 = 0.3;
/// Speed that counts as half of a fast motion, rad/s.
const HALF_SPEED: f64 = 0.3;

/// The joints' motion.
#[derive(Clone, Debug)]
pub(super) struct Motion {
    last: Vec<f64>,
    velocity: Vec<f64>,
    speed: f64,
}

impl Motion {
    pub(super) fn new(dof: usize) -> Self {
        Self {
            last: vec![0.0; dof],
            velocity: vec![0.0; dof],
            speed: 0.0,
        }
    }

    /// Begins at a position, at rest.
    pub(super) fn begin(&mut self, position: &[f64]) {
        self.last.copy_from_slice(position);
        self.velocity.fill(0.0);
        self.speed = 0.0;
    }

    /// Takes a position in.
    pub(super) fn update(&mut self, position: &[f64], step_secs: f64) {
        let gain = 1.0 - (-step_secs / SMOOTHING_SECS).exp();
        let mut squares = 0.0;
        for ((last, velocity), position) in
            (self.last.iter_mut().zip(&mut self.velocity)).zip(position)
        {
            *velocity += gain * ((position - *last) / step_secs - *velocity);
            *last = *position;
            squares += *velocity * *velocity;
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
}
