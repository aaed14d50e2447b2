//! Estimates as CSV: one row a sample, in the robot's root frame, metres and newtons.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use anyhow::{Context, Result};
use palpate_model::Robot;

use crate::track::Estimated;

/// Names of the columns.
pub const HEADER: &str = "stamp_ns,status,link,x,y,z,nx,ny,nz,force,stiffness,std,probability";

/// A row. Without contact the fields after the status are empty.
pub fn row(robot: &Robot, estimated: &Estimated) -> String {
    let start = format!("{},{}", estimated.stamp_ns, estimated.status.word());
    let Some(mode) = &estimated.best else {
        return start + ",,,,,,,,,,,";
    };
    let (p, n) = (&mode.point_in_root, &mode.normal_in_root);
    format!(
        "{start},{},{:.6},{:.6},{:.6},{:.5},{:.5},{:.5},{:.4},{:.2},{:.6},{:.4}",
        robot.links[mode.link].name,
        p.x,
        p.y,
        p.z,
        n.x,
        n.y,
        n.z,
        mode.force,
        mode.stiffness,
        mode.std(),
        mode.probability
    )
}

/// Writes all rows, with the header, to a file.
pub fn write(path: &Path, robot: &Robot, estimates: &[Estimated]) -> Result<()> {
    write_rows(path, robot, estimates).with_context(|| format!("cannot write {}", path.display()))
}

fn write_rows(path: &Path, robot: &Robot, estimates: &[Estimated]) -> std::io::Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    writeln!(file, "{HEADER}")?;
    for estimated in estimates {
        writeln!(file, "{}", row(robot, estimated))?;
    }
    file.flush()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, Point3, Vector3};
    use palpate_filter::{ContactStatus, Mode};
    use palpate_model::{LoadOptions, iiwa14};

    #[test]
    fn every_row_has_as_many_fields_as_the_header() {
        let robot = iiwa14(&LoadOptions::default()).unwrap();
        let mut estimated = Estimated {
            stamp_ns: 5,
            status: ContactStatus::NoContact,
            best: None,
        };
        let fields = HEADER.split(',').count();
        assert_eq!(row(&robot, &estimated).split(',').count(), fields);
        estimated.status = ContactStatus::Located;
        estimated.best = Some(Mode {
            link: 3,
            probability: 0.75,
            point_in_root: Point3::new(0.1, -0.2, 0.3),
            point_in_link: Point3::origin(),
            normal_in_root: Vector3::z_axis(),
            force_in_root: Vector3::zeros(),
            force: 12.5,
            stiffness: 8000.0,
            covariance_in_root: Matrix3::from_diagonal_element(1e-4 / 3.0),
        });
        assert_eq!(
            row(&robot, &estimated),
            "5,located,lbr_link_3,0.100000,-0.200000,0.300000,0.00000,0.00000,1.00000,12.5000,8000.00,0.010000,0.7500"
        );
    }
}
