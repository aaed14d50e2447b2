//! The estimator of this project: the paper's curvature model with memory.
//!
//! A particle is an obstacle that rests in the world or drifts ([`obstacle`]); its weight is the evidence of the contact's
//! whole history ([`memory`], [`evidence`]), with force, stiffness, friction and bias solved and the noise learned
//! ([`noise`]). Peaks of the evidence are found by asking every triangle ([`scan`]) and climbing ([`search`],
//! [`facets`]); Markov chain moves ([`moves`]) carry the particles between and around them, so that a wrong mode is left
//! again. The work that a keyframe causes is spread over the samples until the next ([`agenda`]).

mod agenda;
mod chart;
mod crowd;
mod evidence;
mod facets;
mod history;
mod likeness;
mod memory;
mod moves;
mod noise;
mod obstacle;
mod parameters;
mod peaks;
mod scan;
mod search;
mod sight;
mod sums;
mod work;

use nalgebra::Matrix3;
use palpate_model::Robot;

use crate::resample::normalise;
use crate::step::Step;
use crate::{Mode, Particle};

use agenda::{Agenda, Phase};
use evidence::Evidence;
pub(crate) use evidence::MOST_JOINTS;
use history::History;
use memory::Memory;
use noise::Noise;
use obstacle::{Obstacle, Spot, touch};
pub use parameters::PalpateParameters;
use peaks::Peak;
use work::Workbench;

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
    /// Where on a bar the contact was when last shown.
    spot: Spot,
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
    bench: Workbench,
    chosen: Vec<u32>,
    /// Number of particles that the posterior asks for.
    crowd: usize,
    /// Number of the sample that completed the newest keyframe: keys the random streams.
    key: u64,
    /// Keyframes since the contact began, and how many of the last ones did not fit.
    keyframes: usize,
    misfits: usize,
}

impl PalpateFilter {
    pub(crate) fn new(robot: &Robot, parameters: PalpateParameters, seed: u64) -> Self {
        Self {
            seed,
            memory: Memory::new(robot),
            noise: Noise::new(robot.dof()),
            particles: Vec::new(),
            weights: Vec::new(),
            peaks: Vec::new(),
            crowd: parameters.hypotheses,
            agenda: Agenda::new(),
            bench: Workbench::default(),
            chosen: Vec::new(),
            key: 0,
            keyframes: 0,
            misfits: 0,
            parameters,
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
        self.bench.clear();
        self.agenda.enter(Phase::Idle);
        self.keyframes = 0;
        self.misfits = 0;
        self.crowd = self.parameters.hypotheses;
    }

    /// One step: remember; when the last keyframe's work is done and the next complete, take that in; work.
    pub(crate) fn step(&mut self, step: &Step, stamp_ns: i64) {
        self.noise.learn(step.torque);
        self.memory.push(stamp_ns, step.position, step.torque);
        if self.agenda.phase == Phase::Idle && self.memory.is_complete() {
            let past_secs = self.memory.newest_secs();
            self.memory.commit(step.robot);
            self.drift_on(self.memory.newest_secs() - past_secs);
            self.take_in_keyframe(step);
        }
        self.agenda.pay(self.memory.period_secs());
        while self.agenda.goes_on() {
            self.work(step);
        }
    }

    /// Carries what drifts on to the newest keyframe.
    fn drift_on(&mut self, secs: f64) {
        let particles = self.particles.iter_mut().map(|one| &mut one.obstacle);
        let peaks = self.peaks.iter_mut().map(|peak| &mut peak.obstacle);
        for obstacle in particles.chain(peaks) {
            obstacle.core = obstacle.core.after(secs);
        }
    }

    /// Judges by the new keyframe, and puts the work that it causes on the agenda.
    fn take_in_keyframe(&mut self, step: &Step) {
        self.key = step.number;
        self.keyframes += 1;
        self.noise.know_biases(step.bias);
        self.noise.sum(&self.memory.keyframes);
        if let Some((obstacle, evidence)) = self.best() {
            let history = history(step, &self.memory, &self.noise);
            if self.noise.misfit(&obstacle, &evidence, &history) > MISFIT {
                self.misfits += 1;
            } else {
                self.misfits = 0;
            }
        }
        if self.misfits >= MISFITS {
            self.memory.keep_last(MISFITS);
            self.noise.begin();
            self.forget_places();
            self.keyframes = 1;
            self.noise.sum(&self.memory.keyframes);
        }
        self.agenda.enter(match self.misfits {
            0 => Phase::Calibrate,
            _ => self.weighing(),
        });
    }

    /// The phase in which the particles take the newest keyframe in.
    fn weighing(&self) -> Phase {
        match self.particles.is_empty() {
            true => Phase::Spread,
            false => Phase::Reweigh,
        }
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
        let since_secs = self.memory.since_newest_secs();
        cloud.extend(
            self.particles
                .iter_mut()
                .zip(&self.weights)
                .map(|(particle, &weight)| {
                    let link = particle.obstacle.link as usize;
                    let link_from_root = step.now.root_from_link(link).inverse();
                    let core = particle.obstacle.core.after(since_secs);
                    let touch = touch(
                        &particle.obstacle.shape(step.skin),
                        &core.moved(&link_from_root),
                        particle.obstacle.triangle,
                        particle.spot,
                    );
                    particle.spot = touch.spot;
                    Particle {
                        link,
                        point_in_link: touch.point,
                        triangle: touch.triangle,
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
