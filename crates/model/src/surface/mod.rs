//! The surface of one link: closest points, by k-d tree and by walking downhill, and uniform samples.

mod landing;

use std::num::NonZeroUsize;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nalgebra::{Point3, Unit, Vector3};

use crate::TriangleMesh;
use crate::adjacency::{Spoke, spokes_of, triangles_across_edges, triangles_around_vertices};
use crate::bounds::Bounds;
use crate::lists::Lists;
use crate::plate::Plate;
use crate::rivals::Rivals;
use crate::triangle::{Feature, NONE, Triangle};

pub use landing::{Landing, Plates};

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
    plates: Vec<Plate>,
    /// The edges that leave each vertex.
    spokes: Lists<Spoke>,
    rivals: Rivals,
    /// Area of the triangles up to and with each one, m².
    cumulative_area: Vec<f64>,
    centroids: ImmutableKdTree<f64, 3>,
    bounds: Bounds,
}

/// The point of one triangle closest to a query.
struct Nearest {
    triangle: u32,
    point: Point3<f64>,
    feature: Feature,
    /// Squared distance from the query, m².
    squared: f64,
}

impl Surface {
    /// With so many triangles' centroids near a query a search begins: where triangles differ in size, or walls are
    /// thin, the nearest centroid may be of the wrong one.
    const SEEDS: NonZeroUsize = NonZeroUsize::new(4).unwrap();

    /// Prepares a mesh. None if it has no triangle.
    pub fn new(mesh: &TriangleMesh) -> Option<Self> {
        if mesh.triangles.is_empty() {
            return None;
        }
        let around = triangles_around_vertices(mesh);
        let triangles: Vec<_> = (0..mesh.triangles.len())
            .map(|index| {
                let across = triangles_across_edges(mesh, &around, index);
                Triangle::new(mesh.corners(index), mesh.triangles[index], across)
            })
            .collect();
        let mut spokes = Lists::default();
        for vertex in 0..mesh.vertices.len() {
            spokes.push(spokes_of(mesh, vertex as u32, around.get(vertex)));
        }
        let mut total = 0.0;
        let cumulative_area = (triangles.iter())
            .map(|triangle| {
                total += triangle.area();
                total
            })
            .collect();
        let centroids: Vec<[f64; 3]> = (triangles.iter())
            .map(|triangle| triangle.centroid().coords.into())
            .collect();
        let corners: Vec<_> = (0..mesh.triangles.len())
            .map(|at| mesh.corners(at))
            .collect();
        let rivals = Rivals::new(mesh, &triangles, &around);
        let plate = |(index, triangle)| Plate::new(triangle, rivals.steepest(index));
        Some(Self {
            spokes,
            plates: (0..).zip(&triangles).map(plate).collect(),
            rivals,
            triangles,
            cumulative_area,
            centroids: ImmutableKdTree::new_from_slice(&centroids).ok()?,
            bounds: Bounds::new(&corners),
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

    /// Area of a triangle, m².
    pub fn triangle_area(&self, triangle: u32) -> f64 {
        let index = triangle as usize;
        let before = if index == 0 {
            0.0
        } else {
            self.cumulative_area[index - 1]
        };
        self.cumulative_area[index] - before
    }

    /// Outward normal of a triangle.
    pub fn normal(&self, triangle: u32) -> Unit<Vector3<f64>> {
        self.triangles[triangle as usize].normal
    }

    /// Centre of a triangle, m.
    pub fn centroid(&self, triangle: u32) -> Point3<f64> {
        self.triangles[triangle as usize].centroid()
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
            point: triangle.at(along_1, along_2),
            triangle: index as u32,
        }
    }

    /// The surface point closest to `query`: walks as [`Surface::closest_point_from`] does, from the closest of the
    /// triangles with the nearest centroids.
    pub fn closest_point(&self, query: &Point3<f64>) -> SurfacePoint {
        let near = (self.centroids.query(&[query.x, query.y, query.z]))
            .nearest_n::<SquaredEuclidean<f64>>(Self::SEEDS)
            .execute();
        let seeds = near.iter().map(|seed| seed.item);
        match self.nearest_among(query, f64::INFINITY, seeds) {
            Some(start) => self.walk(query, start),
            None => self.closest_point_from(query, 0),
        }
    }

    /// The point closest to `query` that a walk from the triangle `start` finds. It goes downhill, and also over the
    /// ridges between neighbours, so that no triangle which shares a corner with the last one is closer. Exact unless
    /// the surface has another local minimum of the distance farther away.
    pub fn closest_point_from(&self, query: &Point3<f64>, start: u32) -> SurfacePoint {
        self.walk(query, self.nearest_on(query, start))
    }

    fn walk(&self, query: &Point3<f64>, start: Nearest) -> SurfacePoint {
        let mut current = start;
        // Each step strictly shortens the distance, so no triangle comes twice and the walk ends.
        for _ in 0..self.triangles.len() {
            let step = self.downhill(query, &current);
            let Some(step) = step.or_else(|| self.over_a_ridge(query, &current)) else {
                break;
            };
            current = step;
        }
        SurfacePoint {
            point: current.point,
            triangle: current.triangle,
        }
    }

    /// The best neighbour across the feature that holds the closest point, if it is closer still.
    #[inline]
    fn downhill(&self, query: &Point3<f64>, current: &Nearest) -> Option<Nearest> {
        let triangle = &self.triangles[current.triangle as usize];
        match current.feature {
            Feature::Face => None,
            Feature::Edge(edge) => {
                self.nearest_among(query, current.squared, [triangle.across[edge]])
            }
            Feature::Corner(corner) => {
                let away = query - current.point;
                // Only edges that lead towards the query shorten the distance, and only triangles between such.
                let spokes = self.spokes.get(triangle.vertices[corner] as usize).iter();
                let towards = spokes.filter(|spoke| spoke.edge.dot(&away) > 0.0);
                let neighbours = towards.flat_map(|spoke| spoke.triangles);
                self.nearest_among(query, current.squared, neighbours)
            }
        }
    }

    /// The best of the triangles around a local minimum, if it is closer still.
    #[inline]
    fn over_a_ridge(&self, query: &Point3<f64>, current: &Nearest) -> Option<Nearest> {
        let triangle = &self.triangles[current.triangle as usize];
        let below = triangle.normal.dot(&(query - current.point)) < 0.0;
        let depths = triangle.depths(&current.point);
        let rivals = (self.rivals).of(current.triangle, below, depths, current.squared);
        self.nearest_among(query, current.squared, rivals.iter().copied())
    }

    /// The closest of some triangles, if it is closer than a squared distance.
    #[inline]
    fn nearest_among(
        &self,
        query: &Point3<f64>,
        squared: f64,
        triangles: impl IntoIterator<Item = u32>,
    ) -> Option<Nearest> {
        let mut best = None;
        let mut least = squared * (1.0 - 1e-12) - 1e-24;
        for triangle in triangles.into_iter().filter(|&triangle| triangle != NONE) {
            // No point of it is closer than its plane.
            if self.triangles[triangle as usize].height(query).powi(2) >= least {
                continue;
            }
            let nearest = self.nearest_on(query, triangle);
            if nearest.squared < least {
                least = nearest.squared;
                best = Some(nearest);
            }
        }
        best
    }

    #[inline]
    fn nearest_on(&self, query: &Point3<f64>, triangle: u32) -> Nearest {
        let (point, feature) = self.triangles[triangle as usize].closest_point(query);
        Nearest {
            triangle,
            point,
            feature,
            squared: (query - point).norm_squared(),
        }
    }
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

    /// All triangles that share a corner with this one.
    fn ring(surface: &Surface, triangle: u32) -> Vec<u32> {
        let vertices = surface.triangles[triangle as usize].vertices;
        let touches = |&other: &u32| {
            let others = surface.triangles[other as usize].vertices;
            others.iter().any(|vertex| vertices.contains(vertex))
        };
        (0..surface.triangle_count() as u32)
            .filter(touches)
            .collect()
    }

    #[test]
    fn closest_point_of_a_dented_ball_equals_brute_force() {
        let surface = Surface::new(&ball(0.03)).unwrap();
        for index in 0..4000 {
            let query = Point3::from(uniform(index).map(|u| (u - 0.5) * 0.5));
            let found = (surface.closest_point(&query).point - query).norm();
            let exact = brute_force(&surface, &query);
            assert!(found - exact < 1e-12, "{query}: {found}, exact {exact}");
        }
    }

    /// Where a surface bends towards the query, many triangles hold a local minimum of the distance inside: here the
    /// ball's wall, seen from a third of the way to its middle.
    #[test]
    fn a_walk_leaves_local_minima_beside_the_closest_point() {
        let surface = Surface::new(&ball(0.0)).unwrap();
        let mut traps = 0;
        for index in 0..200 {
            let on_wall = surface.sample(uniform(index));
            let query = on_wall.point * 0.6;
            let exact = brute_force(&surface, &query);
            let end = surface.closest_point_from(&query, on_wall.triangle);
            for start in ring(&surface, end.triangle) {
                let (point, feature) = surface.triangles[start as usize].closest_point(&query);
                let is_trap = feature == Feature::Face && (point - query).norm() > exact + 1e-9;
                traps += u32::from(is_trap);
                let found = (surface.closest_point_from(&query, start).point - query).norm();
                assert!(found - exact < 1e-12, "{query} from {start}");
                let landing = surface.land(&query.coords.cast(), start);
                let found = f64::from(landing.distance);
                assert!((found - exact).abs() < 1e-7, "{query} from {start}");
            }
        }
        assert!(traps > 50, "only {traps} starts were traps");
    }

    #[test]
    fn no_triangle_around_the_answer_is_closer() {
        let surface = Surface::new(&ball(0.03)).unwrap();
        for index in 0..300 {
            let query = Point3::from(uniform(index).map(|u| (u - 0.5) * 0.3));
            let start = index * 6 % surface.triangle_count() as u32;
            let found = surface.closest_point_from(&query, start);
            let distance = (found.point - query).norm();
            for other in ring(&surface, found.triangle) {
                let other = surface.triangles[other as usize].closest_point(&query).0;
                assert!((other - query).norm() > distance - 1e-12, "{query}");
            }
        }
    }

    #[test]
    fn a_convex_surface_has_no_rivals_outside_and_a_dented_one_few() {
        let rivals = |surface: &Surface| {
            let above = |&t: &u32| !surface.rivals.of(t, false, [0.0; 3], 1.0).is_empty();
            (0..surface.triangle_count() as u32).filter(above).count()
        };
        assert_eq!(rivals(&Surface::new(&ball(0.0)).unwrap()), 0);
        let dented = Surface::new(&ball(0.03)).unwrap();
        let (some, all) = (rivals(&dented), dented.triangle_count());
        assert!((1..all / 2).contains(&some), "{some} of {all}");
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

    /// What single precision finds is as close as what double precision does; where the surface is hollow, nearly always
    /// so, as then there are local minima farther away.
    #[test]
    fn a_landing_is_as_close_as_the_walk() {
        for dent in [0.0, 0.03] {
            let surface = Surface::new(&ball(dent)).unwrap();
            let (mut singles, mut others, mut insides) = (0, 0, 0);
            for index in 0..2000 {
                let start = surface.sample(uniform(index));
                let normal = surface.normal(start.triangle).into_inner();
                let offset = Vector3::from(uniform(index + 7).map(|u| (u - 0.5) * 0.01));
                let height = 0.3 * uniform(index + 3)[0].powi(4) - 0.003;
                let query = start.point + normal * height + offset;
                let single = query.coords.cast();
                let found = surface.land(&single, start.triangle);
                let walked = surface.closest_point_from(&query, start.triangle).point;
                let (distance, exact) = (f64::from(found.distance), (walked - query).norm());
                let apart = (found.point.cast::<f64>() - query.coords).norm();
                others += u32::from((distance - exact).abs() > 1e-7);
                assert!((apart - distance).abs() < 1e-7);
                let (height, is_inside) = surface.plates().height_over(start.triangle, &single);
                let over_start = (start.triangle, height.abs());
                assert!(!is_inside || over_start == (found.triangle, found.distance));
                insides += u32::from(is_inside);
                // Their last bits tell them apart.
                singles += u32::from(found != surface.land_by_walk(&single, start.triangle));
            }
            // Enough that single precision is what is tested.
            assert!(singles > 1000, "{singles}");
            assert!((100..1900).contains(&insides), "{insides}");
            let most = if dent == 0.0 { 0 } else { 20 };
            assert!(others <= most, "{others}");
        }
    }

    /// Points beside a sample, in the plane of its triangle.
    #[test]
    fn a_point_that_its_triangle_holds_is_where_it_lands() {
        let surface = Surface::new(&ball(0.03)).unwrap();
        let mut held = 0;
        for index in 0..2000 {
            let start = surface.sample(uniform(index));
            let aside = Vector3::from(uniform(index + 7).map(|u| (u - 0.5) * 0.01));
            let point = start.point + surface.normal(start.triangle).cross(&aside);
            let point = point.coords.cast();
            let found = surface.land(&point, start.triangle);
            let stays = (found.triangle == start.triangle) && found.distance < 1e-7;
            assert!(stays || !surface.plates().holds(start.triangle, &point));
            held += u32::from(surface.plates().holds(start.triangle, &point));
        }
        assert!((500..1500).contains(&held), "{held}");
    }

    /// A walk does not get from one ball to the other.
    #[test]
    fn an_audit_finds_the_closest_point_wherever_the_walk_ended() {
        let (mut balls, other) = (ball(0.03), ball(0.0));
        let count = balls.vertices.len() as u32;
        let aside = Vector3::new(0.25, 0.0, 0.0);
        (balls.vertices).extend(other.vertices.iter().map(|vertex| vertex + aside));
        let moved = (other.triangles.iter()).map(|at| at.map(|vertex| vertex + count));
        balls.triangles.extend(moved);
        let surface = Surface::new(&balls).unwrap();
        let mut better = 0;
        for index in 0..2000 {
            let query = Point3::from(uniform(index).map(|u| (u - 0.5) * 0.5)) + aside * 0.5;
            let start = surface.sample(uniform(index + 7)).triangle;
            let single = query.coords.cast();
            let walked = surface.land(&single, start);
            let found = surface.audit(&single, walked);
            let exact = brute_force(&surface, &query);
            assert!((f64::from(found.distance) - exact).abs() < 1e-7, "{query}");
            assert!(((found.point - single).norm() - found.distance).abs() < 1e-7);
            better += u32::from(found.distance < walked.distance - 1e-3);
        }
        assert!(better > 300, "{better}");
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
            let above = |t: &&Triangle| t.centroid().z > z;
            surface
                .triangles
                .iter()
                .filter(above)
                .map(Triangle::area)
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
