//! How the touched link relates to its mesh, which nobody knows beforehand: the evidence tells.

use rand::{Rng, RngExt};

/// What a link is taken for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Likeness {
    /// Its mesh, flat triangles and all: simulated robots are.
    Mesh,
    /// The smooth body that the mesh stands for, about: its normals follow from the mesh to within a degree only.
    Body,
}

impl Likeness {
    /// All of them, a priori equally likely.
    pub(super) const ALL: [Self; 2] = [Self::Mesh, Self::Body];

    /// Whether contacts are on the smooth body.
    pub(super) fn is_smooth(self) -> bool {
        self != Self::Mesh
    }

    /// Standard deviation, as a share of the push, of a force in any direction beside it that is new in each keyframe:
    /// the normal and the depth are a little other than the mesh makes them.
    pub(super) fn slack(self) -> f64 {
        match self {
            Self::Mesh => 0.0,
            Self::Body => 0.01,
        }
    }

    /// The same for a part that lasts: the contact stays where the normal is a little off.
    pub(super) fn tilt(self) -> f64 {
        match self {
            Self::Mesh => 0.0,
            Self::Body => 0.015,
        }
    }

    /// One drawn at random.
    pub(super) fn draw(random: &mut impl Rng) -> Self {
        Self::ALL[random.random_range(0..Self::ALL.len())]
    }

    /// Another one drawn at random.
    pub(super) fn other(self, random: &mut impl Rng) -> Self {
        let step = random.random_range(1..Self::ALL.len());
        Self::ALL[(self as usize + step) % Self::ALL.len()]
    }
}
