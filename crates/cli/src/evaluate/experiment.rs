//! What is measured: conditions and estimators to compare, link by link.

use super::estimator::Estimator::{self, Curvature, Link, Palpate, World};

/// An experiment.
pub struct Experiment {
    /// Name on the command line and of its files.
    pub name: &'static str,
    /// In words.
    pub title: &'static str,
    /// Names of its conditions.
    pub conditions: &'static [&'static str],
    /// What estimates, if nothing else is asked for.
    pub estimators: &'static [Estimator],
    /// What is told about it.
    pub view: View,
}

/// What is told of an experiment's trials.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// Particles at several times of one trial a link.
    Progress,
    /// Position error by link.
    Error,
    /// Error over time, and the time to stay below 2 cm.
    Convergence,
    /// How often the truth lies in the estimate's region.
    Calibration,
    /// How often the right link is named.
    RightLink,
    /// Measured values beside those to reach.
    Targets,
}

const BOTH: &[Estimator] = &[Curvature, Palpate];

/// Every experiment, in the order in which they run.
pub static EXPERIMENTS: [Experiment; 16] = [
    Experiment {
        name: "progress",
        title: "Particles as the contact is found (the paper's figure 3)",
        conditions: &["noise10"],
        estimators: BOTH,
        view: View::Progress,
    },
    Experiment {
        estimators: &[Link, World, Curvature, Palpate],
        ..error(
            "models",
            "Motion models and methods (the paper's figure 4)",
            &["noise10"],
        )
    },
    error(
        "noise",
        "Torque noise of 0, 5 and 10 % of each joint's rms (the paper's figure 5)",
        &["noise0", "noise5", "noise10"],
    ),
    error("edge", "A cube's edge (the paper's figure 6)", &["edge"]),
    error("bias", "A bias on every joint", &["bias", "begun"]),
    error("friction", "Friction", &["friction"]),
    error(
        "finer",
        "A true mesh finer than the filter's",
        &["finer", "refined"],
    ),
    ours("mesh15", "A coarse mesh in the filter", &["mesh15"]),
    ours("floor", "Noise on every joint", &["floor"]),
    ours("cylinder", "A pole", &["cylinder"]),
    ours("plane", "A plane", &["plane"]),
    ours("drift", "An obstacle that drifts", &["drift"]),
    Experiment {
        view: View::Convergence,
        ..error("convergence", "Time to converge", &["noise10", "finer"])
    },
    Experiment {
        view: View::Calibration,
        ..error(
            "calibration",
            "Truth within the estimate's 50 and 90 % region",
            &["noise10", "finer", "bias", "friction", "edge"],
        )
    },
    Experiment {
        view: View::RightLink,
        ..error(
            "rightlink",
            "Share of the last second with the right link",
            &["noise10", "finer", "bias", "friction", "edge"],
        )
    },
    Experiment {
        view: View::Targets,
        ..ours(
            "targets",
            "Measured values beside those to reach",
            &["noise10", "finer", "bias", "friction", "edge"],
        )
    },
];

/// Position error of both methods.
const fn error(
    name: &'static str,
    title: &'static str,
    conditions: &'static [&'static str],
) -> Experiment {
    Experiment {
        name,
        title,
        conditions,
        estimators: BOTH,
        view: View::Error,
    }
}

/// The same, of this project's method alone.
const fn ours(
    name: &'static str,
    title: &'static str,
    conditions: &'static [&'static str],
) -> Experiment {
    Experiment {
        estimators: &[Palpate],
        ..error(name, title, conditions)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::condition;

    #[test]
    fn every_condition_named_exists_and_every_existing_one_is_named() {
        let named: Vec<_> = EXPERIMENTS.iter().flat_map(|e| e.conditions).collect();
        assert!(named.iter().all(|name| condition::named(name).is_some()));
        let unused = (condition::CONDITIONS.iter()).find(|c| !named.contains(&&c.name));
        assert!(unused.is_none(), "{}", unused.unwrap().name);
    }
}
