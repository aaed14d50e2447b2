//! How good a row of estimates is.

use nalgebra::Point3;
use palpate_filter::{ContactEstimate, ContactStatus, Filter, Intake, Mode};
use palpate_model::JointSample;

use super::region;
use crate::last_second::median;

/// An estimate counts until a newer one comes, but at most for this long, ns.
const HOLD_NS: i64 = 500_000_000;
/// What "the last second" is, s.
const TAIL_SECS: f64 = 1.0;
/// The contact counts as found while the error is below this, m.
pub const FOUND: f64 = 0.02;
/// Time between the points of [`Score::course`], s.
pub const COURSE_SECS: f64 = 0.1;

/// The truth at one stamp with contact.
#[derive(Clone, Copy, Debug)]
pub struct Known {
    /// ns.
    pub stamp_ns: i64,
    /// Index of the touched link.
    pub link: usize,
    /// m.
    pub point_in_root: Point3<f64>,
    /// Size of the force, N.
    pub force: f64,
}

/// Estimate against truth at one stamp.
#[derive(Clone, Copy, Debug)]
struct Seen {
    /// Time from the first stamp with contact, s.
    secs: f64,
    /// m; infinite without an estimate.
    error: f64,
    is_right_link: bool,
    /// N; NaN without an estimate.
    force_error: f64,
    true_force: f64,
    is_ambiguous: bool,
    /// Standard deviation of the first mode, m; NaN without one.
    std: f64,
}

/// What a trial comes to.
#[derive(Clone, Debug, PartialEq)]
pub struct Score {
    /// Median position error over the last second, m; infinite where most of it is without estimate.
    pub error: f64,
    /// Share of the last second with the right link.
    pub right_link: f64,
    /// Share of the whole contact with the right link.
    pub right_link_all: f64,
    /// Median error of the force over the last second, N; NaN without estimate.
    pub force_error: f64,
    /// The same as a share of the median true force.
    pub force_error_share: f64,
    /// First time, from the begin of contact, after which the error stays below [`FOUND`]; infinite if it never does, s.
    pub settled_secs: f64,
    /// Share of the contact without estimate.
    pub without: f64,
    /// Share of the last second with the status "ambiguous".
    pub ambiguous: f64,
    /// The estimate's own standard deviation at the end, m; NaN without estimate.
    pub std: f64,
    /// Whether the truth lies in each of the estimate's regions at the end.
    pub holds: [bool; region::LEVELS.len()],
    /// Error every [`COURSE_SECS`] from the begin of contact, m.
    pub course: Vec<f64>,
}

/// Runs a filter over samples and scores what it says against the truth; shows it to `see` after each sample. None if
/// the truth has no contact. Samples that the intake refuses are left out.
pub fn score(
    filter: &mut Filter,
    dof: usize,
    samples: &[JointSample],
    truth: &[Known],
    mut see: impl FnMut(&JointSample, &Filter),
) -> Option<Score> {
    let start_ns = truth.first()?.stamp_ns;
    let end_ns = truth.last()?.stamp_ns;
    let mut holds = [false; region::LEVELS.len()];
    let mut intake = Intake::new(dof);
    let mut seen = Vec::with_capacity(truth.len());
    let mut waiting = truth.iter().peekable();
    let mut newest: Option<i64> = None;
    let mut compared = |filter: &Filter, newest, known: &Known| {
        let now = compare(filter.estimate(), newest, known, start_ns);
        if known.stamp_ns == end_ns && now.error.is_finite() {
            holds = region::holds(filter.estimate(), &known.point_in_root);
        }
        seen.push(now);
    };
    for sample in samples {
        // Truth from before this sample belongs to the estimate that was there then.
        while let Some(known) = waiting.next_if(|known| known.stamp_ns < sample.stamp_ns) {
            compared(filter, newest, known);
        }
        if let Ok(admitted) = intake.admit(sample) {
            filter.update(admitted);
            newest = Some(sample.stamp_ns);
            see(sample, filter);
        }
    }
    waiting.for_each(|known| compared(filter, newest, known));
    summarise(&seen, holds)
}

fn compare(
    estimate: &ContactEstimate,
    newest_ns: Option<i64>,
    known: &Known,
    start_ns: i64,
) -> Seen {
    let is_fresh = newest_ns.is_some_and(|newest| known.stamp_ns - newest <= HOLD_NS);
    let is_finite = |mode: &&Mode| mode.point_in_root.coords.iter().all(|x| x.is_finite());
    let best = estimate.best().filter(|mode| is_fresh && is_finite(mode));
    Seen {
        secs: (known.stamp_ns - start_ns) as f64 * 1e-9,
        error: best.map_or(f64::INFINITY, |mode| {
            (mode.point_in_root - known.point_in_root).norm()
        }),
        is_right_link: best.is_some_and(|mode| mode.link == known.link),
        force_error: best.map_or(f64::NAN, |mode| {
            (mode.force_in_root.norm() - known.force).abs()
        }),
        true_force: known.force,
        is_ambiguous: best.is_some() && estimate.status == ContactStatus::Ambiguous,
        std: best.map_or(f64::NAN, |mode| mode.std()),
    }
}

fn summarise(seen: &[Seen], holds: [bool; region::LEVELS.len()]) -> Option<Score> {
    let end = seen.last()?;
    let last: Vec<_> = (seen.iter())
        .filter(|s| s.secs >= end.secs - TAIL_SECS - 1e-9)
        .collect();
    let far = seen.iter().rposition(|s| s.error >= FOUND);
    let settled = seen.get(far.map_or(0, |index| index + 1));
    let force_error = median(
        last.iter()
            .map(|s| s.force_error)
            .filter(|error| error.is_finite()),
    );
    let course = (0..)
        .map(|point| f64::from(point) * COURSE_SECS)
        .take_while(|secs| *secs <= end.secs + 1e-9);
    let at = |secs: f64| seen[..seen.partition_point(|s| s.secs <= secs + 1e-9)].last();
    Some(Score {
        error: median(last.iter().map(|s| s.error)),
        right_link: share(last.iter().map(|s| s.is_right_link)),
        right_link_all: share(seen.iter().map(|s| s.is_right_link)),
        force_error,
        force_error_share: force_error / median(last.iter().map(|s| s.true_force)),
        settled_secs: settled.map_or(f64::INFINITY, |s| s.secs),
        without: share(seen.iter().map(|s| s.error.is_infinite())),
        ambiguous: share(last.iter().map(|s| s.is_ambiguous)),
        std: end.std,
        holds,
        course: course.filter_map(at).map(|s| s.error).collect(),
    })
}

/// Share that holds; NaN of nothing.
pub fn share(all: impl ExactSizeIterator<Item = bool>) -> f64 {
    let count = all.len();
    all.filter(|holds| *holds).count() as f64 / count as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    const NO: [bool; region::LEVELS.len()] = [false; region::LEVELS.len()];

    /// Ten seconds at 10 Hz with these errors, m.
    fn seen(error_at: impl Fn(f64) -> f64) -> Vec<Seen> {
        (0..100)
            .map(|index| {
                let secs = f64::from(index) * 0.1;
                let error = error_at(secs);
                Seen {
                    secs,
                    error,
                    is_right_link: error < 0.1,
                    force_error: if error.is_finite() { 1.0 } else { f64::NAN },
                    true_force: 10.0,
                    is_ambiguous: false,
                    std: 0.01,
                }
            })
            .collect()
    }

    #[test]
    fn the_last_second_and_the_time_to_settle_are_told_apart() {
        let scored = summarise(&seen(|secs| if secs < 2.95 { 0.5 } else { 0.003 }), NO).unwrap();
        assert_eq!(scored.error, 0.003);
        assert_eq!((scored.right_link, scored.right_link_all), (1.0, 0.7));
        assert!((scored.settled_secs - 3.0).abs() < 1e-9);
        assert_eq!(scored.force_error_share, 0.1);
        assert_eq!(scored.course.len(), 100);
        assert_eq!((scored.course[29], scored.course[30]), (0.5, 0.003));
    }

    #[test]
    fn what_is_never_found_never_settles() {
        let scored = summarise(&seen(|secs| if secs < 9.85 { 0.003 } else { 0.5 }), NO).unwrap();
        assert_eq!(scored.error, 0.003, "the median of the last second");
        assert_eq!(scored.settled_secs, f64::INFINITY);
        let nothing = summarise(&seen(|_| f64::INFINITY), NO).unwrap();
        assert_eq!((nothing.error, nothing.without), (f64::INFINITY, 1.0));
        assert!(nothing.force_error.is_nan());
        let at_once = summarise(&seen(|_| 0.001), NO).unwrap();
        assert_eq!(at_once.settled_secs, 0.0);
        assert!(summarise(&[], NO).is_none());
    }
}
