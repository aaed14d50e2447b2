//! The surface of one link: closest points and uniform samples.

use nalgebra::{Point3, Unit, Vector3};

use crate::TriangleMesh;

/// A point on a triangle of a [`Surface`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The point in the link's frame, m.
    pub point: Point3<f64>,
    /// Index of the triangle that it lies on.
    pub triangle: u32,
}

/// A link's mesh, prepared for the questions that the filter asks.
#[derive(Clone, Debug)]
pub struct Surface {
    mesh: TriangleMesh,
    normals: Vec<Unit<Vector3<f64>>>,
    /// Area of the triangles up to and with each one, m².
    cumulative_area: Vec<f64>,
}
