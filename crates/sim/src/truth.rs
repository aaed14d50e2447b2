//! What really happened, sample by sample.

use std::io::{self, Write};

use nalgebra::{Point3, Unit, Vector3};

/// The contact of one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueContact {
    /// The point on the link's mesh in the root frame, m.
    pub point_in_root: Point3<f64>,
    /// The same point in the link's frame, m.
    pub point_in_link: Point3<f64>,
    /// Outward normal of the link at the point, in the root frame: against the frictionless force.
    pub normal_in_root: Unit<Vector3<f64>>,
    /// Force of the obstacle on the robot, friction included, in the root frame, N.
    pub force_in_root: Vector3<f64>,
    /// How deep obstacle and link are in each other, m; times the stiffness it is the normal force.
    pub penetration: f64,
}

/// The truth of one sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// Stamp of the sample, ns.
    pub stamp_ns: i64,
    /// Index of the touched link in [`Robot::links`](palpate_model::Robot::links).
    pub link: usize,
    /// How many movable joints are between the touched link and the root: the number in the names of most arms' links.
    pub link_number: usize,
    /// Name of the touched link.
    pub link_name: String,
    /// The contact; none while the arm is still free.
    pub contact: Option<TrueContact>,
}

/// Writes one row a sample: `t,link_index,link_name,px..,lx..,nx..,fx..,force_N` with the point in the root and in the
/// link's frame, normal and force in the root frame, and zeros where there is no contact. `link_index` is
/// [`Truth::link_number`].
///
/// # Errors
/// Those of the writer.
pub fn write_truth_csv(truth: &[Truth], out: &mut impl Write) -> io::Result<()> {
    writeln!(
        out,
        "t,link_index,link_name,px,py,pz,lx,ly,lz,nx,ny,nz,fx,fy,fz,force_N"
    )?;
    for row in truth {
        let secs = row.stamp_ns as f64 * 1e-9;
        write!(out, "{secs:.6},{},{}", row.link_number, row.link_name)?;
        for value in columns(row.contact.as_ref()) {
            write!(out, ",{value:.9}")?;
        }
        writeln!(out)?;
    }
    Ok(())
}

fn columns(contact: Option<&TrueContact>) -> Vec<f64> {
    let Some(contact) = contact else {
        return vec![0.0; 13];
    };
    let vectors = [
        contact.point_in_root.coords,
        contact.point_in_link.coords,
        contact.normal_in_root.into_inner(),
        contact.force_in_root,
    ];
    (vectors.iter().flat_map(|vector| vector.iter().copied()))
        .chain([contact.force_in_root.norm()])
        .collect()
}
