//! The robot that ships with the project: its files describe an LBR iiwa 14.

use std::collections::HashMap;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

use nalgebra::{Matrix3, Point3, Vector3};
use palpate_model::{Geometry, IIWA14_URDF, Kinematics, LoadOptions, Robot, TriangleMesh, iiwa14};

fn assert_near<const N: usize>(found: impl Into<[f64; N]>, expected: impl Into<[f64; N]>) {
    let (found, expected) = (found.into(), expected.into());
    let near = |(a, b): (f64, f64)| (a - b).abs() < 1e-9;
    assert!(
        found.into_iter().zip(expected).all(near),
        "{found:?} is not {expected:?}"
    );
}

/// The robot with the triangles of its files.
fn as_shipped() -> Robot {
    let options = LoadOptions {
        max_edge: f64::INFINITY,
        ..LoadOptions::default()
    };
    iiwa14(&options).expect("the shipped robot loads")
}

fn meshes(robot: &Robot) -> Vec<(&str, &TriangleMesh)> {
    (robot.links.iter())
        .filter_map(|link| Some((link.name.as_str(), link.mesh.as_ref()?)))
        .collect()
}

/// Origin of a link in the root frame.
fn origin(robot: &Robot, position: [f64; 7], link: &str) -> Point3<f64> {
    let mut kinematics = Kinematics::new(robot);
    kinematics.update(robot, &position);
    let link = robot.link_index(link).expect("the link is there");
    kinematics.root_from_link(link) * Point3::origin()
}

#[test]
fn links_are_closed_and_face_outwards() {
    let robot = as_shipped();
    assert_eq!(meshes(&robot).len(), 8);
    for (name, mesh) in meshes(&robot) {
        let count = mesh.triangles.len();
        assert!((1500..=4000).contains(&count), "{name}: {count} triangles");
        let mut edges = HashMap::new();
        for &[a, b, c] in &mesh.triangles {
            for edge in [(a, b), (b, c), (c, a)] {
                *edges.entry(edge).or_insert(0) += 1;
            }
        }
        for (&(from, to), &times) in &edges {
            assert_eq!(
                times, 1,
                "{name}: edge {from} {to} is used twice the same way"
            );
            assert!(
                edges.contains_key(&(to, from)),
                "{name}: hole at {from} {to}"
            );
        }
        // Euler: vertices - edges + faces is 2 for one closed surface without handles.
        assert_eq!(mesh.vertices.len() + count, edges.len() / 2 + 2, "{name}");
        let volume = |triangle| {
            let [a, b, c] = mesh.corners(triangle).map(|corner| corner.coords);
            a.dot(&b.cross(&c)) / 6.0
        };
        let volume: f64 = (0..count).map(volume).sum();
        assert!(volume > 2e-4, "{name}: volume {volume} m³");
    }
}

#[test]
fn triangles_are_even_enough_to_be_left_as_they_are() {
    for (name, mesh) in meshes(&as_shipped()) {
        for triangle in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.corners(triangle);
            let double_area = (b - a).cross(&(c - a)).norm();
            let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
            assert!(
                longest < LoadOptions::default().max_edge,
                "{name}: edge of {longest} m"
            );
            assert!(double_area / longest > 1e-3, "{name}: sliver {triangle}");
        }
    }
}

#[test]
fn stands_straight_at_zero_with_the_published_lengths() {
    let robot = as_shipped();
    for (link, height) in [
        ("lbr_link_0", 0.0),
        ("lbr_link_2", 0.36),
        ("lbr_link_4", 0.36 + 0.42),
        ("lbr_link_6", 0.36 + 0.42 + 0.40),
        ("lbr_link_ee", 0.36 + 0.42 + 0.40 + 0.126),
    ] {
        let expected = Point3::new(0.0, 0.0, height);
        assert_near(origin(&robot, [0.0; 7], link), expected);
    }
}

#[test]
fn turns_the_way_the_arm_turns() {
    let robot = as_shipped();
    let flange = |joint: usize, angle: f64| {
        let mut position = [0.0; 7];
        position[joint] = angle;
        origin(&robot, position, "lbr_link_ee")
    };
    // A2, A4 and A6 at a quarter turn lay what is above them along x, A4 backwards.
    let lengths = [
        (1, 0.36, 0.946, 1.0),
        (3, 0.78, 0.526, -1.0),
        (5, 1.18, 0.126, 1.0),
    ];
    for (joint, height, length, sense) in lengths {
        let expected = Point3::new(sense * length, 0.0, height);
        assert_near(flange(joint, FRAC_PI_2), expected);
    }
    // A1, A3, A5 and A7 turn about z, counter-clockwise seen from above.
    for joint in [0, 2, 4, 6] {
        let mut position = [0.0; 7];
        position[joint] = 0.5;
        let mut kinematics = Kinematics::new(&robot);
        kinematics.update(&robot, &position);
        let flange = robot.link_index("lbr_link_ee").unwrap();
        let turned = kinematics.root_from_link(flange).rotation.scaled_axis();
        assert_near(turned, Vector3::z() * 0.5);
    }
}

#[test]
fn limits_are_the_published_ones() {
    let robot = as_shipped();
    let published = [
        (170, 85, 320.0),
        (120, 85, 320.0),
        (170, 100, 176.0),
        (120, 75, 176.0),
        (170, 130, 110.0),
        (120, 135, 40.0),
        (175, 135, 40.0),
    ];
    assert_eq!(robot.dof(), published.len());
    for (number, (joint, (turn, speed, torque))) in (1..).zip(robot.joints.iter().zip(published)) {
        assert_eq!(joint.name, format!("lbr_A{number}"));
        let limits = joint.limits.unwrap();
        let (turn, speed) = (f64::from(turn).to_radians(), f64::from(speed).to_radians());
        let found = [limits.upper, limits.lower, limits.velocity];
        assert_near(found, [turn, -turn, speed]);
        assert_eq!(limits.effort, torque);
    }
}

#[test]
fn inertias_are_those_of_real_bodies() {
    let urdf = urdf_rs::read_from_string(IIWA14_URDF).unwrap();
    let robot = as_shipped();
    let mut total = 0.0;
    for (link, (_, mesh)) in urdf.links.iter().zip(meshes(&robot)) {
        let inertial = &link.inertial;
        let i = &inertial.inertia;
        let matrix = Matrix3::new(
            i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz,
        );
        let moments = matrix.symmetric_eigenvalues();
        assert!(moments.min() > 0.0, "{}: moments {moments}", link.name);
        assert!(
            moments.sum() > 2.0 * moments.max(),
            "{}: moments {moments}",
            link.name
        );
        let center = Point3::from(inertial.origin.xyz.0);
        for axis in 0..3 {
            let coordinates = mesh.vertices.iter().map(|vertex| vertex[axis]);
            assert!(coordinates.clone().any(|x| x < center[axis]));
            assert!(coordinates.clone().any(|x| x > center[axis]));
        }
        total += inertial.mass.value;
    }
    assert_near([total], [29.9]);
}

#[test]
fn loads_from_its_file_without_being_told_of_packages() {
    let repository = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for geometry in [Geometry::Collision, Geometry::Visual] {
        let options = LoadOptions {
            geometry,
            ..LoadOptions::default()
        };
        let path = repository.join("urdf/iiwa14.urdf");
        let (robot, _) = Robot::from_urdf_file(path, &[], &[], &options).unwrap();
        assert_eq!(meshes(&robot), meshes(&iiwa14(&options).unwrap()));
    }
}
