//! What to draw of an estimate and its particles, for whoever draws: the ROS 2 node, a bag, a picture.
//!
//! Everything is in the robot's root frame and finite: viewers such as RViz refuse a whole marker for one NaN.

use nalgebra::{
    Isometry3, Matrix3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3,
};
use palpate_model::{Kinematics, Robot};

use crate::{ContactEstimate, ContactStatus, Mode, Particle};

/// Red, green, blue and opacity, each 0 to 1.
pub type Colour = [f32; 4];

/// One particle, ready to draw.
#[derive(Clone, Debug, PartialEq)]
pub struct CloudPoint {
    /// Contact point, m.
    pub point_in_root: Point3<f64>,
    /// Outward surface normal.
    pub normal_in_root: Unit<Vector3<f64>>,
    /// Normalised weight.
    pub weight: f64,
    /// Normal force, N.
    pub force: f64,
    /// Contact stiffness, N/m.
    pub stiffness: f64,
    /// Index of the link in [`Robot::links`].
    pub link: usize,
    /// Red for the least to green for the most likely particle.
    pub colour: Colour,
}

/// An arrow whose tip touches the surface where the force acts.
#[derive(Clone, Debug, PartialEq)]
pub struct Arrow {
    /// Tail, m.
    pub from_in_root: Point3<f64>,
    /// Tip: the contact point, m.
    pub to_in_root: Point3<f64>,
    /// Opaque for the best mode, fainter for the less probable ones.
    pub colour: Colour,
}

/// A line of text beside the arrow.
#[derive(Clone, Debug, PartialEq)]
pub struct Label {
    /// Where, m.
    pub at_in_root: Point3<f64>,
    /// What.
    pub text: String,
}

/// What to draw at one instant. Empty without contact.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// Stamp of the estimate, ns.
    pub stamp_ns: i64,
    /// The particles.
    pub cloud: Vec<CloudPoint>,
    /// One for each mode, the most probable first.
    pub arrows: Vec<Arrow>,
    /// Link, probability and force of the best mode.
    pub label: Option<Label>,
}

impl Scene {
    /// Diameter of a particle's sphere, m.
    pub const SPHERE: f64 = 0.01;
    /// Diameter of an arrow's shaft, m.
    pub const SHAFT: f64 = 0.01;
    /// Diameter of an arrow's head, m.
    pub const HEAD: f64 = 0.025;
    /// Length of an arrow's head, m.
    pub const HEAD_LENGTH: f64 = 0.03;
    /// Height of the label's capital letters, m.
    pub const TEXT: f64 = 0.05;

    /// Draws `estimate` and `particles` at the configuration of `kinematics`. Particles with a value that is not
    /// finite, or a link that the robot has not, are left out.
    pub fn new(
        robot: &Robot,
        kinematics: &Kinematics,
        estimate: &ContactEstimate,
        particles: &[Particle],
    ) -> Self {
        let most = particles
            .iter()
            .map(|particle| particle.weight)
            .filter(|weight| weight.is_finite())
            .fold(0.0, f64::max);
        Self {
            stamp_ns: estimate.stamp_ns,
            cloud: particles
                .iter()
                .filter(|particle| particle.link < robot.links.len())
                .filter_map(|particle| cloud_point(kinematics, particle, most))
                .collect(),
            arrows: estimate.modes.iter().filter_map(arrow).collect(),
            label: estimate
                .best()
                .and_then(|mode| label(robot, estimate.status, mode)),
        }
    }
}

fn cloud_point(kinematics: &Kinematics, particle: &Particle, most: f64) -> Option<CloudPoint> {
    let root_from_link = kinematics.root_from_link(particle.link);
    let point = CloudPoint {
        point_in_root: root_from_link * particle.point_in_link,
        normal_in_root: root_from_link.rotation * particle.normal_in_link,
        weight: particle.weight,
        force: particle.force,
        stiffness: particle.stiffness,
        link: particle.link,
        colour: likelihood_colour(particle.weight, most),
    };
    let numbers = [point.weight, point.force, point.stiffness];
    let finite = is_finite(&point.point_in_root.coords)
        && is_finite(&point.normal_in_root)
        && numbers.iter().all(|number| number.is_finite());
    finite.then_some(point)
}

/// From red at zero to green at `most`, as in figure 3 of the paper.
fn likelihood_colour(weight: f64, most: f64) -> Colour {
    let share = if most > 0.0 { weight / most } else { 1.0 };
    let share = share.clamp(0.0, 1.0) as f32;
    [1.0 - share, share, 0.0, 1.0]
}

/// Shortest and longest arrow, m, and its length per force, m/N.
const ARROW_LENGTH: (f64, f64) = (0.08, 0.4);
const ARROW_PER_FORCE: f64 = 0.01;

fn arrow(mode: &Mode) -> Option<Arrow> {
    let force = mode.force_in_root;
    if !is_finite(&force) || !is_finite(&mode.point_in_root.coords) {
        return None;
    }
    // Where the force is too small to have a direction, the normal has one.
    let direction = Unit::try_new(force, 1e-9).unwrap_or(-mode.normal_in_root);
    let length = (force.norm() * ARROW_PER_FORCE).clamp(ARROW_LENGTH.0, ARROW_LENGTH.1);
    let from_in_root = mode.point_in_root - direction.into_inner() * length;
    let opacity = if mode.probability.is_finite() {
        mode.probability.clamp(0.2, 1.0) as f32
    } else {
        1.0
    };
    is_finite(&from_in_root.coords).then_some(Arrow {
        from_in_root,
        to_in_root: mode.point_in_root,
        colour: [0.1, 0.3, 1.0, opacity],
    })
}

fn label(robot: &Robot, status: ContactStatus, mode: &Mode) -> Option<Label> {
    let at_in_root = arrow(mode)?.from_in_root;
    let link = robot.links.get(mode.link)?;
    Some(Label {
        at_in_root,
        text: format!(
            "{} {:.0} % ({}): {:.1} N",
            link.name,
            100.0 * mode.probability,
            status.word(),
            mode.force
        ),
    })
}

/// The contact as a pose: position, rotation and their covariance.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactPose {
    /// A frame at the contact point whose z axis is the outward normal; x and y lie in the tangent plane, nothing
    /// more is promised of them.
    pub root_from_contact: Isometry3<f64>,
    /// 6 × 6, by rows: x, y, z, then rotations about the root's x, y, z. Those are not estimated: zeros.
    pub covariance: [f64; 36],
}

impl ContactPose {
    /// The pose of a mode; none if one of its values is not finite.
    pub fn new(mode: &Mode) -> Option<Self> {
        let covariance = &mode.covariance_in_root;
        let finite = is_finite(&mode.point_in_root.coords)
            && is_finite(&mode.normal_in_root)
            && covariance.iter().all(|number| number.is_finite());
        finite.then(|| Self {
            root_from_contact: Isometry3::from_parts(
                Translation3::from(mode.point_in_root),
                rotation_with_z(&mode.normal_in_root),
            ),
            covariance: covariance_6x6(covariance),
        })
    }
}

fn covariance_6x6(position: &Matrix3<f64>) -> [f64; 36] {
    std::array::from_fn(|index| match (index / 6, index % 6) {
        (row @ 0..3, column @ 0..3) => position[(row, column)],
        _ => 0.0,
    })
}

/// A rotation whose z axis is `z`, with an x axis that is as horizontal as it can be.
fn rotation_with_z(z: &Unit<Vector3<f64>>) -> UnitQuaternion<f64> {
    let x = Vector3::z().cross(z);
    let x = if x.norm() < 1e-6 {
        Vector3::x()
    } else {
        x.normalize()
    };
    let y = z.cross(&x).normalize();
    let x = y.cross(z);
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, **z]));
    UnitQuaternion::from_rotation_matrix(&rotation)
}

fn is_finite(vector: &Vector3<f64>) -> bool {
    vector.iter().all(|number| number.is_finite())
}

/// Type of a cloud's field, with the number that `sensor_msgs/msg/PointField` gives it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum CloudFieldType {
    /// 32-bit unsigned integer.
    UInt32 = 6,
    /// 32-bit float.
    Float32 = 7,
}

/// One field of a packed [`CloudPoint`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CloudField {
    /// Name, as viewers look for it.
    pub name: &'static str,
    /// First byte in the point.
    pub offset: u32,
    /// Type.
    pub kind: CloudFieldType,
}

/// Fields of a packed point: nine floats, then the link's index.
pub const CLOUD_FIELDS: [CloudField; 10] = [
    float_field("x", 0),
    float_field("y", 4),
    float_field("z", 8),
    float_field("normal_x", 12),
    float_field("normal_y", 16),
    float_field("normal_z", 20),
    float_field("weight", 24),
    float_field("force", 28),
    float_field("stiffness", 32),
    CloudField {
        name: "link",
        offset: 36,
        kind: CloudFieldType::UInt32,
    },
];

/// Bytes of a packed point.
pub const CLOUD_POINT_STEP: usize = 40;

const fn float_field(name: &'static str, offset: u32) -> CloudField {
    CloudField {
        name,
        offset,
        kind: CloudFieldType::Float32,
    }
}

/// Packs points for a `sensor_msgs/msg/PointCloud2`: little-endian, one after the other, as [`CLOUD_FIELDS`] tells.
pub fn pack_cloud(points: &[CloudPoint]) -> Vec<u8> {
    let mut data = Vec::with_capacity(points.len() * CLOUD_POINT_STEP);
    for point in points {
        let (p, n) = (point.point_in_root, point.normal_in_root);
        let floats = [
            p.x,
            p.y,
            p.z,
            n.x,
            n.y,
            n.z,
            point.weight,
            point.force,
            point.stiffness,
        ];
        for value in floats {
            data.extend_from_slice(&(value as f32).to_le_bytes());
        }
        let link = u32::try_from(point.link).unwrap_or(u32::MAX);
        data.extend_from_slice(&link.to_le_bytes());
    }
    data
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::{Joint, JointKind, Link};

    fn pendulum() -> Robot {
        let link = |name: &str, parent, joint, path| Link {
            name: name.to_owned(),
            parent,
            parent_from_rest: Isometry3::translation(0.0, 0.0, 1.0),
            joint,
            path,
            inertial: None,
            mesh: None,
        };
        Robot {
            name: "pendulum".to_owned(),
            joints: vec![Joint {
                name: "hinge".to_owned(),
                kind: JointKind::Revolute,
                axis_in_joint: Vector3::x_axis(),
                limits: None,
            }],
            links: vec![
                link("base", None, None, vec![]),
                link("bob", Some(0), Some(0), vec![0]),
            ],
        }
    }

    fn particle(weight: f64) -> Particle {
        Particle {
            triangle: 0,
            link: 1,
            point_in_link: Point3::new(0.1, 0.2, 0.3),
            normal_in_link: Vector3::y_axis(),
            force: 5.0,
            stiffness: 2000.0,
            weight,
        }
    }

    fn mode() -> Mode {
        Mode {
            link: 1,
            probability: 0.75,
            point_in_root: Point3::new(0.1, 0.2, 0.3),
            point_in_link: Point3::origin(),
            normal_in_root: Unit::new_normalize(Vector3::new(1.0, -2.0, 0.5)),
            force_in_root: Vector3::new(0.0, 20.0, 0.0),
            force: 20.0,
            stiffness: 1e3,
            covariance_in_root: Matrix3::new(1.0, 2.0, 3.0, 2.0, 5.0, 6.0, 3.0, 6.0, 9.0),
        }
    }

    fn estimate(modes: Vec<Mode>) -> ContactEstimate {
        ContactEstimate {
            stamp_ns: 7,
            status: ContactStatus::Located,
            modes,
        }
    }

    fn scene(modes: Vec<Mode>, particles: &[Particle]) -> Scene {
        let robot = pendulum();
        let mut kinematics = Kinematics::new(&robot);
        kinematics.update(&robot, &[std::f64::consts::FRAC_PI_2]);
        Scene::new(&robot, &kinematics, &estimate(modes), particles)
    }

    #[test]
    fn points_move_with_their_link() {
        let robot = pendulum();
        let mut kinematics = Kinematics::new(&robot);
        kinematics.update(&robot, &[std::f64::consts::FRAC_PI_2]);
        let origin = kinematics.root_from_link(1).translation.vector;
        let point = &scene(vec![], &[particle(1.0)]).cloud[0];
        // A quarter turn about x takes y to z, and z to -y.
        let expected = origin + Vector3::new(0.1, -0.3, 0.2);
        assert!((point.point_in_root.coords - expected).norm() < 1e-12);
        assert!((point.normal_in_root.into_inner() - Vector3::z()).norm() < 1e-12);
    }

    #[test]
    fn colours_run_from_red_to_green() {
        let weights = [0.0, 0.2, 0.4].map(particle);
        let colours: Vec<_> = scene(vec![], &weights)
            .cloud
            .iter()
            .map(|point| point.colour)
            .collect();
        let expected = [
            [1.0, 0.0, 0.0, 1.0],
            [0.5, 0.5, 0.0, 1.0],
            [0.0, 1.0, 0.0, 1.0],
        ];
        assert_eq!(colours, expected);
    }

    #[test]
    fn nothing_that_is_not_finite_is_drawn() {
        let mut lost = particle(0.5);
        lost.point_in_link.x = f64::NAN;
        let mut endless = particle(f64::INFINITY);
        endless.force = f64::INFINITY;
        let mut broken = mode();
        broken.force_in_root.z = f64::NAN;
        let scene = scene(
            vec![broken.clone(), mode()],
            &[lost, particle(0.5), endless],
        );
        assert_eq!((scene.cloud.len(), scene.arrows.len()), (1, 1));
        assert_eq!(scene.label, None);
        broken.covariance_in_root.m12 = f64::NAN;
        assert_eq!(ContactPose::new(&broken), None);
    }

    #[test]
    fn an_arrow_ends_at_the_contact_along_the_force() {
        let scene = scene(vec![mode()], &[]);
        let arrow = &scene.arrows[0];
        assert_eq!(arrow.to_in_root, mode().point_in_root);
        let along = arrow.to_in_root - arrow.from_in_root;
        assert!((along - Vector3::new(0.0, 0.2, 0.0)).norm() < 1e-12);
        let text = scene.label.map(|label| label.text);
        assert_eq!(text.as_deref(), Some("bob 75 % (located): 20.0 N"));
    }

    #[test]
    fn the_pose_has_the_normal_as_its_z_axis() {
        let straight = [Vector3::z_axis(), -Vector3::z_axis(), Vector3::x_axis()];
        for normal in straight.into_iter().chain([mode().normal_in_root]) {
            let pose = ContactPose::new(&Mode {
                normal_in_root: normal,
                ..mode()
            })
            .unwrap();
            let z = pose.root_from_contact.rotation * Vector3::z();
            assert!((z - normal.into_inner()).norm() < 1e-9, "{normal:?}");
            assert!((pose.root_from_contact.rotation.norm() - 1.0).abs() < 1e-9);
        }
        let covariance = ContactPose::new(&mode()).unwrap().covariance;
        assert_eq!(covariance[6..9], [2.0, 5.0, 6.0]);
        assert!(covariance[18..].iter().all(|&entry| entry == 0.0));
    }

    #[test]
    fn a_packed_point_is_where_the_fields_say() {
        let cloud = scene(vec![], &[particle(0.25), particle(0.75)]).cloud;
        let data = pack_cloud(&cloud);
        assert_eq!(data.len(), 2 * CLOUD_POINT_STEP);
        let field = |name: &str| {
            let field = CLOUD_FIELDS.iter().find(|field| field.name == name);
            let start = CLOUD_POINT_STEP + field.unwrap().offset as usize;
            <[u8; 4]>::try_from(&data[start..start + 4]).unwrap()
        };
        assert_eq!(f32::from_le_bytes(field("weight")), 0.75);
        assert_eq!(f32::from_le_bytes(field("force")), 5.0);
        assert_eq!(f32::from_le_bytes(field("stiffness")), 2000.0);
        assert_eq!(f32::from_le_bytes(field("normal_z")), 1.0);
        assert_eq!(u32::from_le_bytes(field("link")), 1);
    }
}
