//! The work that a keyframe causes, phase by phase, in portions that the agenda allows.

use std::ops::Range;

use rand::{Rng, RngExt};
use rayon::prelude::*;

use super::agenda::Phase;
use super::history::{History, Place};
use super::likeness::Likeness;
use super::moves::Proposals;
use super::obstacle::{Obstacle, RADIUS_RANGE};
use super::peaks::{MOST, Peak, keep_best, keep_likely};
use super::scan::Candidate;
use super::{Hypothesis, PalpateFilter, PalpateParameters, crowd, history, scan, sight};
use crate::random::{Purpose, stream};
use crate::resample::{effective_sample_size, normalise, systematic};
use crate::step::Step;

/// Draws for each particle at the start.
const FIRST_DRAWS: usize = 8;
/// Climbs from new places at each keyframe, and the steps of each.
const HOPS: usize = 16;
const HOP_CLIMB: usize = 3;
/// Every other one begins somewhat farther from one of so many best peaks, with any kind of obstacle,
const FAR_HOPS_FROM: usize = 4;
/// the others beside so many best peaks, and then at particles.
const HOPS_FROM_PEAKS: usize = 6;
/// Share of the particles below which their effective number may fall.
const RESAMPLE_BELOW: f64 = 0.5;
/// By this share their number may differ from what is asked for.
const RESIZE_BEYOND: f64 = 0.25;
/// Evaluations that one Newton step takes.
const STEP_COST: usize = 14;
/// Evaluations that a look at the systematic errors takes.
const SIGHT_COST: usize = 7;

/// What the present phase has made so far, to take effect when it is complete, and what later phases start from.
#[derive(Default)]
pub(super) struct Workbench {
    particles: Vec<Hypothesis>,
    peaks: Vec<Peak>,
    candidates: Vec<Candidate>,
    /// Climbs of a scan that are still in the running.
    climbs: Vec<Peak>,
    /// Bins of the particles, with weights.
    occupied: Vec<((u16, u32), f64)>,
    /// The particles as they were before the moves.
    others: Vec<Hypothesis>,
}

impl Workbench {
    pub(super) fn clear(&mut self) {
        self.particles.clear();
        self.peaks.clear();
        self.candidates.clear();
        self.climbs.clear();
    }
}

impl PalpateFilter {
    /// Does a portion of the present phase, and what completes it if that was the last.
    pub(super) fn work(&mut self, step: &Step) {
        match self.agenda.phase {
            Phase::Idle => {}
            Phase::Spread => self.spread(step),
            Phase::Reweigh => self.reweigh(step),
            Phase::Climb => self.climb(step),
            Phase::Hop => self.hop(step),
            Phase::Scan(round) => self.scan(step, round),
            Phase::Bars => self.bars(step),
            Phase::Sight => self.sight(step),
            Phase::Move(round) => self.mutate(step, round),
        }
    }

    /// The next portion of `units` that take `evaluations` of the whole history each.
    fn portion(&mut self, units: usize, evaluations: usize) -> Range<usize> {
        self.agenda
            .take(units, evaluations * self.memory.keyframes.len())
    }

    /// Particles all over the robot, with any radius, as likely as the first keyframe says.
    fn spread(&mut self, step: &Step) {
        let total = self.parameters.hypotheses * FIRST_DRAWS;
        let portion = self.portion(total, 1);
        let (seed, key) = (self.seed, self.key);
        let history = history(step, &self.memory, &self.noise);
        let draw = |index| draw(&history, &mut stream(seed, key, index, Purpose::Spread));
        self.bench
            .particles
            .par_extend(portion.into_par_iter().map(draw));
        if self.agenda.done == total {
            self.renew_particles();
        }
    }

    /// Weighs every particle by what the newest keyframe changed in its evidence.
    fn reweigh(&mut self, step: &Step) {
        let total = self.particles.len();
        let portion = self.portion(total, 1);
        let history = history(step, &self.memory, &self.noise);
        let particles = self.particles[portion].par_iter();
        self.bench
            .particles
            .par_extend(particles.map(|particle| reweighed(particle, &history)));
        if self.agenda.done == total {
            self.renew_particles();
        }
    }

    /// Takes the particles from the bench, resamples them if need be and goes on to the peaks.
    fn renew_particles(&mut self) {
        std::mem::swap(&mut self.particles, &mut self.bench.particles);
        self.bench.particles.clear();
        normalise(
            self.particles.iter().map(|particle| particle.log_weight),
            &mut self.weights,
        );
        self.size_crowd();
        let (count, present) = (self.crowd as f64, self.particles.len() as f64);
        let fits = (1.0 - RESIZE_BEYOND..1.0 + RESIZE_BEYOND).contains(&(present / count));
        let size = effective_sample_size(&self.weights);
        if !fits || size < RESAMPLE_BELOW * present {
            let count = self.crowd;
            let mut random = stream(self.seed, self.key, 0, Purpose::Resample);
            systematic(&self.weights, count, random.random(), &mut self.chosen);
            let child = |&parent: &u32| Hypothesis {
                log_weight: 0.0,
                ..self.particles[parent as usize]
            };
            self.bench.particles.extend(self.chosen.iter().map(child));
            std::mem::swap(&mut self.particles, &mut self.bench.particles);
            self.bench.particles.clear();
        }
        self.agenda.enter(Phase::Climb);
    }

    /// How many particles the posterior asks for: bins are triangles.
    fn size_crowd(&mut self) {
        let bin = |particle: &Hypothesis| (particle.obstacle.link, particle.obstacle.triangle);
        let particles = self
            .particles
            .iter()
            .map(bin)
            .zip(self.weights.iter().copied());
        let PalpateParameters {
            hypotheses,
            min_hypotheses,
            ..
        } = self.parameters;
        let least = 1.0 / hypotheses as f64;
        let bins = crowd::bins(particles, least, &mut self.bench.occupied);
        self.crowd = crowd::enough(bins).clamp(min_hypotheses.min(hypotheses), hypotheses);
    }

    /// Keeps the peaks on top of the evidence, which each keyframe changes.
    fn climb(&mut self, step: &Step) {
        let total = self.peaks.len();
        let portion = self.portion(total, STEP_COST);
        let history = history(step, &self.memory, &self.noise);
        self.peaks[portion]
            .par_iter_mut()
            .for_each(|peak| peak.climb(&history, 1));
        if self.agenda.done == total {
            self.agenda.enter(Phase::Hop);
        }
    }

    /// Basin hopping (Wales and Doye 1997): climbs anew from beside the best peaks and from particles.
    fn hop(&mut self, step: &Step) {
        let portion = self.portion(HOPS, STEP_COST * HOP_CLIMB);
        let history = history(step, &self.memory, &self.noise);
        let hop = |index| {
            let mut peak = Peak::new(self.hop_start(index, &history), &history);
            peak.climb(&history, HOP_CLIMB);
            peak
        };
        let hops: Vec<Peak> = portion.into_par_iter().map(hop).collect();
        self.bench.peaks.extend(hops);
        if self.agenda.done == HOPS {
            self.bench.candidates.clear();
            if scan::is_due(self.keyframes) {
                self.bench.candidates = scan::candidates(&history, self.seed, self.key);
            }
            self.agenda.enter(Phase::Scan(0));
        }
    }

    /// Beside a peak, or a particle, seen as a ball or a bar.
    fn hop_start(&self, index: usize, history: &History) -> Obstacle {
        let mut random = stream(self.seed, self.key, index, Purpose::Hop);
        if index.is_multiple_of(2) && !self.peaks.is_empty() {
            let among = self.peaks.len().min(FAR_HOPS_FROM);
            let peak = &self.peaks[random.random_range(0..among)];
            return history.elsewhere(&peak.obstacle, &mut random);
        }
        let index = index / 2;
        match self.peaks.get(index).filter(|_| index < HOPS_FROM_PEAKS) {
            Some(peak) => {
                let own = peak.obstacle.likeness;
                Obstacle {
                    core: peak.draw(history, &mut random),
                    likeness: match random.random::<bool>() {
                        true => own.other(&mut random),
                        false => own,
                    },
                    ..peak.obstacle
                }
            }
            None => {
                let particle = &self.particles[random.random_range(0..self.particles.len())];
                let turn = std::f64::consts::PI * random.random::<f64>();
                history.reshaped(&particle.obstacle, random.random::<bool>().then_some(turn))
            }
        }
    }

    /// Climbs from the candidates of a scan, if one was due; after each round, the best go on.
    fn scan(&mut self, step: &Step, round: usize) {
        let total = match round {
            0 => self.bench.candidates.len(),
            _ => self.bench.climbs.len(),
        };
        let (_, steps) = scan::ROUNDS[round];
        let portion = self.portion(total, STEP_COST * steps);
        let history = history(step, &self.memory, &self.noise);
        if round == 0 {
            let candidates = self.bench.candidates[portion.clone()].par_iter();
            let begun = candidates.map(|candidate| scan::ball(&history, candidate));
            self.bench.climbs.par_extend(begun);
        }
        let climbs = self.bench.climbs[portion].par_iter_mut();
        climbs.for_each(|peak| peak.climb(&history, steps));
        if self.agenda.done < total {
            return;
        }
        match scan::ROUNDS.get(round + 1) {
            Some(&(most, _)) => {
                keep_best(&mut self.bench.climbs, most);
                self.agenda.enter(Phase::Scan(round + 1));
            }
            None => {
                self.bench.peaks.append(&mut self.bench.climbs);
                self.renew_peaks();
                self.agenda.enter(Phase::Bars);
            }
        }
    }

    /// After a scan, climbs as bars from where the best peaks are.
    fn bars(&mut self, step: &Step) {
        let total = if self.bench.candidates.is_empty() {
            0
        } else {
            scan::BARS.min(self.peaks.len())
        };
        let portion = self.portion(total, STEP_COST * scan::BAR_CLIMB);
        let history = history(step, &self.memory, &self.noise);
        let peaks = self.peaks[portion].par_iter();
        self.bench
            .peaks
            .par_extend(peaks.map(|peak| scan::climb_bar(&history, peak)));
        if self.agenda.done == total {
            self.renew_peaks();
            self.agenda.enter(Phase::Sight);
        }
    }

    fn renew_peaks(&mut self) {
        self.peaks.append(&mut self.bench.peaks);
        keep_best(&mut self.peaks, MOST);
        keep_likely(&mut self.peaks);
    }

    /// Looks at what systematic errors would do to each peak.
    fn sight(&mut self, step: &Step) {
        let total = self.peaks.len();
        let portion = self.portion(total, SIGHT_COST);
        let history = history(step, &self.memory, &self.noise);
        let peaks = self.peaks[portion].par_iter_mut();
        peaks.for_each(|peak| peak.sight = Some(sight::sight(peak, &history)));
        if self.agenda.done == total {
            self.bench.others.clone_from(&self.particles);
            self.agenda.enter(Phase::Move(1));
        }
    }

    /// Moves every particle once.
    fn mutate(&mut self, step: &Step, round: usize) {
        let total = self.particles.len();
        let portion = self.portion(total, 1);
        let first = portion.start + round * total;
        let (seed, key) = (self.seed, self.key);
        let history = history(step, &self.memory, &self.noise);
        let proposals = Proposals::new(history, &self.bench.others, &self.peaks);
        self.particles[portion]
            .par_iter_mut()
            .enumerate()
            .for_each(|(index, particle)| {
                proposals.mutate(
                    particle,
                    &mut stream(seed, key, first + index, Purpose::Propagate),
                );
            });
        if self.agenda.done == total {
            let last = round >= self.parameters.rounds;
            self.agenda.enter(if last {
                Phase::Idle
            } else {
                Phase::Move(round + 1)
            });
        }
    }
}

/// A ball or bar anywhere on the robot, as likely as the history says.
fn draw(history: &History, random: &mut impl Rng) -> Hypothesis {
    let (link, place) = history.skin.sample(random.random());
    let [least, most] = RADIUS_RANGE;
    let radius = least * (most / least).powf(random.random());
    let place = Place {
        link,
        likeness: Likeness::draw(random),
        triangle: place.triangle,
        point: place.point,
        normal: history.skin.surface(link).normal(place.triangle),
    };
    let turn = std::f64::consts::PI * random.random::<f64>();
    let bar = random.random::<bool>().then_some(turn);
    let mut obstacle = history.obstacle_at(&place, radius, bar);
    let evidence = history.evidence(&mut obstacle);
    let log_prior = history.log_prior(&obstacle, radius);
    Hypothesis {
        obstacle,
        evidence,
        log_prior,
        log_weight: evidence.log,
    }
}

/// The particle with its weight changed by what the newest keyframe changed in its evidence.
fn reweighed(particle: &Hypothesis, history: &History) -> Hypothesis {
    let mut obstacle = particle.obstacle;
    let evidence = history.evidence(&mut obstacle);
    Hypothesis {
        log_prior: history.log_prior(&obstacle, evidence.reference),
        log_weight: particle.log_weight + evidence.log - particle.evidence.log,
        obstacle,
        evidence,
    }
}
