//! Kinematics against independent answers: finite differences of the poses, and levers about the joints' axes.

#![expect(clippy::unwrap_used, reason = "a failed helper fails its test")]

use nalgebra::{Isometry3, Point3, Vector3};
use palpate_model::{EmbeddedMeshes, JointKind, Kinematics, LoadOptions, Robot, iiwa14};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

/// Step of the central differences, rad or m.
const STEP: f64 = 1e-5;
/// Central differences err by about step² and by rounding / step.
const NEAR: f64 = 1e-8;

/// A body that turns without end, with two branches: a slide that carries a hinge behind a fixed bracket, and a wrist.
const TREE: &str = r#"<robot name="tree">
  <link name="base"/>
  <link name="body"><collision><geometry><box size="0.2 0.2 0.4"/></geometry></collision></link>
  <link name="slide"><collision><geometry><box size="0.1 0.1 0.3"/></geometry></collision></link>
  <link name="bracket"><collision><geometry><box size="0.1 0.2 0.1"/></geometry></collision></link>
  <link name="hand"><collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>
  <link name="tip"/>
  <link name="wrist"><collision><geometry><box size="0.1 0.1 0.2"/></geometry></collision></link>
  <joint name="turn" type="continuous">
    <parent link="base"/><child link="body"/><origin xyz="0.1 -0.2 0.3" rpy="0.4 -0.3 0.2"/><axis xyz="0.2 -0.1 1"/>
  </joint>
  <joint name="reach" type="prismatic">
    <parent link="body"/><child link="slide"/><origin xyz="0 0.3 0.1" rpy="-0.5 0.1 0.7"/><axis xyz="1 2 -2"/>
    <limit lower="-0.2" upper="0.3" velocity="1" effort="9"/>
  </joint>
  <joint name="mount" type="fixed">
    <parent link="slide"/><child link="bracket"/><origin xyz="0.2 0 0.1" rpy="0.3 0.9 -0.4"/>
  </joint>
  <joint name="hinge" type="revolute">
    <parent link="bracket"/><child link="hand"/><origin xyz="0.1 0.2 0" rpy="1.1 0 0.6"/><axis xyz="0 -1 0.5"/>
    <limit lower="-1" upper="2" velocity="3" effort="4"/>
  </joint>
  <joint name="nail" type="fixed">
    <parent link="hand"/><child link="tip"/><origin xyz="0 0 0.25" rpy="0 0.2 0"/>
  </joint>
  <joint name="bend" type="revolute">
    <parent link="body"/><child link="wrist"/><origin xyz="-0.2 0 0.4" rpy="0 1.2 0"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" velocity="3" effort="4"/>
  </joint>
</robot>"#;

fn tree() -> Robot {
    let options = LoadOptions::default();
    let (robot, _) = Robot::from_urdf(TREE, &EmbeddedMeshes(&[]), &options).unwrap();
    robot
}

fn robots() -> [Robot; 2] {
    [tree(), iiwa14(&LoadOptions::default()).unwrap()]
}

fn random_vector(random: &mut StdRng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| random.random_range(-1.0..1.0))
}

fn random_position(robot: &Robot, random: &mut StdRng) -> Vec<f64> {
    (0..robot.dof())
        .map(|_| random.random_range(-2.0..2.0))
        .collect()
}

fn at(robot: &Robot, position: &[f64]) -> Kinematics {
    let mut kinematics = Kinematics::new(robot);
    kinematics.update(robot, position);
    kinematics
}

/// A link's poses with one joint a step back and a step forth.
fn nudged(robot: &Robot, position: &[f64], link: usize, joint: usize) -> [Isometry3<f64>; 2] {
    [-STEP, STEP].map(|step| {
        let mut position = position.to_vec();
        position[joint] += step;
        *at(robot, &position).root_from_link(link)
    })
}

/// Calls `check` with a robot, a configuration and a link, for every link and several configurations.
fn everywhere(seed: u64, check: impl Fn(&Robot, &[f64], usize, &mut StdRng)) {
    let mut random = StdRng::seed_from_u64(seed);
    for robot in robots() {
        for _ in 0..20 {
            let position = random_position(&robot, &mut random);
            for link in 0..robot.links.len() {
                check(&robot, &position, link, &mut random);
            }
        }
    }
}

#[test]
fn the_tree_has_every_kind_of_joint() {
    let robot = tree();
    let kinds: Vec<_> = robot.joints.iter().map(|joint| joint.kind).collect();
    use JointKind::{Continuous, Prismatic, Revolute};
    assert_eq!(kinds, [Continuous, Prismatic, Revolute, Revolute]);
    let path = |name| robot.links[robot.link_index(name).unwrap()].path.as_slice();
    assert!(path("base").is_empty());
    assert_eq!(path("bracket"), [0, 1]);
    assert_eq!(path("tip"), [0, 1, 2]);
    assert_eq!(path("wrist"), [0, 3]);
}

#[test]
fn screws_are_the_links_velocities() {
    everywhere(1, |robot, position, link, _| {
        let kinematics = at(robot, position);
        for (column, &joint) in robot.links[link].path.iter().enumerate() {
            let [back, forth] = nudged(robot, position, link, joint);
            let root_from_link = kinematics.root_from_link(link).rotation;
            let moved = forth.translation.vector - back.translation.vector;
            let linear = root_from_link.inverse() * (moved / (2.0 * STEP));
            let angular = (back.rotation.inverse() * forth.rotation).scaled_axis() / (2.0 * STEP);
            let screw = kinematics.screws_in_link(link).column(column).into_owned();
            let found_linear: Vector3<f64> = screw.fixed_rows::<3>(0).into_owned();
            let found_angular: Vector3<f64> = screw.fixed_rows::<3>(3).into_owned();
            let name = &robot.links[link].name;
            assert!(
                (found_linear - linear).norm() < NEAR,
                "{name}, joint {joint}"
            );
            assert!(
                (found_angular - angular).norm() < NEAR,
                "{name}, joint {joint}"
            );
        }
    });
}

#[test]
fn jacobians_are_the_points_velocities() {
    everywhere(2, |robot, position, link, random| {
        let point = Point3::from(random_vector(random));
        let jacobian = at(robot, position).jacobian_in_root(link, &point);
        let path = &robot.links[link].path;
        assert_eq!(jacobian.shape(), (3, path.len()));
        for (column, &joint) in path.iter().enumerate() {
            let [back, forth] = nudged(robot, position, link, joint).map(|pose| pose * point);
            let velocity = (forth - back) / (2.0 * STEP);
            let error = (jacobian.column(column) - velocity).norm();
            assert!(
                error < NEAR,
                "{}, joint {joint}: {error}",
                robot.links[link].name
            );
        }
    });
}

#[test]
fn joints_off_the_path_do_not_move_a_link() {
    everywhere(3, |robot, position, link, _| {
        for joint in (0..robot.dof()).filter(|joint| !robot.links[link].path.contains(joint)) {
            let [back, forth] = nudged(robot, position, link, joint);
            assert_eq!(back, forth);
        }
    });
}

/// Torque of a force about a joint's axis by its lever, in the root frame.
fn torque_by_lever(
    robot: &Robot,
    kinematics: &Kinematics,
    joint: usize,
    point: &Point3<f64>,
    force: &Vector3<f64>,
) -> f64 {
    let child = robot
        .links
        .iter()
        .position(|link| link.joint == Some(joint))
        .unwrap();
    let root_from_child = kinematics.root_from_link(child);
    let axis = root_from_child.rotation * robot.joints[joint].axis_in_joint.into_inner();
    match robot.joints[joint].kind {
        JointKind::Prismatic => axis.dot(force),
        JointKind::Revolute | JointKind::Continuous => {
            let origin = Point3::from(root_from_child.translation.vector);
            axis.dot(&(point - origin).cross(force))
        }
    }
}

#[test]
fn torques_of_a_force_are_those_by_levers() {
    everywhere(4, |robot, position, link, random| {
        let kinematics = at(robot, position);
        let root_from_link = kinematics.root_from_link(link);
        let (point, force) = (
            Point3::from(random_vector(random)),
            random_vector(random) * 50.0,
        );
        let (point_in_root, force_in_root) = (root_from_link * point, root_from_link * force);
        let jacobian = kinematics.jacobian_in_root(link, &point);
        let moment = point.coords.cross(&force);
        for (column, &joint) in robot.links[link].path.iter().enumerate() {
            let expected =
                torque_by_lever(robot, &kinematics, joint, &point_in_root, &force_in_root);
            let screw = kinematics.screws_in_link(link).column(column).into_owned();
            let by_screw =
                screw.fixed_rows::<3>(0).dot(&force) + screw.fixed_rows::<3>(3).dot(&moment);
            let by_jacobian = jacobian.column(column).dot(&force_in_root);
            let name = &robot.links[link].name;
            assert!((by_screw - expected).abs() < 1e-10, "{name}, joint {joint}");
            assert!(
                (by_jacobian - expected).abs() < 1e-10,
                "{name}, joint {joint}"
            );
        }
    });
}

#[test]
fn links_behind_fixed_joints_move_as_one_and_keep_their_names() {
    let robot = tree();
    let mut random = StdRng::seed_from_u64(5);
    for (parent, child) in [("slide", "bracket"), ("hand", "tip")] {
        let link = |name| robot.link_index(name).unwrap();
        let (parent, child) = (link(parent), link(child));
        assert_eq!(robot.links[child].joint, None);
        assert_eq!(robot.links[child].path, robot.links[parent].path);
        for _ in 0..20 {
            let kinematics = at(&robot, &random_position(&robot, &mut random));
            let pose = |link| kinematics.root_from_link(link);
            let between = pose(parent).inv_mul(pose(child));
            let fixed = robot.links[child].parent_from_rest;
            assert!((between.to_homogeneous() - fixed.to_homogeneous()).norm() < 1e-12);
        }
    }
}

#[test]
fn what_was_before_does_not_matter() {
    let mut random = StdRng::seed_from_u64(6);
    for robot in robots() {
        let mut used = Kinematics::new(&robot);
        for _ in 0..5 {
            let position = random_position(&robot, &mut random);
            used.update(&robot, &position);
            let fresh = at(&robot, &position);
            for link in 0..robot.links.len() {
                assert_eq!(used.root_from_link(link), fresh.root_from_link(link));
                assert_eq!(used.screws_in_link(link), fresh.screws_in_link(link));
            }
        }
    }
}
