//! What each joint's external torque reads while nothing touches.

/// The bias of one joint's external torque.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointBias {
    /// The bias, Nm (N for a prismatic joint); subtracted before anything else looks at the torque.
    pub mean: f64,
    /// Standard deviation of what is left of it, Nm.
    pub std: f64,
}
