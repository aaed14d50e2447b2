//! Motions, forces and inertias of rigid bodies as six-dimensional vectors and operators (Featherstone, *Rigid Body
//! Dynamics Algorithms*, 2008, chapter 2), all taken at the origin of a body's frame and expressed along its axes.

use std::ops::{Add, AddAssign, Mul};

use nalgebra::{Isometry3, Matrix3, Vector3};

use crate::Inertial;

/// Velocity or acceleration of a rigid body.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Twist {
    /// rad/s.
    pub angular: Vector3<f64>,
    /// Of the body's point at the frame's origin, m/s.
    pub linear: Vector3<f64>,
}

/// Force on a rigid body, or its momentum.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Wrench {
    /// About the frame's origin, Nm.
    pub moment: Vector3<f64>,
    /// N.
    pub force: Vector3<f64>,
}

/// Where a body's frame is in its parent's.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placement {
    pub turn: Matrix3<f64>,
    pub shift: Vector3<f64>,
}

/// Mass, first and second moment of one or more bodies that move as one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SpatialInertia {
    /// kg.
    pub mass: f64,
    /// Mass times centre, kg m.
    pub first_moment: Vector3<f64>,
    /// Rotational inertia about the frame's origin, kg m².
    pub about_origin: Matrix3<f64>,
}

impl Add for Twist {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            angular: self.angular + other.angular,
            linear: self.linear + other.linear,
        }
    }
}

impl Mul<f64> for Twist {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        Self {
            angular: self.angular * factor,
            linear: self.linear * factor,
        }
    }
}

impl Twist {
    /// How `other` changes when it is carried along with this motion: v × m.
    pub fn cross(&self, other: &Self) -> Self {
        Self {
            angular: self.angular.cross(&other.angular),
            linear: self.angular.cross(&other.linear) + self.linear.cross(&other.angular),
        }
    }

    /// How a momentum changes when it is carried along with this motion: v ×* h.
    pub fn cross_wrench(&self, momentum: &Wrench) -> Wrench {
        Wrench {
            moment: self.angular.cross(&momentum.moment) + self.linear.cross(&momentum.force),
            force: self.angular.cross(&momentum.force),
        }
    }

    /// Power of a force on a body that moves so; along a unit motion, the torque that a joint feels.
    pub fn dot(&self, wrench: &Wrench) -> f64 {
        self.angular.dot(&wrench.moment) + self.linear.dot(&wrench.force)
    }
}

impl AddAssign for Wrench {
    fn add_assign(&mut self, other: Self) {
        self.moment += other.moment;
        self.force += other.force;
    }
}

impl Placement {
    /// A motion of the parent, seen from the body.
    pub fn twist_in_body(&self, twist_in_parent: &Twist) -> Twist {
        let at_body = twist_in_parent.linear + twist_in_parent.angular.cross(&self.shift);
        Twist {
            angular: self.turn.tr_mul(&twist_in_parent.angular),
            linear: self.turn.tr_mul(&at_body),
        }
    }

    /// A force on the body, seen from the parent.
    pub fn wrench_in_parent(&self, wrench_in_body: &Wrench) -> Wrench {
        let force = self.turn * wrench_in_body.force;
        Wrench {
            moment: self.turn * wrench_in_body.moment + self.shift.cross(&force),
            force,
        }
    }

    /// The inertia of the body, seen from the parent.
    pub fn inertia_in_parent(&self, inertia_in_body: &SpatialInertia) -> SpatialInertia {
        let mass = inertia_in_body.mass;
        let turned = self.turn * inertia_in_body.first_moment;
        let first_moment = turned + self.shift * mass;
        // By the parallel axes: from the body's origin to the parent's, both moments count.
        let shifted =
            parallel_axes(&self.shift, &turned) + parallel_axes(&first_moment, &self.shift);
        SpatialInertia {
            mass,
            first_moment,
            about_origin: self.turn * inertia_in_body.about_origin * self.turn.transpose()
                + shifted,
        }
    }
}

impl From<Isometry3<f64>> for Placement {
    fn from(pose: Isometry3<f64>) -> Self {
        Self {
            turn: pose.rotation.to_rotation_matrix().into_inner(),
            shift: pose.translation.vector,
        }
    }
}

impl AddAssign for SpatialInertia {
    fn add_assign(&mut self, other: Self) {
        self.mass += other.mass;
        self.first_moment += other.first_moment;
        self.about_origin += other.about_origin;
    }
}

impl SpatialInertia {
    /// The inertia of a body that is fixed to a frame.
    pub fn new(inertial: &Inertial, frame_from_link: &Isometry3<f64>) -> Self {
        let centre = inertial.centre_in_link.coords;
        let first_moment = centre * inertial.mass;
        let in_link = Self {
            mass: inertial.mass,
            first_moment,
            about_origin: inertial.inertia_in_link + parallel_axes(&centre, &first_moment),
        };
        Placement::from(*frame_from_link).inertia_in_parent(&in_link)
    }

    /// Momentum of the body in motion, or the force that accelerates it from rest.
    pub fn of(&self, twist: &Twist) -> Wrench {
        Wrench {
            moment: self.about_origin * twist.angular + self.first_moment.cross(&twist.linear),
            force: twist.linear * self.mass + twist.angular.cross(&self.first_moment),
        }
    }
}

/// −\[a\]×\[b\]×, for a mass moment b at a: what the parallel axes add.
fn parallel_axes(a: &Vector3<f64>, b: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::from_diagonal_element(a.dot(b)) - b * a.transpose()
}
