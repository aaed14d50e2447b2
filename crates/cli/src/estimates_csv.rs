//! Estimates as CSV: one row a sample, in the robot's root frame, metres and newtons.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use palpate_model::Robot;

use crate::track::Estimated;

/// Names of the columns.
const HEADER: &str = "stamp_ns,status,link,x,y,z,nx,ny,nz,force,stiffness,std,probability";

/// A row. Without contact the fields after the status are empty.
fn row(robot: &Robot, estimated: &Estimated) -> String {
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

/// A CSV file to be written. It is made before the long work, so that a wrong path is told at once.
pub struct EstimatesCsv {
    path: PathBuf,
    file: BufWriter<File>,
}

impl EstimatesCsv {
    /// Makes the file.
    pub fn create(path: &Path) -> Result<Self> {
        let file = File::create(path).with_context(|| cannot_write(path))?;
        Ok(Self {
            path: path.to_owned(),
            file: BufWriter::new(file),
        })
    }

    /// Writes the header and all rows.
    pub fn write(mut self, robot: &Robot, estimates: &[Estimated]) -> Result<()> {
        let rows = estimates.iter().map(|estimated| row(robot, estimated));
        std::iter::once(HEADER.to_owned())
            .chain(rows)
            .try_for_each(|line| writeln!(self.file, "{line}"))
            .and_then(|()| self.file.flush())
            .with_context(|| cannot_write(&self.path))
    }
}

fn cannot_write(path: &Path) -> String {
    format!("cannot write {}", path.display())
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
