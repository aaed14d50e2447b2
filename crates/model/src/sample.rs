//! One sample of what the robot reports.

/// Joint positions and external joint torques of one instant.
///
/// Both vectors have one entry a movable joint, in the order of [`Robot::joints`](crate::Robot::joints). The external
/// torque is the torque that the environment applies on the joints, τ_ext = J(q)ᵀ f, with f the force *on the robot*.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointSample {
    /// Time of the sample, nanoseconds since the epoch of its source.
    pub stamp_ns: i64,
    /// Joint positions q, rad (revolute) or m (prismatic).
    pub position: Vec<f64>,
    /// External joint torques τ_ext, Nm (revolute) or N (prismatic).
    pub external_torque: Vec<f64>,
}
