//! Robots of different build, each with a few joints.

use palpate_model::{EmbeddedMeshes, LoadOptions, Robot, iiwa14};

const LIMIT: &str = r#"<limit lower="-3" upper="3" velocity="1" effort="100"/>"#;
const BOX: &str = r#"<collision><geometry><box size="0.1 0.08 0.3"/></geometry></collision>"#;
const BALL: &str = r#"<collision><geometry><sphere radius="0.07"/></geometry></collision>"#;

fn options() -> LoadOptions {
    LoadOptions {
        max_edge: 0.05,
        ..LoadOptions::default()
    }
}

fn robot(name: &str, body: &str) -> Robot {
    let urdf = format!(r#"<robot name="{name}">{body}</robot>"#);
    let (robot, _) = Robot::from_urdf(&urdf, &EmbeddedMeshes(&[]), &options()).unwrap();
    robot
}

fn link(name: &str, shape: &str) -> String {
    format!(r#"<link name="{name}">{shape}</link>"#)
}

fn joint(kind: &str, parent: &str, child: &str) -> String {
    format!(
        r#"<joint name="{parent}_{child}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>
        <origin xyz="0.05 0 0.3" rpy="0.3 1.2 -0.4"/><axis xyz="0 0.6 0.8"/>{LIMIT}</joint>"#
    )
}

/// One turning joint.
pub fn hinge() -> Robot {
    let parts = [link("base", BOX), link("arm", BOX)];
    robot(
        "hinge",
        &(parts.concat() + &joint("revolute", "base", "arm")),
    )
}

/// One sliding joint.
pub fn slider() -> Robot {
    let parts = [link("base", BOX), link("sled", BALL)];
    robot(
        "slider",
        &(parts.concat() + &joint("prismatic", "base", "sled")),
    )
}

/// Two branches on a turning torso; a wrist without a mesh, a welded tool, and a sliding and an endless joint.
pub fn tree() -> Robot {
    let links = [
        ("base", ""),
        ("torso", BOX),
        ("left", BALL),
        ("right", BOX),
        ("wrist", ""),
        ("tool", BALL),
    ];
    let joints = [
        ("revolute", "base", "torso"),
        ("prismatic", "torso", "left"),
        ("continuous", "torso", "right"),
        ("revolute", "right", "wrist"),
        ("fixed", "wrist", "tool"),
    ];
    let links = links.map(|(name, shape)| link(name, shape)).concat();
    let joints = joints.map(|(kind, parent, child)| joint(kind, parent, child));
    robot("tree", &(links + &joints.concat()))
}

/// A chain of turning joints.
pub fn chain(joints: usize) -> Robot {
    let mut body = link("link_0", BOX);
    for number in 1..=joints {
        let [parent, child] = [number - 1, number].map(|number| format!("link_{number}"));
        body += &(link(&child, BOX) + &joint("revolute", &parent, &child));
    }
    robot("chain", &body)
}

/// A joint, but nothing on it that could be touched.
pub fn bare() -> Robot {
    let parts = [link("base", BOX), link("arm", "")];
    robot(
        "bare",
        &(parts.concat() + &joint("revolute", "base", "arm")),
    )
}

/// Something to touch, but no joint that would feel it.
pub fn statue() -> Robot {
    let parts = [link("base", BOX), link("head", BALL)];
    robot(
        "statue",
        &(parts.concat() + &joint("fixed", "base", "head")),
    )
}

/// The robot that ships with the project.
pub fn iiwa() -> Robot {
    iiwa14(&options()).unwrap()
}
