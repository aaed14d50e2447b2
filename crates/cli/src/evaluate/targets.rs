//! What is measured beside what is to be reached.

use super::campaign::Campaign;
use super::estimator::Estimator;
use super::summary::Summary;
use super::table::{heads, markdown, millimetres, percent, seconds};
use super::trial::{Cell, Outcome};

/// A number to reach.
pub struct Target {
    /// Condition, or set of bags.
    pub of: &'static str,
    /// What is measured, in words.
    pub what: &'static str,
    /// Numbers of the links that it holds for.
    pub links: &'static [usize],
    /// How it is measured, and what is to be reached.
    pub goal: Goal,
}

/// What is to be reached.
#[derive(Clone, Copy)]
pub enum Goal {
    /// The median error is below this, m.
    MedianBelow(f64),
    /// No trial errs by more than this, m.
    NoneOver(f64),
    /// The median time to stay below 2 cm is below this, s.
    SettledBelow(f64),
    /// The share of trials whose truth lies in the 90 % region is between these.
    HeldBetween(f64, f64),
    /// The mean share of the last second with the right link is at least this.
    RightLink(f64),
    /// The last second is called ambiguous in every trial.
    SaidAmbiguous,
}

const fn target(
    of: &'static str,
    what: &'static str,
    links: &'static [usize],
    goal: Goal,
) -> Target {
    Target {
        of,
        what,
        links,
        goal,
    }
}

use Goal::{HeldBetween, MedianBelow, NoneOver, RightLink, SaidAmbiguous, SettledBelow};

/// To be reached in simulation.
pub static SIMULATED: [Target; 9] = [
    target(
        "noise10",
        "10 % noise, matched mesh",
        &[3, 4, 5, 6, 7],
        MedianBelow(0.5e-3),
    ),
    target(
        "finer",
        "10 % noise, different truth mesh",
        &[3, 4, 5, 6, 7],
        MedianBelow(3e-3),
    ),
    target(
        "bias",
        "the same, bias 0.2 Nm",
        &[3, 5, 6, 7],
        MedianBelow(2e-3),
    ),
    target(
        "friction",
        "the same, friction 0.3",
        &[5, 6, 7],
        MedianBelow(5e-3),
    ),
    target(
        "edge",
        "the same, cube's edge",
        &[3, 4, 5, 6, 7],
        MedianBelow(5e-3),
    ),
    target(
        "noise10",
        "time to stay below 2 cm, moving",
        &[3, 4, 5, 6, 7],
        SettledBelow(1.0),
    ),
    target(
        "noise10",
        "calibration, matched mesh",
        &[2, 3, 4, 5, 6, 7],
        HeldBetween(0.85, 0.97),
    ),
    target(
        "finer",
        "calibration, different truth mesh",
        &[2, 3, 4, 5, 6, 7],
        HeldBetween(0.85, 0.97),
    ),
    target("noise10", "right link", &[3, 4, 5, 6, 7], RightLink(0.99)),
];

/// To be reached on bags, by the name of their set.
pub static BAGS: [Target; 7] = [
    target(
        "quasistatic",
        "10 % noise",
        &[3, 4, 5, 6, 7],
        MedianBelow(2e-3),
    ),
    target(
        "quasistatic",
        "10 % noise, worst trial",
        &[3, 4, 5, 6, 7],
        NoneOver(10e-3),
    ),
    target("quasistatic", "10 % noise", &[2], MedianBelow(10e-3)),
    target("quasistatic", "ambiguous and said so", &[1], SaidAmbiguous),
    target(
        "quasistatic",
        "the 90 % region holds the truth",
        &[1],
        HeldBetween(1.0, 1.0),
    ),
    target(
        "dynamic",
        "friction, observer, bias, noise",
        &[5, 6, 7],
        MedianBelow(5e-3),
    ),
    target(
        "dynamic",
        "friction, observer, bias, noise",
        &[3, 4],
        MedianBelow(15e-3),
    ),
];

impl Target {
    fn reach(&self) -> String {
        match self.goal {
            MedianBelow(metres) => format!("median < {} mm", millimetres(metres)),
            NoneOver(metres) => format!("none over {} mm", millimetres(metres)),
            SettledBelow(secs) => format!("median < {secs} s"),
            HeldBetween(low, high) if low == high => format!("{} %", percent(low)),
            HeldBetween(low, high) => format!("{} to {} %", percent(low), percent(high)),
            RightLink(share) => format!("≥ {} %", percent(share)),
            SaidAmbiguous => "every trial".to_owned(),
        }
    }

    /// The measured value in words, and whether it is good enough.
    fn measure(&self, summary: &Summary) -> (String, bool) {
        match self.goal {
            MedianBelow(metres) => (
                millimetres(summary.error_median) + " mm",
                summary.error_median < metres,
            ),
            NoneOver(metres) => (
                millimetres(summary.error_max) + " mm",
                summary.error_max <= metres,
            ),
            SettledBelow(secs) => (
                seconds(summary.settled_secs) + " s",
                summary.settled_secs < secs,
            ),
            HeldBetween(low, high) => {
                let [_, held] = summary.held;
                (percent(held) + " %", (low..=high).contains(&held))
            }
            RightLink(share) => (
                format!("{:.1} %", 100.0 * summary.right_link),
                summary.right_link >= share,
            ),
            SaidAmbiguous => (percent(summary.ambiguous) + " %", summary.ambiguous >= 0.99),
        }
    }
}

/// The table of targets; `outcomes` gives those of a condition (or set) and a link. Rows of links without trials are left
/// out.
pub fn table<'a>(
    targets: &[Target],
    outcomes: impl Fn(&'static str, usize) -> Vec<&'a Outcome>,
) -> String {
    let columns = heads(&[
        "where", "what", "links", "reach", "measured", "reached", "trials", "by link",
    ]);
    let mut rows = Vec::new();
    for target in targets {
        let of_link: Vec<_> = (target.links.iter())
            .map(|&link| (link, outcomes(target.of, link)))
            .filter(|(_, outcomes)| !outcomes.is_empty())
            .collect();
        let summary = Summary::of(of_link.iter().flat_map(|(_, outcomes)| outcomes).copied());
        if summary.count == 0 {
            continue;
        }
        let (measured, is_reached) = target.measure(&summary);
        let by_link = of_link.iter().map(|(link, outcomes)| {
            let (value, _) = target.measure(&Summary::of(outcomes.iter().copied()));
            format!("{link}: {}", value.split(' ').next().unwrap_or_default())
        });
        let links: Vec<_> = of_link.iter().map(|(link, _)| link.to_string()).collect();
        rows.push(vec![
            target.of.to_owned(),
            target.what.to_owned(),
            links.join(", "),
            target.reach(),
            measured,
            if is_reached { "yes" } else { "no" }.to_owned(),
            summary.count.to_string(),
            by_link.collect::<Vec<_>>().join(", "),
        ]);
    }
    markdown(&columns, &rows, 8)
}

/// Outcomes of the palpate method under a condition.
pub fn simulated<'a>(
    campaign: &'a Campaign,
    links: &'a [usize],
) -> impl Fn(&'static str, usize) -> Vec<&'a Outcome> {
    move |condition, link| {
        let cell = Cell {
            condition,
            estimator: Estimator::Palpate,
            link,
        };
        match links.contains(&link) {
            true => campaign.outcomes(&cell).iter().collect(),
            false => Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::score::Score;

    fn outcome(error: f64) -> Outcome {
        Ok(Score {
            error,
            right_link: 1.0,
            right_link_all: 1.0,
            force_error: 0.0,
            force_error_share: 0.0,
            settled_secs: 0.4,
            without: 0.0,
            ambiguous: 0.0,
            std: 0.001,
            holds: [true, true],
            course: Vec::new(),
        })
    }

    #[test]
    fn each_goal_tells_reached_from_missed() {
        let good = Summary::of(&[outcome(1e-3), outcome(2e-3), outcome(3e-3)]);
        let reached = |goal| target("noise10", "", &[3], goal).measure(&good).1;
        assert!(reached(MedianBelow(2.1e-3)) && !reached(MedianBelow(2e-3)));
        assert!(reached(NoneOver(3e-3)) && !reached(NoneOver(2.9e-3)));
        assert!(reached(SettledBelow(0.5)) && !reached(SettledBelow(0.4)));
        assert!(reached(HeldBetween(1.0, 1.0)) && !reached(HeldBetween(0.85, 0.97)));
        assert!(reached(RightLink(0.99)) && !reached(SaidAmbiguous));
    }

    #[test]
    fn nothing_measured_is_nothing_reached() {
        let nothing = Summary::of(&[]);
        for target in SIMULATED.iter().chain(&BAGS) {
            assert!(!target.measure(&nothing).1, "{}", target.what);
        }
        assert_eq!(table(&SIMULATED, |_, _| Vec::new()).lines().count(), 2);
    }
}
