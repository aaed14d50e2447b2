//! Closest points in single precision, where that can tell; for the many points of a particle filter that have moved a
//! little.

use kiddo::SquaredEuclidean;
use nalgebra::{Point3, Vector3};

use super::{Surface, SurfacePoint};
use crate::plate::{Plate, Side};
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

/// What single precision tells of a query that both triangles of an edge see beyond it.
enum OnEdge {
    Landing(Landing),
    /// This triangle is closer.
    Rival(u32),
    Unknown,
}

/// The triangles of a [`Surface`], each by itself.
#[derive(Clone, Copy)]
pub struct Plates<'a>(&'a [Plate]);

impl Plates<'_> {
    /// The height of a point over a triangle's plane, m, and whether the closest point is straight below it, inside the
    /// triangle, as [`Surface::land`] from there would find it. Without a branch on the answer, which nothing could predict.
    #[inline(always)]
    pub fn height_over(self, triangle: u32, query: &Vector3<f32>) -> (f32, bool) {
        self.0[triangle as usize].height_over(query)
    }

    /// Whether a point in the plane of a triangle is on it.
    #[inline(always)]
    pub fn holds(self, triangle: u32, point: &Vector3<f32>) -> bool {
        self.0[triangle as usize].holds(point)
    }
}

impl Surface {
    /// As [`Surface::closest_point_from`], in single precision where that can tell, for points that have moved a little:
    /// across a few edges. The answer is as exact but for rounding, 0.1 µm on a link of a metre.
    #[inline(always)]
    pub fn land(&self, query: &Vector3<f32>, start: u32) -> Landing {
        self.land_then(query, start, |landing| landing)
    }

    /// The triangles, each by itself: for many questions one after the other.
    #[inline(always)]
    pub fn plates(&self) -> Plates<'_> {
        Plates(&self.plates)
    }

    /// Does something with what [`Surface::land`] finds, which then need not go through memory.
    #[inline(always)]
    pub fn land_then<T>(
        &self,
        query: &Vector3<f32>,
        start: u32,
        take: impl FnOnce(Landing) -> T,
    ) -> T {
        const MOST: usize = 16;
        let (mut triangle, mut before) = (start, NONE);
        for _ in 0..MOST {
            let plate = &self.plates[triangle as usize];
            match plate.side(query) {
                Side::Inside(height) => return take(plate.landing(query, triangle, height)),
                Side::InReach(height) => {
                    let squared = height * height;
                    match self.closest_rival(query, triangle, height < 0.0, squared) {
                        None => return take(plate.landing(query, triangle, height)),
                        Some(rival) => (before, triangle) = (NONE, rival),
                    }
                }
                Side::Beyond(edge) => {
                    let beyond = plate.beyond(edge);
                    if beyond == NONE {
                        break;
                    }
                    if beyond != before {
                        (before, triangle) = (triangle, beyond);
                        continue;
                    }
                    match self.land_on_edge(query, triangle, edge) {
                        OnEdge::Landing(landing) => return take(landing),
                        OnEdge::Rival(rival) => (before, triangle) = (NONE, rival),
                        OnEdge::Unknown => break,
                    }
                }
            }
        }
        take(self.land_by_walk(query, triangle))
    }

    /// Where both triangles of an edge see the query beyond it.
    #[inline(never)]
    fn land_on_edge(&self, query: &Vector3<f32>, triangle: u32, edge: usize) -> OnEdge {
        let plate = &self.plates[triangle as usize];
        let ends = [edge, (edge + 1) % 3].map(|corner| self.corner(triangle, corner));
        let point = match Plate::nearest_on_edge(edge, ends, query) {
            Ok(point) => {
                let squared = (query - point).norm_squared();
                for side in [triangle, plate.beyond(edge)] {
                    let plate = &self.plates[side as usize];
                    let height = plate.height(query);
                    if let Some(rival) = self.closest_rival(query, side, height < 0.0, squared) {
                        return OnEdge::Rival(rival);
                    }
                }
                Some(point)
            }
            Err(corner) => {
                let edges = 1 << corner | 1 << ((corner + 2) % 3);
                let corner = self.on_corner(query, triangle, corner);
                corner.filter(|point| !plate.has_rivals(point, query, edges))
            }
        };
        match point {
            None => OnEdge::Unknown,
            Some(point) => OnEdge::Landing(Landing {
                point,
                normal: plate.normal(),
                triangle,
                distance: (query - point).norm(),
            }),
        }
    }

    /// A corner of a triangle, if no point of an edge that leaves it is closer to the query.
    fn on_corner(
        &self,
        query: &Vector3<f32>,
        triangle: u32,
        corner: usize,
    ) -> Option<Vector3<f32>> {
        let point = self.corner(triangle, corner);
        let away = (query - point).cast();
        let vertex = self.triangles[triangle as usize].vertices[corner];
        let mut spokes = self.spokes.get(vertex as usize).iter();
        let is_closest = spokes.all(|spoke| spoke.edge.dot(&away) <= 0.0);
        is_closest.then_some(point)
    }

    /// Which of the triangles around one that rise above it, or fall below, comes closest to a query, if one comes closer
    /// than this squared distance, m².
    #[inline(never)]
    fn closest_rival(
        &self,
        query: &Vector3<f32>,
        triangle: u32,
        below: bool,
        squared: f32,
    ) -> Option<u32> {
        let (mut least, mut closest) = (squared, None);
        let exact = Point3::from(query.cast());
        for &rival in self.rivals.all(triangle, below) {
            let (bound, is_reached) = self.plates[rival as usize].bound_squared(query);
            if bound >= least {
                continue;
            }
            let squared = match is_reached {
                true => bound,
                false => self.nearest_on(&exact, rival).squared as f32,
            };
            if squared < least {
                (least, closest) = (squared, Some(rival));
            }
        }
        closest
    }

    fn corner(&self, triangle: u32, corner: usize) -> Vector3<f32> {
        let corner = self.triangles[triangle as usize].corner(corner);
        corner.coords.cast()
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
