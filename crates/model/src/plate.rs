//! A triangle in single precision, for points that moved a little since they were projected the last time.
//!
//! Link frames span about a metre, so a coordinate is good to 0.1 µm: far below what a mesh tells of its link. What that
//! cannot decide, [`Surface::closest_point_from`](crate::Surface::closest_point_from) does in double precision.

use nalgebra::{Matrix3, Vector3};

use crate::triangle::{NONE, Triangle};

/// What a walk over triangles in single precision touches, side by side in memory.
#[derive(Clone, Debug)]
pub(crate) struct Plate {
    corner: Vector3<f32>,
    pub(crate) normal: Vector3<f32>,
    /// Gradients of the depths inside of the first and the last edge; the depths of the three edges sum to one.
    gradients: [Vector3<f32>; 2],
    /// Greatest tan(φ / 2) beyond each edge, in units of the depths: above and below.
    steepest: [[f32; 3]; 2],
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

impl Plate {
    /// For a triangle, given the greatest tan(φ / 2) beyond its edges above and below in units of
    /// [`Triangle::depths`].
    pub(crate) fn new(triangle: &Triangle, steepest: [[f64; 3]; 2]) -> Self {
        let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)].map(|(u, v)| triangle.at(u, v));
        let (edge_1, edge_2) = (corners[1] - corners[0], corners[2] - corners[0]);
        let normal = triangle.normal.into_inner();
        // The dual basis: u and v with (u, v, height) the coordinates along the edges and the normal.
        let basis = Matrix3::from_columns(&[edge_1, edge_2, normal]);
        let dual = basis.try_inverse().unwrap_or_else(Matrix3::zeros);
        let gradient = |row: usize| dual.row(row).transpose().cast();
        let sum: f64 = triangle.depths(&corners[0]).iter().sum();
        Self {
            corner: corners[0].coords.cast(),
            normal: normal.cast(),
            gradients: [gradient(1), gradient(0)],
            steepest: steepest.map(|side| side.map(|tangent| (tangent / sum) as f32)),
            across: triangle.across,
        }
    }

    /// How far inside of each edge a point is, seen along the normal: the depths sum to one.
    #[inline]
    fn depths(&self, from_corner: &Vector3<f32>) -> [f32; 3] {
        let first = self.gradients[0].dot(from_corner);
        let last = self.gradients[1].dot(from_corner);
        [first, 1.0 - first - last, last]
    }

    #[inline(always)]
    pub(crate) fn side(&self, query: &Vector3<f32>) -> Side {
        let from_corner = query - self.corner;
        let height = self.normal.dot(&from_corner);
        let depths = self.depths(&from_corner);
        let [first, second, third] = self.least(height);
        // Without branches between them: which edge it is cannot be predicted.
        if (depths[0] >= first) & (depths[1] >= second) & (depths[2] >= third) {
            return Side::Inside(height);
        }
        let farther = usize::from(depths[1] < depths[0]);
        let farthest = if depths[2] < depths[farther] {
            2
        } else {
            farther
        };
        match depths[farthest] < 0.0 {
            true => Side::Beyond(farthest),
            false => Side::InReach,
        }
    }

    /// How deep inside of each edge the closest point must be, that no neighbour is closer at this height.
    #[inline]
    fn least(&self, height: f32) -> [f32; 3] {
        let steepest = &self.steepest[usize::from(height < 0.0)];
        steepest.map(|steepest| steepest * height.abs())
    }

    /// The triangle across an edge; none at a rim.
    #[inline]
    pub(crate) fn beyond(&self, edge: usize) -> Option<u32> {
        Some(self.across[edge]).filter(|&triangle| triangle != NONE)
    }

    /// The point of an edge, given its ends, that is closest to a query above it. None where the closest point is an end,
    /// or a neighbour that rises may be closer.
    pub(crate) fn on_edge(
        &self,
        edge: usize,
        [from, to]: [Vector3<f32>; 2],
        query: &Vector3<f32>,
    ) -> Option<Vector3<f32>> {
        let way = to - from;
        let share = way.dot(&(query - from)) / way.norm_squared();
        if !(share > 0.0 && share < 1.0) {
            return None;
        }
        let point = from + way * share;
        let offset = query - point;
        let steepest = &self.steepest[usize::from(self.normal.dot(&offset) < 0.0)];
        let (depths, distance) = (self.depths(&(point - self.corner)), offset.norm());
        let others = [(edge + 1) % 3, (edge + 2) % 3];
        let is_clear = steepest[edge] == 0.0
            && (others.iter()).all(|&other| depths[other] >= steepest[other] * distance);
        is_clear.then_some(point)
    }
}
