//! From where the arm is looked at.

use nalgebra::{Point3, Vector3};

/// A view without perspective.
#[derive(Clone, Debug)]
pub struct View {
    right: Vector3<f64>,
    up: Vector3<f64>,
    /// Direction towards the viewer, in the root frame.
    pub out: Vector3<f64>,
    /// The point that is shown at `at`.
    pub centre: Point3<f64>,
    /// Where the centre is in the picture, px.
    pub at: [f64; 2],
    /// Pixels a metre.
    pub scale: f64,
}

impl View {
    /// A view of the origin, from a viewer at an angle about the vertical and above the horizon, rad.
    pub fn from(azimuth: f64, elevation: f64) -> Self {
        let (sin, cos) = azimuth.sin_cos();
        let level = Vector3::new(cos, sin, 0.0);
        let out = level * elevation.cos() + Vector3::z() * elevation.sin();
        let right = Vector3::new(-sin, cos, 0.0);
        Self {
            right,
            up: out.cross(&right),
            out,
            centre: Point3::origin(),
            at: [0.0; 2],
            scale: 1.0,
        }
    }

    /// Place in the picture, px, and nearness to the viewer, m.
    pub fn project(&self, point: &Point3<f64>) -> [f64; 3] {
        let from_centre = point - self.centre;
        [
            self.at[0] + self.scale * from_centre.dot(&self.right),
            self.at[1] - self.scale * from_centre.dot(&self.up),
            from_centre.dot(&self.out),
        ]
    }

    /// Place in the picture, px.
    pub fn place(&self, point: &Point3<f64>) -> [f64; 2] {
        let [x, y, _] = self.project(point);
        [x, y]
    }

    /// How bright a surface with this normal is, 0 to 1, lit from above the viewer's left shoulder.
    pub fn brightness(&self, normal: &Vector3<f64>) -> f64 {
        let light = (self.out * 0.7 + self.up * 0.6 - self.right * 0.45).normalize();
        let facing = normal.dot(&self.out).clamp(0.0, 1.0);
        let lit = 0.30 + 0.70 * normal.dot(&light).max(0.0);
        (lit * (0.80 + 0.20 * facing.sqrt())).clamp(0.0, 1.0)
    }

    /// The view moved and scaled so that all points fit between two corners of the picture, px.
    pub fn fitted(mut self, points: &[Point3<f64>], low: [f64; 2], high: [f64; 2]) -> Self {
        let [mut left, mut top] = [f64::INFINITY; 2];
        let [mut right, mut bottom] = [f64::NEG_INFINITY; 2];
        for point in points {
            let [x, y] = self.place(point);
            (left, right) = (left.min(x), right.max(x));
            (top, bottom) = (top.min(y), bottom.max(y));
        }
        let (width, height) = ((right - left).max(1e-6), (bottom - top).max(1e-6));
        let factor = ((high[0] - low[0]) / width).min((high[1] - low[1]) / height);
        let middle = [0.5 * (left + right), 0.5 * (top + bottom)];
        for axis in 0..2 {
            let centre = 0.5 * (low[axis] + high[axis]);
            self.at[axis] = centre + factor * (self.at[axis] - middle[axis]);
        }
        self.scale *= factor;
        self
    }

    /// The same direction of view with `point` at `at` and another scale.
    pub fn zoomed(&self, point: Point3<f64>, at: [f64; 2], scale: f64) -> Self {
        Self {
            centre: point,
            at,
            scale,
            ..self.clone()
        }
    }
}
