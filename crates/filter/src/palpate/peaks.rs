//! Peaks of the evidence: climbed by Newton's method, each with its Laplace approximation.

use nalgebra::{Matrix3, Matrix3x2, SMatrix};
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

use super::chart::{COORDINATES, Chart, Coordinates};
use super::evidence::Evidence;
use super::history::History;
use super::obstacle::{Core, Obstacle, Touch, log_radius_prior};

type Square = SMatrix<f64, COORDINATES, COORDINATES>;

/// Finite-difference steps along the chart's axes: m, m, on the logarithm of the radius, rad, and three times m/s.
pub(super) const STEPS: [f64; COORDINATES] = [1e-3, 1e-3, 0.1, 0.05, 3e-4, 3e-4, 3e-4];
/// Precision that the chart's axes have anyhow: a decimetre, a decimetre, a factor of five, a radian, decimetres a second.
const PRIOR_PRECISION: [f64; COORDINATES] = [100.0, 100.0, 0.4, 1.0, 100.0, 100.0, 100.0];
/// Longest Newton step along the chart's axes.
const REACH: [f64; COORDINATES] = [0.02, 0.02, 1.0, 0.5, 5e-3, 5e-3, 5e-3];
/// A peak that moves by less than this share of a step rests.
const AT_REST: f64 = 0.1;
/// How much wider than Laplace's approximation the draws are, and which share of them, so that tails are reached.
const WIDTHS: [(f64, f64); 2] = [(0.7, 1.1), (0.3, 3.0)];

/// A local maximum of the evidence and the Gaussian that approximates the posterior around it.
#[derive(Clone, Debug)]
pub(super) struct Peak {
    pub(super) obstacle: Obstacle,
    pub(super) evidence: Evidence,
    pub(super) touch: Touch,
    /// Log of the posterior mass by Laplace's approximation.
    pub(super) log_mass: f64,
    /// Whether the last step hardly moved it.
    pub(super) rests: bool,
    chart: Chart,
    precision: Square,
    /// Log of the volume of its Gaussian.
    log_volume: f64,
    /// Lower Cholesky factor of the covariance.
    pub(super) root: Square,
    /// Covariance of the contact point from systematic errors, m², in the link's frame, once it was
    /// looked at.
    pub(super) sight: Option<Matrix3<f64>>,
}

impl Peak {
    /// Prepares the climb from a first guess.
    pub(super) fn new(mut obstacle: Obstacle, history: &History) -> Self {
        let evidence = history.evidence(&mut obstacle);
        Self::of(obstacle, evidence, history)
    }

    /// The same where the evidence is known.
    pub(super) fn of(obstacle: Obstacle, evidence: Evidence, history: &History) -> Self {
        let touch = history.newest_touch(&obstacle);
        let link_from_root = history.newest_link_from_root(obstacle.link);
        Self {
            chart: Chart::new(link_from_root, &obstacle.core, &touch),
            log_mass: evidence.log,
            log_volume: 0.0,
            precision: Square::identity(),
            root: Square::identity(),
            rests: false,
            sight: None,
            obstacle,
            evidence,
            touch,
        }
    }

    /// Takes the newest keyframe in.
    pub(super) fn refresh(&mut self, history: &History) {
        self.evidence = history.evidence(&mut self.obstacle);
    }

    /// One step of Newton's method with all derivatives by finite differences.
    pub(super) fn step(&mut self, history: &History) {
        *self = Self {
            sight: self.sight,
            ..Self::of(self.obstacle, self.evidence, history)
        };
        let counting = self.chart.counting();
        let value = |x: &Coordinates| self.try_at(x, history).2;
        let here = value(&Coordinates::zeros());
        let offset = |axis: usize, sign: f64| {
            let mut x = Coordinates::zeros();
            x[axis] = sign * STEPS[axis];
            x
        };
        let mut gradient = Coordinates::zeros();
        let mut hessian = Square::zeros();
        let mut ahead = [0.0; COORDINATES];
        for (done, &i) in counting.iter().enumerate() {
            ahead[i] = value(&offset(i, 1.0));
            let behind = value(&offset(i, -1.0));
            gradient[i] = (ahead[i] - behind) / (2.0 * STEPS[i]);
            hessian[(i, i)] = (ahead[i] - 2.0 * here + behind) / (STEPS[i] * STEPS[i]);
            for &j in &counting[..done] {
                let both = value(&(offset(i, 1.0) + offset(j, 1.0)));
                let mixed = (both - ahead[i] - ahead[j] + here) / (STEPS[i] * STEPS[j]);
                hessian[(i, j)] = mixed;
                hessian[(j, i)] = mixed;
            }
        }
        let covariance = self.approximate(&hessian, here);
        let newton = covariance * gradient;
        let scale = (0..COORDINATES)
            .map(|i| newton[i].abs() / REACH[i])
            .fold(1.0, f64::max);
        self.rests = self.search_along(newton / scale, here, history) < AT_REST;
    }

    /// Laplace's approximation from the log posterior's second derivatives. Away from a maximum the curvature may
    /// have either sign: its size still is a scale. Returns the covariance.
    fn approximate(&mut self, hessian: &Square, log_posterior: f64) -> Square {
        let eigen = hessian.symmetric_eigen();
        let lifted = Square::from_diagonal(&eigen.eigenvalues.map(f64::abs));
        self.precision = eigen.eigenvectors * lifted * eigen.eigenvectors.transpose();
        self.precision += Square::from_diagonal(&PRIOR_PRECISION.into());
        let covariance = self
            .precision
            .try_inverse()
            .unwrap_or_else(Square::identity);
        self.root = covariance
            .cholesky()
            .map_or_else(Square::zeros, |factor| factor.l());
        self.log_volume = self.log_gaussian();
        self.log_mass = log_posterior + self.log_volume - self.log_direction();
        covariance
    }

    /// Log of the volume of the peak's Gaussian over the coordinates that count: √2π for each, and the determinant.
    fn log_gaussian(&self) -> f64 {
        let counting = self.chart.counting();
        let unused = (0..COORDINATES).filter(|axis| !counting.contains(axis));
        let of_unused: f64 = unused.map(|axis| PRIOR_PRECISION[axis].ln()).sum();
        let determinant = self.precision.determinant().max(f64::MIN_POSITIVE);
        0.5 * (counting.len() as f64 * std::f64::consts::TAU.ln() + of_unused - determinant.ln())
    }

    /// Minus the log of the prior density of a bar's direction.
    fn log_direction(&self) -> f64 {
        match self.obstacle.core.axis {
            None => 0.0,
            Some(_) => std::f64::consts::PI.ln(),
        }
    }

    /// Goes as much of `way` as improves the posterior. Tells how far it moved, in steps.
    fn search_along(&mut self, way: Coordinates, here: f64, history: &History) -> f64 {
        for share in [1.0, 0.4, 0.1] {
            let (obstacle, evidence, value) = self.try_at(&(way * share), history);
            if value > here {
                self.obstacle = obstacle;
                self.evidence = evidence;
                self.log_mass += value - here;
                return (0..COORDINATES)
                    .map(|i| (way[i] * share / STEPS[i]).abs())
                    .fold(0.0, f64::max);
            }
        }
        0.0
    }

    /// The obstacle at x in the peak's chart.
    pub(super) fn at(&self, x: &Coordinates, history: &History) -> Obstacle {
        let shape = history.shape(&self.obstacle);
        Obstacle {
            core: self.chart.core(&shape, x),
            ..self.obstacle
        }
    }

    /// The coordinates that count.
    pub(super) fn counting(&self) -> &'static [usize] {
        self.chart.counting()
    }

    /// The two directions along the surface, in the link's frame.
    pub(super) fn sides(&self) -> Matrix3x2<f64> {
        self.chart.sides()
    }

    /// Obstacle, evidence and log posterior in the chart's measure at x.
    pub(super) fn try_at(&self, x: &Coordinates, history: &History) -> (Obstacle, Evidence, f64) {
        let mut obstacle = self.at(x, history);
        let evidence = history.evidence(&mut obstacle);
        let log_prior = log_radius_prior(self.chart.radius(x)) + obstacle.core.log_drift_prior();
        let value = evidence.log + log_prior;
        (obstacle, evidence, value)
    }

    /// A core drawn from the peak's Gaussian, somewhat widened.
    pub(super) fn draw(&self, history: &History, random: &mut impl Rng) -> Core {
        let widen = if random.random::<f64>() < WIDTHS[0].0 {
            WIDTHS[0].1
        } else {
            WIDTHS[1].1
        };
        self.displaced(&Coordinates::zeros(), widen, history, random)
    }

    /// A core some standard deviations, in all directions of the peak's Gaussian, from the one at x.
    pub(super) fn displaced(
        &self,
        x: &Coordinates,
        deviations: f64,
        history: &History,
        random: &mut impl Rng,
    ) -> Core {
        let gauss = Coordinates::from_fn(|_, _| random.sample::<f64, _>(StandardNormal));
        let shape = history.shape(&self.obstacle);
        self.chart
            .core(&shape, &(x + self.root * gauss * deviations))
    }

    /// Coordinates of a core in the peak's chart, with the log of the volume element.
    pub(super) fn coordinates(&self, core: &Core) -> Option<(Coordinates, f64)> {
        self.chart.coordinates(core)
    }

    /// Log density, in space, of [`Peak::draw`] at a core.
    pub(super) fn log_density(&self, core: &Core) -> f64 {
        let Some((x, log_volume)) = self.chart.coordinates(core) else {
            return f64::NEG_INFINITY;
        };
        let squared = x.dot(&(self.precision * x));
        let dimension = self.chart.counting().len() as i32;
        let part = |(share, width): (f64, f64)| {
            share * (-0.5 * squared / (width * width)).exp() / width.powi(dimension)
        };
        let mixture: f64 = WIDTHS.into_iter().map(part).sum();
        mixture.max(f64::MIN_POSITIVE).ln() - self.log_volume - log_volume
    }

    /// Whether another peak is the same one; or would be, if it rested as this one does, and explains hardly more.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        let radius = |peak: &Self| peak.touch.distance.max(1e-3).ln();
        let explains_more = other.evidence.log > self.evidence.log + WORTH_DRIFTING;
        let drift = match self.obstacle.core.drift {
            None if !explains_more => None,
            _ => other.obstacle.core.drift,
        };
        self.is_akin(&other.obstacle.drifting(drift))
            && (self.touch.point - other.touch.point).norm() < 4e-3
            && (radius(self) - radius(other)).abs() < 0.5
    }

    /// Whether this peak is of the same link and kind as an obstacle.
    pub(super) fn is_akin(&self, obstacle: &Obstacle) -> bool {
        self.obstacle.link == obstacle.link
            && self.obstacle.likeness == obstacle.likeness
            && self.obstacle.core.axis.is_some() == obstacle.core.axis.is_some()
            && self.obstacle.core.drift.is_some() == obstacle.core.drift.is_some()
    }
}

/// Evaluations that one Newton step takes, in the mean over some peaks.
pub(super) fn step_cost(peaks: &[Peak]) -> usize {
    let of_one = |peak: &Peak| {
        let dimension = peak.counting().len();
        // The derivatives, and one or two on the way.
        2 + dimension * (dimension + 3) / 2
    };
    peaks.iter().map(of_one).sum::<usize>() / peaks.len().max(1)
}

/// A drifting peak is kept beside the one at rest if the log of its evidence is larger by so much.
const WORTH_DRIFTING: f64 = 5.0;
/// Most peaks kept from keyframe to keyframe.
pub(super) const MOST: usize = 24;
/// Of those whose log mass is so much below the best one's,
const FAINT: f64 = 300.0;
/// only as many as to have so many in all.
const FEW: usize = 8;

/// Leaves at most `most` peaks, those with the largest mass, each once, the largest first.
pub(super) fn keep_best(peaks: &mut Vec<Peak>, most: usize) {
    peaks.sort_by(|a, b| b.log_mass.total_cmp(&a.log_mass));
    let mut kept: Vec<Peak> = Vec::with_capacity(most.min(peaks.len()));
    for peak in peaks.drain(..) {
        if kept.len() < most
            && peak.log_mass.is_finite()
            && !kept.iter().any(|other| other.is_same(&peak))
        {
            kept.push(peak);
        }
    }
    *peaks = kept;
}

/// Leaves at most `most` balls and as many bars.
pub(super) fn keep_best_of_each(peaks: &mut Vec<Peak>, most: usize) {
    let is_bar = |peak: &mut Peak| peak.obstacle.core.axis.is_some();
    let mut bars: Vec<Peak> = peaks.extract_if(.., is_bar).collect();
    keep_best(&mut bars, most);
    keep_best(peaks, most);
    peaks.append(&mut bars);
}

/// Leaves out the faint ones of peaks that [`keep_best`] has put in order.
pub(super) fn keep_likely(peaks: &mut Vec<Peak>) {
    let Some(best) = peaks.first().map(|peak| peak.log_mass) else {
        return;
    };
    let likely = peaks.partition_point(|peak| peak.log_mass > best - FAINT);
    peaks.truncate(likely.max(FEW));
}
