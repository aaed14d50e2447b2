//! The estimators that are compared.

use palpate_filter::{Method, MotionModel, PaperParameters, Parameters};

/// A method with its motion model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Estimator {
    /// The paper's filter with its curvature model.
    Curvature,
    /// The paper's filter with the contact at rest in the link's frame.
    Link,
    /// The paper's filter with the contact at rest in the world.
    World,
    /// This project's filter.
    Palpate,
}

impl Estimator {
    /// Every estimator.
    pub const ALL: [Self; 4] = [Self::Curvature, Self::Link, Self::World, Self::Palpate];

    /// Name in options, tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Curvature => "curvature",
            Self::Link => "link",
            Self::World => "world",
            Self::Palpate => "palpate",
        }
    }

    /// In words.
    pub fn title(self) -> &'static str {
        match self {
            Self::Curvature => "paper, curvature",
            Self::Link => "paper, at rest in the link",
            Self::World => "paper, at rest in the world",
            Self::Palpate => "palpate",
        }
    }

    /// Its parameters: the defaults, but for the number of particles if one is given.
    pub fn parameters(self, particles: Option<usize>) -> Parameters {
        let paper = |motion_model| {
            let paper = PaperParameters {
                motion_model,
                ..PaperParameters::default()
            };
            (Method::Paper, paper)
        };
        let (method, paper) = match self {
            Self::Curvature => paper(MotionModel::Curvature),
            Self::Link => paper(MotionModel::Link),
            Self::World => paper(MotionModel::World),
            Self::Palpate => (Method::Palpate, PaperParameters::default()),
        };
        let mut parameters = Parameters {
            method,
            paper,
            ..Parameters::default()
        };
        if let Some(particles) = particles {
            parameters.particles = particles;
            parameters.palpate.hypotheses = particles;
        }
        parameters
    }
}
