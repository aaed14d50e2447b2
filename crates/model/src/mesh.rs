//! Triangle meshes.

use nalgebra::Point3;

/// Triangles over shared vertices. Cleaned by its loaders: no duplicate vertices, no degenerate triangles, indices in
/// range, coordinates finite.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Vertices, m.
    pub vertices: Vec<Point3<f64>>,
    /// Vertex indices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl TriangleMesh {
    /// The three corners of a triangle.
    pub fn corners(&self, triangle: usize) -> [Point3<f64>; 3] {
        self.triangles[triangle].map(|vertex| self.vertices[vertex as usize])
    }
}
