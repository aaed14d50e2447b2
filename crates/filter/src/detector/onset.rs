//! Charts of sudden changes: of each joint what the joints beyond it do not explain.
//!
//! A contact on a link makes torques on the joints that move it and none beyond, so that what the joints beyond read is
//! noise. Noise is correlated between joints: that of the speeds reaches the external torque multiplied by the mass matrix,
//! and a mass that is wrong acts on many joints. So the joints beyond tell much of a joint's noise, and its *partial
//! residual*, what is left of its torque given theirs, has less of it (the innovations of the covariance's factorisation
//! U D Uᵀ, from the last joint to the first). How the mass matrix changes is known ([`scale`](super::scale)); the rest of
//! the covariance is learned within seconds.
//!
//! Charted is the mean of a short time, in which later torques weigh more as a push grows through the observer's filter,
//! less the mean of a longer time before. This needs no bias to be known: what changes slowly, the torque of a wrong payload
//! in motion for one, is no contact.

use palpate_model::Robot;

use super::cells::{Cells, ramp_variance};
use super::covariance::{CLIP, Covariance, LEAST_VARIANCE};
use super::scale::Scale;
use super::turns;

/// Charts of sudden changes, and over how long each takes the mean, s.
pub(super) const ONSETS: usize = 4;
const RECENT_SECS: [f64; ONSETS] = [0.01, 0.02, 0.05, 0.1];
/// Length of the time before, s.
const BEFORE_SECS: f64 = 0.1;
/// Time over which the covariance of each is learned, s; at least so many cells.
const MEMORY_SECS: [f64; ONSETS] = [1.5, 3.0, 6.0, 12.0];
const MEMORY_CELLS: f64 = 200.0;
/// The covariance of a chart is well known once it was learned from so many means that have no cell in common.
const WELL_KNOWN: f64 = 60.0;
/// Cells in which the white part of the partial residuals' noise is learned.
const SWIFT_CELLS: f64 = 100.0;
/// A second difference beyond so many standard deviations of a cell is no noise.
const LONE: f64 = 8.0;
/// The scale and the factorisation are renewed this often, s.
const RENEWED_SECS: f64 = 0.008;

/// What the charts read of one joint.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Partial {
    /// Partial residuals, Nm, and their variances, Nm²; 0 while not enough is known.
    pub(super) residual: [f64; ONSETS],
    pub(super) variance: [f64; ONSETS],
    /// The square of the joint's own change, beyond what noise reaches, Nm².
    pub(super) excess: [f64; ONSETS],
}

/// The charts of all joints.
#[derive(Clone, Debug)]
pub(super) struct Onset {
    cells: Cells,
    scale: Scale,
    covariances: [Covariance; ONSETS],
    partials: Vec<Partial>,
    /// Variance of the white part of a cell's partial residuals, Nm².
    white: Vec<f64>,
    /// The partial second differences that are beyond noise, Nm; else 0.
    lone: Vec<f64>,
    /// Whether the last sample made the charts read anew.
    is_new: bool,
}

impl Onset {
    pub(super) fn new(robot: &Robot) -> Self {
        let dof = robot.dof();
        Self {
            cells: Cells::new(dof),
            scale: Scale::new(robot),
            covariances: std::array::from_fn(|_| Covariance::new(dof)),
            partials: vec![Partial::default(); dof],
            white: vec![0.0; dof],
            lone: vec![0.0; dof],
            is_new: false,
        }
    }

    /// Forgets everything learned.
    pub(super) fn forget(&mut self) {
        self.covariances.iter_mut().for_each(Covariance::forget);
        self.white.fill(0.0);
        self.begin();
    }

    /// Begins anew with the next sample, as after a gap; the noise stays as it is known.
    pub(super) fn begin(&mut self) {
        self.cells.begin();
        self.partials.fill(Partial::default());
        self.is_new = false;
    }

    /// Whether what the joints read together can be told from noise. How much of it noise makes is known later than for
    /// one joint alone: of few means any joints seem to be related (the tails of Hotelling's T²).
    pub(super) fn is_well_known(&self, chart: usize) -> bool {
        let recent = self.cells.length(RECENT_SECS[chart]);
        self.covariances[chart].seen >= WELL_KNOWN * recent as f64
    }

    /// What the charts read, by joint.
    pub(super) fn partials(&self) -> &[Partial] {
        &self.partials
    }

    /// Puts a sample's torques, Nm, on the charts. `jump` tells for a joint and a chart what its turning back adds to a
    /// variance, Nm²; `position` is in rad.
    pub(super) fn look(
        &mut self,
        position: &[f64],
        torques: impl Iterator<Item = f64>,
        step_secs: f64,
        jump: impl Fn(usize, usize) -> f64,
    ) {
        self.is_new = self.cells.take(torques, step_secs);
        if !self.is_new {
            return;
        }
        self.learn_white();
        let before = self.cells.length(BEFORE_SECS);
        let renewed = self.cells.length(RENEWED_SECS);
        let is_due = self.cells.count.is_multiple_of(renewed);
        if is_due {
            self.scale.renew(position);
        }
        for (chart, covariance) in self.covariances.iter_mut().enumerate() {
            let recent = self.cells.length(RECENT_SECS[chart]);
            let Some(rises) = self.cells.rises(recent, before) else {
                self.is_new = false;
                return;
            };
            for (reading, rise) in covariance.reading.iter_mut().zip(rises) {
                *reading = rise;
            }
            if is_due {
                covariance.factorise(&mut self.scale, |joint| jump(joint, chart));
            }
            if covariance.seen < MEMORY_CELLS {
                continue;
            }
            let share = ramp_variance(recent) + 1.0 / before as f64;
            covariance.explain_reading();
            let lasting = (MEMORY_SECS[chart] / self.cells.cell_secs).max(MEMORY_CELLS);
            let independent = covariance.seen.min(lasting) / recent as f64;
            for (joint, partial) in self.partials.iter_mut().enumerate() {
                let fitted = (covariance.dof - 1 - joint) as f64;
                let unsure = 1.0 + 2.0 * fitted / independent;
                let left = covariance.factor[joint * (covariance.dof + 1)];
                partial.residual[chart] = covariance.partial[joint];
                partial.excess[chart] =
                    turns::beyond_noise(covariance.reading[joint], covariance.noise[joint]);
                partial.variance[chart] = unsure * left.max(share * self.white[joint]);
            }
        }
    }

    /// Learns the white part from second differences, which no bias, motion or contact reaches, and mends a cell that is wrong
    /// by itself.
    fn learn_white(&mut self) {
        let Some(seconds) = self.cells.seconds() else {
            return;
        };
        let covariance = &mut self.covariances[0];
        covariance.explain(seconds);
        let mut most = 0.0_f64;
        for ((variance, partial), lone) in
            (self.white.iter_mut().zip(&covariance.partial)).zip(&mut self.lone)
        {
            let square = partial * partial / 6.0;
            let expected = variance.max(LEAST_VARIANCE);
            let is_beyond = partial.abs() > LONE * expected.sqrt();
            *lone = if is_beyond { partial.abs() } else { 0.0 };
            most = most.max(*lone);
            *variance += (square.min(CLIP * CLIP * expected) - *variance) / SWIFT_CELLS;
        }
        if most > 0.0 && covariance.seen >= MEMORY_CELLS {
            covariance.explain(self.cells.about_last_but_one());
            // What stays changed is no wrong cell.
            let mut found = self.lone.iter().zip(&covariance.partial);
            if found.any(|(lone, stays)| *lone > 2.0 * stays.abs()) {
                self.cells.mend();
            }
        }
    }

    /// Learns the noise from what the charts read with the last sample, without contact; `trust` is the share of the full
    /// gain.
    pub(super) fn learn(&mut self, trust: f64) {
        if !self.is_new {
            return;
        }
        for (covariance, secs) in self.covariances.iter_mut().zip(MEMORY_SECS) {
            let lasting = (secs / self.cells.cell_secs).max(MEMORY_CELLS);
            covariance.learn(&self.scale, trust, lasting);
        }
    }
}
