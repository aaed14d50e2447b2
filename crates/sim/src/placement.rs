//! Where the obstacle touches: a configuration, a point of the link and the obstacle against it, all drawn.

use std::f64::consts::TAU;

use nalgebra::{
    Isometry3, Matrix3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3,
};
use palpate_model::{Joint, Kinematics, TriangleMesh};
use rand::{Rng, RngExt};

use crate::obstacle::{Touch, box_core_half_extents};
use crate::scene::{Refusal, Scene, triangle_normal};
use crate::torque::joint_torques;
use crate::{Obstacle, ObstacleKind, Scenario};

/// Share of each joint's range, about its middle, that configurations are drawn from.
const LIMIT_SHARE: f64 = 0.8;
/// Least lever (Nm per N, all joints together) with which the arm can press and feel.
const LEAST_LEVER: f64 = 0.02;

/// The start of a contact.
pub(crate) struct Placement {
    pub position: Vec<f64>,
    pub obstacle: Obstacle,
    pub touch: Touch,
}

/// Draws a configuration and an obstacle that is `depth` (m) deep in the link.
pub(crate) fn draw_placement(
    scene: &Scene,
    scenario: &Scenario,
    depth: f64,
    rng: &mut impl Rng,
) -> Result<Placement, Refusal> {
    let position: Vec<_> = (scene.robot.joints.iter())
        .map(|joint| draw_position(joint, rng))
        .collect();
    let mut kinematics = Kinematics::new(scene.robot);
    kinematics.update(scene.robot, &position);
    let (point, normal) = draw_surface_point(&scene.mesh, rng);
    let root_from_link = kinematics.root_from_link(scene.link);
    let root_from_obstacle = draw_pose(
        &scenario.obstacle,
        &(root_from_link * point),
        &(root_from_link * normal),
        rng,
    )?;
    let drawn = Obstacle {
        kind: scenario.obstacle.clone(),
        root_from_obstacle,
    };
    let (obstacle, touch) = set_depth(scene, &kinematics, drawn, depth)?;
    if !scene.is_clear(&kinematics, &obstacle) {
        return Err(Refusal::Covered);
    }
    let push = touch.push_in_root.into_inner();
    let point = touch.point_in_root;
    let lever = joint_torques(scene.robot, &kinematics, scene.link, &point, &push);
    if lever.iter().map(|l| l * l).sum::<f64>().sqrt() < LEAST_LEVER {
        return Err(Refusal::Lever);
    }
    Ok(Placement {
        position,
        obstacle,
        touch,
    })
}

fn draw_position(joint: &Joint, rng: &mut impl Rng) -> f64 {
    let (lower, upper) = (joint.limits).map_or((-TAU / 2.0, TAU / 2.0), |l| (l.lower, l.upper));
    let half_range = 0.5 * (upper - lower) * LIMIT_SHARE;
    0.5 * (lower + upper) + half_range * rng.random_range(-1.0..=1.0)
}

/// A point of the mesh, uniform by area, and the outward normal there.
fn draw_surface_point(mesh: &TriangleMesh, rng: &mut impl Rng) -> (Point3<f64>, Vector3<f64>) {
    let area = |triangle: usize| {
        let [a, b, c] = mesh.corners(triangle);
        (b - a).cross(&(c - a)).norm()
    };
    let total: f64 = (0..mesh.triangles.len()).map(area).sum();
    let mut left = total * rng.random::<f64>();
    let triangle = (0..mesh.triangles.len()).find(|&triangle| {
        left -= area(triangle);
        left <= 0.0
    });
    let triangle = triangle.unwrap_or(mesh.triangles.len() - 1);
    let [a, b, c] = mesh.corners(triangle);
    // The square root makes it uniform: the area beyond a cut parallel to the side b–c grows with its square.
    let (towards_side, along_side) = (rng.random::<f64>().sqrt(), rng.random::<f64>());
    let on_side = b + (c - b) * along_side;
    (
        a + (on_side - a) * towards_side,
        triangle_normal(mesh, triangle),
    )
}

/// A pose in which the obstacle's surface passes through `point`, on the side that `normal` points to.
fn draw_pose(
    kind: &ObstacleKind,
    point: &Point3<f64>,
    normal: &Vector3<f64>,
    rng: &mut impl Rng,
) -> Result<Isometry3<f64>, Refusal> {
    let tangent = draw_tangent(normal, rng);
    Ok(match *kind {
        ObstacleKind::Sphere { radius } => Translation3::from(point + normal * radius).into(),
        ObstacleKind::Cylinder {
            radius,
            half_length,
            axis,
        } => {
            let axis = axis.map_or(tangent, |axis| Unit::new_normalize(axis.into()));
            let away = across(normal, &axis)?;
            let along = axis.into_inner() * half_length * rng.random_range(-0.4..0.4);
            let centre = point + away.into_inner() * radius + along;
            let rotation = frame(&away, &axis);
            Isometry3::from_parts(centre.into(), rotation)
        }
        ObstacleKind::Box { fillet, .. } => {
            let edge = Unit::new_normalize(tangent.into_inner());
            let towards_box =
                Rotation3::from_axis_angle(&edge, rng.random_range(-0.4..0.4)) * normal;
            // The edge that touches is the one at -x, -y: the box lies along its diagonal.
            let eighth_turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -TAU / 8.0);
            let rotation = frame(&Unit::new_normalize(towards_box), &edge) * eighth_turn;
            let half = box_core_half_extents(kind);
            let from_edge = Vector3::new(half.x, half.y, half.z * rng.random_range(-0.4..0.4));
            let centre = point + normal * fillet + rotation * from_edge;
            Isometry3::from_parts(centre.into(), rotation)
        }
        ObstacleKind::Plane {} => {
            // Tilted, so that a flat face of the link meets it by its rim and not everywhere at once.
            let tilt = Rotation3::from_axis_angle(&tangent, rng.random_range(-0.3..0.3));
            let up = Unit::new_normalize(-(tilt * normal));
            let side = draw_tangent(&up, rng);
            Isometry3::from_parts((*point).into(), frame(&side, &up))
        }
    })
}

/// A random direction along the surface.
fn draw_tangent(normal: &Vector3<f64>, rng: &mut impl Rng) -> Unit<Vector3<f64>> {
    let least = normal.iamin();
    let helper = Vector3::ith_axis(least);
    let first = Unit::new_normalize(normal.cross(&helper));
    let second = normal.cross(&first);
    let (sin, cos) = (TAU * rng.random::<f64>()).sin_cos();
    Unit::new_normalize(first.into_inner() * cos + second * sin)
}

/// The part of the normal across the pole, as a direction.
fn across(normal: &Vector3<f64>, axis: &Unit<Vector3<f64>>) -> Result<Unit<Vector3<f64>>, Refusal> {
    const LEAST_PART: f64 = 0.9;
    let part = normal - axis.into_inner() * axis.dot(normal);
    Unit::try_new(part, LEAST_PART).ok_or(Refusal::AcrossAxis)
}

/// Rotation whose x and z axes are the given ones, which are perpendicular.
fn frame(x: &Unit<Vector3<f64>>, z: &Unit<Vector3<f64>>) -> UnitQuaternion<f64> {
    let y = z.cross(x);
    let columns = Matrix3::from_columns(&[x.into_inner(), y, z.into_inner()]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(columns))
}

/// Shifts the obstacle along the direction of contact until it is `depth` deep in the link. The point that it touches
/// then is the closest one, which need not be the drawn one.
fn set_depth(
    scene: &Scene,
    kinematics: &Kinematics,
    mut obstacle: Obstacle,
    depth: f64,
) -> Result<(Obstacle, Touch), Refusal> {
    const SHIFTS: usize = 20;
    const CLOSE_ENOUGH: f64 = 1e-6;
    for _ in 0..SHIFTS {
        let touch = scene.touch(kinematics, &obstacle.root_from_obstacle)?;
        if !scene.is_outside(kinematics, &touch) {
            return Err(Refusal::Inside);
        }
        let excess = touch.penetration - depth;
        if excess.abs() < CLOSE_ENOUGH {
            return Ok((obstacle, touch));
        }
        obstacle = obstacle.moved(&(-touch.push_in_root.into_inner() * excess));
    }
    Err(Refusal::Lost)
}
