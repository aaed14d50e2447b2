//! `palpate inspect`: what a URDF and its meshes hold, as the filter sees it.

use anyhow::Result;
use clap::Args;
use comfy_table::Table;
use nalgebra::{Point3, Vector3};
use palpate_filter::RobotSettings;
use palpate_model::{
    Geometry, Joint, JointKind, Link, LinkReport, LoadOptions, LoadReport, Robot, TriangleMesh,
};

use crate::robot_args::RobotArgs;
use crate::table;

/// Show the joints and links of a robot, and what loading found in its meshes
#[derive(Args)]
pub struct Inspect {
    #[command(flatten)]
    robot: RobotArgs,
    /// Take the visual geometry instead of the collision geometry
    #[arg(long)]
    visual: bool,
    /// Split triangles until no edge is longer, m
    #[arg(long, value_name = "M", default_value_t = LoadOptions::default().max_edge)]
    max_edge: f64,
    /// Hold this joint at zero, as a gripper's finger; can be given several times
    #[arg(long = "fixed-joint", value_name = "JOINT")]
    fixed_joints: Vec<String>,
}

impl Inspect {
    /// Runs the command.
    pub fn run(&self) -> Result<()> {
        let options = LoadOptions {
            geometry: if self.visual {
                Geometry::Visual
            } else {
                Geometry::Collision
            },
            max_edge: self.max_edge,
            fixed_joints: self.fixed_joints.clone(),
        };
        let (robot, report) = self.robot.load(&RobotSettings::default(), &options)?;
        table::print(&joints(&robot))?;
        table::print(&links(&robot, &report))?;
        for link in &report.links {
            for warning in &link.warnings {
                table::print(&format!("{}: {warning}", link.name))?;
            }
        }
        Ok(())
    }
}

fn joints(robot: &Robot) -> Table {
    let mut table = table::columns(&["joint", "kind", "lower", "upper", "velocity", "effort"]);
    for joint in &robot.joints {
        table.add_row(joint_row(joint));
    }
    table
}

fn joint_row(joint: &Joint) -> Vec<String> {
    let (kind, unit, effort) = match joint.kind {
        JointKind::Revolute => ("revolute", "rad", "Nm"),
        JointKind::Continuous => ("continuous", "rad", "Nm"),
        JointKind::Prismatic => ("prismatic", "m", "N"),
    };
    let limit = |value: Option<f64>, unit: &str| match value {
        Some(value) => format!("{value:.3} {unit}"),
        None => "–".to_owned(),
    };
    let limits = joint.limits;
    vec![
        joint.name.clone(),
        kind.to_owned(),
        limit(limits.map(|limits| limits.lower), unit),
        limit(limits.map(|limits| limits.upper), unit),
        limit(limits.map(|limits| limits.velocity), &format!("{unit}/s")),
        limit(limits.map(|limits| limits.effort), effort),
    ]
}

fn links(robot: &Robot, report: &LoadReport) -> Table {
    let heads = [
        "link",
        "joints felt",
        "triangles",
        "split",
        "area m²",
        "open edges",
        "dropped",
        "enclosed",
        "box m",
    ];
    let mut table = table::columns(&heads);
    for (link, report) in robot.links.iter().zip(&report.links) {
        table.add_row(link_row(robot, link, report));
    }
    table
}

fn link_row(robot: &Robot, link: &Link, report: &LinkReport) -> Vec<String> {
    let mut row = vec![link.name.clone(), path(robot, link)];
    match &link.mesh {
        None => row.resize(9, "–".to_owned()),
        Some(mesh) => {
            let cleaning = &report.cleaning;
            let dropped = cleaning.degenerate_triangles
                + cleaning.duplicate_triangles
                + cleaning.invalid_triangles;
            let size = size(mesh);
            row.extend([
                report.triangles_read.to_string(),
                report.triangles.to_string(),
                format!("{:.4}", mesh.area()),
                report.open_edges.to_string(),
                dropped.to_string(),
                report.enclosed_triangles.to_string(),
                format!("{:.3} × {:.3} × {:.3}", size.x, size.y, size.z),
            ]);
        }
    }
    row
}

/// The joints from the root to the link.
fn path(robot: &Robot, link: &Link) -> String {
    let name = |index: &usize| robot.joints[*index].name.as_str();
    match link.path.as_slice() {
        [] => "none".to_owned(),
        [only] => name(only).to_owned(),
        [first, .., last] => format!("{} … {} ({})", name(first), name(last), link.path.len()),
    }
}

/// Size of the bounding box along the link's axes, m.
fn size(mesh: &TriangleMesh) -> Vector3<f64> {
    let first = mesh.vertices.first().copied().unwrap_or(Point3::origin());
    let (low, high) = (mesh.vertices.iter()).fold((first, first), |(low, high), vertex| {
        (low.inf(vertex), high.sup(vertex))
    });
    high - low
}
