//! The measurement model, eqs. 5 to 7: predicted against measured external torque.

use std::ops::Range;

use nalgebra::{Matrix6, Point3, Unit, Vector3, Vector6};
use wide::f32x8;

use crate::cloud::{Block, Column};
use crate::palpate::MOST_JOINTS;
use crate::step::Step;

/// ‖τ_ext − τ̂‖² for contacts on one link, conditioned on one sample.
///
/// With S (6 × k) the screws of the joints on the link's path and w = \[n̂; p × n̂\], a force of size F that pushes into
/// the link gives τ̂ = −F Sᵀ w on these joints and zero on all others.
#[derive(Clone, Debug, Default)]
pub(super) struct LinkLikelihood {
    /// A = S Sᵀ and g = S τ: the force that fits best minimises τᵀτ + 2 F gᵀw + F² wᵀA w.
    a: Matrix6<f64>,
    g: Vector6<f64>,
    joints: usize,
    /// Screw and torque of each joint on the path. In single precision: torques are good to 10⁻⁵ Nm.
    screws: [[f32; 6]; MOST_JOINTS],
    torques: [f32; MOST_JOINTS],
    /// Sum of the squares of all other joints' torques.
    others: f32,
}

impl LinkLikelihood {
    pub(super) fn new(step: &Step, link: usize) -> Self {
        let screws = step.now.screws_in_link(link);
        let path = &step.robot.links[link].path;
        let mut of = Self {
            joints: path.len().min(MOST_JOINTS),
            ..Self::default()
        };
        let mut others: f64 = step.torque.iter().map(|torque| torque * torque).sum();
        for (index, (column, &joint)) in screws.column_iter().zip(path).enumerate() {
            let torque = step.torque[joint];
            of.a += column * column.transpose();
            of.g += column * torque;
            others -= torque * torque;
            if index < of.joints {
                of.screws[index] = std::array::from_fn(|row| column[row] as f32);
                of.torques[index] = torque as f32;
            }
        }
        of.others = others.max(0.0) as f32;
        of
    }

    /// Writes ‖τ_ext − τ̂‖², Nm², of the particles of a run.
    pub(super) fn squared_errors(&self, block: &Block, range: Range<usize>, errors: &mut Column) {
        for group in range.start / 8..range.end.div_ceil(8) {
            let first = group * 8;
            let squared = self.squared_error(block, group).to_array();
            let (start, end) = (range.start.max(first), range.end.min(first + 8));
            errors[start..end].copy_from_slice(&squared[start - first..end - first]);
        }
    }

    /// Of eight particles side by side.
    #[inline]
    fn squared_error(&self, block: &Block, group: usize) -> f32x8 {
        let eight = |column: &Column| f32x8::new(column.as_chunks().0[group]);
        let [x, y, z] = block.point.each_ref().map(eight);
        let [nx, ny, nz] = block.normal.each_ref().map(eight);
        let force = eight(&block.force);
        let w = [
            nx,
            ny,
            nz,
            y * nz - z * ny,
            z * nx - x * nz,
            x * ny - y * nx,
        ];
        let mut squared = f32x8::splat(self.others);
        for (screw, &torque) in self.screws.iter().zip(&self.torques).take(self.joints) {
            let mut lever = w[0] * screw[0];
            for (&part, &of_screw) in w.iter().zip(screw).skip(1) {
                lever += part * of_screw;
            }
            let left = lever * force + torque;
            squared += left * left;
        }
        squared
    }

    /// The force F ≥ 0 (N) against n̂ at p that leaves the least error.
    pub(super) fn best_force(&self, point: &Point3<f64>, normal: &Unit<Vector3<f64>>) -> f64 {
        let moment = point.coords.cross(normal);
        let w = Vector6::new(normal.x, normal.y, normal.z, moment.x, moment.y, moment.z);
        (-self.g.dot(&w) / w.dot(&(self.a * w)).max(f64::MIN_POSITIVE)).max(0.0)
    }
}
