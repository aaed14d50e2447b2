//! Centre of mass and inertia of a closed mesh of even density.

use nalgebra::{Matrix3, Vector3};
use palpate_model::TriangleMesh;

/// Mass, its centre, and the inertia about that centre, in the mesh's frame.
pub struct Inertia {
    /// kg
    pub mass: f64,
    /// m
    pub center: Vector3<f64>,
    /// kg m², about the centre
    pub inertia: Matrix3<f64>,
}

/// Inertia of what `mesh` encloses, if it weighs `mass` (kg): sums over the tetrahedra from the origin to each triangle.
pub fn inertia(mesh: &TriangleMesh, mass: f64) -> Inertia {
    let (mut volume, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
    for triangle in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(triangle).map(|corner| corner.coords);
        let part = a.dot(&b.cross(&c)) / 6.0;
        let sum = a + b + c;
        volume += part;
        first += sum * (part / 4.0);
        let squares = a * a.transpose() + b * b.transpose() + c * c.transpose();
        second += (squares + sum * sum.transpose()) * (part / 20.0);
    }
    let center = first / volume;
    let spread = second / volume - center * center.transpose();
    let inertia = (Matrix3::identity() * spread.trace() - spread) * mass;
    Inertia {
        mass,
        center,
        inertia,
    }
}
