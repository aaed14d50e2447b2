//! Markov chain moves that leave the posterior as it is (Metropolis and Hastings).

use nalgebra::{Point3, Unit, Vector3};
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

use super::Hypothesis;
use super::chart::tangential;
use super::history::History;
use super::likeness::Likeness;
use super::obstacle::{Core, Obstacle, Spot};
use super::peaks::Peak;

/// How far a slide goes, m, and how far a radial move on the logarithm of the radius.
const SLIDES: [f64; 4] = [2e-4, 1e-3, 5e-3, 2e-2];
const RADIAL: [f64; 3] = [0.02, 0.1, 0.5];

/// Share of the prior in the density that jumps are drawn from.
const PRIOR_SHARE: f64 = 0.05;

/// What the moves draw on besides the particle itself.
pub(super) struct Proposals<'a> {
    history: History<'a>,
    others: &'a [Hypothesis],
    /// Indices of the others by [`kind`].
    akin: Vec<Vec<u32>>,
    peaks: &'a [Peak],
    /// Share of the draws that each peak has; they sum to one.
    shares: Vec<f64>,
}

impl<'a> Proposals<'a> {
    pub(super) fn new(history: History<'a>, others: &'a [Hypothesis], peaks: &'a [Peak]) -> Self {
        let mut akin = vec![Vec::new(); 4 * Likeness::ALL.len() * history.robot.links.len()];
        for (index, other) in others.iter().enumerate() {
            akin[kind(&other.obstacle)].push(index as u32);
        }
        let top = peaks
            .iter()
            .map(|peak| peak.log_mass)
            .fold(f64::NEG_INFINITY, f64::max);
        // Tempered, and with something for each, so that every peak is tried.
        let share = |peak: &Peak| 0.2 / peaks.len() as f64 + (0.5 * (peak.log_mass - top)).exp();
        let total: f64 = peaks.iter().map(share).sum();
        let shares = peaks.iter().map(|peak| share(peak) / total).collect();
        Self {
            history,
            others,
            akin,
            peaks,
            shares,
        }
    }

    /// Makes one move of a kind chosen at random.
    pub(super) fn mutate(&self, particle: &mut Hypothesis, random: &mut impl Rng) {
        match random.random::<f64>() {
            r if r < 0.3 => self.jump(particle, random),
            r if r < 0.55 => self.wander(particle, random),
            r if r < 0.75 => self.differ(particle, random),
            r if r < 0.8 => self.breathe(particle, random),
            r if r < 0.85 => self.liken(particle, random),
            _ => self.slide(particle, random),
        }
    }

    /// Accepts or refuses a proposed core. `log_proposal` is the log of the proposal density back over that forth.
    fn decide(
        &self,
        particle: &mut Hypothesis,
        mut obstacle: Obstacle,
        log_proposal: f64,
        random: &mut impl Rng,
    ) {
        let evidence = self.history.evidence(&mut obstacle);
        let log_prior = self.history.log_prior(&obstacle, evidence.reference);
        let log_ratio =
            evidence.log - particle.evidence.log + log_prior - particle.log_prior + log_proposal;
        if random.random::<f64>().ln() < log_ratio {
            *particle = Hypothesis {
                obstacle,
                evidence,
                log_prior,
                spot: Spot::CENTRE,
                ..*particle
            };
        }
    }

    fn pick_peak(&self, random: &mut impl Rng) -> Option<&Peak> {
        let mut wanted = random.random::<f64>();
        self.peaks
            .iter()
            .zip(&self.shares)
            .find_map(|(peak, share)| {
                wanted -= share;
                (wanted <= 0.0).then_some(peak)
            })
    }

    /// An independent draw from the peaks, on whatever link and of whatever kind: how particles change modes.
    fn jump(&self, particle: &mut Hypothesis, random: &mut impl Rng) {
        let Some(peak) = self.pick_peak(random) else {
            return;
        };
        let core = peak.draw(&self.history, random);
        let obstacle = Obstacle {
            core,
            ..peak.obstacle
        };
        // As if a small share came from the prior: else a particle away from all peaks could hardly leave its place.
        let log_density = |obstacle: &Obstacle, log_prior: f64| {
            let akin = self
                .peaks
                .iter()
                .zip(&self.shares)
                .filter(|(peak, _)| peak.is_akin(obstacle));
            let terms: f64 = akin
                .map(|(peak, share)| share * peak.log_density(&obstacle.core).exp())
                .sum();
            (terms + PRIOR_SHARE * log_prior.exp())
                .max(f64::MIN_POSITIVE)
                .ln()
        };
        let touch = self.history.newest_touch(&obstacle);
        let log_prior = self.history.log_prior(&obstacle, touch.distance);
        let back = log_density(&particle.obstacle, particle.log_prior);
        let back_over_forth = back - log_density(&obstacle, log_prior);
        self.decide(particle, obstacle, back_over_forth, random);
    }

    /// A random walk with the shape of a peak's Gaussian.
    fn wander(&self, particle: &mut Hypothesis, random: &mut impl Rng) {
        let Some(peak) = self.pick_peak(random) else {
            return;
        };
        if !peak.is_akin(&particle.obstacle) {
            return;
        }
        let Some((x, log_volume)) = peak.coordinates(&particle.obstacle.core) else {
            return;
        };
        let deviations = [0.1, 0.4, 1.2][random.random_range(0..3)];
        let core = peak.displaced(&x, deviations, &self.history, random);
        let Some((_, new_log_volume)) = peak.coordinates(&core) else {
            return;
        };
        let obstacle = Obstacle {
            core,
            ..particle.obstacle
        };
        self.decide(particle, obstacle, new_log_volume - log_volume, random);
    }

    /// Differential evolution: along the difference of two others (ter Braak 2006).
    fn differ(&self, particle: &mut Hypothesis, random: &mut impl Rng) {
        let akin = &self.akin[kind(&particle.obstacle)];
        if akin.len() < 8 {
            return;
        }
        let mut pick = || {
            self.others[akin[random.random_range(0..akin.len())] as usize]
                .obstacle
                .core
        };
        let (one, other) = (pick(), pick());
        // γ = 2.38 / √(2 d) or less, now and then 1 to jump between modes.
        let gamma = match random.random::<f64>() < 0.1 {
            true => 1.0,
            false => 0.97 * random.random::<f64>().sqrt(),
        };
        let core = particle.obstacle.core;
        let centre = core.centre + (one.centre - other.centre) * gamma + gauss(random) * 1e-5;
        let axis = core
            .axis
            .zip(one.axis)
            .zip(other.axis)
            .map(|((own, one), other)| {
                let sign = if one.dot(&other) < 0.0 { -1.0 } else { 1.0 };
                let turned =
                    own.into_inner() + (one.into_inner() - other.into_inner() * sign) * gamma;
                Unit::new_normalize(turned)
            });
        let drift = core
            .drift
            .zip(one.drift)
            .zip(other.drift)
            .map(|((own, one), other)| own + (one - other) * gamma);
        let obstacle = Obstacle {
            core: Core {
                centre,
                axis,
                drift,
            },
            ..particle.obstacle
        };
        self.decide(particle, obstacle, 0.0, random);
    }

    /// Changes the radius only: the contact stays.
    fn breathe(&self, particle: &mut Hypothesis, random: &mut impl Rng) {
        let change =
            random.sample::<f64, _>(StandardNormal) * RADIAL[random.random_range(0..RADIAL.len())];
        let touch = self.history.newest_touch(&particle.obstacle);
        let root_from_link = self
            .history
            .newest_link_from_root(particle.obstacle.link)
            .inverse();
        let foot = root_from_link * touch.point;
        let core = particle.obstacle.core;
        let obstacle = Obstacle {
            core: Core {
                centre: foot + (core.centre - foot) * change.exp(),
                ..core
            },
            ..particle.obstacle
        };
        // Uniform in the logarithm of the radius, as the prior is: the densities in space undo the priors.
        let distance = touch.distance;
        let log_prior = |distance: f64| self.history.log_prior(&obstacle, distance);
        let back_over_forth = log_prior(distance) - log_prior(distance * change.exp());
        self.decide(particle, obstacle, back_over_forth, random);
    }

    /// Takes the link for something else.
    fn liken(&self, particle: &mut Hypothesis, random: &mut impl Rng) {
        let obstacle = Obstacle {
            likeness: particle.obstacle.likeness.other(random),
            ..particle.obstacle
        };
        self.decide(particle, obstacle, 0.0, random);
    }

    /// Slides along the surface, the farther the larger the radius; a bar turns as well.
    fn slide(&self, particle: &mut Hypothesis, random: &mut impl Rng) {
        let touch = self.history.newest_touch(&particle.obstacle);
        let root_from_link = self
            .history
            .newest_link_from_root(particle.obstacle.link)
            .inverse();
        let normal = root_from_link.rotation * touch.normal;
        let size = SLIDES[random.random_range(0..SLIDES.len())];
        let way = gauss(random);
        let sideways = way - normal.into_inner() * way.dot(&normal);
        let core = particle.obstacle.core;
        let spread = 1.0 + touch.distance.abs() / super::obstacle::LINK_RADIUS;
        let centre: Point3<f64> = core.centre + sideways * (size * spread);
        let turn = random.sample::<f64, _>(StandardNormal) * size * 20.0;
        let axis = core.axis.map(|axis| tangential(&axis, &normal, turn));
        let obstacle = Obstacle {
            core: Core {
                centre,
                axis,
                ..core
            },
            ..particle.obstacle
        };
        self.decide(particle, obstacle, 0.0, random);
    }
}

fn kind(obstacle: &Obstacle) -> usize {
    let is_bar = usize::from(obstacle.core.axis.is_some());
    let drifts = usize::from(obstacle.core.drift.is_some());
    let likeness = obstacle.link as usize * Likeness::ALL.len() + obstacle.likeness as usize;
    likeness * 4 + 2 * is_bar + drifts
}

fn gauss(random: &mut impl Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| random.sample::<f64, _>(StandardNormal))
}
