//! One hypothesis about the contact, as shown to the outside.

use nalgebra::{Point3, Unit, Vector3};

/// One particle, in the paper's state {link n, point p, force F, stiffness K}, with its weight.
#[derive(Clone, Debug, PartialEq)]
pub struct Particle {
    /// Index of the link in [`Robot::links`](palpate_model::Robot::links).
    pub link: usize,
    /// Contact point p in the link's frame, m.
    pub point_in_link: Point3<f64>,
    /// Mesh triangle that p lies on.
    pub triangle: u32,
    /// Outward normal n̂ of the surface at p in the link's frame.
    pub normal_in_link: Unit<Vector3<f64>>,
    /// Normal force F ≥ 0, N.
    pub force: f64,
    /// Contact stiffness K, N/m.
    pub stiffness: f64,
    /// Normalised weight; those of all particles sum to one.
    pub weight: f64,
}
