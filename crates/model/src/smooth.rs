//! The smooth body that a mesh of flat triangles stands for, and its point closest to another.

use nalgebra::{Matrix2, Matrix3, Point3, Unit, Vector2, Vector3};

use crate::adjacency::{triangles_across_edges, triangles_around_vertices};
use crate::lists::Lists;
use crate::triangle::NONE;
use crate::{Surface, TriangleMesh};

/// Triangles that meet at a larger angle meet at an edge of the body: cosine of 40°.
const CREASE_COSINE: f64 = 0.766;
/// Most Newton steps towards the closest point, and the length of one that needs no other, m.
const MOST_STEPS: usize = 6;
const CLOSE: f64 = 2e-6;
/// Below this share of a flat surface's, the way to the closest point is not a way downhill.
const LEAST_SLOPE: f64 = 0.1;

/// A smooth body through the vertices of a mesh, with normals that change continuously over the triangles (Phong) but
/// at edges sharper than 40°, which stay sharp.
///
/// Its closest points are Phong projections (Panozzo et al. 2013): the way from the foot x to the query is along the
/// normal interpolated at x. The body passes above the foot at the height of half a Phong tessellation (Boubekeur and
/// Alexa 2008), which for vertices on a circle is that circle, to the third order of the angle between them.
pub struct SmoothBody {
    patches: Vec<Patch>,
}

/// The point of a [`SmoothBody`] closest to a query.
#[derive(Clone, Copy, Debug)]
pub struct SmoothPoint {
    /// The point in the link's frame, m.
    pub point: Point3<f64>,
    /// Outward normal there; from an edge of the body towards the query.
    pub normal: Unit<Vector3<f64>>,
    /// Distance of the query along the normal, m; negative inside.
    pub distance: f64,
    /// Index of the triangle that it lies above.
    pub triangle: u32,
}

/// One triangle's part of the body, in coordinates along the triangle (x from the first corner to the second, z
/// outwards).
#[derive(Clone, Debug)]
struct Patch {
    /// The first corner, in the link's frame.
    origin: Point3<f64>,
    link_from_patch: Matrix3<f64>,
    /// The corners.
    corners: [Vector2<f64>; 3],
    /// Unit normals of the edges, inwards.
    inwards: [Vector2<f64>; 3],
    /// The normal at the origin and how it changes along x and y: n = n₀ + x n₁ + y n₂.
    normal: [Vector3<f64>; 3],
    /// Change along x and y of Σ λᵢ nᵢ · pᵢ, with λ the barycentric coordinates of the corners p.
    lift: Vector2<f64>,
    /// Triangle across each edge that the surface goes on to smoothly, or [`NONE`].
    smooth_across: [u32; 3],
}

/// A point of a patch's plane, in the patch's coordinates.
struct Foot {
    triangle: u32,
    at: Vector2<f64>,
}

impl SmoothBody {
    /// The body through a mesh's vertices; the mesh must be the one that `surface` was made from.
    pub fn new(mesh: &TriangleMesh) -> Self {
        let fans = Fans::new(mesh);
        Self {
            patches: (0..mesh.triangles.len())
                .map(|index| Patch::new(&fans, index))
                .collect(),
        }
    }

    /// The point closest to `query`, from where a walk over the flat `surface` of the same mesh, begun at the triangle
    /// `start`, ends.
    pub fn closest_point_from(
        &self,
        surface: &Surface,
        query: &Point3<f64>,
        start: u32,
    ) -> SmoothPoint {
        let flat = surface.closest_point_from(query, start);
        let triangle = flat.triangle;
        let at = self.patches[triangle as usize].to_plane(&flat.point).xy();
        self.seek(query, Foot { triangle, at })
            .unwrap_or_else(|| self.sharp(query, triangle, &flat.point))
    }

    /// Newton's method for the foot, over the smooth edges. None where the surface bends towards the query so much
    /// that there is no single closest point.
    fn seek(&self, query: &Point3<f64>, mut foot: Foot) -> Option<SmoothPoint> {
        let mut left = NONE;
        let mut patch = &self.patches[foot.triangle as usize];
        let mut local = patch.to_plane(query);
        for _ in 0..MOST_STEPS {
            let step = patch.step(&local, &foot.at)?;
            foot.at += step;
            let Some(edge) = patch.edge_crossed(&foot.at) else {
                if step.norm_squared() < CLOSE * CLOSE {
                    break;
                }
                continue;
            };
            let next = patch.smooth_across[edge];
            if next == NONE {
                let on_edge = patch.on_edge(edge, &local);
                return Some(self.sharp(query, foot.triangle, &on_edge));
            }
            if next == left {
                // To and fro over an edge: the closest point is at it, where both patches agree.
                break;
            }
            left = foot.triangle;
            let point = patch.to_link(&foot.at.push(0.0));
            patch = &self.patches[next as usize];
            local = patch.to_plane(query);
            let at = patch.to_plane(&point).xy();
            foot = Foot { triangle: next, at };
        }
        Some(self.above(query, &foot))
    }

    /// The body's point above a foot.
    fn above(&self, query: &Point3<f64>, foot: &Foot) -> SmoothPoint {
        let patch = &self.patches[foot.triangle as usize];
        let normal = patch.normal_at(&foot.at).normalize();
        let height = 0.5 * (patch.lift - normal.xy()).dot(&foot.at);
        let above = foot.at.push(0.0) + normal * height;
        let normal = Unit::new_unchecked(patch.link_from_patch * normal);
        let point = patch.to_link(&above);
        SmoothPoint {
            point,
            normal,
            distance: normal.dot(&(query - point)),
            triangle: foot.triangle,
        }
    }

    /// A point at an edge of the body, seen from the query.
    fn sharp(&self, query: &Point3<f64>, triangle: u32, point: &Point3<f64>) -> SmoothPoint {
        let patch = &self.patches[triangle as usize];
        let outwards = patch.link_from_patch.column(2).into_owned();
        let away = query - point;
        let side = if away.dot(&outwards) < 0.0 { -1.0 } else { 1.0 };
        let normal = Unit::try_new(away * side, 1e-7);
        SmoothPoint {
            point: *point,
            normal: normal.unwrap_or(Unit::new_unchecked(outwards)),
            distance: side * away.norm(),
            triangle,
        }
    }
}

impl Patch {
    fn new(fans: &Fans, index: usize) -> Self {
        let [a, b, c] = fans.mesh.corners(index);
        let z = fans.normals[index];
        let x = (b - a).normalize();
        let link_from_patch = Matrix3::from_columns(&[x, z.cross(&x), z]);
        let (width, tip) = ((b - a).norm(), link_from_patch.tr_mul(&(c - a)).xy());
        let corners = [Vector2::zeros(), Vector2::new(width, 0.0), tip];
        let vertices = fans.mesh.triangles[index];
        let normals = vertices.map(|v| link_from_patch.tr_mul(&fans.normal_at(index, v)));
        // From values at the corners to the linear function through them.
        let slopes = |[at_a, at_b, at_c]: [f64; 3]| {
            let along_x = (at_b - at_a) / width;
            Vector2::new(along_x, (at_c - at_a - along_x * tip.x) / tip.y)
        };
        let of = |axis: usize| slopes(normals.map(|normal| normal[axis]));
        let [in_x, in_y, in_z] = [of(0), of(1), of(2)];
        Self {
            origin: a,
            link_from_patch,
            inwards: [0, 1, 2].map(|edge| {
                let along: Vector2<f64> = corners[(edge + 1) % 3] - corners[edge];
                Vector2::new(-along.y, along.x).normalize()
            }),
            corners,
            normal: [
                normals[0],
                Vector3::new(in_x.x, in_y.x, in_z.x),
                Vector3::new(in_x.y, in_y.y, in_z.y),
            ],
            lift: slopes([0.0, normals[1].x * width, normals[2].xy().dot(&tip)]),
            smooth_across: [0, 1, 2].map(|edge| fans.smooth_across(index, edge)),
        }
    }

    fn to_plane(&self, point: &Point3<f64>) -> Vector3<f64> {
        self.link_from_patch.tr_mul(&(point - self.origin))
    }

    fn to_link(&self, local: &Vector3<f64>) -> Point3<f64> {
        self.origin + self.link_from_patch * local
    }

    fn normal_at(&self, at: &Vector2<f64>) -> Vector3<f64> {
        self.normal[0] + self.normal[1] * at.x + self.normal[2] * at.y
    }

    /// The Newton step from a foot to where the normal leads to the query.
    fn step(&self, query: &Vector3<f64>, foot: &Vector2<f64>) -> Option<Vector2<f64>> {
        let normal = self.normal_at(foot);
        let miss = (query.xy() - foot) * normal.z - normal.xy() * query.z;
        let bend = Matrix2::from_columns(&[self.normal[1].xy(), self.normal[2].xy()]) * query.z;
        let slope = Matrix2::identity() * normal.z + bend;
        let determinant = slope.determinant();
        let is_downhill = determinant > LEAST_SLOPE && slope.trace() > 2.0 * LEAST_SLOPE;
        is_downhill.then(|| {
            Vector2::new(
                slope.m22 * miss.x - slope.m12 * miss.y,
                slope.m11 * miss.y - slope.m21 * miss.x,
            ) / determinant
        })
    }

    /// The edge that a foot lies farthest outside of, if it lies outside.
    fn edge_crossed(&self, at: &Vector2<f64>) -> Option<usize> {
        let depth = |edge: usize| self.inwards[edge].dot(&(at - self.corners[edge]));
        let depths = [depth(0), depth(1), depth(2)];
        let mut edge = usize::from(depths[1] < depths[0]);
        if depths[2] < depths[edge] {
            edge = 2;
        }
        (depths[edge] < -1e-9).then_some(edge)
    }

    /// The point of an edge closest to a query, in the link's frame.
    fn on_edge(&self, edge: usize, query: &Vector3<f64>) -> Point3<f64> {
        let (from, to) = (self.corners[edge], self.corners[(edge + 1) % 3]);
        let along = (query.xy() - from).dot(&(to - from)) / (to - from).norm_squared();
        self.to_link(&(from + (to - from) * along.clamp(0.0, 1.0)).push(0.0))
    }
}

/// What the triangles around the vertices say about the body's normals.
struct Fans<'a> {
    mesh: &'a TriangleMesh,
    around: Lists<u32>,
    across: Vec<[u32; 3]>,
    normals: Vec<Vector3<f64>>,
}

impl<'a> Fans<'a> {
    fn new(mesh: &'a TriangleMesh) -> Self {
        let around = triangles_around_vertices(mesh);
        let all = 0..mesh.triangles.len();
        let normal = |index| {
            let [a, b, c] = mesh.corners(index);
            (b - a).cross(&(c - a)).normalize()
        };
        Self {
            across: (all.clone())
                .map(|index| triangles_across_edges(mesh, &around, index))
                .collect(),
            normals: all.map(normal).collect(),
            around,
            mesh,
        }
    }

    /// The triangle across an edge, if the body has no edge there.
    fn smooth_across(&self, index: usize, edge: usize) -> u32 {
        let across = self.across[index][edge];
        let is_smooth = across != NONE
            && self.normals[index].dot(&self.normals[across as usize]) > CREASE_COSINE;
        if is_smooth { across } else { NONE }
    }

    /// Normal of the body at a vertex of a triangle: the mean of the triangles' around it, weighted by their angles
    /// there, as far as they are reached from this one without crossing an edge of the body.
    fn normal_at(&self, index: usize, vertex: u32) -> Vector3<f64> {
        let mut fan = vec![index as u32];
        let mut next = 0;
        while let Some(&member) = fan.get(next) {
            next += 1;
            for edge in 0..3 {
                let other = self.smooth_across(member as usize, edge);
                let is_around = self.around.get(vertex as usize).contains(&other);
                if is_around && !fan.contains(&other) {
                    fan.push(other);
                }
            }
        }
        let weighted =
            |&member: &u32| self.normals[member as usize] * self.angle_at(member as usize, vertex);
        let sum: Vector3<f64> = fan.iter().map(weighted).sum();
        sum.try_normalize(1e-12).unwrap_or(self.normals[index])
    }

    fn angle_at(&self, index: usize, vertex: u32) -> f64 {
        let corners = self.mesh.triangles[index];
        let at = corners.iter().position(|&corner| corner == vertex);
        let points = self.mesh.corners(index);
        at.map_or(0.0, |at| {
            let apex = points[at];
            (points[(at + 1) % 3] - apex).angle(&(points[(at + 2) % 3] - apex))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{SurfacePoint, shape};

    /// Well spread directions.
    fn directions() -> impl Iterator<Item = Vector3<f64>> {
        (0..500).map(|index| {
            let index = f64::from(index) + 0.5;
            let height = 1.0 - index / 250.0;
            let (sin, cos) = (index * 2.399_963).sin_cos();
            let level = (1.0 - height * height).sqrt();
            Vector3::new(level * cos, level * sin, height)
        })
    }

    fn closest(mesh: &TriangleMesh, queries: &[Point3<f64>]) -> Vec<(SmoothPoint, SurfacePoint)> {
        let (surface, body) = (Surface::new(mesh).unwrap(), SmoothBody::new(mesh));
        let both = |query: &Point3<f64>| {
            let flat = surface.closest_point(query);
            (
                body.closest_point_from(&surface, query, flat.triangle),
                flat,
            )
        };
        queries.iter().map(both).collect()
    }

    #[test]
    fn a_meshed_ball_is_a_ball_again() {
        let ball = shape::sphere(0.07, 0.015);
        for distance in [-0.02, 0.001, 0.03, 0.5] {
            let queries: Vec<_> = directions()
                .map(|way| Point3::from(way * (0.07 + distance)))
                .collect();
            for ((smooth, flat), way) in closest(&ball, &queries).into_iter().zip(directions()) {
                // Away from the poles, where narrow triangles meet.
                if way.z.abs() > 0.9 {
                    continue;
                }
                assert!(
                    smooth.normal.angle(&way) < 0.01,
                    "{way} {}",
                    smooth.normal.angle(&way)
                );
                assert!(
                    (smooth.distance - distance).abs() < 2e-5,
                    "{way} {distance} {smooth:?}"
                );
                assert!((smooth.point - (Point3::origin() + way * 0.07)).norm() < 7e-4);
                assert!((smooth.point - flat.point).norm() < 0.02);
            }
        }
    }

    /// The flat triangles' normals are off by as much as half the angle between them, the body's by far less.
    #[test]
    fn the_normals_of_a_cylinder_turn_evenly() {
        let pole = shape::cylinder(0.05, 0.4, 0.01);
        let around = |step: i32| {
            let (sin, cos) = (f64::from(step) * 0.01).sin_cos();
            Vector3::new(cos, sin, 0.0)
        };
        let queries: Vec<_> = (0..60)
            .map(|step| Point3::from(around(step) * 0.08))
            .collect();
        let found = closest(&pole, &queries);
        let off = |normals: &dyn Fn(usize) -> Unit<Vector3<f64>>| {
            (0..60)
                .map(|step| normals(step).angle(&around(step as i32)))
                .fold(0.0, f64::max)
        };
        let surface = Surface::new(&pole).unwrap();
        let flat = off(&|step| surface.normal(found[step].1.triangle));
        let smooth = off(&|step| found[step].0.normal);
        assert!(flat > 0.07 && smooth < 0.004, "{flat} {smooth}");
    }

    #[test]
    fn a_box_keeps_its_edges() {
        let cuboid = shape::cuboid(&Vector3::new(0.1, 0.2, 0.3));
        let queries: Vec<_> = directions().map(|way| Point3::from(way * 0.25)).collect();
        for ((smooth, flat), query) in closest(&cuboid, &queries).into_iter().zip(&queries) {
            assert!((smooth.point - flat.point).norm() < 1e-9, "{query}");
            let away = Unit::new_normalize(query - flat.point);
            assert!(smooth.normal.angle(&away) < 1e-6, "{query}");
            assert!((smooth.distance - (query - flat.point).norm()).abs() < 1e-9);
        }
    }

    #[test]
    fn the_way_back_from_the_closest_point_leads_to_the_query() {
        let capsule = shape::capsule(0.06, 0.2, 0.015);
        let queries: Vec<_> = directions().map(|way| Point3::from(way * 0.3)).collect();
        for ((smooth, _), query) in closest(&capsule, &queries).into_iter().zip(&queries) {
            let back = smooth.point + smooth.normal.into_inner() * smooth.distance;
            assert!(
                (back - query).norm() < 5e-4,
                "{query}: {}",
                (back - query).norm()
            );
        }
    }

    #[test]
    fn odd_meshes_have_closest_points_too() {
        let lone = TriangleMesh {
            vertices: [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0]]
                .map(Point3::from)
                .to_vec(),
            triangles: vec![[0, 1, 2]],
        };
        let queries: Vec<_> = directions().map(|way| Point3::from(way * 0.2)).collect();
        for (smooth, flat) in closest(&lone, &queries) {
            assert!(smooth.distance.is_finite() && (smooth.point - flat.point).norm() < 1e-9);
        }
    }
}
