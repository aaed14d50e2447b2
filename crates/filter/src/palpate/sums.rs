//! What a contact's history says about one obstacle, as sums of products over the keyframes.
//!
//! The torques of a keyframe are linear in the unknowns: y = J (n + μ t + ε)(F₀ + K e) + b + noise, with J the contact's
//! Jacobian, n the unit push, t the rub against the slip, b the joints' biases and ε the tilt of the push. The noise is
//! that of the joints, of inverse covariance W, and a slack: a force of variance s² in any direction at the contact,
//! so that its covariance is W⁻¹ + s² J Jᵀ. Products with the inverse of that follow from G = Jᵀ W J, h = Jᵀ W y and
//! A = 1 + s² G (Woodbury): Jᵀ(…)⁻¹J = G A⁻¹ and Jᵀ(…)⁻¹y = A⁻¹ h.

use nalgebra::{Matrix3, Vector3};

use super::evidence::{FORCE_SCALE, MOST_JOINTS};
use super::likeness::Likeness;
use super::noise::Noise;

/// Number of columns that products are kept of: J n, e J n, J t, e J t and y.
pub(super) const COLUMNS: usize = 5;
/// Most unknowns that are integrated out: the biases of the path's joints, then the three components of the tilt.
const MOST_NUISANCES: usize = MOST_JOINTS + 3;

type Rows = [[f64; COLUMNS]; MOST_NUISANCES];
/// The lower triangle of a symmetric matrix, row by row.
type Lower = [f64; MOST_NUISANCES * (MOST_NUISANCES + 1) / 2];

/// Where a row of a [`Lower`] begins.
const fn row_of(row: usize) -> usize {
    row * (row + 1) / 2
}

/// How one joint of the path feels a force at the contact in one keyframe.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Lever {
    /// Torque of a unit force along each axis of the link's frame, Nm/N: a row of J.
    pub(super) row: Vector3<f64>,
    /// Measured torque y, Nm.
    pub(super) measured: f64,
    /// Inverse variance of the measured torque: W is diagonal.
    pub(super) weight: f64,
}

/// Directions, in the link's frame, of the forces at a contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct Directions {
    /// Unit vector of the push n.
    pub(super) push: Vector3<f64>,
    /// Rub t: against the slip, shorter than one where that is slow.
    pub(super) rub: Vector3<f64>,
}

/// Products over the history for one hypothesis.
#[derive(Clone, Debug)]
pub(super) struct Sums {
    likeness: Likeness,
    /// Products of the columns with each other; row ≤ column.
    gram: [[f64; COLUMNS]; COLUMNS],
    /// Products of the nuisances with the columns.
    rows: Rows,
    /// Products of the nuisances with each other.
    mixed: Lower,
    /// Half of the log of what the slack multiplies the determinant of the noise covariance by.
    log_slack: f64,
}

/// The forces of one keyframe, with A⁻¹ applied.
struct Slackened {
    /// Most likely size of the push, as this keyframe alone has it, N.
    force: f64,
    /// Variance s² of the slack, N².
    variance: f64,
    inverse: Matrix3<f64>,
    /// A⁻¹ n, A⁻¹ t and A⁻¹ h.
    push: Vector3<f64>,
    rub: Vector3<f64>,
    with_torque: Vector3<f64>,
}

impl Slackened {
    /// Without slack: A is one, and what is multiplied by the variance does not matter.
    fn none(directions: &Directions) -> Self {
        Self {
            force: 0.0,
            variance: 0.0,
            inverse: Matrix3::identity(),
            push: directions.push,
            rub: directions.rub,
            with_torque: Vector3::zeros(),
        }
    }
}

impl Sums {
    /// Sums over nothing yet.
    pub(super) fn new(likeness: Likeness) -> Self {
        Self {
            likeness,
            gram: [[0.0; COLUMNS]; COLUMNS],
            rows: [[0.0; COLUMNS]; MOST_NUISANCES],
            mixed: [0.0; row_of(MOST_NUISANCES)],
            log_slack: 0.0,
        }
    }

    /// Adds one keyframe with approach e = d₀ − d, m.
    pub(super) fn add(&mut self, e: f64, directions: &Directions, levers: &[Lever]) {
        match self.likeness.is_smooth() {
            false => self.add_levers(e, directions, &Slackened::none(directions), levers),
            true => {
                let (mut g, mut h) = (Matrix3::zeros(), Vector3::zeros());
                for lever in levers {
                    let weighted = lever.row * lever.weight;
                    g += weighted * lever.row.transpose();
                    h += weighted * lever.measured;
                }
                let slackened = self.slacken(directions, &g, &h);
                self.add_levers(e, directions, &slackened, levers);
                self.mix(levers, &slackened, &g);
                self.add_tilt(e, levers.len(), &slackened, &g);
            }
        }
    }

    fn slacken(
        &mut self,
        directions: &Directions,
        g: &Matrix3<f64>,
        h: &Vector3<f64>,
    ) -> Slackened {
        let Directions { push, rub } = directions;
        let force = push.dot(h).max(0.0) / (push.dot(&(g * push)) + FORCE_SCALE.powi(-2));
        let variance = (self.likeness.slack() * force).powi(2);
        let a = Matrix3::identity() + g * variance;
        let mut inverse = a;
        if variance > 0.0 {
            self.log_slack += 0.5 * a.determinant().ln();
            inverse = a.try_inverse().unwrap_or_else(Matrix3::identity);
        }
        Slackened {
            force,
            variance,
            push: inverse * push,
            rub: inverse * rub,
            with_torque: inverse * h,
            inverse,
        }
    }

    /// Adds the products of the columns with each other and with the biases.
    fn add_levers(
        &mut self,
        e: f64,
        directions: &Directions,
        slackened: &Slackened,
        levers: &[Lever],
    ) {
        let [mut nn, mut nt, mut tt, mut ny, mut ty, mut yy] = [0.0; 6];
        for (index, lever) in levers.iter().enumerate() {
            let Lever {
                row,
                measured: y,
                weight,
            } = lever;
            let (n, t) = (row.dot(&directions.push), row.dot(&directions.rub));
            let with_n = weight * row.dot(&slackened.push);
            let with_t = weight * row.dot(&slackened.rub);
            let with_y = weight * (y - slackened.variance * row.dot(&slackened.with_torque));
            nn += with_n * n;
            nt += with_n * t;
            tt += with_t * t;
            ny += with_n * y;
            ty += with_t * y;
            yy += with_y * y;
            self.mixed[row_of(index) + index] += weight;
            self.add_row(index, e, with_n, with_t, with_y);
        }
        let products = [
            [nn, nn * e, nt, nt * e, ny],
            [0.0, nn * e * e, nt * e, nt * e * e, ny * e],
            [0.0, 0.0, tt, tt * e, ty],
            [0.0, 0.0, 0.0, tt * e * e, ty * e],
            [0.0, 0.0, 0.0, 0.0, yy],
        ];
        for (sums, products) in self.gram.iter_mut().zip(&products) {
            for (sum, product) in sums.iter_mut().zip(products) {
                *sum += product;
            }
        }
    }

    /// Adds what the slack and the tilt have to do with the biases, and the tilt with itself.
    fn mix(&mut self, levers: &[Lever], slackened: &Slackened, g: &Matrix3<f64>) {
        let force = slackened.force;
        let tilt = slackened.inverse * g * (force * force);
        let joints = levers.len();
        let tilt_rows = [0, 1, 2].map(|axis| row_of(joints + axis));
        for (index, lever) in levers.iter().enumerate() {
            let pulled = slackened.inverse * lever.row * lever.weight;
            let slack = pulled * slackened.variance;
            let row = &mut self.mixed[row_of(index)..=row_of(index) + index];
            for (other, mixed) in levers.iter().zip(row) {
                *mixed -= other.weight * other.row.dot(&slack);
            }
            for (axis, row) in tilt_rows.into_iter().enumerate() {
                self.mixed[row + index] += force * pulled[axis];
            }
        }
        for (axis, row) in tilt_rows.into_iter().enumerate() {
            for other in 0..=axis {
                self.mixed[row + joints + other] += tilt[(axis, other)];
            }
        }
    }

    fn add_tilt(&mut self, e: f64, joints: usize, slackened: &Slackened, g: &Matrix3<f64>) {
        let force = slackened.force;
        let (with_push, with_rub) = (g * slackened.push, g * slackened.rub);
        for axis in 0..3 {
            self.add_row(
                joints + axis,
                e,
                force * with_push[axis],
                force * with_rub[axis],
                force * slackened.with_torque[axis],
            );
        }
    }

    fn add_row(&mut self, index: usize, e: f64, n: f64, t: f64, y: f64) {
        let products = [n, n * e, t, t * e, y];
        for (sum, product) in self.rows[index].iter_mut().zip(products) {
            *sum += product;
        }
    }

    /// Integrates the nuisances out, for biases of one scale.
    pub(super) fn reduce(
        &self,
        noise: &Noise,
        scale: usize,
        path: &[usize],
        reduced: &mut Reduced,
    ) {
        let tilt = self.likeness.tilt();
        let count = path.len() + if tilt > 0.0 { 3 } else { 0 };
        let Reduced {
            gram,
            factor,
            white,
            ..
        } = reduced;
        *gram = self.gram;
        // What the priors make of the determinant, by Cholesky's factorisation row by row.
        let mut determinant = 1.0;
        for i in 0..count {
            let (mean, precision) = match path.get(i) {
                Some(&joint) => {
                    let bias = noise.bias(scale, joint);
                    (bias.mean, bias.precision)
                }
                None => (0.0, 1.0 / (tilt * tilt)),
            };
            let start = row_of(i);
            let mut pivot = self.mixed[start + i] + precision;
            let mut row = self.rows[i];
            row[COLUMNS - 1] += precision * mean;
            gram[COLUMNS - 1][COLUMNS - 1] += precision * mean * mean;
            // On the mesh itself the nuisances are the biases, which have nothing to do with each other.
            let coupled = if tilt > 0.0 { i } else { 0 };
            for j in 0..coupled {
                let (own, other) = (&factor[start..start + j], &factor[row_of(j)..][..=j]);
                let known: f64 = own.iter().zip(other).map(|(one, other)| one * other).sum();
                let entry = (self.mixed[start + j] - known) * other[j];
                factor[start + j] = entry;
                pivot -= entry * entry;
                for (value, other) in row.iter_mut().zip(&white[j]) {
                    *value -= entry * other;
                }
            }
            let pivot = pivot.max(1e-9);
            determinant *= pivot / precision;
            // Of the diagonal only the inverse is needed.
            let scale = pivot.sqrt().recip();
            factor[start + i] = scale;
            white[i] = row.map(|value| value * scale);
            for (row, sums) in gram.iter_mut().enumerate() {
                for column in row..COLUMNS {
                    sums[column] -= white[i][row] * white[i][column];
                }
            }
        }
        let log_noise = noise.base_beside(scale, path) - self.log_slack;
        reduced.log = log_noise - 0.5 * (determinant.ln() + reduced.gram[4][4]);
        reduced.joints = path.len();
    }
}

/// [`Sums`] with the nuisances integrated out.
pub(super) struct Reduced {
    /// Products of the columns with each other; row ≤ column.
    pub(super) gram: [[f64; COLUMNS]; COLUMNS],
    /// Log density of the torques if nothing pushed.
    pub(super) log: f64,
    /// Cholesky's factor of the nuisances' precision, with the inverse of its diagonal.
    factor: Lower,
    /// The nuisances' products with the columns, the factor divided out.
    white: Rows,
    joints: usize,
}

impl Reduced {
    /// Room for them.
    pub(super) fn new() -> Self {
        Self {
            gram: [[0.0; COLUMNS]; COLUMNS],
            log: 0.0,
            factor: [0.0; row_of(MOST_NUISANCES)],
            white: [[0.0; COLUMNS]; MOST_NUISANCES],
            joints: 0,
        }
    }

    /// Most probable tilt ε, for each column's coefficient but the torque's.
    pub(super) fn tilt(&self, coefficients: [f64; COLUMNS - 1]) -> Vector3<f64> {
        let mut tilt = Vector3::zeros();
        for axis in (0..3).rev() {
            let row = self.joints + axis;
            let mut rest = self.white[row][COLUMNS - 1];
            for (coefficient, column) in coefficients.iter().zip(&self.white[row]) {
                rest -= coefficient * column;
            }
            for later in axis + 1..3 {
                rest -= self.factor[row_of(self.joints + later) + row] * tilt[later];
            }
            tilt[axis] = rest * self.factor[row_of(row) + row];
        }
        tilt
    }
}
