//! Estimates and scenes as ROS messages. All of them are in the robot's root frame.

use nalgebra::Point3;
use palpate_filter::{
    Arrow, CLOUD_FIELDS, CLOUD_POINT_STEP, Colour, ContactPose, Label, Mode, Scene, pack_cloud,
};
use r2r::builtin_interfaces::msg::Time;
use r2r::geometry_msgs::msg::{
    Point, Pose, PoseWithCovariance, PoseWithCovarianceStamped, Quaternion, Vector3, Wrench,
    WrenchStamped,
};
use r2r::sensor_msgs::msg::{PointCloud2, PointField};
use r2r::std_msgs::msg::{ColorRGBA, Header};
use r2r::visualization_msgs::msg::{Marker, MarkerArray};

/// A header in `frame` with a stamp in nanoseconds.
pub fn header(stamp_ns: i64, frame: &str) -> Header {
    Header {
        stamp: time(stamp_ns),
        frame_id: frame.to_owned(),
    }
}

/// Nanoseconds as ROS 2 writes time, whose seconds end in 2038.
pub fn time(stamp_ns: i64) -> Time {
    Time {
        sec: i32::try_from(stamp_ns.div_euclid(1_000_000_000)).unwrap_or(i32::MAX),
        nanosec: stamp_ns.rem_euclid(1_000_000_000) as u32,
    }
}

/// Nanoseconds of a message's stamp.
pub fn nanoseconds(stamp: &Time) -> i64 {
    i64::from(stamp.sec) * 1_000_000_000 + i64::from(stamp.nanosec)
}

/// The contact as a pose whose z axis is the outward normal.
pub fn pose(pose: &ContactPose, header: Header) -> PoseWithCovarianceStamped {
    let rotation = pose.root_from_contact.rotation;
    PoseWithCovarianceStamped {
        header,
        pose: PoseWithCovariance {
            pose: Pose {
                position: point(&pose.root_from_contact.translation.vector.into()),
                orientation: Quaternion {
                    x: rotation.i,
                    y: rotation.j,
                    z: rotation.k,
                    w: rotation.w,
                },
            },
            covariance: pose.covariance.to_vec(),
        },
    }
}

/// The force on the robot. It acts at the contact point, about which its torque is zero.
pub fn wrench(mode: &Mode, header: Header) -> WrenchStamped {
    let force = mode.force_in_root;
    WrenchStamped {
        header,
        wrench: Wrench {
            force: scale(force.x, force.y, force.z),
            torque: Vector3::default(),
        },
    }
}

/// The particles as a cloud with normal, weight, force, stiffness and link.
pub fn cloud(scene: &Scene, header: Header) -> PointCloud2 {
    let fields = CLOUD_FIELDS.map(|field| PointField {
        name: field.name.to_owned(),
        offset: field.offset,
        datatype: field.kind as u8,
        count: 1,
    });
    let count = scene.cloud.len();
    PointCloud2 {
        header,
        height: 1,
        width: count as u32,
        fields: fields.to_vec(),
        is_bigendian: false,
        point_step: CLOUD_POINT_STEP as u32,
        row_step: (count * CLOUD_POINT_STEP) as u32,
        data: pack_cloud(&scene.cloud),
        is_dense: true,
    }
}

/// Markers that replace all earlier ones: the particles as one sphere list coloured by likelihood, an arrow for each
/// mode, a label.
pub fn markers(scene: &Scene, header: &Header) -> MarkerArray {
    let mut markers = vec![Marker {
        header: header.clone(),
        action: i32::from(Marker::DELETEALL as u8),
        ..Marker::default()
    }];
    if !scene.cloud.is_empty() {
        markers.push(spheres(scene, header));
    }
    for (id, arrow) in scene.arrows.iter().enumerate() {
        markers.push(arrow_marker(arrow, id as i32, header));
    }
    markers.extend(scene.label.iter().map(|label| label_marker(label, header)));
    MarkerArray { markers }
}

fn spheres(scene: &Scene, header: &Header) -> Marker {
    Marker {
        type_: Marker::SPHERE_LIST as i32,
        ns: "particles".to_owned(),
        scale: scale(Scene::SPHERE, Scene::SPHERE, Scene::SPHERE),
        points: scene
            .cloud
            .iter()
            .map(|at| point(&at.point_in_root))
            .collect(),
        colors: scene.cloud.iter().map(|at| colour(at.colour)).collect(),
        ..marker(header)
    }
}

fn arrow_marker(arrow: &Arrow, id: i32, header: &Header) -> Marker {
    Marker {
        type_: Marker::ARROW as i32,
        ns: "contact".to_owned(),
        id,
        scale: scale(Scene::SHAFT, Scene::HEAD, Scene::HEAD_LENGTH),
        points: vec![point(&arrow.from_in_root), point(&arrow.to_in_root)],
        color: colour(arrow.colour),
        ..marker(header)
    }
}

fn label_marker(label: &Label, header: &Header) -> Marker {
    let mut marker = Marker {
        type_: Marker::TEXT_VIEW_FACING as i32,
        ns: "label".to_owned(),
        scale: scale(0.0, 0.0, Scene::TEXT),
        text: label.text.clone(),
        ..marker(header)
    };
    marker.pose.position = point(&label.at_in_root);
    marker
}

/// A marker to be added, opaque and at the header's frame, whatever it is to show.
pub fn marker(header: &Header) -> Marker {
    let mut marker = Marker {
        header: header.clone(),
        action: Marker::ADD as i32,
        color: colour([1.0; 4]),
        ..Marker::default()
    };
    marker.pose.orientation.w = 1.0;
    marker
}

/// A point, m.
pub fn point(point: &Point3<f64>) -> Point {
    Point {
        x: point.x,
        y: point.y,
        z: point.z,
    }
}

/// A size or a vector.
pub fn scale(x: f64, y: f64, z: f64) -> Vector3 {
    Vector3 { x, y, z }
}

/// A colour.
pub fn colour([r, g, b, a]: Colour) -> ColorRGBA {
    ColorRGBA { r, g, b, a }
}
