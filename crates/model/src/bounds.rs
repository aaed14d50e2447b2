//! Boxes around triangles, in a tree of four below each: which triangles may be closer to a point than a distance that
//! is known already.
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
        let centre = |triangle: u32| {
            let [a, b, c] = &corners[triangle as usize];
            a.coords + b.coords + c.coords
        };
        let mut triangles: Vec<u32> = (0..corners.len() as u32).collect();
        sort(&mut triangles, &centre);
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
fn sort(triangles: &mut [u32], centre: &impl Fn(u32) -> Vector3<f64>) {
    if triangles.len() <= 1 {
        return;
    }
    let centres = triangles.iter().map(|&triangle| centre(triangle));
    let low = centres
        .clone()
        .fold(Vector3::repeat(f64::MAX), |a, b| a.inf(&b));
    let high = centres.fold(Vector3::repeat(f64::MIN), |a, b| a.sup(&b));
    let axis = (high - low).imax();
    let half = triangles.len().next_power_of_two() / 2;
    triangles.select_nth_unstable_by(half, |&a, &b| {
        let by_place = centre(a)[axis].total_cmp(&centre(b)[axis]);
        by_place.then(a.cmp(&b))
    });
    let (first, last) = triangles.split_at_mut(half);
    sort(first, centre);
    sort(last, centre);
}

type Corners = (Vector3<f32>, Vector3<f32>);

fn around(boxes: &[Corners]) -> Corners {
    let both = |a: Corners, b: &Corners| (a.0.inf(&b.0), a.1.sup(&b.1));
    boxes[1..].iter().fold(boxes[0], both)
}

impl Boxes {
    /// Of at most four; the others are nowhere.
    fn new(boxes: &[Corners]) -> Self {
        let side = |pick: fn(&Corners) -> &Vector3<f32>| {
            [0, 1, 2].map(|axis| {
                let at = |lane: usize| boxes.get(lane).map_or(f32::INFINITY, |one| pick(one)[axis]);
                f32x4::new([0, 1, 2, 3].map(at))
            })
        };
        Self {
            low: side(|corners| &corners.0),
            high: side(|corners| &corners.1),
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
}
