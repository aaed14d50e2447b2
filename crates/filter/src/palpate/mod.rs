//! The estimator of this project: the paper's curvature model with memory.
//!
//! A particle is an obstacle that rests in the world ([`obstacle`]); its weight is the evidence of the contact's whole
//! history ([`memory`], [`evidence`]), with force, stiffness, friction and bias solved. Particles at several
//! temperatures search and exchange places ([`moves`]), so that a wrong mode is left again (Neal 2001, annealed
//! importance sampling; Ter Braak 2006, differential evolution; Geyer 1991, parallel tempering).

mod evidence;
mod memory;
mod moves;
mod noise;
mod obstacle;
mod peaks;
mod scan;

use rand::{Rng, RngExt};
use rayon::prelude::*;

use crate::Particle;
use crate::random::{Purpose, stream};
use crate::resample::{effective_sample_size, normalise, systematic};
use crate::step::Step;

use evidence::Evidence;
use memory::Memory;
use noise::Noise;
use obstacle::{Obstacle, log_prior, touch};
use peaks::Peak;
use scan::{Candidate, scan};

/// Inverse temperatures: the first are the particles themselves, the others scouts.
const TEMPERATURES: [f64; 2] = [1.0, 0.1];
/// Keyframes, counted from the contact's begin, after which peaks are looked for anew; then every tenth.
const SCANS: [usize; 8] = [1, 2, 3, 5, 7, 10, 14, 19];
/// Most peaks kept.
const MOST_PEAKS: usize = 12;
/// Candidates of each link that a scan climbs from.
const CANDIDATES: usize = 6;
/// Radii that a climb may start with, m.
const FIRST_RADII: [f64; 3] = [0.006, 0.04, 0.25];
/// Rounds of moves at each keyframe.
const ROUNDS: usize = 3;

/// One particle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hypothesis {
    obstacle: Obstacle,
    evidence: Evidence,
    log_prior: f64,
    log_weight: f64,
}

pub(crate) struct PalpateFilter {
    seed: u64,
    memory: Memory,
    noise: Noise,
    /// One population a temperature.
    populations: Vec<Vec<Hypothesis>>,
    count: usize,
    cloud_weights: Vec<f64>,
    peaks: Vec<Peak>,
    keyframes_seen: usize,
}

impl PalpateFilter {
    pub(crate) fn new(robot: &palpate_model::Robot, count: usize, seed: u64) -> Self {
        Self {
            seed,
            memory: Memory::new(robot),
            noise: Noise::new(robot.dof()),
            populations: vec![Vec::new(); TEMPERATURES.len()],
            count,
            cloud_weights: Vec::new(),
            peaks: Vec::new(),
            keyframes_seen: 0,
        }
    }

    pub(crate) fn begin(&mut self, stamp_ns: i64) {
        self.memory.begin(stamp_ns);
        self.noise.begin();
        self.populations.iter_mut().for_each(Vec::clear);
        self.peaks.clear();
        self.keyframes_seen = 0;
    }

    pub(crate) fn step(&mut self, step: &Step, stamp_ns: i64) {
        self.noise.learn(step.torque);
        if self.memory.push(step.robot, stamp_ns, step.position, step.torque) {
            self.calibrate(step);
            self.noise.sum(&self.memory.keyframes);
            self.keyframes_seen += 1;
            if self.populations[0].is_empty() {
                self.spread(step);
            } else {
                self.reweigh(step);
            }
            self.seek_peaks(step);
            self.debug(step);
            for round in 0..ROUNDS {
                self.mutate(step, round);
                self.exchange(step, round);
            }
        }
    }

    /// Keeps the peaks on top of the evidence, and now and then looks for others.
    fn seek_peaks(&mut self, step: &Step) {
        let (keyframes, noise) = (&self.memory.keyframes, &self.noise);
        self.peaks.par_iter_mut().for_each(|peak| {
            peak.climb(step, keyframes, noise);
        });
        let seen = self.keyframes_seen;
        if SCANS.contains(&seen) || seen.is_multiple_of(10) {
            let newest = &keyframes[keyframes.len() - 1];
            let candidates: Vec<Candidate> = (step.skin.links().par_iter())
                .flat_map_iter(|&link| scan(step.robot, link, step.skin.surface(link), newest, noise, CANDIDATES))
                .collect();
            let found: Vec<Peak> = candidates.par_iter().map(|candidate| {
                let surface = step.skin.surface(candidate.link);
                let foot = surface.centroid(candidate.triangle);
                let normal = surface.normal(candidate.triangle);
                let guess = |radius: f64| {
                    let obstacle = Obstacle {
                        link: candidate.link as u16,
                        triangle: candidate.triangle,
                        centre: newest.links[candidate.link].link_from_root.inverse_transform_point(&(foot + normal.into_inner() * radius)),
                    };
                    Peak::new(obstacle, step, keyframes, noise)
                };
                let mut peak = (FIRST_RADII.into_iter().map(guess))
                    .max_by(|a, b| a.evidence.log.total_cmp(&b.evidence.log))
                    .unwrap_or_else(|| guess(0.03));
                for _ in 0..10 {
                    if peak.climb(step, keyframes, noise) < 0.1 {
                        break;
                    }
                }
                peak
            }).collect();
            self.peaks.extend(found);
        }
        self.peaks.sort_by(|a, b| b.log_mass.total_cmp(&a.log_mass));
        let mut kept: Vec<Peak> = Vec::new();
        for peak in self.peaks.drain(..) {
            if kept.len() < MOST_PEAKS && !kept.iter().any(|other| other.is_same(&peak)) {
                kept.push(peak);
            }
        }
        self.peaks = kept;
    }

    fn debug(&self, step: &Step) {
        if std::env::var("PDEBUG").is_err() || !(self.keyframes_seen.is_multiple_of(10)) { return; }
        let Some((o, e)) = self.best() else { return };
        println!("  kf {} best link {} log {:.1} F {:.1} K {:.0} mu {} bias {} r {:.4} centre {:.3?} infl {:.2?} white {:.4?}", self.keyframes_seen, o.link, e.log, e.force, e.stiffness, e.friction, e.bias_scale, e.reference, o.centre.coords.as_slice(), (0..step.torque.len()).map(|j| self.noise.inflation(j)).collect::<Vec<_>>(), self.noise.whites());
        for p in self.peaks.iter().take(5) { println!("     peak link {} log {:.1} mass {:.1} r {:.4} F {:.1} K {:.0} mu {} bias {}", p.obstacle.link, p.evidence.log, p.log_mass, p.touch.distance, p.evidence.force, p.evidence.stiffness, p.evidence.friction, p.evidence.bias_scale); }
        if let Ok(t) = std::env::var("TRUTH") {
            let v: Vec<f64> = t.split(',').map(|x| x.parse().unwrap()).collect();
            let link = v[0] as usize; let centre = nalgebra::Point3::new(v[1], v[2], v[3]);
            let kf = &self.memory.keyframes[self.memory.keyframes.len()-1];
            let tr = touch(step.skin.surface(link), &(kf.links[link].link_from_root * centre), None);
            let mut o = Obstacle { link: link as u16, triangle: tr.triangle, centre };
            let e = o.evidence(step.robot, step.skin, &self.memory.keyframes, &self.noise);
            println!("     TRUE  link {} log {:.1} r {:.4} F {:.1} K {:.0} mu {} bias {}", link, e.log, tr.distance, e.force, e.stiffness, e.friction, e.bias_scale);
        }
    }

    /// Best particle or peak.
    fn best(&self) -> Option<(Obstacle, Evidence)> {
        let particle = self.populations[0].iter().max_by(|a, b| a.evidence.log.total_cmp(&b.evidence.log)).map(|p| (p.obstacle, p.evidence));
        let peak = self.peaks.iter().map(|p| (p.obstacle, p.evidence)).max_by(|a, b| a.1.log.total_cmp(&b.1.log));
        particle.into_iter().chain(peak).max_by(|a, b| a.1.log.total_cmp(&b.1.log))
    }

    fn spread(&mut self, step: &Step) {
        let newest = &self.memory.keyframes[self.memory.keyframes.len() - 1];
        let (memory, noise, seed) = (&self.memory, &self.noise, self.seed);
        for (level, population) in self.populations.iter_mut().enumerate() {
            let count = if level == 0 { self.count } else { self.count / 4 };
            let drawn: Vec<Hypothesis> = (0..count * 8 / 64)
                .into_par_iter()
                .flat_map_iter(|chunk| {
                    let mut random = stream(seed, step.number, chunk + level * 100_000, Purpose::Spread);
                    let draw = move |_| {
                        let (link, place) = step.skin.sample(random.random());
                        let radius = 1e-3 * 1000f64.powf(random.random());
                        let normal = step.skin.surface(link).normal(place.triangle);
                        let centre_in_link = place.point + normal.into_inner() * radius;
                        let mut obstacle = Obstacle {
                            link: link as u16,
                            triangle: place.triangle,
                            centre: newest.links[link].link_from_root.inverse() * centre_in_link,
                        };
                        let evidence = obstacle.evidence(step.robot, step.skin, &memory.keyframes, noise);
                        Hypothesis { obstacle, evidence, log_prior: log_prior(radius), log_weight: evidence.log }
                    };
                    (0..64).map(draw)
                })
                .collect();
            resample(drawn, count, TEMPERATURES[level], &mut stream(seed, step.number, level, Purpose::Resample), population);
        }
    }

    /// Weighs every particle by what the newest keyframe changed in its evidence; resamples if need be.
    fn reweigh(&mut self, step: &Step) {
        let (memory, noise, seed) = (&self.memory, &self.noise, self.seed);
        for (level, population) in self.populations.iter_mut().enumerate() {
            population.par_iter_mut().with_min_len(64).for_each(|particle| {
                let evidence = particle.obstacle.evidence(step.robot, step.skin, &memory.keyframes, noise);
                particle.log_weight += evidence.log - particle.evidence.log;
                particle.evidence = evidence;
            });
            let mut weights = Vec::new();
            normalise(population.iter().map(|p| p.log_weight * TEMPERATURES[level]), &mut weights);
            if effective_sample_size(&weights) < 0.5 * population.len() as f64 {
                let old = std::mem::take(population);
                let count = old.len();
                resample(old, count, TEMPERATURES[level], &mut stream(seed, step.number, level, Purpose::Resample), population);
            }
        }
    }

    /// Learns from the best particle's residuals how much larger they are than the noise model says.
    fn calibrate(&mut self, step: &Step) {
        let Some((obstacle, evidence)) = self.best() else { return };
        let keyframes = &self.memory.keyframes;
        let mut table = vec![vec![]; step.torque.len()];
        obstacle::residuals(&obstacle, &evidence, step.robot, step.skin, keyframes, &self.noise, |_, joint, residual, weight| {
            table[joint].push((residual, weight));
        });
        let mut changes = Vec::new();
        for (joint, rows) in table.iter().enumerate() {
            if rows.len() < 6 {
                continue;
            }
            let total: f64 = rows.iter().map(|r| r.1).sum();
            let mean = rows.iter().map(|r| r.0 * r.1).sum::<f64>() / total;
            let chi: f64 = rows.iter().map(|r| (r.0 - mean).powi(2) * r.1).sum::<f64>() * self.noise.inflation(joint);
            // A prior worth 8 residuals that the model is right.
            changes.push((joint, (chi + 8.0) / (rows.len() as f64 + 8.0 - 1.0)));
        }
        for (joint, factor) in changes {
            self.noise.inflate(joint, factor);
        }
    }

    fn mutate(&mut self, step: &Step, round: usize) {
        let (memory, noise, seed, peaks) = (&self.memory, &self.noise, self.seed, &self.peaks);
        for (level, population) in self.populations.iter_mut().enumerate() {
            let others = population.clone();
            let by_link = moves::by_link(&others, step.robot.links.len());
            population.par_chunks_mut(64).enumerate().for_each(|(chunk, particles)| {
                let key = chunk + 1000 * (round + 10 * level);
                let mut random = stream(seed, step.number, key, Purpose::Propagate);
                for particle in particles {
                    moves::mutate(particle, TEMPERATURES[level], &others, &by_link, peaks, step, &memory.keyframes, noise, &mut random);
                }
            });
        }
    }

    /// Particles take places from the next warmer population, as often as detailed balance allows.
    fn exchange(&mut self, step: &Step, round: usize) {
        let mut random = stream(self.seed, step.number, round, Purpose::Fresh);
        for level in 0..TEMPERATURES.len() - 1 {
            let (colder, warmer) = self.populations.split_at_mut(level + 1);
            let (colder, warmer) = (&mut colder[level], &mut warmer[0]);
            let gap = TEMPERATURES[level] - TEMPERATURES[level + 1];
            for one in colder.iter_mut() {
                if random.random::<f64>() > 0.3 {
                    continue;
                }
                let other = &warmer[random.random_range(0..warmer.len())];
                let log_ratio = gap * (other.evidence.log - one.evidence.log);
                if random.random::<f64>().ln() < log_ratio {
                    *one = Hypothesis { log_weight: one.log_weight, ..*other };
                }
            }
        }
    }

    pub(crate) fn show(&mut self, step: &Step, cloud: &mut Vec<Particle>) {
        let particles = &self.populations[0];
        normalise(particles.iter().map(|p| p.log_weight), &mut self.cloud_weights);
        cloud.extend(particles.iter().zip(&self.cloud_weights).map(|(particle, &weight)| {
            let link = particle.obstacle.link as usize;
            let view = step.now.root_from_link(link);
            let centre = view.inverse_transform_point(&particle.obstacle.centre);
            let touch = touch(step.skin.surface(link), &centre, Some(particle.obstacle.triangle));
            Particle {
                link,
                point_in_link: touch.point,
                normal_in_link: touch.normal,
                force: particle.evidence.force_at(touch.distance),
                stiffness: particle.evidence.stiffness.max(0.0),
                weight,
            }
        }));
    }
}

fn resample(
    drawn: Vec<Hypothesis>,
    count: usize,
    temperature: f64,
    random: &mut impl Rng,
    population: &mut Vec<Hypothesis>,
) {
    let (mut weights, mut chosen) = (Vec::new(), Vec::new());
    normalise(drawn.iter().map(|p| p.log_weight * temperature), &mut weights);
    systematic(&weights, count, random.random(), &mut chosen);
    population.clear();
    population.extend(chosen.iter().map(|&parent| Hypothesis { log_weight: 0.0, ..drawn[parent as usize] }));
}
