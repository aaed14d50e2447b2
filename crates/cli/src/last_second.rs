//! What the last second of estimates says together.

use std::collections::BTreeMap;

use nalgebra::Point3;
use palpate_filter::Mode;

use crate::track::Estimated;

/// Medians over the last second, of the estimates on the link that most of them name.
pub struct LastSecond {
    /// Index of that link.
    pub link: usize,
    /// Share of the last second's estimates that name it.
    pub share: f64,
    /// Contact point in the root frame, coordinate by coordinate, m.
    pub point_in_root: Point3<f64>,
    /// Standard deviation of the point, m.
    pub std: f64,
    /// Force, N.
    pub force: f64,
}

impl LastSecond {
    /// Of estimates in the order of time; none if the last second is without contact.
    pub fn of(estimates: &[Estimated]) -> Option<Self> {
        let end_ns = estimates.last()?.stamp_ns;
        let last: Vec<_> = (estimates.iter().rev())
            .take_while(|e| end_ns.saturating_sub(e.stamp_ns) <= 1_000_000_000)
            .collect();
        let modes: Vec<_> = last.iter().filter_map(|e| e.best.as_ref()).collect();
        let mut votes: BTreeMap<usize, usize> = BTreeMap::new();
        for mode in &modes {
            *votes.entry(mode.link).or_default() += 1;
        }
        let (link, count) = votes.into_iter().max_by_key(|(_, count)| *count)?;
        let on_link: Vec<_> = modes.into_iter().filter(|m| m.link == link).collect();
        let of = |value: &dyn Fn(&Mode) -> f64| median(on_link.iter().map(|mode| value(mode)));
        Some(Self {
            link,
            share: count as f64 / last.len() as f64,
            point_in_root: Point3::new(
                of(&|m| m.point_in_root.x),
                of(&|m| m.point_in_root.y),
                of(&|m| m.point_in_root.z),
            ),
            std: of(&Mode::std),
            force: of(&|m| m.force),
        })
    }
}

/// Median; NaN of nothing.
pub fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match (sorted.get(middle), sorted.len() % 2) {
        (Some(value), 1) => *value,
        (Some(value), _) => 0.5 * (sorted[middle - 1] + value),
        (None, _) => f64::NAN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_median_is_the_middle_whatever_the_order() {
        assert_eq!(median([3.0, 1.0, 2.0].into_iter()), 2.0);
        assert_eq!(median([4.0, 1.0, 3.0, 2.0].into_iter()), 2.5);
        assert!(median(std::iter::empty()).is_nan());
    }
}
