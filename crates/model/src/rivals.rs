//! Which triangles may be closer to a point than one of their neighbours that is a local minimum of the distance.
//!
//! Where a surface bends towards a point, the faces on both sides of a crease are local minima, and walking downhill may
//! end on the wrong one. Where that can be is known beforehand. Let d be the distance of the point from a triangle and
//! s the depth of the closest point inside of an edge. What rises from the line of that edge, at most at the angle φ to
//! the triangle's plane, stays out of the ball of radius d about the point if s ≥ d tan(φ / 2): then a wall that leans at
//! φ just touches the ball.

use crate::TriangleMesh;
use crate::lists::Lists;
use crate::triangle::Triangle;

/// A triangle rises above another one's plane if by more than this, m.
const LEAST_RISE: f64 = 1e-9;

/// For each triangle, which of those that share a corner with it rise above it and which fall below it.
pub(crate) struct Rivals {
    /// Greatest tan(φ / 2) beyond each edge, in the units of [`Triangle::depths`]; upwards for triangle t at 2 t,
    /// downwards at 2 t + 1.
    steepest: Vec<[f64; 3]>,
    /// Those that rise so, in the same order.
    triangles: Lists<u32>,
}

impl Rivals {
    /// For the triangles of a mesh, given those around each vertex.
    pub(crate) fn new(mesh: &TriangleMesh, triangles: &[Triangle], around: &Lists<u32>) -> Self {
        let mut steepest = Vec::with_capacity(2 * triangles.len());
        let mut rising = Lists::default();
        let mut ring = Vec::new();
        for triangle in triangles {
            ring.clear();
            for vertex in triangle.vertices {
                ring.extend_from_slice(around.get(vertex as usize));
            }
            ring.sort_unstable();
            ring.dedup();
            let units = triangle.depth_units();
            for side in [1.0, -1.0] {
                let mut steepest_here = [0.0_f64; 3];
                rising.push(ring.iter().copied().filter(|&other| {
                    let other = mesh.triangles[other as usize];
                    let Some((edge, steepness)) = rise(mesh, triangle, &units, other, side) else {
                        return false;
                    };
                    steepest_here[edge] = steepest_here[edge].max(steepness * units[edge]);
                    true
                }));
                steepest.push(steepest_here);
            }
        }
        Self {
            steepest,
            triangles: rising,
        }
    }

    /// Greatest tan(φ / 2) beyond each edge of a triangle, in the units of [`Triangle::depths`]: above and below.
    pub(crate) fn steepest(&self, index: usize) -> [[f64; 3]; 2] {
        [self.steepest[2 * index], self.steepest[2 * index + 1]]
    }

    /// Those around `triangle` (number `index`) that may come closer than `depths` inside of its edges do, to a point
    /// above or below it at this squared distance. None where the surface bends away from the point.
    #[inline]
    pub(crate) fn of(&self, index: u32, below: bool, depths: [f64; 3], squared: f64) -> &[u32] {
        let index = 2 * index as usize + usize::from(below);
        let steepest = &self.steepest[index];
        let reached = |edge: usize| {
            // Rounding may put a point of an edge outside of it.
            depths[edge].max(0.0).powi(2) < squared * steepest[edge].powi(2)
        };
        // Without branches between them: which edge it is cannot be predicted.
        match reached(0) | reached(1) | reached(2) {
            true => self.triangles.get(index),
            false => &[],
        }
    }

    /// All those around a triangle that rise above or fall below it.
    pub(crate) fn all(&self, index: u32, below: bool) -> &[u32] {
        self.triangles.get(2 * index as usize + usize::from(below))
    }
}

/// Beyond which edge of `triangle` another one rises, and tan(φ / 2) for it. Where it only shares a corner, two edges
/// would do; the one for which it is less steep tells more.
fn rise(
    mesh: &TriangleMesh,
    triangle: &Triangle,
    units: &[f64; 3],
    other: [u32; 3],
    side: f64,
) -> Option<(usize, f64)> {
    let shares = |corner: usize| other.contains(&triangle.vertices[corner % 3]);
    let mut steepness: [Option<f64>; 3] = [None; 3];
    for vertex in other
        .iter()
        .filter(|vertex| !triangle.vertices.contains(vertex))
    {
        let vertex = &mesh.vertices[*vertex as usize];
        let height = side * triangle.height(vertex);
        if height <= LEAST_RISE {
            continue;
        }
        let depths = triangle.depths(vertex);
        for edge in 0..3 {
            // The formula is for what starts on the line of the edge.
            if !shares(edge + 2) || (shares(edge) && shares(edge + 1)) {
                let beyond = -depths[edge] / units[edge];
                let tangent = height / (beyond + beyond.hypot(height));
                steepness[edge] = Some(steepness[edge].map_or(tangent, |most| most.max(tangent)));
            }
        }
    }
    (0..3)
        .filter_map(|edge| Some((edge, steepness[edge]?)))
        .min_by(|a, b| a.1.total_cmp(&b.1))
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};

    use crate::{Surface, TriangleMesh};

    /// Two walls, 1 m deep, that meet along the y axis and rise at the given angle on both sides.
    fn valley(lean: f64) -> TriangleMesh {
        let (sin, cos) = lean.sin_cos();
        let vertices = [-1.0, 0.0, 1.0]
            .map(|x: f64| [-1.0, 1.0].map(|y| Point3::new(x * cos, y, x.abs() * sin)));
        TriangleMesh {
            vertices: vertices.concat(),
            triangles: vec![[0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3]],
        }
    }

    /// Both walls are as close to points above the crease; a little aside one of them is closer.
    #[test]
    fn the_other_wall_of_a_valley_is_found_as_soon_as_it_is_closer() {
        for lean in [0.02, 0.3, 1.0, 1.4] {
            let surface = Surface::new(&valley(lean)).unwrap();
            for (x, start) in [(-1e-6, 2), (-1e-6, 3), (1e-6, 0), (1e-6, 1)] {
                let query = Point3::new(x, 0.1, 0.2);
                let found = surface.closest_point_from(&query, start).point;
                let towards_wall = Vector3::new(lean.sin() * x.signum(), 0.0, -lean.cos());
                let expected = query + towards_wall * (0.2 * lean.cos() + x.abs() * lean.sin());
                assert!(
                    (found - expected).norm() < 1e-5,
                    "{lean} {x} {start}: {found}"
                );
            }
        }
    }
}
