//! The work that a keyframe causes, phase by phase, in portions that the agenda allows.

use std::ops::Range;

use rand::{Rng, RngExt};
use rayon::prelude::*;

use super::agenda::Phase;
use super::history::{History, Place};
use super::likeness::Likeness;
use super::moves::Proposals;
use super::noise::Calibration;
use super::obstacle::{RADIUS_RANGE, Spot};
use super::peaks::{Peak, step_cost};
use super::scan::Candidate;
use super::{Hypothesis, PalpateFilter, PalpateParameters, crowd, history, sight};
use crate::random::{Purpose, stream};
use crate::resample::{effective_sample_size, normalise, systematic};
use crate::step::Step;

/// Draws for each particle at the start.
const FIRST_DRAWS: usize = 8;
/// Share of the particles below which their effective number may fall.
const RESAMPLE_BELOW: f64 = 0.5;
/// By this share their number may differ from what is asked for.
const RESIZE_BEYOND: f64 = 0.25;
/// What solving for force, stiffness, friction and bias costs beside the looks at the keyframes, in such looks.
const SOLVING: usize = 3;
/// Evaluations that a look at the systematic errors takes.
const SIGHT_COST: usize = 7;

/// Evaluations that it takes to see how loud the noise is by a peak.
const CALIBRATION_COST: usize = 3;

/// What the present phase has made so far, to take effect when it is complete, and what later phases start from.
#[derive(Default)]
pub(super) struct Workbench {
    particles: Vec<Hypothesis>,
    /// Climbs that go on,
    pub(super) climbs: Vec<Peak>,
    /// and where a scan begins some.
    pub(super) candidates: Vec<Candidate>,
    /// Bins of the particles, with weights.
    occupied: Vec<((u16, u32), f64)>,
    /// The particles as they were before the moves.
    others: Vec<Hypothesis>,
    /// What the noise is by each peak.
    calibrations: Vec<Calibration>,
}

impl Workbench {
    pub(super) fn clear(&mut self) {
        self.particles.clear();
        self.candidates.clear();
        self.climbs.clear();
        self.calibrations.clear();
    }
}

impl PalpateFilter {
    /// Does a portion of the present phase, and what completes it if that was the last.
    pub(super) fn work(&mut self, step: &Step) {
        match self.agenda.phase {
            Phase::Idle => {}
            Phase::Calibrate => self.calibrate(step),
            Phase::Spread => self.spread(step),
            Phase::Reweigh => self.reweigh(step),
            Phase::Climb => self.climb(step),
            Phase::Hop(round) => self.hop(step, round),
            Phase::Ask => self.ask(step),
            Phase::Screen => self.screen(step),
            Phase::Scan(round) => self.scan(step, round),
            Phase::Facets(round) => self.facets(step, round),
            Phase::Bars(round) => self.bars(step, round),
            Phase::Drifts(round) => self.drifts(step, round),
            Phase::Sight => self.sight(step),
            Phase::Move(round) => self.mutate(step, round),
        }
    }

    /// The next portion of `units` that take `evaluations` of the whole history each.
    pub(super) fn portion(&mut self, units: usize, evaluations: usize) -> Range<usize> {
        self.agenda
            .take(units, evaluations * (self.memory.keyframes.len() + SOLVING))
    }

    /// Sees how loud the noise is by each peak, and goes by the one that is best with its own.
    fn calibrate(&mut self, step: &Step) {
        let total = self.peaks.len();
        let portion = self.portion(total, CALIBRATION_COST);
        let history = history(step, &self.memory, &self.noise);
        let calibration = |peak: &Peak| {
            let mut calibration = self.noise.calibration(peak.obstacle, &history);
            // The peak's width counts as it does for its mass.
            calibration.log += peak.log_mass - peak.evidence.log;
            calibration
        };
        let calibrations = self.peaks[portion].par_iter().map(calibration);
        self.bench.calibrations.par_extend(calibrations);
        if self.agenda.done < total {
            return;
        }
        let best = (self.bench.calibrations.iter()).max_by(|a, b| a.log.total_cmp(&b.log));
        if let Some(best) = best {
            self.noise.inflate(&best.inflation, &self.memory.keyframes);
        }
        self.bench.calibrations.clear();
        self.agenda.enter(self.weighing());
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
        let portion = self.portion(total, step_cost(&self.peaks));
        let history = history(step, &self.memory, &self.noise);
        self.peaks[portion].par_iter_mut().for_each(|peak| {
            peak.refresh(&history);
            peak.step(&history);
        });
        if self.agenda.done == total {
            self.agenda.enter(Phase::Hop(0));
        }
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
        spot: Spot::CENTRE,
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
        spot: Spot::CENTRE,
    }
}
