//! Triangle meshes.

use std::collections::HashMap;

use nalgebra::{Isometry3, Point3, Vector3};

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

    /// Volume enclosed, m³: positive where the triangles face outwards. Taken from the mean of the vertices, so that it
    /// also means something for a mesh with small holes.
    pub fn signed_volume(&self) -> f64 {
        let sum: Vector3<f64> = self.vertices.iter().map(|vertex| vertex.coords).sum();
        let centre = Point3::from(sum / self.vertices.len().max(1) as f64);
        let sixfold = |corners: [Point3<f64>; 3]| {
            let [a, b, c] = corners.map(|corner| corner - centre);
            a.dot(&b.cross(&c))
        };
        (0..self.triangles.len())
            .map(|triangle| sixfold(self.corners(triangle)))
            .sum::<f64>()
            / 6.0
    }

    /// Area of all triangles, m².
    pub fn area(&self) -> f64 {
        self.area_vectors().map(|vector| vector.norm()).sum()
    }

    /// Sum over the triangles of area times normal, m²; zero for a closed mesh.
    pub(crate) fn area_vector(&self) -> Vector3<f64> {
        self.area_vectors().sum()
    }

    fn area_vectors(&self) -> impl Iterator<Item = Vector3<f64>> {
        (0..self.triangles.len()).map(|triangle| {
            let [a, b, c] = self.corners(triangle);
            (b - a).cross(&(c - a)) / 2.0
        })
    }

    /// Diagonal of the bounding box, m; zero for a mesh without vertices.
    pub fn extent(&self) -> f64 {
        let Some(first) = self.vertices.first() else {
            return 0.0;
        };
        let (low, high) = (self.vertices.iter()).fold((*first, *first), |(low, high), vertex| {
            (low.inf(vertex), high.sup(vertex))
        });
        (high - low).norm()
    }

    /// Scales the vertices; a reflection also turns the triangles over, so that they still face outwards.
    pub(crate) fn scale(&mut self, scale: &Vector3<f64>) {
        for vertex in &mut self.vertices {
            vertex.coords.component_mul_assign(scale);
        }
        if scale.iter().filter(|factor| **factor < 0.0).count() % 2 == 1 {
            self.flip();
        }
    }

    /// Moves the vertices to another frame.
    pub(crate) fn transform(&mut self, a_from_b: &Isometry3<f64>) {
        for vertex in &mut self.vertices {
            *vertex = a_from_b * *vertex;
        }
    }

    /// Turns every triangle over.
    pub(crate) fn flip(&mut self) {
        for triangle in &mut self.triangles {
            triangle.swap(1, 2);
        }
    }

    /// Adds the triangles of another mesh, none of whose vertices are shared.
    pub(crate) fn append(&mut self, other: &Self) {
        let offset = self.vertices.len() as u32;
        self.vertices.extend_from_slice(&other.vertices);
        let moved = |triangle: &[u32; 3]| triangle.map(|vertex| vertex + offset);
        self.triangles.extend(other.triangles.iter().map(moved));
    }

    /// How the triangles meet along their edges.
    pub fn edges(&self) -> EdgeCount {
        let mut uses: HashMap<[u32; 2], (u32, u32)> = HashMap::new();
        for [a, b, c] in &self.triangles {
            for (from, to) in [(*a, *b), (*b, *c), (*c, *a)] {
                let count = uses.entry([from.min(to), from.max(to)]).or_default();
                if from < to {
                    count.0 += 1;
                } else {
                    count.1 += 1;
                }
            }
        }
        let count = |wanted: fn(&(u32, u32)) -> bool| uses.values().filter(|u| wanted(u)).count();
        EdgeCount {
            total: uses.len(),
            open: count(|(forth, back)| forth + back == 1),
            inconsistent: count(|(forth, back)| forth + back > 1 && forth != back),
        }
    }
}

/// How the triangles of a mesh meet along their edges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EdgeCount {
    /// All edges, each once.
    pub total: usize,
    /// Edges with one triangle only: the rims of holes.
    pub open: usize,
    /// Edges whose triangles do not run along them equally often both ways: neighbours disagree on which side is
    /// outside, or an odd number of triangles meet.
    pub inconsistent: usize,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::cuboid;

    fn cube() -> TriangleMesh {
        cuboid(&Vector3::repeat(2.0))
    }

    #[test]
    fn volume_does_not_depend_on_the_place_and_changes_sign_when_flipped() {
        let mut mesh = cube();
        mesh.transform(&Isometry3::new(
            Vector3::new(5.0, -7.0, 11.0),
            Vector3::new(0.3, 0.2, 0.1),
        ));
        assert!((mesh.signed_volume() - 8.0).abs() < 1e-9);
        assert!(mesh.area_vector().norm() < 1e-9);
        mesh.flip();
        assert!((mesh.signed_volume() + 8.0).abs() < 1e-9);
    }

    #[test]
    fn a_reflected_mesh_still_faces_outwards() {
        for scale in [[-1.0, 1.0, 1.0], [-1.0, -2.0, 1.0], [-1.0, -1.0, -1.0]] {
            let mut mesh = cube();
            mesh.scale(&scale.into());
            let volume: f64 = 8.0
                * scale
                    .iter()
                    .map(|factor: &f64| factor.abs())
                    .product::<f64>();
            assert!((mesh.signed_volume() - volume).abs() < 1e-9);
        }
    }

    #[test]
    fn edges_tell_holes_and_disagreement() {
        let closed = EdgeCount {
            total: 18,
            open: 0,
            inconsistent: 0,
        };
        assert_eq!(cube().edges(), closed);
        let mut holed = cube();
        holed.triangles.pop();
        assert_eq!(holed.edges(), EdgeCount { open: 3, ..closed });
        let mut disagreeing = cube();
        disagreeing.triangles[4].swap(0, 1);
        let expected = EdgeCount {
            inconsistent: 3,
            ..closed
        };
        assert_eq!(disagreeing.edges(), expected);
    }

    #[test]
    fn a_mesh_without_vertices_has_no_measures() {
        let empty = TriangleMesh::default();
        let measures = (empty.extent(), empty.area(), empty.signed_volume());
        assert_eq!(measures, (0.0, 0.0, 0.0));
    }
}
