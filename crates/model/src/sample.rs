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

/// Joint positions, speeds and measured joint torques of one instant, for robots that report no external torque.
///
/// One entry a movable joint, in the order of [`Robot::joints`](crate::Robot::joints).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeasuredSample {
    /// Time of the sample, nanoseconds since the epoch of its source.
    pub stamp_ns: i64,
    /// Joint positions q, rad (revolute) or m (prismatic).
    pub position: Vec<f64>,
    /// Joint speeds q̇, rad/s or m/s; empty where the robot reports none.
    pub velocity: Vec<f64>,
    /// Torque τ by which each joint drives the arm, as its sensor or its motor current tells, Nm or N: positive along the
    /// joint's axis, so that it is the gravity torque g(q) while the arm rests untouched.
    pub torque: Vec<f64>,
}
