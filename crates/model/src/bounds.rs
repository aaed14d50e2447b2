//! Boxes around triangles, in a tree of four below each: which triangles may be closer to a point than a distance that
//! is known already, and which a ray may hit.
//!
//! Seen from a point far off, all of a surface is about equally near, and a search for the nearest place has to look
//! nearly everywhere before it knows. Given the distance that a walk has found, few boxes reach into it.

use nalgebra::{Point3, Vector3};
use wide::f32x4;

/// Boxes below each box.
const FOUR: usize = 4;

/// Four boxes side by side: their corners with the least and the greatest coordinates, axis by axis, m.
#[derive(Clone)]
struct Boxes {
    low: [f32x4; 3],
    high: [f32x4; 3],
}

/// A box around each triangle, boxes around four of those, and so on up to four that hold all.
pub(crate) struct Bounds {
    levels: Vec<Vec<Boxes>>,
    /// The triangles in the order of their boxes.
    triangles: Vec<u32>,
}

impl Bounds {
    /// Of triangles given by their corners, m.
    pub(crate) fn new(corners: &[[Point3<f64>; 3]]) -> Self {
        let centres: Vec<_> = (corners.iter())
            .map(|[a, b, c]| a.coords + b.coords + c.coords)
            .collect();
        let mut triangles: Vec<u32> = (0..corners.len() as u32).collect();
        sort(&mut triangles, &centres);
        let box_of = |&triangle: &u32| {
            let corners = corners[triangle as usize].map(|corner| corner.coords.cast());
            let [a, b, c] = corners;
            (a.inf(&b).inf(&c), a.sup(&b).sup(&c))
        };
        let mut boxes: Vec<_> = triangles.iter().map(box_of).collect();
        let mut levels = Vec::new();
        loop {
            levels.push(boxes.chunks(FOUR).map(Boxes::new).collect());
            if boxes.len() <= FOUR {
                return Self { levels, triangles };
            }
            boxes = boxes.chunks(FOUR).map(around).collect();
        }
    }

    /// Calls `look` with each triangle whose box is closer to `query` than the square root of `squared`, m²; it returns
    /// what is known then.
    #[inline]
    pub(crate) fn visit(
        &self,
        query: &Vector3<f32>,
        mut squared: f32,
        mut look: impl FnMut(u32) -> f32,
    ) {
        self.descend(self.levels.len() - 1, 0, query, &mut squared, &mut look);
    }

    /// All triangles, those close together soon after each other.
    pub(crate) fn in_order(&self) -> &[u32] {
        &self.triangles
    }

    /// A triangle for which `is_hit` holds, of those whose boxes a ray crosses: the first that is found, not the nearest.
    pub(crate) fn any_along(
        &self,
        origin: &Point3<f64>,
        direction: &Vector3<f64>,
        mut is_hit: impl FnMut(u32) -> bool,
    ) -> Option<u32> {
        let ray = Ray::new(origin, direction);
        self.any_below(self.levels.len() - 1, 0, &ray, &mut is_hit)
    }

    fn any_below(
        &self,
        level: usize,
        group: usize,
        ray: &Ray,
        is_hit: &mut impl FnMut(u32) -> bool,
    ) -> Option<u32> {
        let mut crossed = self.levels[level][group].crossed(ray);
        while crossed != 0 {
            let below = group * FOUR + crossed.trailing_zeros() as usize;
            crossed &= crossed - 1;
            let found = match level {
                0 => Some(self.triangles[below]).filter(|&triangle| is_hit(triangle)),
                _ => self.any_below(level - 1, below, ray, is_hit),
            };
            if found.is_some() {
                return found;
            }
        }
        None
    }

    fn descend(
        &self,
        level: usize,
        group: usize,
        query: &Vector3<f32>,
        squared: &mut f32,
        look: &mut impl FnMut(u32) -> f32,
    ) {
        let mut closer = self.levels[level][group].closer(query, *squared);
        while closer != 0 {
            let below = group * FOUR + closer.trailing_zeros() as usize;
            closer &= closer - 1;
            match level {
                0 => *squared = look(self.triangles[below]),
                _ => self.descend(level - 1, below, query, squared, look),
            }
        }
    }
}

/// Sorts triangles so that those side by side are so in space as well: halves them along the longest side, where the
/// first half fills whole boxes of every level.
fn sort(triangles: &mut [u32], centres: &[Vector3<f64>]) {
    let centre = |triangle: u32| centres[triangle as usize];
    if triangles.len() <= 1 {
        return;
    }
    let places = triangles.iter().map(|&triangle| centre(triangle));
    let low = places
        .clone()
        .fold(Vector3::repeat(f64::MAX), |a, b| a.inf(&b));
    let high = places.fold(Vector3::repeat(f64::MIN), |a, b| a.sup(&b));
    let axis = (high - low).imax();
    let half = triangles.len().next_power_of_two() / 2;
    triangles.select_nth_unstable_by(half, |&a, &b| {
        let by_place = centre(a)[axis].total_cmp(&centre(b)[axis]);
        by_place.then(a.cmp(&b))
    });
    let (first, last) = triangles.split_at_mut(half);
    sort(first, centres);
    sort(last, centres);
}

type Corners = (Vector3<f32>, Vector3<f32>);

fn around(boxes: &[Corners]) -> Corners {
    let both = |a: Corners, b: &Corners| (a.0.inf(&b.0), a.1.sup(&b.1));
    boxes[1..].iter().fold(boxes[0], both)
}

impl Boxes {
    /// Of at most four; the others are nowhere.
    fn new(boxes: &[Corners]) -> Self {
        let side = |nowhere: f32, pick: fn(&Corners) -> &Vector3<f32>| {
            [0, 1, 2].map(|axis| {
                let at = |lane: usize| boxes.get(lane).map_or(nowhere, |one| pick(one)[axis]);
                f32x4::new([0, 1, 2, 3].map(at))
            })
        };
        Self {
            low: side(f32::INFINITY, |corners| &corners.0),
            high: side(f32::NEG_INFINITY, |corners| &corners.1),
        }
    }

    /// Which of the boxes are closer to a point than the square root of `squared`: a bit each.
    #[inline]
    fn closer(&self, query: &Vector3<f32>, squared: f32) -> u32 {
        let mut distance = f32x4::ZERO;
        for axis in 0..3 {
            let at = f32x4::splat(query[axis]);
            let outside = (self.low[axis] - at).fast_max(at - self.high[axis]);
            let outside = outside.fast_max(f32x4::ZERO);
            distance += outside * outside;
        }
        distance.simd_lt(f32x4::splat(squared)).to_bitmask()
    }

    /// Which of the boxes a ray crosses, by the distances at which it enters and leaves each pair of sides (Kay and
    /// Kajiya, Ray Tracing Complex Scenes, 1986): a bit each.
    #[inline]
    fn crossed(&self, ray: &Ray) -> u32 {
        let mut enters = f32x4::ZERO;
        let mut leaves = f32x4::splat(f32::INFINITY);
        for axis in 0..3 {
            let inverse = ray.inverse[axis];
            let low = (self.low[axis] - ray.below[axis]) * inverse;
            let high = (self.high[axis] - ray.above[axis]) * inverse;
            let (near, far) = match ray.forwards[axis] {
                true => (low, high),
                false => (high, low),
            };
            enters = enters.fast_max(near);
            leaves = leaves.fast_min(far);
        }
        enters.simd_le(leaves).to_bitmask()
    }
}

/// A ray as boxes see it.
struct Ray {
    /// The origin, moved by [`WIDER`] so that the lower sides of boxes lie that much lower, and the upper ones higher.
    below: [f32x4; 3],
    above: [f32x4; 3],
    /// One over the direction's coordinates, and whether they are positive.
    inverse: [f32x4; 3],
    forwards: [bool; 3],
}

/// Boxes are taken for so much wider where rays cross them, m: more than single precision rounds on a link.
const WIDER: f32 = 1e-6;

impl Ray {
    fn new(origin: &Point3<f64>, direction: &Vector3<f64>) -> Self {
        let origin = origin.coords.cast::<f32>();
        // Not zero, which would make no number of a side that the origin lies on.
        let along = direction.map(|value| {
            let value = value as f32;
            if value.abs() < 1e-20 { 1e-20 } else { value }
        });
        let each = |of: &dyn Fn(usize) -> f32| [0, 1, 2].map(|axis| f32x4::splat(of(axis)));
        Self {
            below: each(&|axis| origin[axis] + WIDER),
            above: each(&|axis| origin[axis] - WIDER),
            inverse: each(&|axis| 1.0 / along[axis]),
            forwards: [0, 1, 2].map(|axis| along[axis] > 0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Small triangles well spread in a cube of a metre: multiples of the plastic number's powers.
    fn corners(count: u32) -> Vec<[Point3<f64>; 3]> {
        let one = |index: u32| {
            let place = [0.819_172_5, 0.671_043_6, 0.549_700_5]
                .map(|step| (0.5 + step * f64::from(index)).fract());
            let at = Point3::from(place);
            [
                at,
                at + Vector3::x() * 0.01,
                at + Vector3::new(0.0, 0.01, 0.02),
            ]
        };
        (0..count).map(one).collect()
    }

    #[test]
    fn all_triangles_within_the_distance_are_visited_and_few_others() {
        for count in [1, 3, 4, 5, 17, 500] {
            let corners = corners(count);
            let bounds = Bounds::new(&corners);
            for query in [[0.5, 0.4, 0.6], [1.2, 0.1, 0.1], [-0.1, 1.1, 0.3]] {
                let place = Vector3::from(query);
                let mut seen = Vec::new();
                bounds.visit(&place.cast(), 0.3 * 0.3, |triangle| {
                    seen.push(triangle);
                    0.3 * 0.3
                });
                let distance = |triangle: u32| {
                    let corners = corners[triangle as usize].iter();
                    let distances = corners.map(|corner| (corner.coords - place).norm());
                    distances.fold(f64::INFINITY, f64::min)
                };
                let must = (0..count).filter(|&triangle| distance(triangle) < 0.3);
                assert!(must.clone().all(|triangle| seen.contains(&triangle)));
                assert!(seen.iter().all(|&triangle| distance(triangle) < 0.35));
                seen.sort_unstable();
                seen.dedup();
                assert!(seen.len() >= must.count());
            }
        }
    }

    #[test]
    fn a_shrinking_distance_spares_visits() {
        let corners = corners(4000);
        let bounds = Bounds::new(&corners);
        let query = Vector3::new(0.5, 0.5, 3.0);
        let (mut visits, mut least) = (0, 2.1_f32 * 2.1);
        bounds.visit(&query, least, |triangle| {
            visits += 1;
            for corner in &corners[triangle as usize] {
                least = least.min((corner.coords.cast() - query).norm_squared());
            }
            least
        });
        assert!((1..200).contains(&visits), "{visits}");
    }

    #[test]
    fn rays_see_all_that_they_may_hit_and_little_else() {
        let cast = |count: u32| {
            let corners = corners(count);
            let bounds = Bounds::new(&corners);
            move |origin: Point3<f64>, direction: Vector3<f64>| {
                let mut seen = Vec::new();
                bounds.any_along(&origin, &direction, |triangle| {
                    seen.push(triangle);
                    false
                });
                seen
            }
        };
        for count in [1, 3, 4, 5, 17, 500] {
            let (see, corners) = (cast(count), corners(count));
            for (index, corners) in (0..).zip(&corners) {
                for way in [
                    Vector3::x(),
                    -Vector3::y(),
                    Vector3::z(),
                    Vector3::new(0.0, 0.6, -0.8),
                    Vector3::new(-0.36, 0.48, 0.8),
                ] {
                    // Straight at a corner, and so along sides of its box.
                    let seen = see(corners[index as usize % 3] - way * 1.5, way);
                    assert!(seen.contains(&index), "{index} of {count}, {way}");
                    assert!(seen.len() < 3 + count as usize / 20, "{}", seen.len());
                    let behind = see(corners[0] + way * 0.1, way);
                    assert!(!behind.contains(&index), "{index} of {count}, {way}");
                }
            }
        }
    }
}
