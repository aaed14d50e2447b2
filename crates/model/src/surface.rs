//! The surface of one link: closest points, by k-d tree and by walking downhill, and uniform samples.

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nalgebra::{Point3, Unit, Vector3};

use crate::TriangleMesh;

/// Stands for "no triangle": the other side of a hole's border.
const NONE: u32 = u32::MAX;

/// A point on a triangle of a [`Surface`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The point in the link's frame, m.
    pub point: Point3<f64>,
    /// Index of the triangle that it lies on.
    pub triangle: u32,
}

/// A link's mesh, prepared for the questions that the filter asks.
pub struct Surface {
    triangles: Vec<Triangle>,
    /// Triangles around each vertex: those of vertex v are `around[around_start[v]..around_start[v + 1]]`.
    around_start: Vec<u32>,
    around: Vec<u32>,
    /// Area of the triangles up to and with each one, m².
    cumulative_area: Vec<f64>,
    centroids: ImmutableKdTree<f64, 3>,
}

/// One triangle with all that a projection touches, side by side in memory.
#[derive(Clone, Debug)]
struct Triangle {
    corner: Point3<f64>,
    edge_1: Vector3<f64>,
    edge_2: Vector3<f64>,
    normal: Unit<Vector3<f64>>,
    vertices: [u32; 3],
    /// The triangle across the edge from corner i to corner i + 1.
    across: [u32; 3],
}

/// Where on a triangle its closest point lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Feature {
    Face,
    Edge(usize),
    Corner(usize),
}

impl Surface {
    /// Prepares a mesh. None if it has no triangle.
    pub fn new(mesh: &TriangleMesh) -> Option<Self> {
        if mesh.triangles.is_empty() {
            return None;
        }
        let (around_start, around) = triangles_around_vertices(mesh);
        let triangles: Vec<_> = (0..mesh.triangles.len())
            .map(|index| Triangle::new(mesh, index, &around_start, &around))
            .collect();
        let mut total = 0.0;
        let cumulative_area = (triangles.iter())
            .map(|triangle| {
                total += triangle.edge_1.cross(&triangle.edge_2).norm() / 2.0;
                total
            })
            .collect();
        let centroids: Vec<[f64; 3]> = triangles.iter().map(Triangle::centroid).collect();
        Some(Self {
            triangles,
            around_start,
            around,
            cumulative_area,
            centroids: ImmutableKdTree::new_from_slice(&centroids).ok()?,
        })
    }

    /// Number of triangles.
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Area, m².
    pub fn area(&self) -> f64 {
        self.cumulative_area.last().copied().unwrap_or(0.0)
    }

    /// Outward normal of a triangle.
    pub fn normal(&self, triangle: u32) -> Unit<Vector3<f64>> {
        self.triangles[triangle as usize].normal
    }

    /// Centre of a triangle, m.
    pub fn centroid(&self, triangle: u32) -> Point3<f64> {
        self.triangles[triangle as usize].centroid().into()
    }

    /// The triangles that share an edge with this one.
    pub fn neighbours(&self, triangle: u32) -> impl Iterator<Item = u32> {
        let across = self.triangles[triangle as usize].across;
        across.into_iter().filter(|&neighbour| neighbour != NONE)
    }

    /// The point of the surface for three uniform numbers in \[0, 1): uniform over the area.
    pub fn sample(&self, uniform: [f64; 3]) -> SurfacePoint {
        let wanted = uniform[0] * self.area();
        let index = self.cumulative_area.partition_point(|&area| area <= wanted);
        let index = index.min(self.triangles.len() - 1);
        let triangle = &self.triangles[index];
        // Osada et al., Shape Distributions (2002), eq. 1.
        let root = uniform[1].sqrt();
        let (along_1, along_2) = (root * (1.0 - uniform[2]), root * uniform[2]);
        SurfacePoint {
            point: triangle.corner + triangle.edge_1 * along_1 + triangle.edge_2 * along_2,
            triangle: index as u32,
        }
    }

    /// The surface point closest to `query`: the k-d tree gives the triangle with the nearest centroid, and a walk
    /// downhill from there the closest point on triangles.
    pub fn closest_point(&self, query: &Point3<f64>) -> SurfacePoint {
        let nearest = self
            .centroids
            .query(&[query.x, query.y, query.z])
            .nearest_one::<SquaredEuclidean<f64>>()
            .execute();
        self.closest_point_from(query, nearest.item as u32)
    }

    /// The point closest to `query` that walking downhill from the triangle `start` finds. Exact where the surface
    /// between `start` and the closest point has no other local minimum of the distance.
    pub fn closest_point_from(&self, query: &Point3<f64>, start: u32) -> SurfacePoint {
        let mut current = start;
        let (mut point, mut feature) = self.triangles[current as usize].closest_point(query);
        let mut squared = (query - point).norm_squared();
        // Each step strictly shortens the distance, so no triangle comes twice and the walk ends.
        for _ in 0..self.triangles.len() {
            let Some(step) = self.downhill(query, current, feature, squared) else {
                break;
            };
            (current, point, feature, squared) = step;
        }
        SurfacePoint {
            point,
            triangle: current,
        }
    }

    /// The best neighbour across the feature that holds the closest point, if it is closer still. A closest point
    /// inside a face is a local minimum of the distance: nothing else needs to be looked at.
    fn downhill(
        &self,
        query: &Point3<f64>,
        current: u32,
        feature: Feature,
        squared: f64,
    ) -> Option<(u32, Point3<f64>, Feature, f64)> {
        let triangle = &self.triangles[current as usize];
        let neighbours = match feature {
            Feature::Face => return None,
            Feature::Edge(edge) => std::slice::from_ref(&triangle.across[edge]),
            Feature::Corner(corner) => self.around(triangle.vertices[corner]),
        };
        let mut best = None;
        let mut least = squared * (1.0 - 1e-12) - 1e-24;
        for &neighbour in neighbours {
            if neighbour == current || neighbour == NONE {
                continue;
            }
            let (point, feature) = self.triangles[neighbour as usize].closest_point(query);
            let squared = (query - point).norm_squared();
            if squared < least {
                least = squared;
                best = Some((neighbour, point, feature, squared));
            }
        }
        best
    }

    fn around(&self, vertex: u32) -> &[u32] {
        let vertex = vertex as usize;
        &self.around[self.around_start[vertex] as usize..self.around_start[vertex + 1] as usize]
    }
}

impl Triangle {
    fn new(mesh: &TriangleMesh, index: usize, around_start: &[u32], around: &[u32]) -> Self {
        let vertices = mesh.triangles[index];
        let [a, b, c] = mesh.corners(index);
        let across = [0, 1, 2].map(|edge| {
            let (from, to) = (vertices[edge], vertices[(edge + 1) % 3]);
            let range =
                around_start[from as usize] as usize..around_start[from as usize + 1] as usize;
            let shares = |&&other: &&u32| {
                other as usize != index && mesh.triangles[other as usize].contains(&to)
            };
            around[range].iter().find(shares).copied().unwrap_or(NONE)
        });
        Self {
            corner: a,
            edge_1: b - a,
            edge_2: c - a,
            normal: Unit::new_normalize((b - a).cross(&(c - a))),
            vertices,
            across,
        }
    }

    fn centroid(&self) -> [f64; 3] {
        (self.corner + (self.edge_1 + self.edge_2) / 3.0)
            .coords
            .into()
    }

    /// Closest point by Voronoi regions (Ericson, Real-Time Collision Detection, 2005, section 5.1.5; its letters).
    fn closest_point(&self, p: &Point3<f64>) -> (Point3<f64>, Feature) {
        let (a, ab, ac) = (self.corner, &self.edge_1, &self.edge_2);
        let ap = p - a;
        let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
        if d1 <= 0.0 && d2 <= 0.0 {
            return (a, Feature::Corner(0));
        }
        let bp = ap - ab;
        let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
        if d3 >= 0.0 && d4 <= d3 {
            return (a + ab, Feature::Corner(1));
        }
        let vc = d1 * d4 - d3 * d2;
        if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            return (a + ab * (d1 / (d1 - d3)), Feature::Edge(0));
        }
        let cp = ap - ac;
        let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
        if d6 >= 0.0 && d5 <= d6 {
            return (a + ac, Feature::Corner(2));
        }
        let vb = d5 * d2 - d1 * d6;
        if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            return (a + ac * (d2 / (d2 - d6)), Feature::Edge(2));
        }
        let va = d3 * d6 - d5 * d4;
        if va <= 0.0 && d4 >= d3 && d5 >= d6 {
            let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
            return (a + ab + (ac - ab) * w, Feature::Edge(1));
        }
        let scale = 1.0 / (va + vb + vc);
        (a + ab * (vb * scale) + ac * (vc * scale), Feature::Face)
    }
}

/// For each vertex the triangles that have it, as offsets into one list.
fn triangles_around_vertices(mesh: &TriangleMesh) -> (Vec<u32>, Vec<u32>) {
    let mut start = vec![0_u32; mesh.vertices.len() + 1];
    for &vertex in mesh.triangles.iter().flatten() {
        start[vertex as usize + 1] += 1;
    }
    for vertex in 0..mesh.vertices.len() {
        start[vertex + 1] += start[vertex];
    }
    let mut next = start.clone();
    let mut around = vec![0_u32; mesh.triangles.len() * 3];
    for (index, triangle) in mesh.triangles.iter().enumerate() {
        for &vertex in triangle {
            around[next[vertex as usize] as usize] = index as u32;
            next[vertex as usize] += 1;
        }
    }
    (start, around)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ball of radius 0.1 m with a dent of the given depth, as a latitude-longitude mesh.
    fn ball(dent: f64) -> TriangleMesh {
        let (rings, sectors) = (24_u32, 40_u32);
        let mut vertices = vec![Point3::new(0.0, 0.0, 0.1)];
        for ring in 1..rings {
            let polar = std::f64::consts::PI * f64::from(ring) / f64::from(rings);
            for sector in 0..sectors {
                let around = std::f64::consts::TAU * f64::from(sector) / f64::from(sectors);
                let radius = 0.1
                    - dent * (-(polar - 1.5).powi(2) * 8.0 - (around - 2.0).powi(2) * 4.0).exp();
                let (sin, cos) = polar.sin_cos();
                vertices.push(Point3::new(sin * around.cos(), sin * around.sin(), cos) * radius);
            }
        }
        vertices.push(Point3::new(0.0, 0.0, -0.1));
        let at = |ring: u32, sector: u32| 1 + (ring - 1) * sectors + sector % sectors;
        let last = vertices.len() as u32 - 1;
        let mut triangles = Vec::new();
        for sector in 0..sectors {
            triangles.push([0, at(1, sector), at(1, sector + 1)]);
            triangles.push([last, at(rings - 1, sector + 1), at(rings - 1, sector)]);
            for ring in 1..rings - 1 {
                let (a, b) = (at(ring, sector), at(ring, sector + 1));
                let (c, d) = (at(ring + 1, sector), at(ring + 1, sector + 1));
                triangles.extend([[a, c, d], [a, d, b]]);
            }
        }
        TriangleMesh {
            vertices,
            triangles,
        }
    }

    fn brute_force(surface: &Surface, query: &Point3<f64>) -> f64 {
        let distance = |triangle: &Triangle| (triangle.closest_point(query).0 - query).norm();
        surface
            .triangles
            .iter()
            .map(distance)
            .fold(f64::INFINITY, f64::min)
    }

    /// Well spread numbers in [0, 1): multiples of the plastic number's powers.
    fn uniform(index: u32) -> [f64; 3] {
        [0.819_172_5, 0.671_043_6, 0.549_700_5].map(|step| (0.5 + step * f64::from(index)).fract())
    }

    #[test]
    fn closest_point_of_a_ball_equals_brute_force() {
        let surface = Surface::new(&ball(0.0)).unwrap();
        let outside = (0..2000).map(|i| Point3::from(uniform(i).map(|u| (u - 0.5) * 0.5)));
        for query in outside.filter(|query| query.coords.norm() > 0.1) {
            let found = (surface.closest_point(&query).point - query).norm();
            let exact = brute_force(&surface, &query);
            assert!(
                found - exact < 1e-12,
                "{query}: found {found}, exact {exact}"
            );
        }
    }

    /// Where the surface is concave, the triangle of the nearest centroid may belong to another minimum.
    #[test]
    fn closest_point_of_a_dented_ball_errs_little_and_seldom() {
        let surface = Surface::new(&ball(0.03)).unwrap();
        let excess = |index| {
            let query = Point3::from(uniform(index).map(|u| (u - 0.5) * 0.5));
            (surface.closest_point(&query).point - query).norm() - brute_force(&surface, &query)
        };
        let excesses: Vec<f64> = (0..4000).map(excess).collect();
        let wrong = excesses.iter().filter(|&&excess| excess > 1e-12).count();
        assert!(wrong < 40, "{wrong} of 4000 not exact");
        assert!(excesses.iter().all(|&excess| excess < 2e-3));
    }

    #[test]
    fn walking_finds_the_closest_point_from_anywhere_on_the_near_side() {
        let surface = Surface::new(&ball(0.0)).unwrap();
        let query = Point3::new(0.11, -0.05, 0.02);
        let facing = |&start: &u32| surface.normal(start).dot(&query.coords) > 0.05;
        let starts: Vec<u32> = (0..surface.triangle_count() as u32)
            .filter(facing)
            .collect();
        assert!(starts.len() > 300);
        for start in starts {
            let found = (surface.closest_point_from(&query, start).point - query).norm();
            assert!(
                found - brute_force(&surface, &query) < 1e-12,
                "from {start}"
            );
        }
    }

    #[test]
    fn projection_is_idempotent() {
        let surface = Surface::new(&ball(0.03)).unwrap();
        for index in 0..200 {
            let once = surface.closest_point(&Point3::from(uniform(index).map(|u| u - 0.5)));
            let twice = surface.closest_point(&once.point);
            assert!((once.point - twice.point).norm() < 1e-12);
        }
    }

    #[test]
    fn samples_are_uniform_over_the_area() {
        let surface = Surface::new(&ball(0.03)).unwrap();
        let upper: usize = (0..20_000)
            .filter(|&i| surface.sample(uniform(i)).point.z > 0.05)
            .count();
        let area_above = |z: f64| -> f64 {
            let above = |t: &&Triangle| t.centroid()[2] > z;
            surface
                .triangles
                .iter()
                .filter(above)
                .map(|t| t.edge_1.cross(&t.edge_2).norm() / 2.0)
                .sum()
        };
        let expected = area_above(0.05) / surface.area();
        let share = upper as f64 / 20_000.0;
        assert!(
            (share - expected).abs() < 0.02,
            "share {share}, area {expected}"
        );
    }

    #[test]
    fn an_empty_mesh_has_no_surface() {
        assert!(Surface::new(&TriangleMesh::default()).is_none());
    }
}
