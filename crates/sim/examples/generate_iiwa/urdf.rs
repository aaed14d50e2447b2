//! The URDF text.

use std::f64::consts::PI;

use crate::inertia::Inertia;
use palpate_sim::solid::{HEIGHTS, SEAM_RADII};

/// A quarter turn, written out so that its sine is 1 to the last bit.
const QUARTER: &str = "1.5707963267948966";
const HALF: &str = "3.141592653589793";

/// Largest turn either way (deg), speed (deg/s) and torque (Nm) of A1 to A7.
const LIMITS: [(f64, f64, f64); 7] = [
    (170.0, 85.0, 320.0),
    (120.0, 85.0, 320.0),
    (170.0, 100.0, 176.0),
    (120.0, 75.0, 176.0),
    (170.0, 130.0, 110.0),
    (120.0, 135.0, 40.0),
    (175.0, 135.0, 40.0),
];

/// The robot description; `inertias` are those of links 0 to 7.
pub fn urdf(inertias: &[Inertia]) -> String {
    let links = inertias
        .iter()
        .enumerate()
        .map(|(index, inertia)| link(index, inertia));
    let joints = (1..=7).map(joint);
    let body: String = links.chain(joints).collect();
    format!(
        r#"<?xml version="1.0"?>
<!-- KUKA LBR iiwa 14 R820 from its published dimensions. Written by palpate-sim's example generate_iiwa:
     change that, not this file. -->
<robot name="iiwa14">
  <material name="silver">
    <color rgba="0.80 0.81 0.83 1"/>
  </material>
  <material name="grey">
    <color rgba="0.28 0.29 0.31 1"/>
  </material>
  <material name="orange">
    <color rgba="1.00 0.42 0.04 1"/>
  </material>
{body}  <link name="lbr_link_ee"/>
  <joint name="lbr_joint_ee" type="fixed">
    <parent link="lbr_link_7"/>
    <child link="lbr_link_ee"/>
    <origin xyz="0 0 {flange}" rpy="0 0 0"/>
  </joint>
</robot>
"#,
        flange = HEIGHTS[7],
    )
}

fn link(index: usize, inertia: &Inertia) -> String {
    let material = if matches!(index, 0 | 7) {
        "grey"
    } else {
        "silver"
    };
    let Inertia {
        mass,
        center,
        inertia,
    } = inertia;
    let mesh = format!(
        r#"<origin xyz="0 0 0" rpy="0 0 0"/>
      <geometry>
        <mesh filename="package://palpate/meshes/link_{index}.obj"/>
      </geometry>"#
    );
    format!(
        r#"  <link name="lbr_link_{index}">
    <inertial>
      <origin xyz="{x} {y} {z}" rpy="0 0 0"/>
      <mass value="{mass}"/>
      <inertia ixx="{ixx}" ixy="{ixy}" ixz="{ixz}" iyy="{iyy}" iyz="{iyz}" izz="{izz}"/>
    </inertial>
    <visual>
      {mesh}
      <material name="{material}"/>
    </visual>
{ring}    <collision>
      {mesh}
    </collision>
  </link>
"#,
        x = short(center.x),
        y = short(center.y),
        z = short(center.z),
        ixx = short(inertia.m11),
        ixy = short(inertia.m12),
        ixz = short(inertia.m13),
        iyy = short(inertia.m22),
        iyz = short(inertia.m23),
        izz = short(inertia.m33),
        ring = ring(index),
    )
}

/// An orange ring, to look at only, on the seams where a link turns about its own length.
fn ring(index: usize) -> String {
    let Some(radius) = (index % 2 == 1).then(|| SEAM_RADII[index / 2] + 0.0015) else {
        return String::new();
    };
    format!(
        r#"    <visual>
      <origin xyz="0 0 0" rpy="0 0 0"/>
      <geometry>
        <cylinder radius="{radius}" length="0.006"/>
      </geometry>
      <material name="orange"/>
    </visual>
"#
    )
}

fn joint(number: usize) -> String {
    let height = HEIGHTS[number - 1];
    let along_y = format!("0 {height} 0");
    let along_z = format!("0 0 {height}");
    // Quarter turns there and back, so that every joint turns about its own z and the arm at zero stands straight.
    let (position, rotation) = match number {
        1 => (along_z, "0 0 0".to_owned()),
        2 => (along_z, format!("{QUARTER} 0 {HALF}")),
        3 => (along_y, format!("{QUARTER} 0 {HALF}")),
        4 | 6 => (along_z, format!("{QUARTER} 0 0")),
        _ => (along_y, format!("-{QUARTER} {HALF} 0")),
    };
    let (turn, speed, effort) = LIMITS[number - 1];
    let turn = turn * PI / 180.0;
    let speed = speed * PI / 180.0;
    let parent = number - 1;
    format!(
        r#"  <joint name="lbr_A{number}" type="revolute">
    <parent link="lbr_link_{parent}"/>
    <child link="lbr_link_{number}"/>
    <origin xyz="{position}" rpy="{rotation}"/>
    <axis xyz="0 0 1"/>
    <limit lower="-{turn:.9}" upper="{turn:.9}" effort="{effort}" velocity="{speed:.9}"/>
  </joint>
"#
    )
}

/// Six decimals.
fn short(value: f64) -> String {
    let text = format!("{value:.6}");
    if text == "-0.000000" {
        "0.000000".to_owned()
    } else {
        text
    }
}
