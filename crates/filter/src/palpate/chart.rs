//! Coordinates of obstacles around one of them, in which the prior is about uniform.

use nalgebra::{Isometry3, Matrix3, Matrix3x2, Point3, Rotation3, SVector, Unit, Vector3};

use super::obstacle::{Core, LINK_RADIUS, RADIUS_RANGE, Shape, Spot, Touch, touch};

/// Number of coordinates of an obstacle.
pub(super) const COORDINATES: usize = 7;
/// Coordinates x = (a, b, ρ, φ, w): the contact moved by a and b along the surface, m; the logarithm ρ of the radius; for
/// a bar the turn φ of its axis about the normal; and for what drifts the three components w along u, v and n̂ of what its
/// velocity changes by, m/s. The centre is c = p + (a u + b v)(1 + d/R) + d exp(ρ) n̂.
pub(super) type Coordinates = SVector<f64, COORDINATES>;

/// The system of these coordinates around an obstacle, in one configuration of its link.
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
    drift: Option<Vector3<f64>>,
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
        let core = core_in_root.moved(link_from_root);
        Self {
            root_from_link: link_from_root.inverse(),
            foot: touch.point,
            triangle: touch.triangle,
            axes: Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[u, v, normal])),
            distance,
            spread: 1.0 + distance / LINK_RADIUS,
            axis: core.axis,
            drift: core.drift,
        }
    }

    /// The coordinates that count for an obstacle of this kind.
    pub(super) fn counting(&self) -> &'static [usize] {
        match (self.axis, self.drift) {
            (None, None) => &[0, 1, 2],
            (Some(_), None) => &[0, 1, 2, 3],
            (None, Some(_)) => &[0, 1, 2, 4, 5, 6],
            (Some(_), Some(_)) => &[0, 1, 2, 3, 4, 5, 6],
        }
    }

    /// The directions u and v along the surface, in the link's frame.
    pub(super) fn sides(&self) -> Matrix3x2<f64> {
        self.axes.matrix().fixed_columns::<2>(0).into_owned()
    }

    /// Radius of the curvature at x, m.
    pub(super) fn radius(&self, x: &Coordinates) -> f64 {
        self.distance * x[2].exp()
    }

    /// The core at x, in the root frame.
    pub(super) fn core(&self, shape: &Shape, x: &Coordinates) -> Core {
        let local = Vector3::new(x[0] * self.spread, x[1] * self.spread, self.radius(x));
        let centre = self.foot + self.axes * local;
        let axis = self.axis.map(|axis| {
            let ball = Core {
                centre,
                axis: None,
                drift: None,
            };
            let normal = touch(shape, &ball, self.triangle, Spot::CENTRE).normal;
            tangential(&axis, &normal, x[3])
        });
        let change = Vector3::new(x[4], x[5], x[6]);
        let core = Core {
            centre,
            axis,
            drift: self.drift.map(|drift| drift + self.axes * change),
        };
        core.moved(&self.root_from_link)
    }

    /// Coordinates of a core whose centre is where it touches, and the log of the chart's volume element there.
    /// None for another kind of core, or one below the tangent plane.
    pub(super) fn coordinates(&self, core_in_root: &Core) -> Option<(Coordinates, f64)> {
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
        let change = match (self.drift, core.drift) {
            (None, None) => Vector3::zeros(),
            (Some(own), Some(other)) => self.axes.inverse() * (other - own),
            _ => return None,
        };
        let x = Coordinates::from([
            local.x / self.spread,
            local.y / self.spread,
            (local.z / self.distance).ln(),
            turn,
            change.x,
            change.y,
            change.z,
        ]);
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
