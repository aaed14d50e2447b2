//! Markov chain moves that leave the posterior as it is.

use nalgebra::Vector3;
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

use super::Hypothesis;
use super::memory::Keyframe;
use super::noise::Noise;
use super::peaks::Peak;
use super::obstacle::{log_prior, touch};
use crate::step::Step;

/// Indices of the particles on each link.
pub(super) fn by_link(particles: &[Hypothesis], links: usize) -> Vec<Vec<u32>> {
    let mut lists = vec![Vec::new(); links];
    for (index, particle) in particles.iter().enumerate() {
        lists[particle.obstacle.link as usize].push(index as u32);
    }
    lists
}

#[allow(clippy::too_many_arguments)]
pub(super) fn mutate(
    particle: &mut Hypothesis,
    temperature: f64,
    others: &[Hypothesis],
    by_link: &[Vec<u32>],
    peaks: &[Peak],
    step: &Step,
    keyframes: &[Keyframe],
    noise: &Noise,
    random: &mut impl Rng,
) {
    if !peaks.is_empty() && random.random::<f64>() < 0.3 {
        jump(particle, temperature, peaks, step, keyframes, noise, random);
        return;
    }
    let link = particle.obstacle.link as usize;
    let surface = step.skin.surface(link);
    let newest = &keyframes[keyframes.len() - 1].links[link];
    let centre = newest.link_from_root * particle.obstacle.centre;
    let here = touch(surface, &centre, Some(particle.obstacle.triangle));
    let mut normal = || random.sample::<f64, _>(StandardNormal);
    let gauss = Vector3::new(normal(), normal(), normal());
    let radial_gauss = normal();
    let kind: f64 = random.random();
    let mut radial = 0.0;
    let proposed = if kind < 0.5 && by_link[link].len() > 8 {
        let list = &by_link[link];
        let mut pick = || others[list[random.random_range(0..list.len())] as usize].obstacle.centre;
        let (a, b) = (pick(), pick());
        // Ter Braak 2006: γ = 2.38 / √(2 d), now and then 1 to jump between modes.
        let gamma = if random.random::<f64>() < 0.1 { 1.0 } else { 0.97 * random.random::<f64>().sqrt() };
        centre + newest.link_from_root.rotation * ((a - b) * gamma) + gauss * 1e-5
    } else if kind < 0.7 {
        radial = radial_gauss * [0.02, 0.1, 0.5][random.random_range(0..3)];
        here.point + (centre - here.point) * f64::exp(radial)
    } else {
        // Slide on the surface: sideways in proportion to the distance from the link's own axis.
        let size = [2e-4, 1e-3, 5e-3, 2e-2][random.random_range(0..4)];
        let sideways = gauss - here.normal.into_inner() * gauss.dot(&here.normal);
        centre + sideways * (size * (1.0 + here.distance.abs() / 0.07))
    };
    let mut obstacle = particle.obstacle;
    let start = if (proposed - centre).norm() < 0.01 { Some(here.triangle) } else { None };
    let there = touch(surface, &proposed, start);
    let prior = log_prior(there.distance);
    if prior == f64::NEG_INFINITY {
        return;
    }
    obstacle.centre = newest.link_from_root.inverse_transform_point(&proposed);
    obstacle.triangle = there.triangle;
    let evidence = obstacle.evidence(step.robot, step.skin, keyframes, noise);
    // The radial move keeps (p, log r) uniform, which the prior is: only the evidence decides.
    let priors = if radial != 0.0 { 0.0 } else { prior - log_prior(here.distance) };
    let log_ratio = temperature * (evidence.log - particle.evidence.log) + priors;
    if random.random::<f64>().ln() < log_ratio {
        particle.obstacle = obstacle;
        particle.evidence = evidence;
        particle.log_prior = prior;
    }
}

/// An independent draw from the Laplace approximations of all peaks, on whatever link: how particles change modes.
fn jump(
    particle: &mut Hypothesis,
    temperature: f64,
    peaks: &[Peak],
    step: &Step,
    keyframes: &[Keyframe],
    noise: &Noise,
    random: &mut impl Rng,
) {
    let top = peaks.iter().map(|peak| peak.log_mass).fold(f64::NEG_INFINITY, f64::max);
    // Tempered, and with a share for each, so that every peak is tried.
    let share = |peak: &Peak| 0.2 / peaks.len() as f64 + (0.5 * (peak.log_mass - top)).exp();
    let total: f64 = peaks.iter().map(share).sum();
    let mut wanted = random.random::<f64>() * total;
    let chosen = peaks.iter().find(|peak| {
        wanted -= share(peak);
        wanted <= 0.0
    });
    let Some(peak) = chosen else { return };
    let Some(centre) = peak.draw(random) else { return };
    let log_density = |link: u16, centre: &nalgebra::Point3<f64>| {
        let on_link = peaks.iter().filter(|peak| peak.obstacle.link == link);
        let terms: f64 = on_link.map(|peak| share(peak) * peak.log_density(centre).exp()).sum();
        terms.max(1e-300).ln()
    };
    let link = peak.obstacle.link;
    let view = &keyframes[keyframes.len() - 1].links[link as usize];
    let there = touch(step.skin.surface(link as usize), &(view.link_from_root * centre), Some(peak.obstacle.triangle));
    let prior = log_prior(there.distance);
    if prior == f64::NEG_INFINITY {
        return;
    }
    let mut obstacle = crate::palpate::obstacle::Obstacle { link, triangle: there.triangle, centre };
    let evidence = obstacle.evidence(step.robot, step.skin, keyframes, noise);
    let forth = log_density(link, &centre);
    let back = log_density(particle.obstacle.link, &particle.obstacle.centre);
    let log_ratio = temperature * (evidence.log - particle.evidence.log) + prior - particle.log_prior + back - forth;
    if random.random::<f64>().ln() < log_ratio {
        particle.obstacle = obstacle;
        particle.evidence = evidence;
        particle.log_prior = prior;
    }
}
