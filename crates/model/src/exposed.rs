//! Which triangles of a mesh can be touched from outside.
//!
//! Meshes drawn for construction have faces inside of others: motors, screws, the inner side of a shell. Nothing touches
//! those, but the torques may say that it could.

use nalgebra::{Point3, Vector3};

use crate::TriangleMesh;
use crate::bounds::Bounds;
use crate::clean::without_unused_vertices;
use crate::triangle::{NONE, Triangle};

/// Directions all around in which something is looked for. What is seen through less than one of them, as the ground of a
/// crooked bore, is not touched either.
const WAYS: usize = 128;
/// Where rays begin, in turn, as shares of the two edges from the first corner: in the middle and near the corners.
const BEGINNINGS: [[f64; 2]; 4] = [[1.0 / 3.0, 1.0 / 3.0], [0.1, 0.1], [0.8, 0.1], [0.1, 0.8]];
/// Height above the triangle at which they begin, m: more than files round away, less than a robot's surface shows.
const HAIR: f64 = 1e-5;

/// The mesh without its enclosed triangles: those from neither side of which a ray gets away. Both sides count, as
/// triangles may be wound wrongly and sheets be seen from behind. None if all are enclosed.
pub(crate) fn exposed(mesh: &TriangleMesh) -> Option<TriangleMesh> {
    let is_exposed = Walls::new(mesh).exposed();
    let kept = (mesh.triangles.iter().zip(is_exposed)).filter(|(_, is_exposed)| *is_exposed);
    let kept: Vec<_> = kept.map(|(triangle, _)| *triangle).collect();
    if kept.len() == mesh.triangles.len() {
        return Some(mesh.clone());
    }
    let kept = TriangleMesh {
        vertices: mesh.vertices.clone(),
        triangles: kept,
    };
    (!kept.triangles.is_empty()).then(|| without_unused_vertices(&kept))
}

/// A mesh, as it stands in the way of rays.
struct Walls {
    triangles: Vec<Triangle>,
    bounds: Bounds,
    ways: [Vector3<f64>; WAYS],
    /// The triangle last hit each way, which is likely to be hit from the next triangle, close by, too.
    last: [u32; WAYS],
}

impl Walls {
    fn new(mesh: &TriangleMesh) -> Self {
        let corners: Vec<_> = (0..mesh.triangles.len())
            .map(|index| mesh.corners(index))
            .collect();
        Self {
            bounds: Bounds::new(&corners),
            triangles: (corners.into_iter().zip(&mesh.triangles))
                .map(|(corners, vertices)| Triangle::new(corners, *vertices, [NONE; 3]))
                .collect(),
            ways: ways(),
            last: [0; WAYS],
        }
    }

    fn exposed(mut self) -> Vec<bool> {
        let mut exposed = vec![false; self.triangles.len()];
        for index in self.bounds.in_order().to_vec() {
            exposed[index as usize] = self.is_exposed(index);
        }
        exposed
    }

    fn is_exposed(&mut self, index: u32) -> bool {
        let triangle = self.triangles[index as usize].clone();
        let normal = *triangle.normal;
        let from = |at: usize, side: f64| {
            let [along_1, along_2] = BEGINNINGS[at % BEGINNINGS.len()];
            triangle.at(along_1, along_2) + normal * (side.signum() * HAIR)
        };
        let straight = |side: f64| self.hit(&from(0, side), &(normal * side)).is_none();
        if straight(1.0) || straight(-1.0) {
            return true;
        }
        (0..WAYS).any(|at| {
            let way = self.ways[at];
            let side = normal.dot(&way);
            side.abs() > 0.1 && self.gets_away(&from(at, side), at)
        })
    }

    fn gets_away(&mut self, from: &Point3<f64>, at: usize) -> bool {
        let way = self.ways[at];
        if self.triangles[self.last[at] as usize].is_hit(from, &way) {
            return false;
        }
        let hit = self.hit(from, &way);
        self.last[at] = hit.unwrap_or(self.last[at]);
        hit.is_none()
    }

    fn hit(&self, from: &Point3<f64>, way: &Vector3<f64>) -> Option<u32> {
        (self.bounds).any_along(from, way, |index| {
            self.triangles[index as usize].is_hit(from, way)
        })
    }
}

/// Directions evenly all around, on a spiral (Vogel 1979).
fn ways() -> [Vector3<f64>; WAYS] {
    let golden_angle = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    std::array::from_fn(|index| {
        let height = 1.0 - (2 * index + 1) as f64 / WAYS as f64;
        let level = (1.0 - height * height).sqrt();
        let (sin, cos) = (golden_angle * index as f64).sin_cos();
        Vector3::new(level * cos, level * sin, height)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::cuboid;
    use crate::split::split;

    /// A box with edges of so many metres, in triangles of at most 5 cm.
    fn fine_box(size: f64) -> TriangleMesh {
        let mut mesh = cuboid(&Vector3::repeat(size));
        split(&mut mesh, 0.05).unwrap();
        mesh
    }

    fn corners(mesh: &TriangleMesh) -> Vec<[Point3<f64>; 3]> {
        let triangles = 0..mesh.triangles.len();
        triangles.map(|index| mesh.corners(index)).collect()
    }

    /// Whether `exposed` leaves these triangles of a mesh, whatever the order of their vertices.
    fn leaves(mesh: &TriangleMesh, wanted: &TriangleMesh) -> bool {
        corners(&exposed(mesh).unwrap()) == corners(wanted)
    }

    fn both(one: &TriangleMesh, other: &TriangleMesh) -> TriangleMesh {
        let mut mesh = one.clone();
        mesh.append(other);
        mesh
    }

    fn turned_over(mesh: &TriangleMesh) -> TriangleMesh {
        let mut mesh = mesh.clone();
        mesh.flip();
        mesh
    }

    /// The mesh without the triangles whose centroids are where `is_hole` says.
    fn without(mesh: &TriangleMesh, is_hole: impl Fn(&Vector3<f64>) -> bool) -> TriangleMesh {
        let mut mesh = mesh.clone();
        let corners = corners(&mesh);
        let mut centroids =
            (corners.iter()).map(|[a, b, c]| (a.coords + b.coords + c.coords) / 3.0);
        mesh.triangles
            .retain(|_| !is_hole(&centroids.next().unwrap()));
        mesh
    }

    #[test]
    fn an_inner_box_is_dropped_whichever_way_it_is_wound() {
        let (outer, inner) = (fine_box(0.2), cuboid(&Vector3::repeat(0.1)));
        assert!(leaves(&outer, &outer));
        for inner in [&inner, &turned_over(&inner)] {
            for outer in [&outer, &turned_over(&outer)] {
                assert!(leaves(&both(outer, inner), outer));
            }
        }
    }

    #[test]
    fn the_wall_of_a_cup_is_kept() {
        let no_lid = |mesh: &TriangleMesh, top: f64| without(mesh, |at| at.z > top - 1e-9);
        let sheet = no_lid(&fine_box(0.2), 0.1);
        assert!(leaves(&sheet, &sheet));
        let inner = no_lid(&turned_over(&fine_box(0.18)), 0.09);
        let thick = both(&sheet, &inner);
        assert!(leaves(&thick, &thick));
    }

    #[test]
    fn what_is_reached_through_a_hole_is_kept() {
        let (outer, inner) = (fine_box(0.2), cuboid(&Vector3::repeat(0.1)));
        let holed = without(&outer, |at| at.z > 0.1 - 1e-9 && at.xy().amax() < 0.06);
        let hole = outer.area() - holed.area();
        assert!((0.005..0.02).contains(&hole), "{hole}");
        let found = exposed(&both(&holed, &inner)).unwrap();
        let inside = found.area() - holed.area();
        // The face behind the hole, at least; not the one that turns its back on it.
        assert!((0.01 - 1e-9..0.05 + 1e-9).contains(&inside), "{inside}");
        let lowest = |at: &Vector3<f64>| (at.z + 0.05).abs() < 1e-9 && at.xy().amax() < 0.05;
        assert!(without(&found, |at| !lowest(at)).triangles.is_empty());
    }

    #[test]
    fn sheets_are_kept_from_both_sides() {
        let sheet = without(&fine_box(0.2), |at| at.z < 0.1 - 1e-9);
        let doubled = both(&sheet, &turned_over(&sheet));
        for mesh in [sheet, doubled] {
            assert!(leaves(&mesh, &mesh));
        }
    }

    #[test]
    fn a_triangle_that_is_wound_wrongly_is_kept() {
        let mut mesh = fine_box(0.2);
        for triangle in mesh.triangles.iter_mut().step_by(7) {
            triangle.swap(1, 2);
        }
        assert!(leaves(&mesh, &mesh));
    }

    /// No ray slips through where triangles meet, even straight at the edges and corners of an even mesh.
    #[test]
    fn a_closed_mesh_has_no_gaps() {
        for size in [0.01, 0.05, 0.1, 0.15] {
            for outer in [fine_box(0.2), crate::shape::sphere(0.2, 0.02)] {
                let inner = fine_box(size);
                assert!(leaves(&both(&outer, &inner), &outer), "{size}");
            }
        }
    }
}
