//! Splitting of coarse triangles.

use std::collections::HashMap;

use nalgebra::center;

use crate::{ModelError, TriangleMesh};

/// Beyond this ratio of a coordinate to the longest edge, halving an edge would soon be lost in rounding.
const MOST_RATIO: f64 = 1e9;

/// Splitting stops with an error beyond this many triangles: a mesh that needs more is given in the wrong unit.
const MOST_TRIANGLES: usize = 2_000_000;

/// Splits triangles until no edge is longer than `max_edge`, m. Returns how many edges were halved.
///
/// In each round every edge that is too long gets one new vertex in its middle, and each triangle is divided by those
/// on its edges. The vertex belongs to the edge, so neighbours always agree and no vertex ends up inside an edge.
///
/// # Errors
/// If the mesh would need more than two million triangles.
pub(crate) fn split(mesh: &mut TriangleMesh, max_edge: f64) -> Result<usize, ModelError> {
    let too_large = ModelError::MeshTooLarge {
        limit: MOST_TRIANGLES,
        max_edge,
        extent: mesh.extent(),
    };
    let farthest = (mesh.vertices.iter())
        .map(|vertex| vertex.coords.amax())
        .fold(0.0, f64::max);
    if farthest > MOST_RATIO * max_edge {
        return Err(too_large);
    }
    let mut halved = 0;
    loop {
        let mut middles = HashMap::new();
        let mut triangles = Vec::with_capacity(mesh.triangles.len());
        for index in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.triangles[index];
            let middle = [(a, b), (b, c), (c, a)]
                .map(|(from, to)| middle_if_long(mesh, &mut middles, from, to, max_edge));
            divide(mesh, [a, b, c], middle, &mut triangles);
        }
        mesh.triangles = triangles;
        if middles.is_empty() {
            return Ok(halved);
        }
        halved += middles.len();
        if mesh.triangles.len() > MOST_TRIANGLES {
            return Err(too_large);
        }
    }
}

fn middle_if_long(
    mesh: &mut TriangleMesh,
    middles: &mut HashMap<[u32; 2], u32>,
    from: u32,
    to: u32,
    max_edge: f64,
) -> Option<u32> {
    let [a, b] = [from.min(to), from.max(to)];
    let (start, end) = (mesh.vertices[a as usize], mesh.vertices[b as usize]);
    if (end - start).norm() <= max_edge {
        return None;
    }
    Some(*middles.entry([a, b]).or_insert_with(|| {
        mesh.vertices.push(center(&start, &end));
        mesh.vertices.len() as u32 - 1
    }))
}

/// Divides the triangle a b c by the middles of a-b, b-c and c-a, where there are any.
fn divide(
    mesh: &TriangleMesh,
    [a, b, c]: [u32; 3],
    middle: [Option<u32>; 3],
    out: &mut Vec<[u32; 3]>,
) {
    match middle {
        [None, None, None] => out.push([a, b, c]),
        [Some(ab), None, None] => out.extend([[a, ab, c], [ab, b, c]]),
        [None, Some(_), None] => divide(mesh, [b, c, a], [middle[1], None, None], out),
        [None, None, Some(_)] => divide(mesh, [c, a, b], [middle[2], None, None], out),
        [Some(ab), Some(bc), None] => {
            out.push([ab, b, bc]);
            divide_quad(mesh, [a, ab, bc, c], out);
        }
        [None, Some(_), Some(_)] => divide(mesh, [b, c, a], [middle[1], middle[2], None], out),
        [Some(_), None, Some(_)] => divide(mesh, [c, a, b], [middle[2], middle[0], None], out),
        [Some(ab), Some(bc), Some(ca)] => {
            out.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
    }
}

/// Divides a quadrilateral along its shorter diagonal.
fn divide_quad(mesh: &TriangleMesh, [a, b, c, d]: [u32; 4], out: &mut Vec<[u32; 3]>) {
    let length =
        |from: u32, to: u32| (mesh.vertices[to as usize] - mesh.vertices[from as usize]).norm();
    if length(a, c) <= length(b, d) {
        out.extend([[a, b, c], [a, c, d]]);
    } else {
        out.extend([[a, b, d], [b, c, d]]);
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::shape;

    fn longest_edge(mesh: &TriangleMesh) -> f64 {
        let sides = (0..mesh.triangles.len()).flat_map(|triangle| {
            let [a, b, c] = mesh.corners(triangle);
            [(b - a).norm(), (c - b).norm(), (a - c).norm()]
        });
        sides.fold(0.0, f64::max)
    }

    #[test]
    fn splitting_bounds_edges_and_keeps_the_surface_closed() {
        let shapes = [
            shape::cuboid(&Vector3::new(0.3, 0.011, 0.1)),
            shape::cylinder(0.05, 0.7, f64::INFINITY),
            shape::sphere(0.2, f64::INFINITY),
        ];
        for whole in shapes {
            for max_edge in [0.03, 0.02, 0.007] {
                let mut mesh = whole.clone();
                let halved = split(&mut mesh, max_edge).unwrap();
                assert!(halved > 0);
                assert!(longest_edge(&mesh) <= max_edge);
                // A vertex inside a neighbour's edge would open it.
                let edges = mesh.edges();
                assert_eq!((edges.open, edges.inconsistent), (0, 0));
                assert!((mesh.area() - whole.area()).abs() < 1e-9 * whole.area());
                assert!((mesh.signed_volume() - whole.signed_volume()).abs() < 1e-12);
                assert_eq!(mesh.vertices.len(), whole.vertices.len() + halved);
            }
        }
    }

    #[test]
    fn fine_triangles_stay_as_they_are() {
        let whole = shape::cuboid(&Vector3::repeat(1.0));
        let mut mesh = whole.clone();
        assert_eq!(split(&mut mesh, f64::INFINITY).unwrap(), 0);
        assert_eq!(mesh, whole);
    }

    #[test]
    fn a_mesh_in_millimetres_is_refused() {
        let mut mesh = shape::cuboid(&Vector3::repeat(200.0));
        let error = split(&mut mesh, 0.02).unwrap_err().to_string();
        assert!(
            error.contains("346.4") && error.contains("scale"),
            "{error}"
        );
    }

    #[test]
    fn coordinates_beyond_rounding_end_in_an_error() {
        for far in [1e20, f64::MAX] {
            let mut mesh = shape::cuboid(&Vector3::repeat(1.0));
            mesh.vertices[0].x = far;
            assert!(split(&mut mesh, 0.02).is_err());
        }
    }
}
