//! The measurement model, eqs. 5 to 7: predicted against measured external torque.

use std::ops::Range;

use nalgebra::{Matrix6, Point3, Unit, Vector3, Vector6};

use crate::cloud::{BLOCK, Block, Column, set_vector, vector};
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

    /// Writes ‖τ_ext − τ̂‖², Nm², of the particles of a run; `moment` is room for p × n̂.
    #[inline(always)]
    pub(super) fn squared_errors(
        &self,
        block: &Block,
        range: Range<usize>,
        moment: &mut [Column; 3],
        errors: &mut Column,
    ) {
        let (point, normal) = (&block.point, &block.normal);
        let range = range.start..range.end.min(BLOCK);
        for at in range.clone() {
            let moment_at = vector(point, at).cross(&vector(normal, at));
            set_vector(moment, at, &moment_at);
            errors[at] = self.others;
        }
        for (screw, &torque) in self.screws.iter().zip(&self.torques).take(self.joints) {
            for at in range.clone() {
                let [x, y, z] = normal.each_ref().map(|column| column[at]);
                let [u, v, w] = moment.each_ref().map(|column| column[at]);
                let force_part = x * screw[0] + y * screw[1] + z * screw[2];
                let lever = force_part + u * screw[3] + v * screw[4] + w * screw[5];
                let left = lever * block.force[at] + torque;
                errors[at] += left * left;
            }
        }
    }

    /// The force F ≥ 0 (N) against n̂ at p that leaves the least error.
    pub(super) fn best_force(&self, point: &Point3<f64>, normal: &Unit<Vector3<f64>>) -> f64 {
        let moment = point.coords.cross(normal);
        let w = Vector6::new(normal.x, normal.y, normal.z, moment.x, moment.y, moment.z);
        (-self.g.dot(&w) / w.dot(&(self.a * w)).max(f64::MIN_POSITIVE)).max(0.0)
    }
}
