//! The robot as a tree of links, joined by movable or fixed joints.

use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};

use crate::{Inertial, TriangleMesh};

/// How a movable joint moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// Rotates about its axis between limits.
    Revolute,
    /// Rotates about its axis without limits.
    Continuous,
    /// Slides along its axis.
    Prismatic,
}

/// Limits of a joint as the URDF states them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointLimits {
    /// Lowest position, rad or m.
    pub lower: f64,
    /// Highest position, rad or m.
    pub upper: f64,
    /// Highest speed, rad/s or m/s.
    pub velocity: f64,
    /// Highest torque, Nm, or force, N.
    pub effort: f64,
}

/// A movable joint. Its index in [`Robot::joints`] is its index in every vector of positions or torques.
#[derive(Clone, Debug)]
pub struct Joint {
    /// Name in the URDF.
    pub name: String,
    /// How it moves.
    pub kind: JointKind,
    /// Axis in the joint's frame, which is the child link's frame.
    pub axis_in_joint: Unit<Vector3<f64>>,
    /// Limits; none for a continuous joint.
    pub limits: Option<JointLimits>,
}

impl Joint {
    /// Pose of the moved frame in the joint's frame at rest, for position `q` (rad or m).
    pub fn rest_from_moved(&self, q: f64) -> Isometry3<f64> {
        match self.kind {
            JointKind::Prismatic => Translation3::from(self.axis_in_joint.into_inner() * q).into(),
            JointKind::Revolute | JointKind::Continuous => {
                let rotation = UnitQuaternion::from_axis_angle(&self.axis_in_joint, q);
                Isometry3::from_parts(Translation3::identity(), rotation)
            }
        }
    }
}

/// A link: its place in the tree, its mass and its geometry.
#[derive(Clone, Debug)]
pub struct Link {
    /// Name in the URDF.
    pub name: String,
    /// Index of the parent link in [`Robot::links`]; always smaller than this link's own; none for the root.
    pub parent: Option<usize>,
    /// Pose of this link's frame in the parent's while its joint is at zero (the URDF joint's `<origin>`).
    pub parent_from_rest: Isometry3<f64>,
    /// Index of the movable joint between parent and this link; none where the joint is fixed.
    pub joint: Option<usize>,
    /// Indices of the movable joints between the root and this link, from the root outwards: the only joints that
    /// feel a contact on this link.
    pub path: Vec<usize>,
    /// Mass and inertia; none where the URDF gives none.
    pub inertial: Option<Inertial>,
    /// What can be touched, in this link's frame; none where the URDF gives no geometry.
    pub mesh: Option<TriangleMesh>,
}

/// A robot: a tree of links. Never changes after it is loaded.
#[derive(Clone, Debug)]
pub struct Robot {
    /// Name in the URDF.
    pub name: String,
    /// Movable joints, parents before children.
    pub joints: Vec<Joint>,
    /// Links, parents before children; the first is the root.
    pub links: Vec<Link>,
}

impl Robot {
    /// Number of movable joints.
    pub fn dof(&self) -> usize {
        self.joints.len()
    }

    /// Name of the root link, the frame that all results are given in.
    pub fn root(&self) -> &str {
        &self.links[0].name
    }

    /// Index of the movable joint with this name.
    pub fn joint_index(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint.name == name)
    }

    /// Index of the link with this name.
    pub fn link_index(&self, name: &str) -> Option<usize> {
        self.links.iter().position(|link| link.name == name)
    }
}
