//! Obstacles and where they touch a mesh.

use nalgebra::{Isometry3, Point3, Translation3, Unit, Vector3};
use parry3d_f64::math::{Pose, Vector};
use parry3d_f64::partitioning::{BvhLeafCost, BvhNode};
use parry3d_f64::query::details::closest_points_support_map_support_map;
use parry3d_f64::query::{ClosestPoints, PointQuery};
use parry3d_f64::shape::{ConvexPolyhedron, Cuboid, Segment, TriMesh, Triangle};
use serde::{Deserialize, Serialize};

use crate::shape::{to_point, to_pose, to_vector};

/// Shape of an obstacle: a convex core, rounded by a radius, so that the direction of the force is defined wherever the
/// core itself stays out of the link.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(
    tag = "kind",
    rename_all = "lowercase",
    deny_unknown_fields,
    expecting = "an obstacle with `kind: sphere`, `cylinder`, `box` or `plane`"
)]
pub enum ObstacleKind {
    /// A ball about the frame's origin.
    Sphere {
        /// Radius, m.
        radius: f64,
    },
    /// A pole along the frame's z axis, its ends rounded.
    Cylinder {
        /// Radius, m.
        radius: f64,
        /// Half of the length of its axis, m.
        half_length: f64,
        /// Direction of the axis in the root frame; drawn along the link's surface if none.
        #[serde(default)]
        axis: Option<[f64; 3]>,
    },
    /// A box about the frame's origin, its edges rounded; one of its edges touches.
    Box {
        /// Half of its size along x, y and z, with the rounding, m.
        half_extents: [f64; 3],
        /// Radius of the rounded edges, m.
        #[serde(default = "default_fillet")]
        fillet: f64,
    },
    /// Everything below the frame's xy plane.
    Plane {},
}

fn default_fillet() -> f64 {
    0.005
}

impl ObstacleKind {
    /// Name as in a scenario.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Sphere { .. } => "sphere",
            Self::Cylinder { .. } => "cylinder",
            Self::Box { .. } => "box",
            Self::Plane {} => "plane",
        }
    }

    /// Radius around the core, m; none for the plane, which has no core.
    pub fn rounding(&self) -> Option<f64> {
        match *self {
            Self::Sphere { radius } | Self::Cylinder { radius, .. } => Some(radius),
            Self::Box { fillet, .. } => Some(fillet),
            Self::Plane {} => None,
        }
    }
}

/// An obstacle at its place.
#[derive(Clone, Debug, PartialEq)]
pub struct Obstacle {
    /// Its shape.
    pub kind: ObstacleKind,
    /// Pose of its frame in the root frame.
    pub root_from_obstacle: Isometry3<f64>,
}

/// Where an obstacle and a mesh are closest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Touch {
    /// The point on the mesh, m.
    pub point_in_root: Point3<f64>,
    /// From obstacle to link: the direction of a frictionless force on the robot.
    pub push_in_root: Unit<Vector3<f64>>,
    /// How deep the mesh is in the obstacle, m; negative for a gap.
    pub penetration: f64,
    /// The mesh's triangle that holds the point; none for a vertex against a plane.
    pub triangle: Option<u32>,
}

/// The convex core of an obstacle, in its frame.
enum Core {
    Point,
    Segment(Segment),
    /// The same box twice: GJK on a polyhedron is exact for every pair of features, where parry's own query of cuboid
    /// and triangle is not; the cuboid measures points.
    Box(ConvexPolyhedron, Cuboid),
    HalfSpace,
}

/// An obstacle's shape, ready for queries; poses come with each of them.
pub(crate) struct Probe {
    core: Core,
    rounding: f64,
}

impl Probe {
    /// None if the shape is degenerate.
    pub fn new(kind: &ObstacleKind) -> Option<Self> {
        let core = match kind {
            ObstacleKind::Sphere { .. } => Core::Point,
            ObstacleKind::Cylinder { half_length, .. } => {
                let end = Vector::new(0.0, 0.0, *half_length);
                Core::Segment(Segment::new(-end, end))
            }
            ObstacleKind::Box { .. } => {
                let half = box_core_half_extents(kind);
                let cuboid = Cuboid::new(to_vector(&half.into()));
                let corners = box_corners(&half);
                Core::Box(ConvexPolyhedron::from_convex_hull(&corners)?, cuboid)
            }
            ObstacleKind::Plane {} => Core::HalfSpace,
        };
        Some(Self {
            core,
            rounding: kind.rounding().unwrap_or(0.0),
        })
    }

    /// Closest points of the obstacle and a link's mesh. None if the core itself is in the mesh.
    pub fn touch(
        &self,
        root_from_obstacle: &Isometry3<f64>,
        mesh: &TriMesh,
        root_from_link: &Isometry3<f64>,
    ) -> Option<Touch> {
        if matches!(self.core, Core::HalfSpace) {
            return deepest_vertex(root_from_obstacle, mesh, root_from_link);
        }
        let link_from_obstacle = root_from_link.inv_mul(root_from_obstacle);
        let closest = self.closest(mesh, &link_from_obstacle, f64::MAX)?;
        let (on_mesh, on_core) = closest.points?;
        let on_mesh = to_point(on_mesh);
        let on_core = link_from_obstacle * to_point(on_core);
        let (push, distance) = Unit::try_new_and_get(on_mesh - on_core, 1e-9)?;
        Some(Touch {
            point_in_root: root_from_link * on_mesh,
            push_in_root: root_from_link * push,
            penetration: self.rounding - distance,
            triangle: Some(closest.triangle),
        })
    }

    /// Whether the obstacle comes nearer than `clearance` (m) to a link's mesh.
    pub fn is_near(
        &self,
        root_from_obstacle: &Isometry3<f64>,
        mesh: &TriMesh,
        root_from_link: &Isometry3<f64>,
        clearance: f64,
    ) -> bool {
        if matches!(self.core, Core::HalfSpace) {
            let touch = deepest_vertex(root_from_obstacle, mesh, root_from_link);
            return touch.is_some_and(|touch| touch.penetration > -clearance);
        }
        let link_from_obstacle = root_from_link.inv_mul(root_from_obstacle);
        (self.closest(mesh, &link_from_obstacle, self.rounding + clearance)).is_some()
    }

    /// The closest points of mesh and core, if they are nearer than `within` (m).
    fn closest(
        &self,
        mesh: &TriMesh,
        link_from_obstacle: &Isometry3<f64>,
        within: f64,
    ) -> Option<Closest> {
        let pose = to_pose(link_from_obstacle);
        let found = mesh.bvh().find_best(
            within,
            |node: &BvhNode, _| {
                let aabb = node.aabb();
                let centre_in_obstacle = pose.inverse_transform_point(aabb.center());
                self.core_distance(centre_in_obstacle) - aabb.half_extents().length()
            },
            |triangle, nearest| {
                let points = self.to_triangle(&mesh.triangle(triangle), &pose, nearest)?;
                Some(Closest::new(triangle, points, &pose))
            },
        );
        found.map(|(_, closest)| closest)
    }

    /// Distance (m) of a point, in the obstacle's frame, to the core.
    fn core_distance(&self, point: Vector) -> f64 {
        match &self.core {
            Core::Point | Core::HalfSpace => point.length(),
            Core::Segment(segment) => segment.distance_to_local_point(point, true),
            Core::Box(_, cuboid) => cuboid.distance_to_local_point(point, true),
        }
    }

    /// Closest points of a triangle (first, in its frame) and the core (second, in its own), if nearer than `within` (m).
    fn to_triangle(&self, triangle: &Triangle, pose: &Pose, within: f64) -> Option<ClosestPoints> {
        let points = match &self.core {
            Core::Point | Core::HalfSpace => {
                let on_mesh = triangle.project_local_point(pose.translation, false).point;
                ClosestPoints::WithinMargin(on_mesh, Vector::ZERO)
            }
            Core::Segment(segment) => {
                closest_points_support_map_support_map(pose, triangle, segment, within)
            }
            Core::Box(polyhedron, _) => {
                closest_points_support_map_support_map(pose, triangle, polyhedron, within)
            }
        };
        (points != ClosestPoints::Disjoint).then_some(points)
    }
}

/// Closest points of a mesh and a core.
struct Closest {
    triangle: u32,
    /// On the mesh in its frame and on the core in its own; none if they intersect.
    points: Option<(Vector, Vector)>,
    /// Distance, m; below every other if they intersect.
    distance: f64,
}

impl Closest {
    fn new(triangle: u32, points: ClosestPoints, pose: &Pose) -> Self {
        let points = match points {
            ClosestPoints::WithinMargin(on_mesh, on_core) => Some((on_mesh, on_core)),
            ClosestPoints::Intersecting | ClosestPoints::Disjoint => None,
        };
        Self {
            triangle,
            points,
            distance: points.map_or(-f64::MAX, |(on_mesh, on_core)| {
                (on_mesh - pose.transform_point(on_core)).length()
            }),
        }
    }
}

impl BvhLeafCost for Closest {
    fn cost(&self) -> f64 {
        self.distance
    }
}

fn box_corners(half: &Vector3<f64>) -> Vec<Vector> {
    let signs = [-1.0, 1.0];
    let corner = |x: f64, y: f64, z: f64| Vector::new(x * half.x, y * half.y, z * half.z);
    (signs.iter())
        .flat_map(|&x| signs.map(|y| (x, y)))
        .flat_map(|(x, y)| signs.map(|z| corner(x, y, z)))
        .collect()
}

/// Half of the size of a box's core, which is the box less its fillet; zero for other shapes.
pub(crate) fn box_core_half_extents(kind: &ObstacleKind) -> Vector3<f64> {
    match kind {
        ObstacleKind::Box {
            half_extents,
            fillet,
        } => Vector3::from(*half_extents).add_scalar(-fillet),
        _ => Vector3::zeros(),
    }
}

fn deepest_vertex(
    root_from_plane: &Isometry3<f64>,
    mesh: &TriMesh,
    root_from_link: &Isometry3<f64>,
) -> Option<Touch> {
    let link_from_plane = root_from_link.inv_mul(root_from_plane);
    let up = link_from_plane * Vector3::z();
    let up = Vector::new(up.x, up.y, up.z);
    let (vertex, height) = (mesh.vertices().iter())
        .map(|&vertex| (vertex, vertex.dot(up)))
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    let plane_height = to_vector(&link_from_plane.translation.vector.into()).dot(up);
    Some(Touch {
        point_in_root: root_from_link * to_point(vertex),
        push_in_root: root_from_plane * Vector3::z_axis(),
        penetration: plane_height - height,
        triangle: None,
    })
}

impl Obstacle {
    /// The same obstacle, moved by `offset_in_root`, m.
    pub fn moved(&self, offset_in_root: &Vector3<f64>) -> Self {
        Self {
            kind: self.kind.clone(),
            root_from_obstacle: Translation3::from(*offset_in_root) * self.root_from_obstacle,
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Translation3, UnitQuaternion};
    use palpate_model::{LoadOptions, TriangleMesh, iiwa14};
    use rand::rngs::Xoshiro256PlusPlus;
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::shape::tri_mesh;

    type Vec3 = Vector3<f64>;

    /// Closest points of two segments, by their clamped parameters.
    fn segments(a: [Vec3; 2], b: [Vec3; 2]) -> f64 {
        let (along_a, along_b, between) = (a[1] - a[0], b[1] - b[0], a[0] - b[0]);
        let (aa, bb, ab) = (
            along_a.norm_squared(),
            along_b.norm_squared(),
            along_a.dot(&along_b),
        );
        let to_b = |s: f64| ((ab * s + along_b.dot(&between)) / bb).clamp(0.0, 1.0);
        let to_a = |t: f64| ((ab * t - along_a.dot(&between)) / aa).clamp(0.0, 1.0);
        let apart = |s: f64, t: f64| (between + along_a * s - along_b * t).norm();
        let inner = (ab * along_b.dot(&between) - bb * along_a.dot(&between)) / (aa * bb - ab * ab);
        let start = if inner.is_finite() {
            inner.clamp(0.0, 1.0)
        } else {
            0.0
        };
        let candidates = [start, 0.0, 1.0].map(|s| {
            let t = to_b(s);
            apart(to_a(t), t)
        });
        candidates.into_iter().fold(f64::MAX, f64::min)
    }

    /// Distance of a point to a triangle: to its plane where the foot is inside, else to its sides.
    fn point_triangle(point: Vec3, corners: [Vec3; 3]) -> f64 {
        let [a, b, c] = corners;
        let normal = (b - a).cross(&(c - a)).normalize();
        let is_over = [(a, b), (b, c), (c, a)]
            .iter()
            .all(|(from, to)| (to - from).cross(&(point - from)).dot(&normal) >= 0.0);
        if is_over {
            return (point - a).dot(&normal).abs();
        }
        let to_side = |(from, to): (Vec3, Vec3)| {
            let along = to - from;
            let share = ((point - from).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
            (point - from - along * share).norm()
        };
        [(a, b), (b, c), (c, a)]
            .map(to_side)
            .into_iter()
            .fold(f64::MAX, f64::min)
    }

    /// Distance of a body, given by its corners, edges and half size, to a triangle that it does not intersect.
    fn body_triangle(body: &[Vec3], edges: &[[Vec3; 2]], half: Vec3, corners: [Vec3; 3]) -> f64 {
        let [a, b, c] = corners;
        let from_corners = body.iter().map(|&corner| point_triangle(corner, corners));
        let from_edges = (edges.iter())
            .flat_map(|&edge| [[a, b], [b, c], [c, a]].map(|side| segments(edge, side)));
        let to_corners = corners
            .iter()
            .map(|corner| (corner.abs() - half).sup(&Vec3::zeros()).norm());
        from_corners
            .chain(from_edges)
            .chain(to_corners)
            .fold(f64::MAX, f64::min)
    }

    fn distance_by_force(
        kind: &ObstacleKind,
        mesh: &TriangleMesh,
        link_from_obstacle: &Isometry3<f64>,
    ) -> f64 {
        let half = match *kind {
            ObstacleKind::Cylinder { half_length, .. } => Vec3::new(0.0, 0.0, half_length),
            _ => box_core_half_extents(kind),
        };
        let body: Vec<Vec3> = (box_corners(&half).iter())
            .map(|&corner| to_point(corner).coords)
            .collect();
        let pairs = body.iter().flat_map(|&a| body.iter().map(move |&b| [a, b]));
        let edges: Vec<_> = pairs
            .filter(|[a, b]| (a - b).iter().filter(|x| x.abs() > 1e-12).count() == 1)
            .collect();
        (0..mesh.triangles.len())
            .map(|triangle| {
                mesh.corners(triangle)
                    .map(|p| (link_from_obstacle.inverse() * p).coords)
            })
            .map(|corners| body_triangle(&body, &edges, half, corners))
            .fold(f64::MAX, f64::min)
    }

    #[test]
    fn closest_points_are_those_found_by_force() -> Result<(), Box<dyn std::error::Error>> {
        let robot = iiwa14(&LoadOptions::default())?;
        let mesh = robot.links[4].mesh.clone().ok_or("mesh")?;
        let shape = tri_mesh(&mesh)?;
        let kinds = [
            ObstacleKind::Sphere { radius: 0.03 },
            ObstacleKind::Cylinder {
                radius: 0.03,
                half_length: 0.1,
                axis: None,
            },
            ObstacleKind::Box {
                half_extents: [0.05, 0.03, 0.02],
                fillet: 0.005,
            },
        ];
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        for kind in &kinds {
            let probe = Probe::new(kind).ok_or("probe")?;
            let mut touches = 0;
            for _ in 0..60 {
                let mut random = || Vec3::from_fn(|_, _| rng.random_range(-1.0..1.0));
                let translation = Translation3::from(random() * 0.25);
                let rotation = UnitQuaternion::from_scaled_axis(random() * 3.0);
                let pose = Isometry3::from_parts(translation, rotation);
                let Some(touch) = probe.touch(&pose, &shape, &Isometry3::identity()) else {
                    continue;
                };
                touches += 1;
                let expected = distance_by_force(kind, &mesh, &pose);
                let rounding = kind.rounding().ok_or("rounding")?;
                let found = rounding - touch.penetration;
                assert!(
                    (found - expected).abs() < 1e-9,
                    "{}: {found} against {expected}",
                    kind.name()
                );
                let is_near =
                    |clearance| probe.is_near(&pose, &shape, &Isometry3::identity(), clearance);
                assert!(
                    is_near(expected - rounding + 1e-6) && !is_near(expected - rounding - 1e-6)
                );
            }
            assert!(touches > 20, "{}: only {touches}", kind.name());
        }
        Ok(())
    }
}
