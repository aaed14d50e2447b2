//! Charts of all joints together: a push that several joints feel, and none of them enough by itself.
//!
//! A contact reaches the joints from the base to the touched link, by torques that nobody knows beforehand. The likeliest
//! ones are those that were read, so that the squared partial residuals of these joints add up, each in its standard
//! deviations (the generalised likelihood ratio; Kay 1998, chapter 6). While nothing touches, the sum over k joints has
//! the χ² distribution with k degrees of freedom.

use super::alarm;
use super::onset::{ONSETS, Onset, Partial};

/// The limits are renewed when the threshold of one joint changed by so many standard deviations.
const RENEWED: f64 = 0.01;

/// The charts, one for each of those of sudden changes.
#[derive(Clone, Debug)]
pub(super) struct Joined {
    /// Sums that begin a contact, by number of joints, and the threshold of one joint that they belong to.
    limits: Vec<f64>,
    threshold: f64,
    last_ratio: [f64; ONSETS],
    /// The chart that was furthest beyond its threshold with both of the last two samples, in thresholds; and the same with
    /// the last alone.
    pub(super) ratio: f64,
    pub(super) newest_ratio: f64,
}

impl Joined {
    pub(super) fn new(dof: usize) -> Self {
        Self {
            limits: vec![f64::INFINITY; dof],
            threshold: 0.0,
            last_ratio: [0.0; ONSETS],
            ratio: 0.0,
            newest_ratio: 0.0,
        }
    }

    /// Weighs what the charts of sudden changes read. `threshold` is that of one joint, standard deviations; below
    /// `least_torque`, Nm, on each joint nothing is a contact.
    pub(super) fn weigh(&mut self, onset: &Onset, threshold: f64, least_torque: f64) {
        let is_known = std::array::from_fn(|chart| onset.is_well_known(chart));
        self.weigh_partials(onset.partials(), is_known, threshold, least_torque);
    }

    fn weigh_partials(
        &mut self,
        partials: &[Partial],
        is_known: [bool; ONSETS],
        threshold: f64,
        least_torque: f64,
    ) {
        if (threshold - self.threshold).abs() > RENEWED {
            self.threshold = threshold;
            for (count, limit) in self.limits.iter_mut().enumerate() {
                *limit = alarm::joined_threshold(threshold, count + 1);
            }
        }
        self.ratio = 0.0;
        self.newest_ratio = 0.0;
        for (chart, last) in self.last_ratio.iter_mut().enumerate() {
            if !is_known[chart] {
                *last = 0.0;
                continue;
            }
            let most =
                (partials.iter()).fold(0.0, |most, p| f64::max(most, p.residual[chart].abs()));
            let newest = furthest(partials, chart, &self.limits).min(most / least_torque);
            let before = std::mem::replace(last, newest);
            self.ratio = self.ratio.max(newest.min(before));
            self.newest_ratio = self.newest_ratio.max(newest);
        }
    }
}

/// By how much the sum over the joints from the base to any is beyond its limit, at most, in thresholds.
fn furthest(partials: &[Partial], chart: usize, limits: &[f64]) -> f64 {
    let mut sum = 0.0;
    let mut most = 0.0_f64;
    for (partial, limit) in partials.iter().zip(limits) {
        if partial.variance[chart] > 0.0 {
            sum += partial.residual[chart].powi(2) / partial.variance[chart];
            most = most.max(sum / limit);
        }
    }
    most.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is told of joints that read this on the last chart, in standard deviations of 0.1 Nm, in so many samples in a row.
    fn weighed(readings: &[f64], least_torque: f64, samples: usize) -> Joined {
        let partials: Vec<Partial> = (readings.iter())
            .map(|reading| {
                let mut partial = Partial::default();
                partial.residual[ONSETS - 1] = 0.1 * reading;
                partial.variance[ONSETS - 1] = 0.01;
                partial
            })
            .collect();
        let mut joined = Joined::new(readings.len());
        for _ in 0..samples {
            joined.weigh_partials(&partials, [true; ONSETS], 6.0, least_torque);
        }
        joined
    }

    #[test]
    fn joints_add_up_from_the_base_to_any() {
        let many = weighed(&[4.5, -4.5, 4.5, 0.0, 0.0, 0.0, 0.0], 0.15, 2);
        assert!(many.ratio > 1.1, "{}", many.ratio);
        // Those beyond the touched link have no part in it.
        let bare = weighed(&[4.5, -4.5, 4.5], 0.15, 2);
        assert!((many.ratio - bare.ratio).abs() < 1e-12);
        assert!(weighed(&[4.5, 0.0, 0.0], 0.15, 2).ratio < 1.0);
        assert!((weighed(&[6.0], 0.15, 2).ratio - 1.0).abs() < 1e-9);
    }

    #[test]
    fn one_sample_alone_and_torques_that_are_too_small_begin_nothing() {
        let once = weighed(&[5.0; 4], 0.15, 1);
        assert!(once.ratio < 1e-12 && once.newest_ratio > 1.0);
        assert!(weighed(&[5.0; 4], 0.6, 2).ratio < 1.0);
    }
}
