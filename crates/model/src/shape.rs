//! Box, cylinder, sphere and capsule as triangles, centred on their frame's origin, with the z-axis as their own.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::{Point3, Vector3};

use crate::TriangleMesh;

/// Fewest and most corners of a circle.
const SEGMENTS: (f64, f64) = (32.0, 360.0);

/// A box with edges `size`, m.
pub(crate) fn cuboid(size: &Vector3<f64>) -> TriangleMesh {
    let corner = |index: usize| {
        let side = |axis: usize| if index >> axis & 1 == 1 { 0.5 } else { -0.5 };
        Point3::from(Vector3::new(side(0), side(1), side(2)).component_mul(size))
    };
    let faces: [[u32; 4]; 6] = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    TriangleMesh {
        vertices: (0..8).map(corner).collect(),
        triangles: (faces.iter())
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect(),
    }
}

/// A cylinder of `radius` and `length`, m, whose circle has corners at most `max_edge` apart.
pub(crate) fn cylinder(radius: f64, length: f64, max_edge: f64) -> TriangleMesh {
    let half = length / 2.0;
    revolve(
        &[(radius, -half), (radius, half)],
        half,
        segments(radius, max_edge),
    )
}

/// A sphere of `radius`, m, with vertices at most about `max_edge` apart.
pub(crate) fn sphere(radius: f64, max_edge: f64) -> TriangleMesh {
    capsule(radius, 0.0, max_edge)
}

/// A cylinder of `radius` and `length`, m, with a half sphere on either end.
pub(crate) fn capsule(radius: f64, length: f64, max_edge: f64) -> TriangleMesh {
    let segments = segments(radius, max_edge);
    let rings = segments / 4;
    let upper = (0..rings).map(|ring| {
        let angle = FRAC_PI_2 * ring as f64 / rings as f64;
        (radius * angle.cos(), length / 2.0 + radius * angle.sin())
    });
    let upper: Vec<_> = upper.collect();
    let lower = upper
        .iter()
        .rev()
        .map(|(distance, height)| (*distance, -height));
    // A sphere has one equator, a capsule two.
    let equators = usize::from(length == 0.0);
    let profile: Vec<_> = lower.chain(upper.iter().copied().skip(equators)).collect();
    revolve(&profile, length / 2.0 + radius, segments)
}

fn segments(radius: f64, max_edge: f64) -> usize {
    let needed = (TAU * radius / max_edge).ceil();
    // A multiple of four, so that a half sphere has a whole number of rings.
    needed.clamp(SEGMENTS.0, SEGMENTS.1) as usize / 4 * 4
}

/// Turns a profile of (distance from axis, height) about the z-axis, from below upwards, and closes it by a vertex on
/// the axis at either end, `pole` above and below the origin.
fn revolve(profile: &[(f64, f64)], pole: f64, segments: usize) -> TriangleMesh {
    let mut vertices = vec![Point3::new(0.0, 0.0, -pole), Point3::new(0.0, 0.0, pole)];
    for (distance, height) in profile {
        vertices.extend((0..segments).map(|segment| {
            let (sin, cos) = (TAU * segment as f64 / segments as f64).sin_cos();
            Point3::new(distance * cos, distance * sin, *height)
        }));
    }
    let at = |ring: usize, segment: usize| (2 + ring * segments + segment % segments) as u32;
    let top = profile.len().saturating_sub(1);
    let mut triangles = Vec::new();
    for segment in 0..segments {
        triangles.push([0, at(0, segment + 1), at(0, segment)]);
        for ring in 0..top {
            let [a, b] = [at(ring, segment), at(ring, segment + 1)];
            let [c, d] = [at(ring + 1, segment + 1), at(ring + 1, segment)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
        triangles.push([1, at(top, segment), at(top, segment + 1)]);
    }
    TriangleMesh {
        vertices,
        triangles,
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    fn assert_shape(mesh: &TriangleMesh, area: f64, volume: f64) {
        let edges = mesh.edges();
        assert_eq!((edges.open, edges.inconsistent), (0, 0));
        // Corners lie on the true surface, so the triangles lie inside it.
        let found = (mesh.area() / area, mesh.signed_volume() / volume);
        assert!((0.999..1.000001).contains(&found.0), "{found:?}");
        assert!((0.999..1.000001).contains(&found.1), "{found:?}");
    }

    #[test]
    fn shapes_are_closed_face_outwards_and_have_the_area_and_volume_of_the_formulas() {
        let (r, l, fine) = (0.3, 0.5, 0.01);
        let size = Vector3::new(0.1, 0.2, 0.3);
        assert_shape(&cuboid(&size), 0.22, 0.006);
        assert_shape(
            &cylinder(r, l, fine),
            2.0 * PI * r * (r + l),
            PI * r * r * l,
        );
        assert_shape(
            &sphere(r, fine),
            4.0 * PI * r * r,
            4.0 / 3.0 * PI * r.powi(3),
        );
        assert_shape(
            &capsule(r, l, fine),
            4.0 * PI * r * r + 2.0 * PI * r * l,
            4.0 / 3.0 * PI * r.powi(3) + PI * r * r * l,
        );
    }

    #[test]
    fn shapes_reach_as_far_as_they_should() {
        let highest = |mesh: &TriangleMesh, axis: usize| {
            let values = mesh.vertices.iter().map(|vertex| vertex[axis]);
            values.fold(f64::NEG_INFINITY, f64::max)
        };
        for (mesh, x, z) in [
            (cuboid(&Vector3::new(0.2, 0.4, 0.6)), 0.1, 0.3),
            (cylinder(0.3, 0.5, 0.01), 0.3, 0.25),
            (sphere(0.3, 0.01), 0.3, 0.3),
            (capsule(0.3, 0.5, 0.01), 0.3, 0.55),
        ] {
            assert!((highest(&mesh, 0) - x).abs() < 1e-12);
            assert!((highest(&mesh, 2) - z).abs() < 1e-12);
        }
    }

    #[test]
    fn very_small_and_very_large_shapes_are_bounded() {
        for radius in [1e-9, 1e9] {
            let triangles = sphere(radius, 0.02).triangles.len();
            assert!((500..200_000).contains(&triangles), "{triangles}");
        }
    }
}
