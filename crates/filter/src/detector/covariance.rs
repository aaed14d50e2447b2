//! How noise is correlated between joints, and what of a joint's reading those beyond it do not explain.

use super::scale::Scale;

/// Cells that what is believed before is worth, and its standard deviation, Nm where there is little inertia.
const FIRST_CELLS: f64 = 20.0;
const FIRST_STD: f64 = 0.05;
/// Variance of a partial residual, at least, Nm².
pub(super) const LEAST_VARIANCE: f64 = 1e-6;
/// A reading teaches as if it were at most so many standard deviations.
pub(super) const CLIP: f64 = 4.0;

/// What noise does to one chart of all joints.
#[derive(Clone, Debug)]
pub(super) struct Covariance {
    pub(super) dof: usize,
    /// Readings of the joints, Nm.
    pub(super) reading: Vec<f64>,
    /// The same by [`Scale`], and the covariance thereof, row by row.
    scaled: Vec<f64>,
    entries: Vec<f64>,
    /// Variances of the readings, Nm², without what was told beside.
    pub(super) noise: Vec<f64>,
    /// Partial residuals, Nm.
    pub(super) partial: Vec<f64>,
    /// U above the diagonal and D in it, of its factorisation U D Uᵀ.
    pub(super) factor: Vec<f64>,
    /// Cells that were learned from.
    pub(super) seen: f64,
}

impl Covariance {
    pub(super) fn new(dof: usize) -> Self {
        let mut covariance = Self {
            dof,
            reading: vec![0.0; dof],
            scaled: vec![0.0; dof],
            entries: vec![0.0; dof * dof],
            noise: vec![0.0; dof],
            partial: vec![0.0; dof],
            factor: vec![0.0; dof * dof],
            seen: 0.0,
        };
        covariance.forget();
        covariance
    }

    pub(super) fn forget(&mut self) {
        self.seen = 0.0;
        self.entries.fill(0.0);
        for joint in 0..self.dof {
            self.entries[joint * self.dof + joint] = FIRST_STD * FIRST_STD;
        }
        self.factor.copy_from_slice(&self.entries);
    }

    /// Learns from the reading, in which nothing touches.
    pub(super) fn learn(&mut self, scale: &Scale, trust: f64, lasting: f64) {
        self.scaled.copy_from_slice(&self.reading);
        scale.divide(&mut self.scaled);
        let variances = self.entries.iter().step_by(self.dof + 1);
        let beyond = (self.scaled.iter().zip(variances))
            .map(|(reading, variance)| {
                reading * reading / (CLIP * CLIP * variance.max(LEAST_VARIANCE))
            })
            .fold(1.0, f64::max);
        self.seen += 1.0;
        let gain = trust / lasting.min(self.seen + FIRST_CELLS);
        let rows = self.entries.chunks_exact_mut(self.dof).zip(&self.scaled);
        for (row, reading) in rows {
            for (entry, other) in row.iter_mut().zip(&self.scaled) {
                *entry += gain * (reading * other / beyond - *entry);
            }
        }
    }

    /// Factorises the covariance with what `beyond` tells for a joint in its diagonal, Nm².
    pub(super) fn factorise(&mut self, scale: &mut Scale, beyond: impl Fn(usize) -> f64) {
        let n = self.dof;
        scale.multiply(&self.entries, &mut self.factor);
        for joint in 0..n {
            let variance = &mut self.factor[joint * (n + 1)];
            self.noise[joint] = *variance;
            *variance += beyond(joint);
        }
        for joint in (0..n).rev() {
            let pivot = self.factor[joint * n + joint].max(LEAST_VARIANCE);
            self.factor[joint * n + joint] = pivot;
            for row in 0..joint {
                let share = self.factor[row * n + joint] / pivot;
                for column in row..joint {
                    self.factor[row * n + column] -= share * self.factor[column * n + joint];
                }
            }
            for row in 0..joint {
                self.factor[row * n + joint] /= pivot;
            }
        }
    }

    /// Turns the reading into partial residuals.
    pub(super) fn explain_reading(&mut self) {
        self.partial.copy_from_slice(&self.reading);
        self.solve();
    }

    /// Turns what the joints read into partial residuals.
    pub(super) fn explain(&mut self, readings: impl Iterator<Item = f64>) {
        for (partial, reading) in self.partial.iter_mut().zip(readings) {
            *partial = reading;
        }
        self.solve();
    }

    /// Solves U x = reading from the last joint on, in place.
    fn solve(&mut self) {
        for joint in (0..self.dof).rev() {
            let row = &self.factor[joint * self.dof..][..self.dof];
            let beyond = row.iter().zip(&self.partial).skip(joint + 1);
            let explained: f64 = beyond.map(|(share, beyond)| share * beyond).sum();
            self.partial[joint] -= explained;
        }
    }
}
