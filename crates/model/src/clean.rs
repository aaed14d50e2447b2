//! Cleaning of meshes: what real files carry and the filter cannot use.

use std::collections::{HashMap, HashSet};

use nalgebra::Point3;

use crate::TriangleMesh;

/// Vertices at most this far apart are one, m. Well above the rounding of the single precision that files hold, well
/// below what a robot's surface shows.
const SAME_VERTEX: f64 = 1e-6;

/// A triangle whose height is at most this, m, has no usable normal.
const LEAST_HEIGHT: f64 = 1e-7;

/// What cleaning changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cleaning {
    /// Vertices merged into an earlier one at the same place.
    pub duplicate_vertices: usize,
    /// Triangles dropped because they have no area.
    pub degenerate_triangles: usize,
    /// Triangles dropped because another one has the same corners in the same order.
    pub duplicate_triangles: usize,
    /// Triangles dropped because a corner is NaN or infinite, or not among the vertices.
    pub invalid_triangles: usize,
}

/// Merges duplicate vertices and drops invalid, degenerate and duplicate triangles, and vertices that no triangle
/// uses. Holes stay.
pub(crate) fn clean(mesh: &TriangleMesh) -> (TriangleMesh, Cleaning) {
    let mut cleaning = Cleaning::default();
    let mut welder = Welder::default();
    let mut seen = HashSet::new();
    let mut triangles = Vec::new();
    let mut welded = vec![None; mesh.vertices.len()];
    for triangle in &mesh.triangles {
        let Some(corners) = corners_if_valid(mesh, triangle) else {
            cleaning.invalid_triangles += 1;
            continue;
        };
        let mut merged = [0; 3];
        for ((merged, &old), corner) in merged.iter_mut().zip(triangle).zip(&corners) {
            *merged = *welded[old as usize].get_or_insert_with(|| welder.weld(corner));
        }
        if is_degenerate(&merged.map(|vertex| welder.vertices[vertex as usize])) {
            cleaning.degenerate_triangles += 1;
        } else if seen.insert(from_lowest(merged)) {
            triangles.push(merged);
        } else {
            cleaning.duplicate_triangles += 1;
        }
    }
    cleaning.duplicate_vertices = welded.iter().flatten().count() - welder.vertices.len();
    let mesh = TriangleMesh {
        vertices: welder.vertices,
        triangles,
    };
    (without_unused_vertices(&mesh), cleaning)
}

fn corners_if_valid(mesh: &TriangleMesh, triangle: &[u32; 3]) -> Option<[Point3<f64>; 3]> {
    let [a, b, c] = triangle.map(|vertex| mesh.vertices.get(vertex as usize).copied());
    let corners = [a?, b?, c?];
    let finite = |corner: &Point3<f64>| corner.iter().all(|value| value.is_finite());
    corners.iter().all(finite).then_some(corners)
}

/// The same triangle, its corners turned until the lowest index comes first.
fn from_lowest([a, b, c]: [u32; 3]) -> [u32; 3] {
    match a.min(b).min(c) {
        lowest if lowest == a => [a, b, c],
        lowest if lowest == b => [b, c, a],
        _ => [c, a, b],
    }
}

fn is_degenerate([a, b, c]: &[Point3<f64>; 3]) -> bool {
    let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
    let doubled_area = (b - a).cross(&(c - a)).norm();
    doubled_area <= longest * LEAST_HEIGHT
}

/// The mesh with the vertices that its triangles use.
pub(crate) fn without_unused_vertices(mesh: &TriangleMesh) -> TriangleMesh {
    let mut kept = TriangleMesh::default();
    let mut new_index = HashMap::new();
    for triangle in &mesh.triangles {
        let triangle = triangle.map(|old| {
            *new_index.entry(old).or_insert_with(|| {
                kept.vertices.push(mesh.vertices[old as usize]);
                kept.vertices.len() as u32 - 1
            })
        });
        kept.triangles.push(triangle);
    }
    kept
}

/// Finds vertices at the same place by a grid of cells as wide as two such vertices may be apart.
#[derive(Default)]
struct Welder {
    vertices: Vec<Point3<f64>>,
    cells: HashMap<[i64; 3], Vec<u32>>,
}

impl Welder {
    fn weld(&mut self, point: &Point3<f64>) -> u32 {
        let cell = |value: f64| (value / SAME_VERTEX).floor() as i64;
        let centre = [cell(point.x), cell(point.y), cell(point.z)];
        if let Some(found) = self.find(point, centre) {
            return found;
        }
        let index = self.vertices.len() as u32;
        self.vertices.push(*point);
        self.cells.entry(centre).or_default().push(index);
        index
    }

    fn find(&self, point: &Point3<f64>, centre: [i64; 3]) -> Option<u32> {
        let neighbours = (0..27).map(|code| {
            // The cell itself first: where vertices are repeated exactly, as in STL, the search ends there.
            let code = (code + 13) % 27;
            let step = [code / 9 - 1, code / 3 % 3 - 1, code % 3 - 1];
            [0, 1, 2].map(|axis| centre[axis].saturating_add(step[axis]))
        });
        neighbours
            .filter_map(|cell| self.cells.get(&cell))
            .flatten()
            .copied()
            .find(|&index| (self.vertices[index as usize] - point).norm() <= SAME_VERTEX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square_with_faults() -> TriangleMesh {
        let points = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
            [1.0, 1e-9, 0.0],
            [f64::NAN, 0.0, 0.0],
            [0.5, 0.0, 0.0],
        ];
        TriangleMesh {
            vertices: points.map(Point3::from).to_vec(),
            triangles: vec![
                [0, 1, 2],
                [0, 2, 3],
                [4, 2, 0],
                [0, 6, 1],
                [1, 4, 2],
                [0, 5, 2],
                [0, 9, 2],
            ],
        }
    }

    #[test]
    fn each_fault_is_counted_once_and_the_rest_stays() {
        let (mesh, cleaning) = clean(&square_with_faults());
        assert_eq!(mesh.triangles, vec![[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.vertices.len(), 4);
        let expected = Cleaning {
            duplicate_vertices: 1,
            degenerate_triangles: 2,
            duplicate_triangles: 1,
            invalid_triangles: 2,
        };
        assert_eq!(cleaning, expected);
    }

    #[test]
    fn cleaning_again_changes_nothing() {
        let (once, _) = clean(&square_with_faults());
        let (twice, cleaning) = clean(&once);
        assert_eq!(once, twice);
        assert_eq!(cleaning, Cleaning::default());
    }

    #[test]
    fn vertices_on_both_sides_of_a_cell_wall_are_one() {
        let edge = 5.0 * SAME_VERTEX;
        for axis in 0..3 {
            let mut welder = Welder::default();
            let mut near = Point3::new(0.1, 0.2, 0.3);
            near[axis] = edge - 1e-12;
            let mut far = near;
            far[axis] = edge + 1e-12;
            assert_eq!(welder.weld(&near), welder.weld(&far));
        }
    }
}
