//! Closest points in single precision, where that can tell; for the many points of a particle filter that have moved a
//! little.

use kiddo::SquaredEuclidean;
use nalgebra::{Point3, Vector3};

use super::{Surface, SurfacePoint};
use crate::plate::{OnEdge, Side};
use crate::triangle::NONE;

/// Where a point lands on a [`Surface`] when projected in single precision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Landing {
    /// The closest point, m.
    pub point: Vector3<f32>,
    /// Outward normal there.
    pub normal: Vector3<f32>,
    /// Index of the triangle that it lies on.
    pub triangle: u32,
    /// Distance from the query, m.
    pub distance: f32,
}

impl Surface {
    /// As [`Surface::closest_point_from`], in single precision where that can tell, for points that have moved a little:
    /// across a few edges. The answer is as exact but for rounding, 0.1 µm on a link of a metre.
    #[inline(always)]
    pub fn land(&self, query: &Vector3<f32>, start: u32) -> Landing {
        self.land_then(query, start, |landing| landing)
    }

    /// Where [`Surface::land`] finds the closest point if that is inside the triangle `start`, and whether it is. Without
    /// a branch on the answer, which nothing could predict.
    #[inline(always)]
    pub fn land_inside(&self, query: &Vector3<f32>, start: u32) -> (Landing, bool) {
        let plate = &self.plates[start as usize];
        let (height, is_inside) = plate.inside(query);
        (plate.landing(query, start, height), is_inside)
    }

    /// Does something with what [`Surface::land`] finds, which then need not go through memory.
    #[inline(always)]
    pub fn land_then<T>(
        &self,
        query: &Vector3<f32>,
        start: u32,
        take: impl FnOnce(Landing) -> T,
    ) -> T {
        const MOST: usize = 6;
        let (mut triangle, mut before) = (start, NONE);
        for _ in 0..MOST {
            let plate = &self.plates[triangle as usize];
            match plate.side(query) {
                Side::Inside(height) => return take(plate.landing(query, triangle, height)),
                Side::InReach => break,
                Side::Beyond(edge) => {
                    let beyond = plate.beyond(edge);
                    if beyond == NONE {
                        break;
                    }
                    if beyond == before {
                        return take(self.land_on_edge(query, triangle, edge, start));
                    }
                    (before, triangle) = (triangle, beyond);
                }
            }
        }
        take(self.land_by_walk(query, start))
    }

    /// Where both triangles of an edge see the query beyond it.
    #[inline(never)]
    fn land_on_edge(
        &self,
        query: &Vector3<f32>,
        triangle: u32,
        edge: usize,
        start: u32,
    ) -> Landing {
        let plate = &self.plates[triangle as usize];
        let point = match plate.on_edge(edge, query) {
            OnEdge::Between(point) => Some(point),
            OnEdge::Beyond(corner) => self.on_corner(query, triangle, corner),
            OnEdge::InReach => None,
        };
        let Some(point) = point else {
            return self.land_by_walk(query, start);
        };
        Landing {
            point,
            normal: plate.normal(),
            triangle,
            distance: (query - point).norm(),
        }
    }

    /// A corner of a triangle, if no point around it is closer to the query.
    fn on_corner(
        &self,
        query: &Vector3<f32>,
        triangle: u32,
        corner: usize,
    ) -> Option<Vector3<f32>> {
        let plate = &self.plates[triangle as usize];
        let point = plate.corner(corner);
        let away = (query - point).cast();
        let vertex = self.triangles[triangle as usize].vertices[corner];
        let mut spokes = self.spokes.get(vertex as usize).iter();
        let edges = 1 << corner | 1 << ((corner + 2) % 3);
        let is_closest = spokes.all(|spoke| spoke.edge.dot(&away) <= 0.0)
            && !plate.has_rivals(&point, query, edges);
        is_closest.then_some(point)
    }

    #[inline(never)]
    pub(super) fn land_by_walk(&self, query: &Vector3<f32>, start: u32) -> Landing {
        self.landing(
            query,
            self.closest_point_from(&Point3::from(query.cast()), start),
        )
    }

    /// As [`Surface::land`] from the triangle with the nearest centroid. Allocates nothing.
    pub fn land_anew(&self, query: &Vector3<f32>) -> Landing {
        let at: Vector3<f64> = query.cast();
        let nearest = (self.centroids.query(&[at.x, at.y, at.z]))
            .nearest_one::<SquaredEuclidean<f64>>()
            .execute();
        self.land(query, nearest.item)
    }

    /// The closest point of the whole surface to `query`, given one that [`Surface::land`] has found: a walk does not see
    /// a place far away that is closer. Allocates nothing.
    #[inline(never)]
    pub fn audit(&self, query: &Vector3<f32>, found: Landing) -> Landing {
        let at = Point3::from(query.cast());
        let mut closest = None;
        let mut squared = f64::from(found.distance).powi(2);
        self.bounds.visit(query, squared as f32, |triangle| {
            let nearest = self.nearest_on(&at, triangle);
            if nearest.squared < squared {
                squared = nearest.squared;
                closest = Some(SurfacePoint {
                    point: nearest.point,
                    triangle,
                });
            }
            squared as f32
        });
        closest.map_or(found, |closest| self.landing(query, closest))
    }

    fn landing(&self, query: &Vector3<f32>, found: SurfacePoint) -> Landing {
        Landing {
            point: found.point.coords.cast(),
            normal: self.plates[found.triangle as usize].normal(),
            triangle: found.triangle,
            distance: (found.point.coords - query.cast()).norm() as f32,
        }
    }
}
