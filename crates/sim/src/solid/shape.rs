//! Solids as functions: negative inside, positive outside, about a distance near the surface.
//!
//! Only + - * / and sqrt are used, which round alike everywhere, so that the meshes come out the same on every machine.

use nalgebra::Vector3;

type Field = dyn Fn(Vector3<f64>) -> f64;

/// A solid given by its field (m).
pub struct Shape(Box<Field>);

impl Shape {
    /// Value of the field at a point (m).
    pub fn value(&self, point: Vector3<f64>) -> f64 {
        (self.0)(point)
    }

    /// Gradient of the field at a point, by central differences.
    pub fn gradient(&self, point: Vector3<f64>) -> Vector3<f64> {
        const STEP: f64 = 1e-5;
        let slope = |axis: usize| {
            let mut shift = Vector3::zeros();
            shift[axis] = STEP;
            (self.value(point + shift) - self.value(point - shift)) / (2.0 * STEP)
        };
        Vector3::new(slope(0), slope(1), slope(2))
    }

    /// A solid of revolution between `start` and `end`, its radius going straight from one to the other, its rims
    /// rounded.
    pub fn drum(start: [f64; 3], end: [f64; 3], radii: [f64; 2], rounding: f64) -> Self {
        let start = Vector3::from(start);
        let along = Vector3::from(end) - start;
        let length = along.norm();
        let axis = along / length;
        Self(Box::new(move |point| {
            let from_start = point - start;
            let height = from_start.dot(&axis);
            let share = (height / length).clamp(0.0, 1.0);
            let radius = radii[0] + share * (radii[1] - radii[0]);
            let sideways = (from_start - axis * height).norm() - radius;
            let endways = (height - 0.5 * length).abs() - 0.5 * length;
            rounded_corner([sideways, endways, -1.0], rounding)
        }))
    }

    /// A ball that travels from `start` to `end` while its radius goes from one to the other.
    pub fn capsule(start: [f64; 3], end: [f64; 3], radii: [f64; 2]) -> Self {
        let start = Vector3::from(start);
        let along = Vector3::from(end) - start;
        Self(Box::new(move |point| {
            let share = ((point - start).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
            let radius = radii[0] + share * (radii[1] - radii[0]);
            (point - start - along * share).norm() - radius
        }))
    }

    /// A box between two corners with rounded edges.
    pub fn block(low: [f64; 3], high: [f64; 3], rounding: f64) -> Self {
        let center = 0.5 * (Vector3::from(low) + Vector3::from(high));
        let half = 0.5 * (Vector3::from(high) - Vector3::from(low));
        Self(Box::new(move |point| {
            let past = (point - center).abs() - half;
            rounded_corner(past.into(), rounding)
        }))
    }

    /// Everything up to `bound` along one axis (`sign` 1) or from it on (`sign` -1).
    pub fn half_space(axis: usize, sign: f64, bound: f64) -> Self {
        Self(Box::new(move |point| sign * (point[axis] - bound)))
    }

    /// Either solid, the corner between them filled over about `blend` (m).
    pub fn or(self, other: Self, blend: f64) -> Self {
        Self(Box::new(move |point| {
            smooth_min(self.value(point), other.value(point), blend)
        }))
    }

    /// What both solids share, the edge between them worn over about `blend` (m).
    pub fn and(self, other: Self, blend: f64) -> Self {
        Self(Box::new(move |point| {
            -smooth_min(-self.value(point), -other.value(point), blend)
        }))
    }

    /// This solid less the other, the edge between them worn over about `blend` (m).
    pub fn without(self, other: Self, blend: f64) -> Self {
        Self(Box::new(move |point| {
            -smooth_min(-self.value(point), other.value(point), blend)
        }))
    }

    /// The same solid in another frame, `map` giving this frame's coordinates of a point of the other.
    pub fn seen_from(self, map: impl Fn(Vector3<f64>) -> Vector3<f64> + 'static) -> Self {
        Self(Box::new(move |point| self.value(map(point))))
    }
}

/// Distance to a corner whose faces are `past` away (negative: inside), rounded off.
fn rounded_corner(past: [f64; 3], rounding: f64) -> f64 {
    let past = Vector3::from(past).add_scalar(rounding);
    let outside = past.sup(&Vector3::zeros()).norm();
    outside + past.max().min(0.0) - rounding
}

/// The lesser of two values, rounded off where they differ by less than `blend`.
fn smooth_min(a: f64, b: f64, blend: f64) -> f64 {
    let closeness = (blend - (a - b).abs()).max(0.0);
    a.min(b) - closeness * closeness / (4.0 * blend)
}
