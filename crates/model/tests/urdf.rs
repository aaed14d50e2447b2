//! Robots from URDF: the tree, the frames, the geometry, and what is said about faults.

#![expect(clippy::unwrap_used, reason = "a failed helper fails its test")]

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Point3, Vector3};
use palpate_model::{
    EmbeddedMeshes, Geometry, JointKind, LoadOptions, LoadReport, MeshSource, ModelError, Robot,
};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

/// A box from 0 to 1, 2 and 3, with one face missing and all others facing inwards.
const INSIDE_OUT: &[u8] = b"v 0 0 0\nv 1 0 0\nv 0 2 0\nv 1 2 0\nv 0 0 3\nv 1 0 3\nv 0 2 3\nv 1 2 3
f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8\n";

const MESHES: EmbeddedMeshes = EmbeddedMeshes(&[
    ("inside_out.obj", INSIDE_OUT),
    ("empty.obj", b"o nothing\n"),
    ("broken.stl", b"broken"),
    ("flat.obj", b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"),
]);

/// An arm with two branches, its joints listed children first.
const TREE: &str = r#"<robot name="arm">
  <link name="tool"/>
  <link name="finger"><collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>
  <link name="slide"/>
  <link name="upper">
    <visual><geometry><sphere radius="0.2"/></geometry></visual>
    <collision><origin xyz="0 0 0.5"/><geometry><cylinder radius="0.1" length="1"/></geometry></collision>
    <collision><origin xyz="1 0 0"/><geometry><box size="0.2 0.2 0.2"/></geometry></collision>
  </link>
  <link name="base"/>
  <joint name="flange" type="fixed">
    <parent link="upper"/><child link="tool"/><origin xyz="0 0 1" rpy="0 0 1.5707963267948966"/>
  </joint>
  <joint name="reach" type="prismatic">
    <parent link="base"/><child link="slide"/><axis xyz="0 0 -4"/><limit lower="0" upper="0.3" velocity="1" effort="9"/>
  </joint>
  <joint name="grip" type="revolute">
    <parent link="tool"/><child link="finger"/><limit lower="-1" upper="2" velocity="3" effort="4"/>
  </joint>
  <joint name="turn" type="continuous">
    <parent link="base"/><child link="upper"/><axis xyz="0 0 1"/><limit velocity="3" effort="4"/>
  </joint>
</robot>"#;

fn load(xml: &str) -> Result<(Robot, LoadReport), ModelError> {
    Robot::from_urdf(xml, &MESHES, &LoadOptions::default())
}

fn message(xml: &str) -> String {
    load(xml).unwrap_err().to_string()
}

/// A robot of one link with this inside.
fn lone(inside: &str) -> String {
    format!(r#"<robot name="r"><link name="only">{inside}</link></robot>"#)
}

fn collision(geometry: &str) -> String {
    lone(&format!(
        "<collision><geometry>{geometry}</geometry></collision>"
    ))
}

fn bounds(robot: &Robot, link: &str) -> [[f64; 3]; 2] {
    let mesh = robot.links[robot.link_index(link).unwrap()]
        .mesh
        .as_ref()
        .unwrap();
    let fold = |pick: fn(&Point3<f64>, &Point3<f64>) -> Point3<f64>| {
        let corner = mesh.vertices.iter().copied().reduce(|a, b| pick(&a, &b));
        corner.unwrap().into()
    };
    [fold(|a, b| a.inf(b)), fold(|a, b| a.sup(b))]
}

fn assert_bounds(robot: &Robot, link: &str, low: [f64; 3], high: [f64; 3]) {
    let found = bounds(robot, link);
    let difference = Vector3::from(found[0]) - Vector3::from(low);
    let other = Vector3::from(found[1]) - Vector3::from(high);
    assert!(difference.amax() < 1e-9 && other.amax() < 1e-9, "{found:?}");
}

#[test]
fn links_and_joints_come_parents_first_and_know_their_path() {
    let (robot, report) = load(TREE).unwrap();
    let links: Vec<_> = robot.links.iter().map(|link| link.name.as_str()).collect();
    assert_eq!(links, ["base", "slide", "upper", "tool", "finger"]);
    let joints: Vec<_> = robot
        .joints
        .iter()
        .map(|joint| joint.name.as_str())
        .collect();
    assert_eq!(joints, ["reach", "turn", "grip"]);
    let paths: Vec<_> = robot.links.iter().map(|link| link.path.clone()).collect();
    assert_eq!(paths, [vec![], vec![0], vec![1], vec![1], vec![1, 2]]);
    let parents: Vec<_> = robot.links.iter().map(|link| link.parent).collect();
    assert_eq!(parents, [None, Some(0), Some(0), Some(2), Some(3)]);
    assert_eq!(robot.links[3].joint, None);
    let reported: Vec<_> = report.links.iter().map(|link| link.name.as_str()).collect();
    assert_eq!(reported, links);
}

#[test]
fn joints_keep_kind_axis_limits_and_origin() {
    let (robot, _) = load(TREE).unwrap();
    let [reach, turn, grip] = &robot.joints[..] else {
        panic!("{:?}", robot.joints);
    };
    assert_eq!(
        (reach.kind, turn.kind),
        (JointKind::Prismatic, JointKind::Continuous)
    );
    assert_eq!(reach.axis_in_joint.into_inner(), -Vector3::z());
    assert_eq!(reach.limits.unwrap().upper, 0.3);
    assert_eq!(turn.limits, None);
    // The format's default.
    assert_eq!(grip.axis_in_joint.into_inner(), Vector3::x());
    let upper_from_tool = robot.links[3].parent_from_rest;
    assert!((upper_from_tool.translation.z - 1.0).abs() < 1e-15);
    assert!((upper_from_tool * Vector3::x() - Vector3::y()).norm() < 1e-15);
}

#[test]
fn roll_pitch_and_yaw_turn_about_fixed_axes_in_this_order() {
    let xml = lone(&format!(
        r#"<collision><origin xyz="10 0 0" rpy="{FRAC_PI_2} 0 {FRAC_PI_2}"/>
        <geometry><box size="1 2 3"/></geometry></collision>"#
    ));
    let (robot, _) = load(&xml).unwrap();
    // Roll takes z to -y and y to z; yaw then takes x to y and y to -x.
    assert_bounds(&robot, "only", [8.5, -0.5, -1.0], [11.5, 0.5, 1.0]);
}

#[test]
fn all_collision_elements_of_a_link_are_one_mesh_in_its_frame() {
    let (robot, report) = load(TREE).unwrap();
    assert_bounds(&robot, "upper", [-0.1, -0.1, 0.0 - 0.1], [1.1, 0.1, 1.0]);
    assert_eq!(report.links[2].elements, 2);
    let mesh = robot.links[2].mesh.as_ref().unwrap();
    assert_eq!(mesh.triangles.len(), report.links[2].triangles);
    assert_eq!(mesh.edges().open, 0);
}

#[test]
fn links_without_the_geometry_asked_for_cannot_be_touched() {
    let touchable = |geometry| {
        let options = LoadOptions {
            geometry,
            max_edge: 0.05,
            ..LoadOptions::default()
        };
        let (robot, _) = Robot::from_urdf(TREE, &MESHES, &options).unwrap();
        let links = robot.links.into_iter().filter(|link| link.mesh.is_some());
        links.map(|link| link.name).collect::<Vec<_>>()
    };
    assert_eq!(touchable(Geometry::Collision), ["upper", "finger"]);
    assert_eq!(touchable(Geometry::Visual), ["upper"]);
}

#[test]
fn meshes_are_scaled_before_they_are_moved_and_turned_outwards() {
    let xml = lone(
        r#"<collision><origin xyz="0 0 1"/><geometry>
        <mesh filename="inside_out.obj" scale="-0.1 0.1 0.1"/></geometry></collision>"#,
    );
    let (robot, report) = load(&xml).unwrap();
    assert_bounds(&robot, "only", [-0.1, 0.0, 1.0], [0.0, 0.2, 1.3]);
    let mesh = robot.links[0].mesh.as_ref().unwrap();
    assert!(mesh.signed_volume() > 0.004, "{}", mesh.signed_volume());
    let report = &report.links[0];
    assert_eq!((report.triangles_read, report.open_edges), (11, 3));
    assert!(report.split_edges > 0);
    assert!(
        report.warnings[0].contains("inside_out.obj"),
        "{:?}",
        report.warnings
    );
}

/// A flange as it is drawn: behind its face, on the same line of action, lies the disc of a motor.
#[test]
fn a_disc_behind_a_face_cannot_be_touched() {
    let flange =
        r#"<collision><geometry><cylinder radius="0.05" length="0.1"/></geometry></collision>"#;
    let disc = r#"<collision><origin xyz="0 0 0.01"/><geometry><cylinder radius="0.03" length="0.002"/></geometry>
        </collision>"#;
    let (alone, _) = load(&lone(flange)).unwrap();
    let (robot, report) = load(&lone(&format!("{flange}{disc}"))).unwrap();
    let corners = |robot: &Robot| {
        let mesh = robot.links[0].mesh.as_ref().unwrap();
        let triangles = 0..mesh.triangles.len();
        triangles
            .map(|index| mesh.corners(index))
            .collect::<Vec<_>>()
    };
    assert!(corners(&robot) == corners(&alone));
    let report = &report.links[0];
    assert_eq!(report.elements, 2);
    assert!(report.enclosed_triangles > 32, "{report:?}");
    assert!(report.warnings.is_empty());
}

struct Book(String);

impl MeshSource for Book {
    fn read(&self, _: &str) -> Result<Vec<u8>, ModelError> {
        Ok(self.0.clone().into_bytes())
    }
}

/// Sheets around an axis like the pages of an open book, so many that no ray finds its way out between them.
#[test]
fn a_link_whose_triangles_all_enclose_each_other_keeps_them() {
    let pages = 720;
    let mut book = String::from("v 0 0 -5\nv 0 0 5\n");
    for page in 0..pages {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(page) / f64::from(pages)).sin_cos();
        let (low, high) = (2 * page + 3, 2 * page + 4);
        book += &format!("v {cos} {sin} -5\nv {cos} {sin} 5\nf 1 {low} {high}\nf 1 {high} 2\n");
    }
    let options = LoadOptions {
        max_edge: f64::INFINITY,
        ..LoadOptions::default()
    };
    let xml = collision(r#"<mesh filename="book.obj"/>"#);
    let (robot, report) = Robot::from_urdf(&xml, &Book(book), &options).unwrap();
    let mesh = robot.links[0].mesh.as_ref().unwrap();
    assert_eq!(mesh.triangles.len(), 2 * pages as usize);
    let report = &report.links[0];
    assert_eq!(report.enclosed_triangles, 0);
    assert!(
        report.warnings[0].contains("enclose"),
        "{:?}",
        report.warnings
    );
}

#[test]
fn faults_in_the_tree_are_named() {
    let without = |what: &str| message(&TREE.replace(what, ""));
    let with = |from: &str, to: &str| message(&TREE.replace(from, to));
    for (message, told) in [
        (
            without(r#"<link name="slide"/>"#),
            "joint `reach`: expected a link of the robot as its child, found `slide`",
        ),
        (
            with(
                r#"<link name="slide"/>"#,
                r#"<link name="slide"/><link name="base"/>"#,
            ),
            "duplicate link name: expected each once, found `base` twice",
        ),
        (
            with(r#"name="turn""#, r#"name="grip""#),
            "duplicate joint name: expected each once, found `grip` twice",
        ),
        (
            with(r#"<child link="slide"/>"#, r#"<child link="tool"/>"#),
            "found `flange` and `reach` above `tool`",
        ),
        (
            with(
                r#"<link name="slide"/>"#,
                r#"<link name="slide"/><link name="lost"/>"#,
            ),
            "found lost, base",
        ),
        (
            with(
                r#"<parent link="base"/><child link="upper"/>"#,
                r#"<parent link="finger"/><child link="upper"/>"#,
            ),
            "a cycle of joints with tool, finger, upper",
        ),
        (
            with(r#"<parent link="base"/>"#, r#"<parent link="slide"/>"#),
            "a cycle of joints with tool, finger, slide, upper",
        ),
        (message(r#"<robot name="r"/>"#), "found none"),
        (
            with("continuous", "floating"),
            "joint `turn`: expected type revolute, continuous, prismatic or fixed, found floating",
        ),
        (with("continuous", "ball"), "joint `turn`"),
        (
            with("<axis xyz=\"0 0 1\"/>", "<axis xyz=\"0 0 0\"/>"),
            "joint `turn` axis",
        ),
        (
            with("<axis xyz=\"0 0 1\"/>", "<axis xyz=\"0 NaN 0\"/>"),
            "joint `turn` axis",
        ),
        (
            with("<axis xyz=\"0 0 1\"/>", "<axis xyz=\"0 inf 0\"/>"),
            "joint `turn` axis",
        ),
        (
            with(r#"lower="-1""#, r#"lower="5""#),
            "found lower 5 and upper 2",
        ),
        (
            with("xyz=\"0 0 1\" rpy", "xyz=\"0 0 inf\" rpy"),
            "joint `flange` origin xyz: expected three finite numbers, found 0 0 inf",
        ),
        (
            with(
                r#"<limit velocity="3" effort="4"/>"#,
                r#"<limit velocity="3" effort="4"/><mimic joint="grip"/>"#,
            ),
            "found a mimic of `grip`",
        ),
    ] {
        assert!(message.contains(told), "expected {told}\nfound {message}");
    }
}

#[test]
fn joints_that_are_held_stay_where_zero_is_whatever_their_type() {
    let options = LoadOptions {
        fixed_joints: ["grip", "turn", "absent", ""].map(str::to_owned).to_vec(),
        ..LoadOptions::default()
    };
    let mimic = r#"<limit velocity="3" effort="4"/><mimic joint="grip"/>"#;
    for xml in [
        TREE.to_owned(),
        TREE.replace("continuous", "floating"),
        TREE.replace(r#"<limit velocity="3" effort="4"/>"#, mimic),
    ] {
        let (held, _) = Robot::from_urdf(&xml, &MESHES, &options).unwrap();
        let names: Vec<_> = held.joints.iter().map(|joint| &joint.name).collect();
        assert_eq!(names, ["reach"]);
        let (free, _) = load(TREE).unwrap();
        assert_eq!(held.links.len(), free.links.len());
        for link in &free.links {
            let found = &held.links[held.link_index(&link.name).unwrap()];
            assert_eq!(found.parent_from_rest, link.parent_from_rest);
            assert_eq!(found.mesh, link.mesh);
        }
    }
}

#[test]
fn text_that_is_no_urdf_is_told_apart() {
    for (xml, told) in [
        ("", "malformed URDF"),
        ("<robot name='r'><link name='a'></robot>", "1:"),
        ("<sdf/>", "expected <robot>, found <sdf>"),
        ("<robot name='r'><link/></robot>", "name"),
        (
            "<robot name='r' xmlns:xacro='http://ros.org/wiki/xacro'><xacro:arm/></robot>",
            "<xacro:arm>",
        ),
        (&lone(&("<a>".repeat(70) + &"</a>".repeat(70))), "nested"),
        (
            &lone(&("<a>".repeat(50_000) + &"</a>".repeat(50_000))),
            "nested",
        ),
    ] {
        let message = message(xml);
        assert!(message.contains(told), "expected {told}\nfound {message}");
    }
}

#[test]
fn faults_in_a_geometry_name_the_link_and_the_file() {
    for (geometry, told) in [
        (r#"<mesh filename="absent.stl"/>"#, "mesh not found"),
        (
            r#"<mesh filename="empty.obj"/>"#,
            "expected at least one triangle",
        ),
        (r#"<mesh filename="flat.obj"/>"#, "found 1 degenerate"),
        (
            r#"<mesh filename="broken.stl"/>"#,
            "expected 84 bytes, found 6",
        ),
        (
            r#"<mesh filename="inside_out.obj" scale="1 0 1"/>"#,
            "scale",
        ),
        (
            r#"<mesh filename="inside_out.obj" scale="1e9 1e9 1e9"/>"#,
            "too large",
        ),
    ] {
        let message = message(&collision(geometry));
        let file = geometry.split('"').nth(1).unwrap();
        assert!(message.contains("link `only`"), "{message}");
        assert!(message.contains(told), "expected {told}\nfound {message}");
        assert!(told == "too large" || message.contains(file), "{message}");
    }
    for shape in [
        r#"<box size="1 0 1"/>"#,
        r#"<sphere radius="-1"/>"#,
        r#"<cylinder radius="NaN" length="1"/>"#,
    ] {
        let message = message(&collision(shape));
        assert!(
            message.contains("link `only`") && message.contains("above zero"),
            "{message}"
        );
    }
}

#[test]
fn a_longest_edge_that_is_no_length_is_refused() {
    for max_edge in [0.0, -1.0, f64::NAN] {
        let options = LoadOptions {
            max_edge,
            ..LoadOptions::default()
        };
        let error = Robot::from_urdf(TREE, &MESHES, &options).unwrap_err();
        assert!(error.to_string().contains("max_edge"), "{error}");
    }
}

#[test]
fn files_are_read_with_meshes_beside_them() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("robot.urdf");
    let xml = collision(r#"<mesh filename="inside_out.obj" scale="0.1 0.1 0.1"/>"#);
    std::fs::write(&path, xml).unwrap();
    let options = LoadOptions::default();
    let error = Robot::from_urdf_file(&path, &[], &[], &options).unwrap_err();
    assert!(error.to_string().contains("inside_out.obj"), "{error}");
    std::fs::write(dir.path().join("inside_out.obj"), INSIDE_OUT).unwrap();
    let (robot, _) = Robot::from_urdf_file(&path, &[], &[], &options).unwrap();
    assert_bounds(&robot, "only", [0.0; 3], [0.1, 0.2, 0.3]);
    let error = Robot::from_urdf_file(dir.path().join("absent.urdf"), &[], &[], &options);
    assert!(error.unwrap_err().to_string().contains("absent.urdf"));
}

#[test]
fn damaged_text_never_panics() {
    let mut random = StdRng::seed_from_u64(11);
    let options = LoadOptions {
        max_edge: 0.5,
        ..LoadOptions::default()
    };
    let (mut accepted, mut refused) = (0, 0);
    for _ in 0..2000 {
        let mut bytes = TREE.as_bytes().to_vec();
        for _ in 0..random.random_range(1..3) {
            let place = random.random_range(0..bytes.len());
            match random.random_range(0..4) {
                0 => bytes[place] = random.random_range(32..127),
                1 => bytes[place] = b"<>/\"0123456789-. e"[random.random_range(0..18)],
                2 => drop(bytes.drain(place..(place + 9).min(bytes.len()))),
                _ => bytes.insert(place, random.random()),
            }
        }
        let text = String::from_utf8_lossy(&bytes);
        match Robot::from_urdf(&text, &MESHES, &options) {
            Ok((robot, _)) => {
                assert_eq!(robot.dof(), robot.joints.len());
                accepted += 1;
            }
            Err(_) => refused += 1,
        }
    }
    assert!(accepted > 100 && refused > 100, "{accepted} {refused}");
}
