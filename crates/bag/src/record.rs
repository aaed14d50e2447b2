//! What palpate records: samples, estimates, scenes and the truth, as standard messages.

use nalgebra::{Point3, Vector3};
use palpate_filter::{
    CLOUD_FIELDS, CLOUD_POINT_STEP, CloudPoint, ContactEstimate, ContactPose, Scene, pack_cloud,
};
use palpate_model::{JointSample, Kinematics, MeasuredSample, Robot};

use crate::message::*;
use crate::{BagError, BagWriter};

/// Names of the topics that are written.
pub mod topics {
    /// `sensor_msgs/msg/JointState` with names and positions.
    pub const JOINT_STATES: &str = "/joint_states";
    /// `sensor_msgs/msg/JointState` with names and efforts: the torques that the environment applies on the joints.
    pub const EXTERNAL_TORQUES: &str = "/external_torques";
    /// `std_msgs/msg/String`: the URDF.
    pub const ROBOT_DESCRIPTION: &str = "/robot_description";
    /// `tf2_msgs/msg/TFMessage`: every link in its parent.
    pub const TF: &str = "/tf";
    /// `geometry_msgs/msg/PoseWithCovarianceStamped`: the best mode, z along the outward normal.
    pub const CONTACT_POSE: &str = "/palpate/contact_pose";
    /// `geometry_msgs/msg/WrenchStamped`: force on the robot at the contact point.
    pub const CONTACT_WRENCH: &str = "/palpate/contact_wrench";
    /// `sensor_msgs/msg/PointCloud2`: the particles.
    pub const PARTICLES: &str = "/palpate/particles";
    /// `visualization_msgs/msg/MarkerArray`: arrows, particles coloured by likelihood, a label.
    pub const MARKERS: &str = "/palpate/markers";
    /// `geometry_msgs/msg/PointStamped`: the true contact point.
    pub const TRUE_POINT: &str = "/ground_truth/contact_point";
    /// `geometry_msgs/msg/WrenchStamped`: the true force on the robot.
    pub const TRUE_FORCE: &str = "/ground_truth/force";
    /// `std_msgs/msg/String`: name of the link that is touched.
    pub const TRUE_LINK: &str = "/ground_truth/link";
}

/// Numbers of `visualization_msgs/msg/Marker`.
mod marker {
    pub(super) const ARROW: i32 = 0;
    pub(super) const SPHERE_LIST: i32 = 7;
    pub(super) const TEXT_VIEW_FACING: i32 = 9;
    pub(super) const ADD: i32 = 0;
    pub(super) const DELETE_ALL: i32 = 3;
}

/// Each method writes messages stamped with the stamp of what it is given, in the robot's root frame.
///
/// # Errors
/// All of them fail if the file cannot be written.
impl BagWriter {
    /// Writes the URDF, for viewers that draw the robot.
    pub fn robot_description(&mut self, stamp_ns: i64, urdf: &str) -> Result<(), BagError> {
        let data = urdf.to_owned();
        self.write(topics::ROBOT_DESCRIPTION, stamp_ns, &Text { data })
    }

    /// Writes joint positions and external torques.
    pub fn sample(&mut self, robot: &Robot, sample: &JointSample) -> Result<(), BagError> {
        let names: Vec<_> = robot
            .joints
            .iter()
            .map(|joint| joint.name.clone())
            .collect();
        let state = JointState {
            header: Header::new(sample.stamp_ns, ""),
            name: names,
            ..JointState::default()
        };
        let positions = JointState {
            position: sample.position.clone(),
            ..state.clone()
        };
        let torques = JointState {
            effort: sample.external_torque.clone(),
            ..state
        };
        self.write(topics::JOINT_STATES, sample.stamp_ns, &positions)?;
        self.write(topics::EXTERNAL_TORQUES, sample.stamp_ns, &torques)
    }

    /// Writes positions, speeds and measured torques, as most drivers report them.
    pub fn measured(&mut self, robot: &Robot, sample: &MeasuredSample) -> Result<(), BagError> {
        let names = robot.joints.iter().map(|joint| joint.name.clone());
        let state = JointState {
            header: Header::new(sample.stamp_ns, ""),
            name: names.collect(),
            position: sample.position.clone(),
            velocity: sample.velocity.clone(),
            effort: sample.torque.clone(),
        };
        self.write(topics::JOINT_STATES, sample.stamp_ns, &state)
    }

    /// Writes the pose of every link in its parent.
    pub fn transforms(
        &mut self,
        stamp_ns: i64,
        robot: &Robot,
        kinematics: &Kinematics,
    ) -> Result<(), BagError> {
        let transforms = robot.links.iter().enumerate().filter_map(|(index, link)| {
            let parent = link.parent?;
            let root_from_parent = kinematics.root_from_link(parent);
            let parent_from_link = root_from_parent.inv_mul(kinematics.root_from_link(index));
            Some(TransformStamped {
                header: Header::new(stamp_ns, &robot.links[parent].name),
                child_frame_id: link.name.clone(),
                transform: (&parent_from_link).into(),
            })
        });
        let transforms = transforms.collect();
        self.write(topics::TF, stamp_ns, &TfMessage { transforms })
    }

    /// Writes pose and wrench of the best mode; nothing without contact.
    pub fn estimate(&mut self, robot: &Robot, estimate: &ContactEstimate) -> Result<(), BagError> {
        let Some(mode) = estimate.best() else {
            return Ok(());
        };
        let header = Header::new(estimate.stamp_ns, robot.root());
        if let Some(pose) = ContactPose::new(mode) {
            let message = PoseWithCovarianceStamped {
                header: header.clone(),
                pose: PoseWithCovariance {
                    pose: (&pose.root_from_contact).into(),
                    covariance: Covariance(pose.covariance),
                },
            };
            self.write(topics::CONTACT_POSE, estimate.stamp_ns, &message)?;
        }
        let message = wrench(header, &mode.force_in_root);
        self.write(topics::CONTACT_WRENCH, estimate.stamp_ns, &message)
    }

    /// Writes the particle cloud and the markers.
    pub fn scene(&mut self, robot: &Robot, scene: &Scene) -> Result<(), BagError> {
        let header = Header::new(scene.stamp_ns, robot.root());
        let cloud = point_cloud(header.clone(), &scene.cloud);
        self.write(topics::PARTICLES, scene.stamp_ns, &cloud)?;
        let markers = markers(&header, scene);
        self.write(topics::MARKERS, scene.stamp_ns, &MarkerArray { markers })
    }

    /// Writes the true contact: its point, the force on the robot, and the link that is touched.
    pub fn truth(
        &mut self,
        stamp_ns: i64,
        robot: &Robot,
        link: &str,
        point_in_root: &Point3<f64>,
        force_in_root: &Vector3<f64>,
    ) -> Result<(), BagError> {
        let header = Header::new(stamp_ns, robot.root());
        let point = PointStamped {
            header: header.clone(),
            point: point_in_root.into(),
        };
        let link = Text {
            data: link.to_owned(),
        };
        self.write(topics::TRUE_POINT, stamp_ns, &point)?;
        self.write(topics::TRUE_FORCE, stamp_ns, &wrench(header, force_in_root))?;
        self.write(topics::TRUE_LINK, stamp_ns, &link)
    }
}

/// A force on the robot in the header's frame. It acts at the contact point, about which its torque is zero.
fn wrench(header: Header, force: &Vector3<f64>) -> WrenchStamped {
    WrenchStamped {
        header,
        wrench: Wrench {
            force: force.into(),
            torque: Xyz::default(),
        },
    }
}

fn point_cloud(header: Header, points: &[CloudPoint]) -> PointCloud2 {
    let fields = CLOUD_FIELDS.iter().map(|field| PointField {
        name: field.name.to_owned(),
        offset: field.offset,
        datatype: field.kind as u8,
        count: 1,
    });
    let data = pack_cloud(points);
    PointCloud2 {
        header,
        height: 1,
        width: (data.len() / CLOUD_POINT_STEP) as u32,
        fields: fields.collect(),
        is_bigendian: false,
        point_step: CLOUD_POINT_STEP as u32,
        row_step: data.len() as u32,
        data,
        is_dense: true,
    }
}

/// The markers of a scene. The first deletes those of the scene before, so that nothing outlives its contact.
fn markers(header: &Header, scene: &Scene) -> Vec<Marker> {
    let marker = |ns: &str, id: usize, kind, [x, y, z]: [f64; 3], color: [f32; 4]| Marker {
        header: header.clone(),
        ns: ns.to_owned(),
        id: id as i32,
        kind,
        action: marker::ADD,
        pose: (&nalgebra::Isometry3::identity()).into(),
        scale: Xyz { x, y, z },
        color: color.into(),
        ..Marker::default()
    };
    let mut markers = vec![Marker {
        action: marker::DELETE_ALL,
        ..marker("", 0, marker::ARROW, [0.0; 3], [0.0; 4])
    }];
    let arrow_scale = [Scene::SHAFT, Scene::HEAD, Scene::HEAD_LENGTH];
    for (id, arrow) in scene.arrows.iter().enumerate() {
        markers.push(Marker {
            points: vec![(&arrow.from_in_root).into(), (&arrow.to_in_root).into()],
            ..marker("contact", id, marker::ARROW, arrow_scale, arrow.colour)
        });
    }
    if let Some(label) = &scene.label {
        let scale = [0.0, 0.0, Scene::TEXT];
        let mut text = marker("label", 0, marker::TEXT_VIEW_FACING, scale, [1.0; 4]);
        text.pose.position = (&label.at_in_root).into();
        text.text.clone_from(&label.text);
        markers.push(text);
    }
    if !scene.cloud.is_empty() {
        let points = scene
            .cloud
            .iter()
            .map(|point| (&point.point_in_root).into());
        let colors = scene.cloud.iter().map(|point| point.colour.into());
        markers.push(Marker {
            points: points.collect(),
            colors: colors.collect(),
            ..marker(
                "particles",
                0,
                marker::SPHERE_LIST,
                [Scene::SPHERE; 3],
                [1.0; 4],
            )
        });
    }
    markers
}
