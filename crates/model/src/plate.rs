//! A triangle in single precision, for points that moved a little since they were projected the last time.
//!
//! Link frames span about a metre, so a coordinate is good to 0.1 µm: far below what a mesh tells of its link. What that
//! cannot decide, [`Surface::closest_point_from`](crate::Surface::closest_point_from) does in double precision.

use nalgebra::{Matrix3, Vector3};
use wide::f32x4;

use crate::Landing;
use crate::triangle::Triangle;

/// What a walk over triangles in single precision touches: two lines of a cache.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(crate) struct Plate {
    /// Gradients of the depths inside of the three edges, which sum to one, and of the height, side by side: their x, y
    /// and z.
    gradients: [f32x4; 3],
    /// Depths and height of the frame's origin.
    at_origin: f32x4,
    /// Greatest tan(φ / 2) beyond each edge, in units of the depths: above, and below with a minus. Last a one, by which
    /// the height is as great as it has to be.
    steepest: [f32x4; 2],
    /// What a unit of the depths is, m; zero for the height.
    units: f32x4,
    across: [u32; 3],
}

/// Where a point lies, seen from a plate.
pub(crate) enum Side {
    /// Its closest point is inside, at this height, and no neighbour comes closer.
    Inside(f32),
    /// It is beyond this edge.
    Beyond(usize),
    /// Its closest point is inside, at this height, unless a neighbour that rises is closer.
    InReach(f32),
}

/// All edges, a bit each.
const EDGES: u32 = 0b111;
/// All edges, and the height.
const ALL: u32 = 0b1111;

impl Plate {
    /// For a triangle, given the greatest tan(φ / 2) beyond its edges above and below in units of
    /// [`Triangle::depths`].
    pub(crate) fn new(triangle: &Triangle, steepest: [[f64; 3]; 2]) -> Self {
        let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)].map(|(u, v)| triangle.at(u, v));
        let edges = [corners[1] - corners[0], corners[2] - corners[0]];
        let normal = triangle.normal.into_inner();
        // The dual basis: u and v with (u, v, height) the coordinates along the edges and the normal.
        let basis = Matrix3::from_columns(&[edges[0], edges[1], normal]);
        let dual = basis.try_inverse().unwrap_or_else(Matrix3::zeros);
        let (u, v) = (dual.row(0).transpose(), dual.row(1).transpose());
        let gradients = [v, -u - v, u, normal];
        let sum: f64 = triangle.depths(&corners[0]).iter().sum();
        let side = |tangents: [f64; 3], sign: f64| {
            let [a, b, c] = tangents.map(|tangent| (sign * tangent / sum) as f32);
            f32x4::new([a, b, c, 1.0])
        };
        let [above, below] = steepest;
        let mut at_origin = gradients.map(|gradient| -gradient.dot(&corners[0].coords));
        let unit = |gradient: Vector3<f64>| (1.0 / gradient.norm().max(f64::MIN_POSITIVE)) as f32;
        // The corner's depth inside of the edge across.
        at_origin[1] += 1.0;
        Self {
            at_origin: at_origin.map(|part| part as f32).into(),
            gradients: [0, 1, 2].map(|axis| gradients.map(|part| part[axis] as f32).into()),
            steepest: [side(above, 1.0), side(below, -1.0)],
            units: f32x4::new([unit(v), unit(u + v), unit(u), 0.0]),
            across: triangle.across,
        }
    }

    #[inline(always)]
    pub(crate) fn normal(&self) -> Vector3<f32> {
        Vector3::from(self.gradients.each_ref().map(|axis| axis.as_array()[3]))
    }

    /// How far inside of each edge a point is, seen along the normal: the depths sum to one. Last its height, m.
    #[inline(always)]
    fn depths_and_height(&self, point: &Vector3<f32>) -> f32x4 {
        let [x, y, z] = self.gradients;
        self.at_origin + x * point.x + y * point.y + z * point.z
    }

    /// The height of a point, m.
    #[inline]
    pub(crate) fn height(&self, point: &Vector3<f32>) -> f32 {
        self.depths_and_height(point).as_array()[3]
    }

    /// The height of a point, m, and whether its closest point is inside and no neighbour comes closer.
    #[inline(always)]
    pub(crate) fn height_over(&self, query: &Vector3<f32>) -> (f32, bool) {
        let seen = self.depths_and_height(query);
        let height = seen.as_array()[3];
        (height, self.clear(seen, height) == ALL)
    }

    /// Whether a point of the plane is inside.
    #[inline(always)]
    pub(crate) fn holds(&self, point: &Vector3<f32>) -> bool {
        const LEAST: f32x4 = f32x4::new([0.0, 0.0, 0.0, f32::NEG_INFINITY]);
        let seen = self.depths_and_height(point);
        seen.simd_ge(LEAST).to_bitmask() == ALL
    }

    #[inline(always)]
    pub(crate) fn side(&self, query: &Vector3<f32>) -> Side {
        let seen = self.depths_and_height(query);
        let [first, second, third, height] = seen.to_array();
        // All edges at once: which one it is cannot be predicted.
        if self.clear(seen, height) == ALL {
            return Side::Inside(height);
        }
        let depths = [first, second, third];
        let farther = usize::from(second < first);
        let farthest = if third < depths[farther] { 2 } else { farther };
        match depths[farthest] < 0.0 {
            true => Side::Beyond(farthest),
            false => Side::InReach(height),
        }
    }

    /// Of which edges (a bit each) a point is so deep inside that no neighbour beyond them comes closer to a point at this
    /// distance: above, or below with a minus.
    #[inline(always)]
    fn clear(&self, depths: f32x4, distance: f32) -> u32 {
        let [above, below] = self.steepest;
        // One of them is not positive.
        let least = (above * distance).fast_max(below * distance);
        depths.simd_ge(least).to_bitmask()
    }

    /// No point of the triangle is closer than this, m², and whether one is as close: straight below.
    #[inline(always)]
    pub(crate) fn bound_squared(&self, query: &Vector3<f32>) -> (f32, bool) {
        let seen = self.depths_and_height(query);
        let [first, second, third, _] = (seen * self.units).to_array();
        let height = seen.as_array()[3];
        // Not `min`, which spends most of its instructions on what is no number.
        let lower = if second < first { second } else { first };
        let lowest = if third < lower { third } else { lower };
        let beyond = if lowest < 0.0 { lowest } else { 0.0 };
        (height * height + beyond * beyond, lowest >= 0.0)
    }

    /// The triangle across an edge; [`NONE`] at a rim.
    #[inline(always)]
    pub(crate) fn beyond(&self, edge: usize) -> u32 {
        self.across[edge]
    }

    /// Where a point lands whose closest point is inside, `height` below it.
    #[inline(always)]
    pub(crate) fn landing(&self, query: &Vector3<f32>, triangle: u32, height: f32) -> Landing {
        let normal = self.normal();
        Landing {
            point: query - normal * height,
            normal,
            triangle,
            distance: height.abs(),
        }
    }

    /// The point of an edge that is closest to a query beyond it, or else the corner that is: given the edge's ends, m.
    pub(crate) fn nearest_on_edge(
        edge: usize,
        [from, to]: [Vector3<f32>; 2],
        query: &Vector3<f32>,
    ) -> Result<Vector3<f32>, usize> {
        let way = to - from;
        let share = way.dot(&(query - from)) / way.norm_squared();
        if share <= 0.0 {
            return Err(edge);
        }
        if share >= 1.0 {
            return Err((edge + 1) % 3);
        }
        Ok(from + way * share)
    }

    /// Whether a neighbour that rises may be closer to a query than a point on some of the triangle's edges (a bit
    /// each).
    pub(crate) fn has_rivals(&self, point: &Vector3<f32>, query: &Vector3<f32>, on: u32) -> bool {
        let away = query - point;
        let height = self.normal().dot(&away);
        let steepest = match height < 0.0 {
            true => -self.steepest[1],
            false => self.steepest[0],
        };
        let depths = self.depths_and_height(point);
        // On an edge the depth is zero, but for rounding.
        let rise = steepest.simd_gt(f32x4::ZERO).to_bitmask() & on != 0;
        let clear = self.clear(depths, away.norm().copysign(height));
        rise || (clear | on) & EDGES != EDGES
    }
}
