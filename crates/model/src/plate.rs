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
    corner: Vector3<f32>,
    /// From the corner to the next one and to the last one.
    edges: [Vector3<f32>; 2],
    /// Gradients of the depths inside of the three edges, which sum to one, and of the height, side by side: their x, y
    /// and z.
    gradients: [f32x4; 3],
    /// Greatest tan(φ / 2) beyond each edge, in units of the depths: above and below.
    steepest: [f32x4; 2],
    across: [u32; 3],
}

/// Where a point lies, seen from a plate.
pub(crate) enum Side {
    /// Its closest point is inside, at this height, and no neighbour comes closer.
    Inside(f32),
    /// It is beyond this edge.
    Beyond(usize),
    /// A neighbour that rises may be closer.
    InReach,
}

/// The closest point on the line of an edge.
pub(crate) enum OnEdge {
    /// It is between the edge's ends, and no neighbour comes closer.
    Between(Vector3<f32>),
    /// It is beyond this corner of the triangle.
    Beyond(usize),
    /// A neighbour that rises may be closer.
    InReach,
}

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
        let side = |[a, b, c]: [f64; 3]| [a, b, c, 0.0].map(|tangent| (tangent / sum) as f32);
        Self {
            corner: corners[0].coords.cast(),
            edges: edges.map(|edge| edge.cast()),
            gradients: [0, 1, 2].map(|axis| gradients.map(|part| part[axis] as f32).into()),
            steepest: steepest.map(|tangents| side(tangents).into()),
            across: triangle.across,
        }
    }

    #[inline(always)]
    pub(crate) fn normal(&self) -> Vector3<f32> {
        Vector3::from(self.gradients.each_ref().map(|axis| axis.as_array()[3]))
    }

    /// One of the triangle's corners, m.
    #[inline]
    pub(crate) fn corner(&self, corner: usize) -> Vector3<f32> {
        match corner {
            0 => self.corner,
            _ => self.corner + self.edges[corner - 1],
        }
    }

    /// How far inside of each edge a point is, seen along the normal: the depths sum to one. Last its height, m.
    #[inline(always)]
    fn depths_and_height(&self, point: &Vector3<f32>) -> f32x4 {
        let at_corner = f32x4::new([0.0, 1.0, 0.0, 0.0]);
        let from_corner = point - self.corner;
        let [x, y, z] = self.gradients;
        at_corner + x * from_corner.x + y * from_corner.y + z * from_corner.z
    }

    /// The height of a point, m, and whether its closest point is inside and no neighbour comes closer.
    #[inline(always)]
    pub(crate) fn inside(&self, query: &Vector3<f32>) -> (f32, bool) {
        let seen = self.depths_and_height(query);
        let height = seen.as_array()[3];
        (height, self.is_clear(seen, height, height.abs(), 0b111))
    }

    #[inline(always)]
    pub(crate) fn side(&self, query: &Vector3<f32>) -> Side {
        let seen = self.depths_and_height(query);
        let [first, second, third, height] = seen.to_array();
        // All edges at once: which one it is cannot be predicted.
        if self.is_clear(seen, height, height.abs(), 0b111) {
            return Side::Inside(height);
        }
        let depths = [first, second, third];
        let farther = usize::from(second < first);
        let farthest = if third < depths[farther] { 2 } else { farther };
        match depths[farthest] < 0.0 {
            true => Side::Beyond(farthest),
            false => Side::InReach,
        }
    }

    /// Whether a point is so deep inside of each of these edges (a bit each) that no neighbour comes closer to a point
    /// at this distance, above or below.
    #[inline(always)]
    fn is_clear(&self, depths: f32x4, height: f32, distance: f32, edges: u32) -> bool {
        let least = self.steepest[usize::from(height < 0.0)] * distance;
        depths.simd_ge(least).to_bitmask() & edges == edges
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

    /// The point of an edge that is closest to a query beyond it.
    pub(crate) fn on_edge(&self, edge: usize, query: &Vector3<f32>) -> OnEdge {
        let (from, to) = (self.corner(edge), self.corner((edge + 1) % 3));
        let way = to - from;
        let share = way.dot(&(query - from)) / way.norm_squared();
        if share <= 0.0 {
            return OnEdge::Beyond(edge);
        }
        if share >= 1.0 {
            return OnEdge::Beyond((edge + 1) % 3);
        }
        let point = from + way * share;
        match self.has_rivals(&point, query, 1 << edge) {
            true => OnEdge::InReach,
            false => OnEdge::Between(point),
        }
    }

    /// Whether a neighbour that rises may be closer to a query than a point on some of the triangle's edges (a bit
    /// each).
    pub(crate) fn has_rivals(&self, point: &Vector3<f32>, query: &Vector3<f32>, on: u32) -> bool {
        let away = query - point;
        let height = self.normal().dot(&away);
        let steepest = self.steepest[usize::from(height < 0.0)];
        let depths = self.depths_and_height(point);
        // On an edge the depth is zero, but for rounding.
        let rise = steepest.simd_gt(f32x4::ZERO).to_bitmask() & on != 0;
        rise || !self.is_clear(depths, height, away.norm(), 0b111 & !on)
    }
}
