//! The messages that this crate writes, field by field as their definitions say.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use crate::encode::{Encode, Encoder};

/// A message that can stand alone on a topic.
pub(crate) trait TopicMessage: Encode {
    /// `pkg/Type`.
    const TYPE: &'static str;
}

/// Declares messages; the order of their fields is that of the definition. A name after `:` makes it a topic's.
macro_rules! messages {
    ($($name:ident $(: $topic_type:literal)? { $($field:ident: $kind:ty,)* })*) => {
        $(
            #[derive(Clone, Debug, Default, PartialEq)]
            pub(crate) struct $name {
                $(pub(crate) $field: $kind,)*
            }

            impl Encode for $name {
                fn encode(&self, out: &mut Encoder) {
                    $(self.$field.encode(out);)*
                }
            }

            $(impl TopicMessage for $name {
                const TYPE: &'static str = $topic_type;
            })?
        )*
    };
}

messages! {
    Time { sec: i32, nanosec: u32, }
    Header { stamp: Time, frame_id: String, }
    Text: "std_msgs/String" { data: String, }
    Color { r: f32, g: f32, b: f32, a: f32, }
    JointState: "sensor_msgs/JointState" {
        header: Header,
        name: Vec<String>,
        position: Vec<f64>,
        velocity: Vec<f64>,
        effort: Vec<f64>,
    }
    PointField { name: String, offset: u32, datatype: u8, count: u32, }
    PointCloud2: "sensor_msgs/PointCloud2" {
        header: Header,
        height: u32,
        width: u32,
        fields: Vec<PointField>,
        is_bigendian: bool,
        point_step: u32,
        row_step: u32,
        data: Vec<u8>,
        is_dense: bool,
    }
    CompressedImage { header: Header, format: String, data: Vec<u8>, }
    Xyz { x: f64, y: f64, z: f64, }
    Quaternion { x: f64, y: f64, z: f64, w: f64, }
    Pose { position: Xyz, orientation: Quaternion, }
    PoseWithCovariance { pose: Pose, covariance: Covariance, }
    PoseWithCovarianceStamped: "geometry_msgs/PoseWithCovarianceStamped" {
        header: Header,
        pose: PoseWithCovariance,
    }
    PointStamped: "geometry_msgs/PointStamped" { header: Header, point: Xyz, }
    Wrench { force: Xyz, torque: Xyz, }
    WrenchStamped: "geometry_msgs/WrenchStamped" { header: Header, wrench: Wrench, }
    Transform { translation: Xyz, rotation: Quaternion, }
    TransformStamped { header: Header, child_frame_id: String, transform: Transform, }
    TfMessage: "tf2_msgs/TFMessage" { transforms: Vec<TransformStamped>, }
    UvCoordinate { u: f32, v: f32, }
    MeshFile { filename: String, data: Vec<u8>, }
    Marker {
        header: Header,
        ns: String,
        id: i32,
        kind: i32,
        action: i32,
        pose: Pose,
        scale: Xyz,
        color: Color,
        lifetime: Time,
        frame_locked: bool,
        points: Vec<Xyz>,
        colors: Vec<Color>,
        texture_resource: String,
        texture: CompressedImage,
        uv_coordinates: Vec<UvCoordinate>,
        text: String,
        mesh_resource: String,
        mesh_file: MeshFile,
        mesh_use_embedded_materials: bool,
    }
    MarkerArray: "visualization_msgs/MarkerArray" { markers: Vec<Marker>, }
}

/// Covariance of a pose, 6 × 6 by rows.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Covariance(pub(crate) [f64; 36]);

impl Default for Covariance {
    fn default() -> Self {
        Self([0.0; 36])
    }
}

impl Encode for Covariance {
    fn encode(&self, out: &mut Encoder) {
        self.0.encode(out);
    }
}

impl Time {
    /// From nanoseconds; what does not fit the message's 32 bits of seconds is cut.
    pub(crate) fn from_ns(stamp_ns: i64) -> Self {
        let sec = stamp_ns.div_euclid(1_000_000_000);
        let nanosec = stamp_ns.rem_euclid(1_000_000_000);
        Self {
            sec: sec.clamp(i32::MIN.into(), i32::MAX.into()) as i32,
            nanosec: nanosec as u32,
        }
    }
}

impl Header {
    pub(crate) fn new(stamp_ns: i64, frame: &str) -> Self {
        Self {
            stamp: Time::from_ns(stamp_ns),
            frame_id: frame.to_owned(),
        }
    }
}

impl From<&Vector3<f64>> for Xyz {
    fn from(vector: &Vector3<f64>) -> Self {
        Self {
            x: vector.x,
            y: vector.y,
            z: vector.z,
        }
    }
}

impl From<&Point3<f64>> for Xyz {
    fn from(point: &Point3<f64>) -> Self {
        Self::from(&point.coords)
    }
}

impl From<&UnitQuaternion<f64>> for Quaternion {
    fn from(rotation: &UnitQuaternion<f64>) -> Self {
        Self {
            x: rotation.i,
            y: rotation.j,
            z: rotation.k,
            w: rotation.w,
        }
    }
}

impl From<&Isometry3<f64>> for Pose {
    fn from(pose: &Isometry3<f64>) -> Self {
        Self {
            position: (&pose.translation.vector).into(),
            orientation: (&pose.rotation).into(),
        }
    }
}

impl From<&Isometry3<f64>> for Transform {
    fn from(pose: &Isometry3<f64>) -> Self {
        Self {
            translation: (&pose.translation.vector).into(),
            rotation: (&pose.rotation).into(),
        }
    }
}

impl From<[f32; 4]> for Color {
    fn from([r, g, b, a]: [f32; 4]) -> Self {
        Self { r, g, b, a }
    }
}
