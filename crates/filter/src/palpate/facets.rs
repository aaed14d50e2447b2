//! The search on the mesh about where its smooth body was touched: flat triangles make many small peaks of a wide one,
//! and a climb by derivatives ends on the first of them.

use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use rayon::prelude::*;

use super::agenda::Phase;
use super::chart::{COORDINATES, Coordinates};
use super::history::History;
use super::likeness::Likeness;
use super::peaks::Peak;
use super::{PalpateFilter, history};
use crate::random::{Purpose, stream};
use crate::step::Step;

/// Places that are asked at a time, and rounds in which they are.
pub(super) const SCATTERED: usize = 24;
const SCATTERS: usize = 6;
/// Rounds with those of the climbs that follow.
const ROUNDS: usize = SCATTERS + 4;
/// How far flat triangles move what looks like a contact with the smooth body, along the chart's axes: standard
/// deviations, m, m, on the logarithm of the radius, rad.
const FLATNESS: [f64; COORDINATES] = [3e-3, 3e-3, 0.2, 0.1, 0.0, 0.0, 0.0];
/// The places are drawn at every scale down to this share of that.
const NEAREST: f64 = 0.05;

impl PalpateFilter {
    /// After a scan, looks on the mesh about where the smooth body was touched, and climbs from the best places.
    pub(super) fn facets(&mut self, step: &Step, round: usize) {
        let is_done = match round < SCATTERS {
            true => self.scatter(step, round),
            false => self.climb_on(step),
        };
        if !is_done {
            return;
        }
        if round + 1 < ROUNDS {
            return self.agenda.enter(Phase::Facets(round + 1));
        }
        self.renew_peaks();
        self.agenda.enter(Phase::Bars(0));
    }

    /// A portion of a round in which all climbs look around. Tells whether the round is done.
    fn scatter(&mut self, step: &Step, round: usize) -> bool {
        let total = self.bench.climbs.len();
        let portion = self.portion(total, SCATTERED);
        let first = portion.start + round * total;
        let (seed, key) = (self.seed, self.key);
        let history = history(step, &self.memory, &self.noise);
        let climbs = self.bench.climbs[portion].par_iter_mut().enumerate();
        climbs.for_each(|(index, peak)| {
            let mut random = stream(seed, key, first + index, Purpose::Facet);
            peak.scatter(&history, &mut random);
        });
        self.agenda.done == total
    }
}

impl Peak {
    /// Goes to the best of some places around on the mesh. The farthest are as far as the peak is wide and as a flat
    /// triangle moves a contact.
    pub(super) fn scatter(&mut self, history: &History, random: &mut impl Rng) {
        if self.obstacle.likeness.is_smooth() {
            self.obstacle.likeness = Likeness::Mesh;
            self.refresh(history);
        }
        for _ in 0..SCATTERED {
            let Some((here, _)) = self.coordinates(&self.obstacle.core) else {
                break;
            };
            let (obstacle, evidence, _) = self.try_at(&(here + self.way(random)), history);
            if evidence.log > self.evidence.log {
                self.obstacle = obstacle;
                self.evidence = evidence;
            }
        }
        self.log_mass = self.evidence.log;
        self.rests = false;
    }

    /// A way to go along the chart, of any scale.
    fn way(&self, random: &mut impl Rng) -> Coordinates {
        let mut gauss = || Coordinates::from_fn(|_, _| random.sample::<f64, _>(StandardNormal));
        let wide = self.root * gauss();
        let flat = gauss().component_mul(&Coordinates::from(FLATNESS));
        (wide + flat) * NEAREST.powf(random.random())
    }
}
