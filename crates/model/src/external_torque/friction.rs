//! Friction in a joint's gear.

/// Friction of one joint: viscous and Coulomb.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointFriction {
    /// Nm s/rad (N s/m).
    pub viscous: f64,
    /// Nm (N).
    pub coulomb: f64,
}

impl JointFriction {
    /// Speed at which Coulomb friction has three quarters of its size, rad/s (m/s). At rest nobody knows its sign, and the
    /// noise of the speed is not to throw it about.
    pub const COULOMB_SPEED: f64 = 0.02;

    /// Torque that overcomes the friction at a joint speed (rad/s, m/s), Nm (N):
    /// viscous · q̇ + coulomb · tanh(q̇ / [`JointFriction::COULOMB_SPEED`]).
    pub fn torque(&self, speed: f64) -> f64 {
        self.viscous * speed + self.coulomb * (speed / Self::COULOMB_SPEED).tanh()
    }
}
