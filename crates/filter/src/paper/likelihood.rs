//! The measurement model, eqs. 5 to 7: predicted against measured external torque.

use nalgebra::{Matrix6, Point3, Unit, Vector3, Vector6};

use crate::step::Step;

/// ‖τ_ext − τ̂‖² for contacts on one link, conditioned on one sample.
///
/// With S (6 × k) the screws of the joints on the link's path and w = \[n̂; p × n̂\], a force of size F that pushes into
/// the link gives τ̂ = −F Sᵀ w on these joints and zero on all others. So ‖τ_ext − τ̂‖² = τᵀτ + 2 F gᵀw + F² wᵀA w
/// with A = S Sᵀ and g = S τ, shared by all particles of the link.
#[derive(Clone, Debug, Default)]
pub(super) struct LinkLikelihood {
    a: Matrix6<f64>,
    g: Vector6<f64>,
    measured_squared: f64,
}

impl LinkLikelihood {
    pub(super) fn new(step: &Step, link: usize) -> Self {
        let screws = step.now.screws_in_link(link);
        let mut a = Matrix6::zeros();
        let mut g = Vector6::zeros();
        for (column, &joint) in screws.column_iter().zip(&step.robot.links[link].path) {
            a += column * column.transpose();
            g += column * step.torque[joint];
        }
        let measured_squared = step.torque.iter().map(|torque| torque * torque).sum();
        Self {
            a,
            g,
            measured_squared,
        }
    }

    /// ‖τ_ext − τ̂‖², Nm², for the force F (N) against the outward normal n̂ at p (m, link frame).
    pub(super) fn squared_error(
        &self,
        point: &Point3<f64>,
        normal: &Unit<Vector3<f64>>,
        force: f64,
    ) -> f64 {
        let w = wrench(point, normal);
        self.measured_squared + 2.0 * force * self.g.dot(&w) + force * force * w.dot(&(self.a * w))
    }

    /// The force F ≥ 0 (N) against n̂ at p that leaves the least error.
    pub(super) fn best_force(&self, point: &Point3<f64>, normal: &Unit<Vector3<f64>>) -> f64 {
        let w = wrench(point, normal);
        (-self.g.dot(&w) / w.dot(&(self.a * w)).max(f64::MIN_POSITIVE)).max(0.0)
    }
}

/// w = \[n̂; p × n̂\].
fn wrench(point: &Point3<f64>, normal: &Unit<Vector3<f64>>) -> Vector6<f64> {
    let moment = point.coords.cross(normal);
    Vector6::new(normal.x, normal.y, normal.z, moment.x, moment.y, moment.z)
}
