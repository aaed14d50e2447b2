//! The estimator of this project: the paper's curvature model with memory.
//!
//! A particle is an obstacle that rests in the world ([`obstacle`]); its weight is the evidence of the contact's whole
//! history ([`memory`], [`evidence`]), with force, stiffness, friction and bias solved and the noise learned
//! ([`noise`]). Peaks of the evidence are found by asking every triangle ([`scan`]) and climbing ([`peaks`]); Markov
//! chain moves ([`moves`]) carry the particles between and around them, so that a wrong mode is left again. The work
//! that a keyframe causes is spread over the samples until the next ([`agenda`]).

mod agenda;
mod chart;
mod evidence;
mod history;
mod memory;
mod moves;
mod noise;
mod obstacle;
mod parameters;
mod peaks;
mod scan;
mod sight;

use nalgebra::Matrix3;
use palpate_model::Robot;
use rand::{Rng, RngExt};
use rayon::prelude::*;

use crate::random::{Purpose, stream};
use crate::resample::{effective_sample_size, normalise, systematic};
use crate::step::Step;
use crate::{Mode, Particle};

use agenda::{Agenda, Phase};
use evidence::Evidence;
pub(crate) use evidence::MOST_JOINTS;
use history::History;
use memory::Memory;
use moves::Proposals;
use noise::Noise;
use obstacle::Obstacle;
pub use parameters::PalpateParameters;
use peaks::Peak;
use scan::Candidate;

/// Draws for each particle at the start.
const FIRST_DRAWS: usize = 8;
/// Climbs from new places at each keyframe, the first of them from beside the best peaks, and the steps of each.
const HOPS: usize = 8;
const HOPS_FROM_PEAKS: usize = 5;
const HOP_CLIMB: usize = 3;
/// Evaluations that one Newton step takes.
const STEP_COST: usize = 14;
/// A keyframe whose mean squared normalised residual exceeds this does not belong to the contact as it was known; so
/// many in a row are a new contact.
const MISFIT: f64 = 16.0;
const MISFITS: usize = 3;

/// One particle: an obstacle and what the history says of it.
#[derive(Clone, Copy, Debug)]
struct Hypothesis {
    obstacle: Obstacle,
    evidence: Evidence,
    log_prior: f64,
    log_weight: f64,
}

/// The filter of this project.
pub(crate) struct PalpateFilter {
    parameters: PalpateParameters,
    seed: u64,
    memory: Memory,
    noise: Noise,
    particles: Vec<Hypothesis>,
    weights: Vec<f64>,
    peaks: Vec<Peak>,
    agenda: Agenda,
    /// What the present phase has made so far, to take effect when it is complete.
    renewed: Vec<Hypothesis>,
    found: Vec<Peak>,
    candidates: Vec<Candidate>,
    others: Vec<Hypothesis>,
    /// Number of the sample that completed the newest keyframe: keys the random streams.
    key: u64,
    /// Keyframes since the contact began, and how many of the last ones did not fit.
    keyframes: usize,
    misfits: usize,
}

impl PalpateFilter {
    pub(crate) fn new(robot: &Robot, parameters: PalpateParameters, seed: u64) -> Self {
        Self {
            parameters,
            seed,
            memory: Memory::new(robot),
            noise: Noise::new(robot.dof()),
            particles: Vec::new(),
            weights: Vec::new(),
            peaks: Vec::new(),
            agenda: Agenda::new(),
            renewed: Vec::new(),
            found: Vec::new(),
            candidates: Vec::new(),
            others: Vec::new(),
            key: 0,
            keyframes: 0,
            misfits: 0,
        }
    }

    /// Forgets the last contact.
    pub(crate) fn begin(&mut self) {
        self.memory.begin();
        self.noise.begin();
        self.forget_places();
    }

    fn forget_places(&mut self) {
        self.particles.clear();
        self.peaks.clear();
        self.agenda.enter(Phase::Idle);
        self.keyframes = 0;
        self.misfits = 0;
    }

    /// One step: remember; when the last keyframe's work is done and the next complete, take that in; work.
    pub(crate) fn step(&mut self, step: &Step, stamp_ns: i64) {
        self.noise.learn(step.torque);
        self.memory.push(stamp_ns, step.position, step.torque);
        if self.agenda.phase == Phase::Idle && self.memory.is_complete() {
            self.memory.commit(step.robot);
            self.take_in_keyframe(step);
        }
        self.agenda.pay(self.memory.period_secs());
        while self.agenda.goes_on() {
            self.work(step);
        }
    }

    /// Judges and calibrates by the new keyframe, and puts the work that it causes on the agenda.
    fn take_in_keyframe(&mut self, step: &Step) {
        self.key = step.number;
        self.keyframes += 1;
        self.noise.sum(&self.memory.keyframes);
        if let Some((obstacle, evidence)) = self.best() {
            let history = history(step, &self.memory, &self.noise);
            if self.noise.misfit(&obstacle, &evidence, &history) > MISFIT {
                self.misfits += 1;
            } else {
                self.misfits = 0;
                let inflation = self.noise.calibrated(&obstacle, &evidence, &history);
                self.noise.inflate(inflation);
            }
        }
        if self.misfits >= MISFITS {
            self.memory.keep_last(MISFITS);
            self.noise.begin();
            self.forget_places();
            self.keyframes = 1;
        }
        self.noise.sum(&self.memory.keyframes);
        self.agenda.enter(if self.particles.is_empty() {
            Phase::Spread
        } else {
            Phase::Reweigh
        });
    }

    /// The hypothesis with the largest evidence.
    fn best(&self) -> Option<(Obstacle, Evidence)> {
        let peaks = self.peaks.iter().map(|peak| (peak.obstacle, peak.evidence));
        let particles = self
            .particles
            .iter()
            .map(|particle| (particle.obstacle, particle.evidence));
        peaks
            .chain(particles)
            .max_by(|a, b| a.1.log.total_cmp(&b.1.log))
    }

    /// Does a portion of the present phase, and what completes it if that was the last.
    fn work(&mut self, step: &Step) {
        let history = history(step, &self.memory, &self.noise);
        let looks = self.memory.keyframes.len();
        let count = self.particles.len();
        let (seed, key) = (self.seed, self.key);
        match self.agenda.phase {
            Phase::Idle => {}
            Phase::Spread => {
                let total = self.parameters.hypotheses * FIRST_DRAWS;
                let portion = self.agenda.take(total, looks);
                let draw = |index| draw(&history, &mut stream(seed, key, index, Purpose::Spread));
                self.renewed.par_extend(portion.into_par_iter().map(draw));
                if self.agenda.done == total {
                    self.particles = std::mem::take(&mut self.renewed);
                    self.resample();
                    self.agenda.enter(Phase::Climb);
                }
            }
            Phase::Reweigh => {
                let portion = self.agenda.take(count, looks);
                let particles = &self.particles[portion];
                self.renewed.par_extend(
                    particles
                        .par_iter()
                        .map(|particle| reweighed(particle, &history)),
                );
                if self.agenda.done == count {
                    std::mem::swap(&mut self.particles, &mut self.renewed);
                    self.renewed.clear();
                    self.resample();
                    self.agenda.enter(Phase::Climb);
                }
            }
            Phase::Climb => {
                let total = self.peaks.len();
                let portion = self.agenda.take(total, looks * STEP_COST);
                self.peaks[portion]
                    .par_iter_mut()
                    .for_each(|peak| peak.climb(&history, 1));
                if self.agenda.done == total {
                    self.agenda.enter(Phase::Hop);
                }
            }
            Phase::Hop => {
                let portion = self.agenda.take(HOPS, looks * STEP_COST * HOP_CLIMB);
                let hops: Vec<Peak> = portion
                    .into_par_iter()
                    .map(|index| self.hop(index, &history))
                    .collect();
                self.found.extend(hops);
                if self.agenda.done == HOPS {
                    self.candidates.clear();
                    if scan::is_due(self.keyframes) {
                        self.candidates = scan::candidates(&history, seed, key);
                    }
                    self.agenda.enter(Phase::Scan);
                }
            }
            Phase::Scan => {
                let total = self.candidates.len();
                let portion = self.agenda.take(total, looks * STEP_COST * scan::CLIMB);
                let candidates = &self.candidates[portion];
                self.found.par_extend(
                    candidates
                        .par_iter()
                        .map(|candidate| scan::climb_ball(&history, candidate)),
                );
                if self.agenda.done == total {
                    self.peaks.append(&mut self.found);
                    peaks::keep_best(&mut self.peaks);
                    self.agenda.enter(Phase::Bars);
                }
            }
            Phase::Bars => {
                let total = if self.candidates.is_empty() {
                    0
                } else {
                    scan::BARS.min(self.peaks.len())
                };
                let portion = self.agenda.take(total, looks * STEP_COST * scan::CLIMB);
                let balls = &self.peaks[portion];
                self.found
                    .par_extend(balls.par_iter().map(|ball| scan::climb_bar(&history, ball)));
                if self.agenda.done == total {
                    self.peaks.append(&mut self.found);
                    peaks::keep_best(&mut self.peaks);
                    self.agenda.enter(Phase::Sight);
                }
            }
            Phase::Sight => {
                let total = self.peaks.len();
                let portion = self.agenda.take(total, looks * 7);
                self.peaks[portion]
                    .par_iter_mut()
                    .for_each(|peak| peak.sight = Some(sight::sight(peak, &history)));
                if self.agenda.done == total {
                    self.others.clone_from(&self.particles);
                    self.agenda.enter(Phase::Move(1));
                }
            }
            Phase::Move(round) => {
                let portion = self.agenda.take(count, looks);
                let first = portion.start;
                let proposals = Proposals::new(history, &self.others, &self.peaks);
                self.particles[portion]
                    .par_iter_mut()
                    .enumerate()
                    .for_each(|(index, particle)| {
                        let index = first + index + round * count;
                        proposals
                            .mutate(particle, &mut stream(seed, key, index, Purpose::Propagate));
                    });
                if self.agenda.done == count {
                    let last = round >= self.parameters.rounds;
                    self.agenda.enter(if last {
                        Phase::Idle
                    } else {
                        Phase::Move(round + 1)
                    });
                }
            }
        }
    }

    fn resample(&mut self) {
        let count = self.parameters.hypotheses;
        normalise(
            self.particles.iter().map(|particle| particle.log_weight),
            &mut self.weights,
        );
        if self.particles.len() == count
            && effective_sample_size(&self.weights) > 0.5 * count as f64
        {
            return;
        }
        let mut random = stream(self.seed, self.key, 0, Purpose::Resample);
        let mut chosen = Vec::new();
        systematic(&self.weights, count, random.random(), &mut chosen);
        self.particles = (chosen.iter())
            .map(|&parent| Hypothesis {
                log_weight: 0.0,
                ..self.particles[parent as usize]
            })
            .collect();
    }

    /// Basin hopping (Wales and Doye 1997): climbs anew from beside the best peaks, and from particles, seen as balls
    /// and bars in turn.
    fn hop(&self, index: usize, history: &History) -> Peak {
        let mut random = stream(self.seed, self.key, index, Purpose::Hop);
        let start = match self.peaks.get(index).filter(|_| index < HOPS_FROM_PEAKS) {
            Some(peak) => Obstacle {
                core: peak.draw(history, &mut random),
                ..peak.obstacle
            },
            None => {
                let particle = &self.particles[random.random_range(0..self.particles.len())];
                let turn = std::f64::consts::PI * random.random::<f64>();
                history.reshaped(&particle.obstacle, random.random::<bool>().then_some(turn))
            }
        };
        let mut peak = Peak::new(start, history);
        peak.climb(history, HOP_CLIMB);
        peak
    }

    /// Adds to the modes' covariances what particles cannot show: the errors that systematically wrong torques cause.
    pub(crate) fn widen(&self, step: &Step, modes: &mut [Mode]) {
        for mode in modes {
            let apart = |peak: &&Peak| (peak.touch.point - mode.point_in_link).norm();
            let seen =
                |peak: &&Peak| peak.obstacle.link as usize == mode.link && peak.sight.is_some();
            let nearest =
                (self.peaks.iter().filter(seen)).min_by(|a, b| apart(a).total_cmp(&apart(b)));
            let unseen = Matrix3::identity() * sight::UNSEEN;
            let sight = nearest.and_then(|peak| peak.sight).unwrap_or(unseen);
            let rotation = step
                .now
                .root_from_link(mode.link)
                .rotation
                .to_rotation_matrix();
            mode.covariance_in_root += rotation * sight * rotation.transpose();
        }
    }

    /// Writes the particles, with their weights, as the outside sees them at this sample.
    pub(crate) fn show(&mut self, step: &Step, cloud: &mut Vec<Particle>) {
        if self.particles.is_empty() {
            return;
        }
        normalise(
            self.particles.iter().map(|particle| particle.log_weight),
            &mut self.weights,
        );
        cloud.extend(
            self.particles
                .iter()
                .zip(&self.weights)
                .map(|(particle, &weight)| {
                    let link = particle.obstacle.link as usize;
                    let link_from_root = step.now.root_from_link(link).inverse();
                    let touch = particle.obstacle.touch(step.skin, &link_from_root);
                    Particle {
                        link,
                        point_in_link: touch.point,
                        normal_in_link: touch.normal,
                        force: particle.evidence.force_at(touch.distance),
                        stiffness: particle.evidence.stiffness.max(0.0),
                        weight,
                    }
                }),
        );
    }
}

fn history<'a>(step: &Step<'a>, memory: &'a Memory, noise: &'a Noise) -> History<'a> {
    History {
        robot: step.robot,
        skin: step.skin,
        keyframes: &memory.keyframes,
        noise,
    }
}

/// A ball or bar anywhere on the robot, as likely as the history says.
fn draw(history: &History, random: &mut impl Rng) -> Hypothesis {
    let (link, place) = history.skin.sample(random.random());
    let [least, most] = obstacle::RADIUS_RANGE;
    let radius = least * (most / least).powf(random.random());
    let normal = history.skin.surface(link).normal(place.triangle);
    let turn = std::f64::consts::PI * random.random::<f64>();
    let bar = random.random::<bool>().then_some(turn);
    let mut obstacle =
        history.obstacle_on(link, place.triangle, &place.point, &normal, radius, bar);
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
