//! One triangle of a surface and the closest point on it.

use nalgebra::{Point3, Unit, Vector3};

/// Stands for "no triangle": the other side of a hole's rim.
pub(crate) const NONE: u32 = u32::MAX;

/// A triangle with all that a projection touches, side by side in memory. Its edge i leads from corner i to corner
/// i + 1.
#[derive(Clone, Debug)]
pub(crate) struct Triangle {
    corner: Point3<f64>,
    /// From the corner to the next one and to the last one.
    edge_1: Vector3<f64>,
    edge_2: Vector3<f64>,
    /// Products of these two: 1 · 1, 1 · 2 and 2 · 2.
    products: [f64; 3],
    pub(crate) normal: Unit<Vector3<f64>>,
    pub(crate) vertices: [u32; 3],
    /// The triangle across each edge, or [`NONE`].
    pub(crate) across: [u32; 3],
}

/// Where on a triangle its closest point lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Feature {
    Face,
    Edge(usize),
    Corner(usize),
}

impl Triangle {
    pub(crate) fn new([a, b, c]: [Point3<f64>; 3], vertices: [u32; 3], across: [u32; 3]) -> Self {
        let (ab, ac) = (b - a, c - a);
        Self {
            corner: a,
            edge_1: ab,
            edge_2: ac,
            products: [ab.norm_squared(), ab.dot(&ac), ac.norm_squared()],
            normal: Unit::new_normalize(ab.cross(&ac)),
            vertices,
            across,
        }
    }

    /// The first corner plus so many of the two edges that leave it.
    pub(crate) fn at(&self, along_1: f64, along_2: f64) -> Point3<f64> {
        self.corner + self.edge_1 * along_1 + self.edge_2 * along_2
    }

    /// Corner 0, 1 or 2.
    pub(crate) fn corner(&self, index: usize) -> Point3<f64> {
        match index {
            0 => self.corner,
            1 => self.corner + self.edge_1,
            _ => self.corner + self.edge_2,
        }
    }

    pub(crate) fn centroid(&self) -> Point3<f64> {
        self.at(1.0 / 3.0, 1.0 / 3.0)
    }

    pub(crate) fn area(&self) -> f64 {
        self.edge_1.cross(&self.edge_2).norm() / 2.0
    }

    /// Height of a point above the triangle's plane, m.
    pub(crate) fn height(&self, point: &Point3<f64>) -> f64 {
        self.normal.dot(&(point - self.corner))
    }

    /// How far inside of each edge a point is, seen along the normal; negative outside. In units of its own for each
    /// edge, which [`Triangle::depth_units`] gives: that spares a division.
    pub(crate) fn depths(&self, point: &Point3<f64>) -> [f64; 3] {
        let [p11, p12, p22] = self.products;
        let from_corner = point - self.corner;
        let (d1, d2) = (self.edge_1.dot(&from_corner), self.edge_2.dot(&from_corner));
        let (of_2, of_0) = (p22 * d1 - p12 * d2, p11 * d2 - p12 * d1);
        [of_0, p11 * p22 - p12 * p12 - of_0 - of_2, of_2]
    }

    /// What [`Triangle::depths`] give for one metre.
    pub(crate) fn depth_units(&self) -> [f64; 3] {
        let edges = [self.edge_1, self.edge_2 - self.edge_1, self.edge_2];
        edges.map(|edge| edge.norm() * 2.0 * self.area())
    }

    /// Closest point by Voronoi regions (Ericson, Real-Time Collision Detection, 2005, section 5.1.5; its letters). The
    /// products with bp and cp follow from those with ap.
    #[inline]
    pub(crate) fn closest_point(&self, p: &Point3<f64>) -> (Point3<f64>, Feature) {
        let (a, ab, ac) = (self.corner, &self.edge_1, &self.edge_2);
        let [ab_ab, ab_ac, ac_ac] = self.products;
        let ap = p - a;
        let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
        if d1 <= 0.0 && d2 <= 0.0 {
            return (a, Feature::Corner(0));
        }
        let (d3, d4) = (d1 - ab_ab, d2 - ab_ac);
        if d3 >= 0.0 && d4 <= d3 {
            return (a + ab, Feature::Corner(1));
        }
        let vc = d1 * d4 - d3 * d2;
        if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            return (a + ab * (d1 / ab_ab), Feature::Edge(0));
        }
        let (d5, d6) = (d1 - ab_ac, d2 - ac_ac);
        if d6 >= 0.0 && d5 <= d6 {
            return (a + ac, Feature::Corner(2));
        }
        let vb = d5 * d2 - d1 * d6;
        if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            return (a + ac * (d2 / ac_ac), Feature::Edge(2));
        }
        let va = d3 * d6 - d5 * d4;
        if va <= 0.0 && d4 >= d3 && d5 >= d6 {
            let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
            return (a + ab + (ac - ab) * w, Feature::Edge(1));
        }
        (p - *self.normal * self.normal.dot(&ap), Feature::Face)
    }

    /// Whether a ray hits the triangle, from whichever side (Möller and Trumbore, Fast, Minimum Storage Ray/Triangle
    /// Intersection, 1997; its letters). So does one that passes an edge by a rounding error, lest any slip through
    /// between two triangles.
    #[inline]
    pub(crate) fn is_hit(&self, origin: &Point3<f64>, direction: &Vector3<f64>) -> bool {
        const MARGIN: f64 = 1e-9;
        let p = direction.cross(&self.edge_2);
        let inverse = 1.0 / self.edge_1.dot(&p);
        let t = origin - self.corner;
        let u = t.dot(&p) * inverse;
        let q = t.cross(&self.edge_1);
        let v = direction.dot(&q) * inverse;
        u >= -MARGIN && v >= -MARGIN && u + v <= 1.0 + MARGIN && self.edge_2.dot(&q) * inverse > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> Triangle {
        let corners = [[0.1, 0.2, 0.0], [0.5, 0.1, 0.2], [0.2, 0.6, 0.3]].map(Point3::from);
        Triangle::new(corners, [0, 1, 2], [NONE; 3])
    }

    /// Points around the triangle on a grid, m.
    fn queries() -> impl Iterator<Item = Point3<f64>> {
        (0..1000).map(|i| {
            Point3::from([i % 10, i / 10 % 10, i / 100].map(|k| f64::from(k) * 0.11 - 0.2))
        })
    }

    #[test]
    fn no_point_of_the_triangle_is_closer_than_the_closest_point() {
        let triangle = triangle();
        let (mut faces, mut edges, mut corners) = (0, [0; 3], [0; 3]);
        for query in queries() {
            let (closest, feature) = triangle.closest_point(&query);
            match feature {
                Feature::Face => faces += 1,
                Feature::Edge(edge) => edges[edge] += 1,
                Feature::Corner(corner) => corners[corner] += 1,
            }
            // The closest point of a convex set: no other point of the set lies towards the query from there.
            for (along_1, along_2) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)] {
                let towards = (triangle.at(along_1, along_2) - closest).dot(&(query - closest));
                assert!(towards < 1e-12, "{query}: {feature:?} {towards}");
            }
            assert!(triangle.height(&closest).abs() < 1e-12);
            let units = triangle.depth_units();
            let depths = triangle.depths(&closest);
            for edge in 0..3 {
                assert!(depths[edge] / units[edge] > -1e-12);
            }
        }
        let seen = faces.min(edges.into_iter().chain(corners).min().unwrap());
        assert!(seen >= 10, "{faces} {edges:?} {corners:?}");
    }

    #[test]
    fn depths_are_distances_from_the_lines_of_the_edges() {
        let triangle = triangle();
        let corners = [
            triangle.at(0.0, 0.0),
            triangle.at(1.0, 0.0),
            triangle.at(0.0, 1.0),
        ];
        for query in queries() {
            let (depths, units) = (triangle.depths(&query), triangle.depth_units());
            for edge in 0..3 {
                let (from, to) = (corners[edge], corners[(edge + 1) % 3]);
                let inwards = triangle.normal.cross(&(to - from).normalize());
                let expected = inwards.dot(&(query - from));
                assert!((depths[edge] / units[edge] - expected).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn rays_hit_what_they_point_at() {
        let triangle = triangle();
        for query in queries().filter(|query| triangle.height(query).abs() > 1e-3) {
            for (along_1, along_2) in [-0.2, 0.0, 0.3, 0.5, 0.7, 1.0, 1.2]
                .into_iter()
                .flat_map(|one| [-0.1, 0.0, 0.3, 0.5, 1.1].map(|two| (one, two)))
            {
                let is_on_it = along_1 >= 0.0 && along_2 >= 0.0 && along_1 + along_2 <= 1.0;
                let way = (triangle.at(along_1, along_2) - query).normalize();
                assert_eq!(triangle.is_hit(&query, &way), is_on_it, "{query} {way}");
                assert!(!triangle.is_hit(&query, &-way));
            }
            let along_the_plane = triangle.edge_1.normalize();
            assert!(!triangle.is_hit(&query, &along_the_plane));
        }
    }
}
