//! What is known beforehand of the noise: that of the speeds reaches the external torques multiplied by the mass matrix.

use palpate_model::{Dynamics, DynamicsWorkspace, Robot};

/// Inertia at which a joint's noise comes as much from torques as from speeds, kg m².
const EVEN_INERTIA: f64 = 1.0;
/// Square of a scale, at least, (kg m²)².
const LEAST_SQUARE: f64 = 1e-12;

/// The upper triangular U with U Uᵀ = M Mᵀ + J² I for the mass matrix M and [`EVEN_INERTIA`] J: U⁻¹ τ has noise that
/// hardly changes while the arm moves. A torque that no joint beyond k feels stays so, as U is upper triangular. The
/// identity for a robot whose inertias are not known.
#[derive(Clone, Debug)]
pub(super) struct Scale {
    dof: usize,
    dynamics: Option<(Dynamics, DynamicsWorkspace)>,
    /// U, row by row.
    upper: Vec<f64>,
    /// Room for a product of matrices.
    product: Vec<f64>,
}

impl Scale {
    pub(super) fn new(robot: &Robot) -> Self {
        let dof = robot.dof();
        let dynamics = Dynamics::new(robot, Dynamics::UPRIGHT, None).ok();
        let mut upper = vec![0.0; dof * dof];
        upper.iter_mut().step_by(dof + 1).for_each(|u| *u = 1.0);
        Self {
            dof,
            dynamics: dynamics.map(|dynamics| {
                let workspace = dynamics.workspace();
                (dynamics, workspace)
            }),
            upper,
            product: vec![0.0; dof * dof],
        }
    }

    /// Renews it at a position, rad.
    pub(super) fn renew(&mut self, position: &[f64]) {
        let Some((dynamics, workspace)) = &mut self.dynamics else {
            return;
        };
        let mass = dynamics.mass_matrix(workspace, position);
        let n = self.dof;
        for row in 0..n {
            for column in row..n {
                let own = if row == column {
                    EVEN_INERTIA.powi(2)
                } else {
                    0.0
                };
                self.product[row * n + column] = mass.column(row).dot(&mass.column(column)) + own;
            }
        }
        // Cholesky's factorisation from the last column on.
        for column in (0..n).rev() {
            for row in (0..=column).rev() {
                let beyond = (column + 1)..n;
                let explained: f64 = beyond
                    .map(|k| self.upper[row * n + k] * self.upper[column * n + k])
                    .sum();
                let left = self.product[row * n + column] - explained;
                self.upper[row * n + column] = match row == column {
                    true => left.max(LEAST_SQUARE).sqrt(),
                    false => left / self.upper[column * n + column],
                };
            }
        }
    }

    /// Turns torques τ into U⁻¹ τ, in place.
    pub(super) fn divide(&self, torques: &mut [f64]) {
        for joint in (0..self.dof).rev() {
            let row = &self.upper[joint * self.dof..][..self.dof];
            let beyond = row.iter().zip(&*torques).skip(joint + 1);
            let explained: f64 = beyond.map(|(share, beyond)| share * beyond).sum();
            torques[joint] = (torques[joint] - explained) / row[joint];
        }
    }

    /// U C Uᵀ of a symmetric C, both row by row, in and above the diagonal.
    pub(super) fn multiply(&mut self, inner: &[f64], outer: &mut [f64]) {
        let n = self.dof;
        for row in 0..n {
            for column in 0..n {
                self.product[row * n + column] = (row..n)
                    .map(|k| self.upper[row * n + k] * inner[k * n + column])
                    .sum();
            }
        }
        for row in 0..n {
            for column in row..n {
                outer[row * n + column] = (column..n)
                    .map(|k| self.product[row * n + k] * self.upper[column * n + k])
                    .sum();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use palpate_model::{LoadOptions, iiwa14};

    #[test]
    fn noise_of_speeds_and_torques_becomes_white() {
        let robot = iiwa14(&LoadOptions::default()).unwrap();
        let position = [0.3, 0.7, -0.4, 1.1, 0.2, -0.9, 0.5];
        let mut scale = Scale::new(&robot);
        scale.renew(&position);
        let dynamics = Dynamics::new(&robot, Dynamics::UPRIGHT, None).unwrap();
        let mut workspace = dynamics.workspace();
        let mass = dynamics.mass_matrix(&mut workspace, &position);
        let noise = mass * mass.transpose() + DMatrix::identity(7, 7) * EVEN_INERTIA.powi(2);

        let mut outer = vec![0.0; 49];
        scale.multiply(DMatrix::<f64>::identity(7, 7).as_slice(), &mut outer);
        for row in 0..7 {
            for column in row..7 {
                let difference = outer[row * 7 + column] - noise[(row, column)];
                assert!(difference.abs() < 1e-9, "{row} {column}: {difference}");
            }
        }
        // U⁻¹ N U⁻ᵀ = I: |U⁻¹ N^(1/2) e| = |e|, by columns of a root of N.
        let root = noise.cholesky().unwrap().l();
        let mut sum = DMatrix::<f64>::zeros(7, 7);
        for column in root.column_iter() {
            let mut torques: Vec<f64> = column.iter().copied().collect();
            scale.divide(&mut torques);
            let white = DVector::from_vec(torques);
            sum += &white * white.transpose();
        }
        assert!((sum - DMatrix::identity(7, 7)).amax() < 1e-9);
    }

    #[test]
    fn what_no_joint_beyond_feels_stays_so() {
        let robot = iiwa14(&LoadOptions::default()).unwrap();
        let mut scale = Scale::new(&robot);
        scale.renew(&[0.3; 7]);
        let mut torques = [1.0, -2.0, 0.5, 0.0, 0.0, 0.0, 0.0];
        scale.divide(&mut torques);
        assert_eq!(torques[3..], [0.0; 4]);
        assert!(torques[2].abs() > 1e-3);
    }
}
