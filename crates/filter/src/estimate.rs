//! What the filter says about the contact.

use nalgebra::{Matrix3, Point3, Unit, Vector3};

use crate::CredibleRegion;

/// What is known about a contact at one instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContactStatus {
    /// Nothing touches.
    NoContact,
    /// Something touches, but the torques do not tell where: see the modes.
    Ambiguous,
    /// Something touches, and the first mode tells where.
    Located,
}

impl ContactStatus {
    /// The word that files, tables and topics use: `none`, `ambiguous` or `located`.
    pub fn word(self) -> &'static str {
        match self {
            Self::NoContact => "none",
            Self::Ambiguous => "ambiguous",
            Self::Located => "located",
        }
    }
}

/// One explanation of the torques: a place on one link.
#[derive(Clone, Debug, PartialEq)]
pub struct Mode {
    /// Index of the touched link in [`Robot::links`](palpate_model::Robot::links).
    pub link: usize,
    /// Probability of this mode; those of all modes sum to at most one.
    pub probability: f64,
    /// Contact point in the root frame, m.
    pub point_in_root: Point3<f64>,
    /// Contact point in the link's frame, m.
    pub point_in_link: Point3<f64>,
    /// Outward surface normal in the root frame.
    pub normal_in_root: Unit<Vector3<f64>>,
    /// Force on the robot in the root frame, N. Without friction it is −F n̂.
    pub force_in_root: Vector3<f64>,
    /// Size F of the force, N.
    pub force: f64,
    /// Contact stiffness K, N/m.
    pub stiffness: f64,
    /// Covariance of the point in the root frame, m².
    pub covariance_in_root: Matrix3<f64>,
}

impl Mode {
    /// Standard deviation of the contact point, m: the root of the covariance's trace.
    pub fn std(&self) -> f64 {
        self.covariance_in_root.trace().max(0.0).sqrt()
    }
}

/// The contact at one instant. "No contact" is a value, not an error: then there are no modes.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactEstimate {
    /// Stamp of the sample that this follows from, ns.
    pub stamp_ns: i64,
    /// What is known.
    pub status: ContactStatus,
    /// Explanations, the most probable first; empty without contact.
    pub modes: Vec<Mode>,
}

impl ContactEstimate {
    /// The most probable explanation; none without contact.
    pub fn best(&self) -> Option<&Mode> {
        self.modes.first()
    }

    /// The smallest region, in the root frame, that holds the contact with probability `level` (0 … 1).
    pub fn region(&self, level: f64) -> CredibleRegion {
        CredibleRegion::new(&self.modes, level)
    }

    /// Probability that `link` is the touched one: the sum over its modes.
    pub fn link_probability(&self, link: usize) -> f64 {
        self.modes
            .iter()
            .filter(|mode| mode.link == link)
            .map(|mode| mode.probability)
            .sum()
    }
}
