//! The search for better peaks after each keyframe: climbs from new places, one Newton step a round.

use rand::RngExt;
use rayon::prelude::*;

use super::agenda::Phase;
use super::facets::SCATTERED;
use super::history::History;
use super::likeness::Likeness;
use super::obstacle::Obstacle;
use super::peaks::{MOST, Peak, keep_best, keep_best_of_each, keep_likely, step_cost};
use super::scan::{self, Candidate};
use super::{PalpateFilter, history};
use crate::random::{Purpose, stream};
use crate::step::Step;

/// Hops at each keyframe, and the Newton steps of each.
const HOPS: usize = 16;
const HOP_ROUNDS: usize = 3;
/// Every other one begins somewhat farther from one of so many best peaks, with any kind of obstacle,
const FAR_HOPS_FROM: usize = 4;
/// the others beside so many best peaks, and then at particles.
const HOPS_FROM_PEAKS: usize = 6;
/// What looking around on the mesh costs, spread over all hops, in evaluations.
const SCATTERING: usize = SCATTERED * HOPS_FROM_PEAKS / (2 * HOPS);
/// What asking a link's triangles costs, in looks at a keyframe: about what a sample of 1 kHz pays for.
const ASKING: usize = 1000;

impl PalpateFilter {
    /// Basin hopping (Wales and Doye 1997): climbs anew from beside the best peaks and from particles.
    pub(super) fn hop(&mut self, step: &Step, round: usize) {
        let is_done = match round {
            0 => self.begin_climbs(
                step,
                HOPS,
                step_cost(&self.peaks) + SCATTERING,
                Self::hop_start,
            ),
            _ => self.climb_on(step),
        };
        if !is_done {
            return;
        }
        if round + 1 < HOP_ROUNDS {
            return self.agenda.enter(Phase::Hop(round + 1));
        }
        self.renew_peaks();
        self.bench.candidates.clear();
        self.agenda.enter(
            match scan::is_due(self.keyframes, self.noise.most_inflated()) {
                true => Phase::Ask,
                false => Phase::Sight,
            },
        );
    }

    /// Asks the triangles of some links for the candidates of a scan.
    pub(super) fn ask(&mut self, step: &Step) {
        let links = step.skin.links();
        let total = links.len() * scan::QUESTIONS;
        let portion = self.agenda.take(total, ASKING);
        let history = history(step, &self.memory, &self.noise);
        let keys = (self.seed, self.key);
        let ask = |index| {
            let link = links[index / scan::QUESTIONS];
            scan::candidates(&history, link, index % scan::QUESTIONS, keys)
        };
        let asked: Vec<Candidate> = portion.into_par_iter().flat_map_iter(ask).collect();
        // Questions often have the same answer.
        for candidate in asked {
            if !self.bench.candidates.contains(&candidate) {
                self.bench.candidates.push(candidate);
            }
        }
        if self.agenda.done == total {
            self.agenda.enter(Phase::Screen);
        }
    }

    /// Looks at the candidates of a scan as they are, and leaves the best to climb from.
    pub(super) fn screen(&mut self, step: &Step) {
        let total = self.bench.candidates.len();
        let portion = self.portion(total, scan::SCREENING);
        let history = history(step, &self.memory, &self.noise);
        let start = |candidate| scan::start(&history, candidate);
        let starts = self.bench.candidates[portion].par_iter().map(start);
        self.bench.climbs.par_extend(starts);
        if self.agenda.done == total {
            keep_best_of_each(&mut self.bench.climbs, scan::MOST_LEFT[0]);
            self.agenda.enter(Phase::Scan(1));
        }
    }

    /// Climbs from the candidates of a scan; after each round the best go on.
    pub(super) fn scan(&mut self, step: &Step, round: usize) {
        if !self.climb_on(step) {
            return;
        }
        if let Some(&most) = scan::MOST_LEFT.get(round) {
            keep_best_of_each(&mut self.bench.climbs, most);
            return self.agenda.enter(Phase::Scan(round + 1));
        }
        let is_smooth = |peak: &&Peak| peak.obstacle.likeness.is_smooth();
        let smooth = self.bench.climbs.iter().filter(is_smooth);
        let smooth: Vec<Peak> = smooth.cloned().collect();
        self.peaks.append(&mut self.bench.climbs);
        self.bench.climbs = smooth;
        self.agenda.enter(Phase::Facets(0));
    }

    /// After a scan, climbs as bars from where the best peaks are.
    pub(super) fn bars(&mut self, step: &Step, round: usize) {
        let start = |filter: &Self, index: usize, history: &History| {
            scan::bar(history, &filter.peaks[index])
        };
        let is_done = match round {
            0 => self.begin_climbs(
                step,
                scan::BARS.min(self.peaks.len()),
                scan::BAR_COST,
                start,
            ),
            _ => self.climb_on(step),
        };
        if !is_done {
            return;
        }
        if round + 1 < scan::BAR_ROUNDS {
            return self.agenda.enter(Phase::Bars(round + 1));
        }
        self.renew_peaks();
        self.agenda.enter(Phase::Drifts(0));
    }

    /// After that, climbs as drifting obstacles from where the best that rest are.
    pub(super) fn drifts(&mut self, step: &Step, round: usize) {
        let resting: Vec<Obstacle> = (self.peaks.iter().map(|peak| peak.obstacle))
            .filter(|obstacle| obstacle.core.drift.is_none())
            .take(scan::DRIFTS)
            .collect();
        let start =
            |_: &Self, index: usize, history: &History| scan::drifting(history, &resting[index]);
        let is_done = match round {
            0 => self.begin_climbs(step, resting.len(), scan::DRIFT_COST, start),
            _ => self.climb_on(step),
        };
        if !is_done {
            return;
        }
        if round + 1 < scan::DRIFT_ROUNDS {
            return self.agenda.enter(Phase::Drifts(round + 1));
        }
        self.renew_peaks();
        self.agenda.enter(Phase::Sight);
    }

    /// A portion of a round that begins so many climbs, each with its first step. Tells whether the round is done.
    fn begin_climbs(
        &mut self,
        step: &Step,
        starts: usize,
        cost: usize,
        start: impl Fn(&Self, usize, &History) -> Peak + Sync,
    ) -> bool {
        let portion = self.portion(starts, cost);
        let history = history(step, &self.memory, &self.noise);
        let begin = |index| {
            let mut peak = start(self, index, &history);
            peak.step(&history);
            peak
        };
        let begun: Vec<Peak> = portion.into_par_iter().map(begin).collect();
        self.bench.climbs.extend(begun);
        self.agenda.done == starts
    }

    /// A portion of a round in which all climbs go one step on. Tells whether the round is done.
    pub(super) fn climb_on(&mut self, step: &Step) -> bool {
        let total = self.bench.climbs.len();
        let portion = self.portion(total, step_cost(&self.bench.climbs));
        let history = history(step, &self.memory, &self.noise);
        let climbs = self.bench.climbs[portion].par_iter_mut();
        climbs
            .filter(|peak| !peak.rests)
            .for_each(|peak| peak.step(&history));
        self.agenda.done == total
    }

    /// Beside a peak, or a particle, seen as a ball or a bar.
    fn hop_start(&self, index: usize, history: &History) -> Peak {
        let mut random = stream(self.seed, self.key, index, Purpose::Hop);
        if index.is_multiple_of(2) && !self.peaks.is_empty() {
            let among = self.peaks.len().min(FAR_HOPS_FROM);
            let peak = &self.peaks[random.random_range(0..among)];
            return Peak::new(history.elsewhere(&peak.obstacle, &mut random), history);
        }
        let index = index / 2;
        let obstacle = match self.peaks.get(index).filter(|_| index < HOPS_FROM_PEAKS) {
            Some(peak) => {
                let likeness = Likeness::draw(&mut random);
                if !likeness.is_smooth() {
                    let mut start = peak.clone();
                    start.scatter(history, &mut random);
                    return start;
                }
                Obstacle {
                    core: peak.draw(history, &mut random),
                    likeness,
                    ..peak.obstacle
                }
            }
            None => {
                let particle = &self.particles[random.random_range(0..self.particles.len())];
                let turn = std::f64::consts::PI * random.random::<f64>();
                history.reshaped(&particle.obstacle, random.random::<bool>().then_some(turn))
            }
        };
        Peak::new(obstacle, history)
    }

    /// The climbs that came to their end are peaks like the others.
    pub(super) fn renew_peaks(&mut self) {
        self.peaks.append(&mut self.bench.climbs);
        keep_best(&mut self.peaks, MOST);
        keep_likely(&mut self.peaks);
    }
}
