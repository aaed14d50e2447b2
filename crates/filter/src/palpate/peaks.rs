//! Peaks of the evidence: found by scanning, climbed by Newton's method, each with its Laplace approximation.

use nalgebra::{Matrix3, Point3, Rotation3, Vector3};
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

use super::evidence::Evidence;
use super::memory::Keyframe;
use super::noise::Noise;
use super::obstacle::{LINK_RADIUS, Obstacle, RADIUS_RANGE, Touch, touch};
use crate::step::Step;

/// Finite-difference steps along the chart's axes: m, m, and on the logarithm of the radius.
const STEPS: [f64; 3] = [1e-3, 1e-3, 0.1];
/// Prior precision that the chart's axes have anyhow: a decimetre, a decimetre, a factor of five.
const PRIOR_PRECISION: [f64; 3] = [100.0, 100.0, 0.4];
/// Longest Newton step along the chart's axes.
const REACH: [f64; 3] = [0.02, 0.02, 1.0];

/// A local maximum of the evidence and the Gaussian that approximates the posterior around it, in a chart: two
/// lengths along the surface, m, and the logarithm of the radius.
#[derive(Clone, Debug)]
pub(super) struct Peak {
    pub(super) obstacle: Obstacle,
    pub(super) evidence: Evidence,
    chart: Chart,
    covariance: Matrix3<f64>,
    precision: Matrix3<f64>,
    /// Log of the posterior mass by Laplace's approximation.
    pub(super) log_mass: f64,
    pub(super) touch: Touch,
}

/// Coordinates (a, b, ρ) of obstacle centres around one: c = p + α n̂ + (a u + b v)(1 + d/R), α = d exp ρ. In these the
/// prior is uniform.
#[derive(Clone, Copy, Debug)]
struct Chart {
    root_from_link: nalgebra::Isometry3<f64>,
    foot: Point3<f64>,
    axes: Rotation3<f64>,
    distance: f64,
    spread: f64,
}

impl Chart {
    fn new(root_from_link: nalgebra::Isometry3<f64>, touch: &Touch) -> Self {
        let normal = touch.normal.into_inner();
        let side = if normal.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
        let u = normal.cross(&side).normalize();
        let v = normal.cross(&u);
        let distance = touch.distance.max(RADIUS_RANGE[0]);
        Self {
            root_from_link,
            foot: touch.point,
            axes: Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[u, v, normal])),
            distance,
            spread: 1.0 + distance / LINK_RADIUS,
        }
    }

    fn centre(&self, x: &Vector3<f64>) -> Point3<f64> {
        let local = Vector3::new(x[0] * self.spread, x[1] * self.spread, self.distance * x[2].exp());
        self.root_from_link * (self.foot + self.axes * local)
    }

    /// Coordinates of a centre, and the log of the chart's volume element there. None below the tangent plane.
    fn coordinates(&self, centre: &Point3<f64>) -> Option<(Vector3<f64>, f64)> {
        let local = self.axes.inverse() * (self.root_from_link.inverse_transform_point(centre) - self.foot);
        if local.z <= 0.0 {
            return None;
        }
        let x = Vector3::new(local.x / self.spread, local.y / self.spread, (local.z / self.distance).ln());
        Some((x, 2.0 * self.spread.ln() + local.z.ln()))
    }
}

impl Peak {
    /// Prepares the climb from a first guess.
    pub(super) fn new(mut obstacle: Obstacle, step: &Step, keyframes: &[Keyframe], noise: &Noise) -> Self {
        let evidence = obstacle.evidence(step.robot, step.skin, keyframes, noise);
        let link = obstacle.link as usize;
        let view = &keyframes[keyframes.len() - 1].links[link];
        let centre = view.link_from_root * obstacle.centre;
        let touch = touch(step.skin.surface(link), &centre, Some(obstacle.triangle));
        Self {
            obstacle,
            evidence,
            chart: Chart::new(view.link_from_root.inverse(), &touch),
            covariance: Matrix3::identity(),
            precision: Matrix3::identity(),
            log_mass: evidence.log,
            touch,
        }
    }

    /// One step of Newton's method with all derivatives by finite differences. Tells how far it moved, in steps.
    pub(super) fn climb(&mut self, step: &Step, keyframes: &[Keyframe], noise: &Noise) -> f64 {
        *self = Self::new(self.obstacle, step, keyframes, noise);
        let value = |x: &Vector3<f64>| self.at(x, step, keyframes, noise).1.log;
        let here = self.evidence.log;
        let offset = |axis: usize, sign: f64| {
            let mut x = Vector3::zeros();
            x[axis] = sign * STEPS[axis];
            x
        };
        let ahead = [0, 1, 2].map(|axis| value(&offset(axis, 1.0)));
        let behind = [0, 1, 2].map(|axis| value(&offset(axis, -1.0)));
        let mut gradient = Vector3::zeros();
        let mut precision = Matrix3::zeros();
        for i in 0..3 {
            gradient[i] = (ahead[i] - behind[i]) / (2.0 * STEPS[i]);
            precision[(i, i)] = -(ahead[i] - 2.0 * here + behind[i]) / (STEPS[i] * STEPS[i]);
            for j in 0..i {
                let both = value(&(offset(i, 1.0) + offset(j, 1.0)));
                let mixed = -(both - ahead[i] - ahead[j] + here) / (STEPS[i] * STEPS[j]);
                precision[(i, j)] = mixed;
                precision[(j, i)] = mixed;
            }
        }
        let eigen = precision.symmetric_eigen();
        let floor = Vector3::from(PRIOR_PRECISION);
        // Away from a maximum the curvature may be negative: its size still is a scale.
        let lifted = eigen.eigenvalues.map(f64::abs);
        self.precision = eigen.eigenvectors * Matrix3::from_diagonal(&lifted) * eigen.eigenvectors.transpose()
            + Matrix3::from_diagonal(&floor);
        self.covariance = self.precision.try_inverse().unwrap_or_else(Matrix3::identity);
        self.log_mass = self.evidence.log - 0.5 * self.precision.determinant().max(1e-300).ln();
        let newton = self.covariance * gradient;
        let scale = (0..3).map(|i| (newton[i].abs() / REACH[i]).max(1.0)).fold(1.0, f64::max);
        self.search_along(newton / scale, step, keyframes, noise)
    }

    /// Goes as much of `way` as improves the evidence.
    fn search_along(&mut self, way: Vector3<f64>, step: &Step, keyframes: &[Keyframe], noise: &Noise) -> f64 {
        for share in [1.0, 0.4, 0.1] {
            let (obstacle, evidence) = self.at(&(way * share), step, keyframes, noise);
            if evidence.log > self.evidence.log {
                self.obstacle = obstacle;
                self.evidence = evidence;
                return (0..3).map(|i| (way[i] * share / STEPS[i]).abs()).fold(0.0, f64::max);
            }
        }
        0.0
    }

    fn at(&self, x: &Vector3<f64>, step: &Step, keyframes: &[Keyframe], noise: &Noise) -> (Obstacle, Evidence) {
        let mut obstacle = Obstacle { centre: self.chart.centre(x), ..self.obstacle };
        let radius = self.chart.distance * x[2].exp();
        if !(RADIUS_RANGE[0]..=RADIUS_RANGE[1]).contains(&radius) {
            return (obstacle, Evidence { log: f64::NEG_INFINITY, ..Evidence::default() });
        }
        let evidence = obstacle.evidence(step.robot, step.skin, keyframes, noise);
        (obstacle, evidence)
    }

    /// A centre drawn from the peak's Gaussian.
    pub(super) fn draw(&self, random: &mut impl Rng) -> Option<Point3<f64>> {
        let gauss = Vector3::from_fn(|_, _| random.sample::<f64, _>(StandardNormal));
        let root = self.covariance.cholesky()?.l();
        // Wider than Laplace's approximation, so that tails are reached.
        let widen = if random.random::<f64>() < 0.3 { 3.0 } else { 1.1 };
        Some(self.chart.centre(&(root * gauss * widen)))
    }

    /// Log density of [`Peak::draw`] at a centre.
    pub(super) fn log_density(&self, centre: &Point3<f64>) -> f64 {
        let Some((x, log_volume)) = self.chart.coordinates(centre) else {
            return f64::NEG_INFINITY;
        };
        let squared = x.dot(&(self.precision * x));
        let half_log_det = 0.5 * self.precision.determinant().max(1e-300).ln();
        let part = |share: f64, widen: f64| share * (-0.5 * squared / (widen * widen)).exp() / (widen * widen * widen);
        (part(0.7, 1.1) + part(0.3, 3.0)).max(1e-300).ln() + half_log_det - log_volume
    }

    /// Whether another peak is the same one.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        self.obstacle.link == other.obstacle.link
            && (self.touch.point - other.touch.point).norm() < 4e-3
            && (self.touch.distance.max(1e-3) / other.touch.distance.max(1e-3)).ln().abs() < 0.5
    }
}
