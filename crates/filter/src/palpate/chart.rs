//! Coordinates of obstacles around one of them, in which the prior is about uniform.

use nalgebra::{Isometry3, Matrix3, Matrix3x2, Point3, Rotation3, Unit, Vector3, Vector4};

use super::obstacle::{Core, LINK_RADIUS, RADIUS_RANGE, Shape, Touch, touch};

/// Coordinates x = (a, b, ρ, φ): the contact moved by a and b along the surface, m; the logarithm ρ of the radius; and
/// for a bar the turn φ of its axis about the normal. The centre is c = p + (a u + b v)(1 + d/R) + d exp(ρ) n̂.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chart {
    root_from_link: Isometry3<f64>,
    foot: Point3<f64>,
    triangle: u32,
    /// Columns u, v, n̂, in the link's frame.
    axes: Rotation3<f64>,
    distance: f64,
    spread: f64,
    axis: Option<Unit<Vector3<f64>>>,
}

impl Chart {
    /// The chart around a core that touches its link, in the configuration of `link_from_root`.
    pub(super) fn new(link_from_root: &Isometry3<f64>, core_in_root: &Core, touch: &Touch) -> Self {
        let normal = touch.normal.into_inner();
        let side = if normal.x.abs() < 0.7 {
            Vector3::x()
        } else {
            Vector3::y()
        };
        let u = normal.cross(&side).normalize();
        let v = normal.cross(&u);
        let distance = touch.distance.max(RADIUS_RANGE[0]);
        Self {
            root_from_link: link_from_root.inverse(),
            foot: touch.point,
            triangle: touch.triangle,
            axes: Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[u, v, normal])),
            distance,
            spread: 1.0 + distance / LINK_RADIUS,
            axis: core_in_root.moved(link_from_root).axis,
        }
    }

    /// Number of coordinates that count: three for a ball, four for a bar.
    pub(super) fn dimension(&self) -> usize {
        if self.axis.is_some() { 4 } else { 3 }
    }

    /// The directions u and v along the surface, in the link's frame.
    pub(super) fn sides(&self) -> Matrix3x2<f64> {
        self.axes.matrix().fixed_columns::<2>(0).into_owned()
    }

    /// Radius of the curvature at x, m.
    pub(super) fn radius(&self, x: &Vector4<f64>) -> f64 {
        self.distance * x[2].exp()
    }

    /// The core at x, in the root frame.
    pub(super) fn core(&self, shape: &Shape, x: &Vector4<f64>) -> Core {
        let local = Vector3::new(x[0] * self.spread, x[1] * self.spread, self.radius(x));
        let centre = self.foot + self.axes * local;
        let axis = self.axis.map(|axis| {
            let ball = Core { centre, axis: None };
            let normal = touch(shape, &ball, self.triangle, 0.0).normal;
            tangential(&axis, &normal, x[3])
        });
        Core { centre, axis }.moved(&self.root_from_link)
    }

    /// Coordinates of a core whose centre is where it touches, and the log of the chart's volume element there.
    /// None for another kind of core, or one below the tangent plane.
    pub(super) fn coordinates(&self, core_in_root: &Core) -> Option<(Vector4<f64>, f64)> {
        let core = core_in_root.moved(&self.root_from_link.inverse());
        let local = self.axes.inverse() * (core.centre - self.foot);
        if local.z <= 0.0 {
            return None;
        }
        let turn = match (self.axis, core.axis) {
            (None, None) => 0.0,
            (Some(own), Some(other)) => self.turn(&own, &other),
            _ => return None,
        };
        let x = Vector4::new(
            local.x / self.spread,
            local.y / self.spread,
            (local.z / self.distance).ln(),
            turn,
        );
        Some((x, 2.0 * self.spread.ln() + local.z.ln()))
    }

    /// Angle about the normal from one axis to another, which have no sign: within ± π/2.
    fn turn(&self, own: &Unit<Vector3<f64>>, other: &Unit<Vector3<f64>>) -> f64 {
        let normal = self.axes * Vector3::z();
        let (x, y) = (own.dot(other), normal.dot(&own.cross(other)));
        if x < 0.0 { (-y).atan2(-x) } else { y.atan2(x) }
    }
}

/// `axis` laid into the plane normal to `normal` and turned about it.
pub(super) fn tangential(
    axis: &Unit<Vector3<f64>>,
    normal: &Unit<Vector3<f64>>,
    turn: f64,
) -> Unit<Vector3<f64>> {
    let flat = axis.into_inner() - normal.into_inner() * axis.dot(normal);
    let flat = Unit::try_new(flat, 1e-9).unwrap_or(*axis);
    Rotation3::from_axis_angle(normal, turn) * flat
}
