//! The true contact of a simulated trial as markers.

use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use palpate_node::messages::{colour, marker, point, scale};
use palpate_sim::{ObstacleKind, Trial, TrueContact};
use r2r::geometry_msgs::msg::{Pose, Quaternion};
use r2r::std_msgs::msg::Header;
use r2r::visualization_msgs::msg::{Marker, MarkerArray};

/// Radius of the dot at the contact, m.
const DOT: f64 = 0.012;
/// Length of a force's arrow, m/N.
const LENGTH_PER_NEWTON: f64 = 0.01;
/// Side of the square that stands for a plane, m.
const PLANE: f64 = 0.5;
const GREEN: [f32; 4] = [0.2, 0.8, 0.3, 1.0];
const CLEAR_GREEN: [f32; 4] = [0.2, 0.8, 0.3, 0.35];

/// Markers that replace all earlier ones: the obstacle, and where it touches, the point and the force.
pub fn draw(trial: &Trial, sample: usize, header: &Header) -> MarkerArray {
    let mut markers = vec![
        Marker {
            header: header.clone(),
            action: Marker::DELETEALL as i32,
            ..Marker::default()
        },
        obstacle(trial, header),
    ];
    if let Some(contact) = trial.truth.get(sample).and_then(|truth| truth.contact) {
        markers.extend([dot(&contact, header), arrow(&contact, header)]);
    }
    MarkerArray { markers }
}

/// Where it first is: drift is not shown.
fn obstacle(trial: &Trial, header: &Header) -> Marker {
    let mut root_from_obstacle = trial.obstacle.root_from_obstacle;
    let (shape, size) = match &trial.obstacle.kind {
        ObstacleKind::Sphere { radius } => (Marker::SPHERE as i32, [2.0 * radius; 3]),
        ObstacleKind::Cylinder {
            radius,
            half_length,
            ..
        } => {
            let across = 2.0 * radius;
            (Marker::CYLINDER as i32, [across, across, 2.0 * half_length])
        }
        ObstacleKind::Box { half_extents, .. } => {
            (Marker::CUBE as i32, half_extents.map(|half| 2.0 * half))
        }
        ObstacleKind::Plane {} => {
            let thickness = 0.002;
            let below = Translation3::new(0.0, 0.0, -0.5 * thickness);
            root_from_obstacle *= Isometry3::from_parts(below, UnitQuaternion::identity());
            (Marker::CUBE as i32, [PLANE, PLANE, thickness])
        }
    };
    Marker {
        type_: shape,
        ns: "obstacle".to_owned(),
        pose: pose(&root_from_obstacle),
        scale: scale(size[0], size[1], size[2]),
        color: colour(CLEAR_GREEN),
        ..marker(header)
    }
}

fn dot(contact: &TrueContact, header: &Header) -> Marker {
    let mut dot = Marker {
        type_: Marker::SPHERE as i32,
        ns: "true contact".to_owned(),
        scale: scale(DOT, DOT, DOT),
        color: colour(GREEN),
        ..marker(header)
    };
    dot.pose.position = point(&contact.point_in_root);
    dot
}

fn arrow(contact: &TrueContact, header: &Header) -> Marker {
    let tail = contact.point_in_root - LENGTH_PER_NEWTON * contact.force_in_root;
    Marker {
        type_: Marker::ARROW as i32,
        ns: "true force".to_owned(),
        scale: scale(0.006, 0.012, 0.02),
        points: vec![point(&tail), point(&contact.point_in_root)],
        color: colour(GREEN),
        ..marker(header)
    }
}

fn pose(root_from_obstacle: &Isometry3<f64>) -> Pose {
    let turn = root_from_obstacle.rotation;
    Pose {
        position: point(&root_from_obstacle.translation.vector.into()),
        orientation: Quaternion {
            x: turn.i,
            y: turn.j,
            z: turn.k,
            w: turn.w,
        },
    }
}
