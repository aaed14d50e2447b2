//! Whether the truth lies in the region that an estimate gives.

use nalgebra::Point3;
use palpate_filter::ContactEstimate;

/// The probabilities that regions are asked for.
pub const LEVELS: [f64; 2] = [0.5, 0.9];

/// For each of [`LEVELS`], whether a place in the root frame, m, lies in the estimate's credible region.
pub fn holds(estimate: &ContactEstimate, place: &Point3<f64>) -> [bool; LEVELS.len()] {
    LEVELS.map(|level| estimate.region(level).holds(place))
}
