//! Other meshes of the same body: finer and rounder, or coarser.

use std::collections::{BTreeMap, HashMap, HashSet};

use nalgebra::{Point3, Vector3};
use palpate_model::TriangleMesh;

/// Triangles that meet at a larger angle (cosine of their normals below this) meet at a true edge of the body: 40°.
const CREASE_COSINE: f64 = 0.766;

/// Splits every triangle into four, `levels` times, with the new vertices where a curved surface through the old ones
/// would be; edges sharper than 40° and open borders stay straight.
///
/// The curve over an edge is that of curved PN triangles (Vlachos et al., I3D 2001): a cubic that leaves both ends at
/// right angles to the normals there. Corners stay where they are, so a refined cylinder is nearer to the true one.
pub fn refine(mesh: &TriangleMesh, levels: u32) -> TriangleMesh {
    (0..levels).fold(mesh.clone(), |mesh, _| refine_once(&mesh))
}

fn refine_once(mesh: &TriangleMesh) -> TriangleMesh {
    let normals: Vec<_> = (0..mesh.triangles.len())
        .map(|triangle| crate::scene::triangle_normal(mesh, triangle))
        .collect();
    let sides = sides_of(mesh);
    let corners = CornerNormals::new(mesh, &normals, &sides);
    let mut vertices = mesh.vertices.clone();
    let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
    let mut triangles = Vec::with_capacity(4 * mesh.triangles.len());
    for (index, &[a, b, c]) in mesh.triangles.iter().enumerate() {
        let mut middle = |from: u32, to: u32| {
            *middles.entry(undirected(from, to)).or_insert_with(|| {
                let is_smooth = smooth_neighbour(&sides, &normals, from, to).is_some();
                vertices.push(if is_smooth {
                    let (start, end) = (corners.at(index, from), corners.at(index, to));
                    curve_middle(mesh, from, to, &start, &end)
                } else {
                    nalgebra::center(&mesh.vertices[from as usize], &mesh.vertices[to as usize])
                });
                (vertices.len() - 1) as u32
            })
        };
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    TriangleMesh {
        vertices,
        triangles,
    }
}

/// Middle of the PN triangle's boundary curve over an edge.
fn curve_middle(
    mesh: &TriangleMesh,
    from: u32,
    to: u32,
    normal_at_start: &Vector3<f64>,
    normal_at_end: &Vector3<f64>,
) -> Point3<f64> {
    let (start, end) = (mesh.vertices[from as usize], mesh.vertices[to as usize]);
    let edge = end - start;
    let bulge =
        normal_at_end * edge.dot(normal_at_end) - normal_at_start * edge.dot(normal_at_start);
    nalgebra::center(&start, &end) + bulge / 8.0
}

fn undirected(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}

/// The triangles at each edge.
type Sides = HashMap<(u32, u32), Vec<usize>>;

fn sides_of(mesh: &TriangleMesh) -> Sides {
    let mut sides = Sides::new();
    for (index, &[a, b, c]) in mesh.triangles.iter().enumerate() {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            sides.entry(undirected(from, to)).or_default().push(index);
        }
    }
    sides
}

/// The two triangles at an edge, if there are just two and the surface goes on smoothly from one to the other.
fn smooth_neighbour(
    sides: &Sides,
    normals: &[Vector3<f64>],
    from: u32,
    to: u32,
) -> Option<[usize; 2]> {
    match sides.get(&undirected(from, to)).map(Vec::as_slice) {
        Some(&[one, other]) if normals[one].dot(&normals[other]) > CREASE_COSINE => {
            Some([one, other])
        }
        _ => None,
    }
}

/// Normals at the corners of triangles, each the mean over the triangles that are reached around the vertex without
/// crossing a crease, so that both sides of a smooth edge see the same one.
struct CornerNormals {
    of_corner: HashMap<(usize, u32), Vector3<f64>>,
}

impl CornerNormals {
    fn new(mesh: &TriangleMesh, normals: &[Vector3<f64>], sides: &Sides) -> Self {
        let mut of_corner = HashMap::new();
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            for &vertex in triangle {
                if of_corner.contains_key(&(index, vertex)) {
                    continue;
                }
                let fan = smooth_fan(mesh, normals, sides, index, vertex);
                let sum: Vector3<f64> = (fan.iter())
                    .map(|&member| normals[member] * angle_at(mesh, member, vertex))
                    .sum();
                let normal = sum.try_normalize(1e-12).unwrap_or(normals[index]);
                of_corner.extend(fan.into_iter().map(|member| ((member, vertex), normal)));
            }
        }
        Self { of_corner }
    }

    fn at(&self, triangle: usize, vertex: u32) -> Vector3<f64> {
        (self.of_corner.get(&(triangle, vertex)).copied()).unwrap_or_default()
    }
}

fn smooth_fan(
    mesh: &TriangleMesh,
    normals: &[Vector3<f64>],
    sides: &Sides,
    start: usize,
    vertex: u32,
) -> Vec<usize> {
    let mut fan = vec![start];
    let mut next = 0;
    while let Some(&triangle) = fan.get(next) {
        next += 1;
        for other in mesh.triangles[triangle]
            .into_iter()
            .filter(|&v| v != vertex)
        {
            let pair = smooth_neighbour(sides, normals, vertex, other).unwrap_or([triangle; 2]);
            for neighbour in pair {
                if !fan.contains(&neighbour) {
                    fan.push(neighbour);
                }
            }
        }
    }
    fan
}

fn angle_at(mesh: &TriangleMesh, triangle: usize, vertex: u32) -> f64 {
    let apex = mesh.vertices[vertex as usize];
    let others = mesh.triangles[triangle].iter().filter(|&&v| v != vertex);
    let mut sides = others.map(|&v| mesh.vertices[v as usize] - apex);
    match (sides.next(), sides.next()) {
        (Some(one), Some(other)) => one.angle(&other),
        _ => 0.0,
    }
}

/// A coarser mesh with triangles of roughly `edge` (m): vertices that share a cell of a cubic grid become one, at their
/// mean, and triangles that lose their area go. Thin parts may fold together; the result is as good as a hasty CAD
/// export, which is what it stands for. A mesh of longer edges, or an `edge` that is not positive, stays as it is.
pub fn coarsen(mesh: &TriangleMesh, edge: f64) -> TriangleMesh {
    if edge.is_nan() || edge <= 0.0 {
        return mesh.clone();
    }
    let cell_of = |point: &Point3<f64>| point.coords.map(|x| (x / edge).floor() as i64);
    let mut clusters: BTreeMap<[i64; 3], (Vector3<f64>, f64)> = BTreeMap::new();
    for vertex in &mesh.vertices {
        let cluster = clusters.entry(cell_of(vertex).into()).or_default();
        *cluster = (cluster.0 + vertex.coords, cluster.1 + 1.0);
    }
    let index_of: HashMap<_, _> = clusters.keys().copied().zip(0_u32..).collect();
    let new_index =
        |vertex: u32| index_of[&<[i64; 3]>::from(cell_of(&mesh.vertices[vertex as usize]))];
    let mut seen = HashSet::new();
    let triangles = (mesh.triangles.iter())
        .map(|triangle| triangle.map(new_index))
        .filter(|[a, b, c]| a != b && b != c && c != a)
        .filter(|triangle| {
            let mut sorted = *triangle;
            sorted.sort_unstable();
            seen.insert(sorted)
        })
        .collect();
    TriangleMesh {
        vertices: (clusters.values())
            .map(|(sum, count)| Point3::from(sum / *count))
            .collect(),
        triangles,
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use super::*;

    /// A ball of radius 1 about the origin.
    fn ball(around: u32) -> TriangleMesh {
        let ring_count = around / 2 - 1;
        let mut vertices = vec![-Point3::<f64>::from(Vector3::z()), Vector3::z().into()];
        for ring in 1..=ring_count {
            let polar = PI - TAU * f64::from(ring) / f64::from(around);
            vertices.extend((0..around).map(|step| {
                let (sin, cos) = (TAU * f64::from(step) / f64::from(around)).sin_cos();
                Point3::new(polar.sin() * cos, polar.sin() * sin, polar.cos())
            }));
        }
        let at = |ring: u32, step: u32| 2 + ring * around + step % around;
        let mut triangles = Vec::new();
        for step in 0..around {
            triangles.push([0, at(0, step + 1), at(0, step)]);
            triangles.push([1, at(ring_count - 1, step), at(ring_count - 1, step + 1)]);
            for ring in 0..ring_count - 1 {
                let (a, b) = (at(ring, step), at(ring, step + 1));
                let (c, d) = (at(ring + 1, step), at(ring + 1, step + 1));
                triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
        TriangleMesh {
            vertices,
            triangles,
        }
    }

    /// A cube of side 2 about the origin.
    fn cube() -> TriangleMesh {
        let at = |bit: u32, index: u32| f64::from(index >> bit & 1) * 2.0 - 1.0;
        let vertices = (0..8)
            .map(|i| Point3::new(at(0, i), at(1, i), at(2, i)))
            .collect();
        let quads = [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ];
        let triangles = quads
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect();
        TriangleMesh {
            vertices,
            triangles,
        }
    }

    fn is_closed(mesh: &TriangleMesh) -> bool {
        sides_of(mesh).values().all(|sides| sides.len() == 2)
    }

    fn farthest_from_sphere(mesh: &TriangleMesh) -> f64 {
        let centre_of = |triangle| {
            mesh.corners(triangle)
                .iter()
                .map(|p| p.coords / 3.0)
                .sum::<Vector3<f64>>()
        };
        (0..mesh.triangles.len())
            .map(|triangle| (centre_of(triangle).norm() - 1.0).abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn refining_a_ball_brings_it_nearer_to_the_sphere() {
        let coarse = ball(16);
        let (once, twice) = (refine(&coarse, 1), refine(&coarse, 2));
        assert_eq!(once.triangles.len(), 4 * coarse.triangles.len());
        assert!(is_closed(&coarse) && is_closed(&once) && is_closed(&twice));
        assert!(farthest_from_sphere(&once) < 0.5 * farthest_from_sphere(&coarse));
        assert!(farthest_from_sphere(&twice) < farthest_from_sphere(&once));
        assert_eq!(once.vertices[..coarse.vertices.len()], coarse.vertices[..]);
    }

    #[test]
    fn refining_a_cube_keeps_it_a_cube() {
        let fine = refine(&cube(), 2);
        assert!(is_closed(&fine));
        assert!(
            fine.vertices
                .iter()
                .all(|vertex| (vertex.coords.amax() - 1.0).abs() < 1e-12)
        );
        assert!((fine.signed_volume() - 8.0).abs() < 1e-12);
    }

    #[test]
    fn coarsening_makes_longer_edges_and_keeps_the_shape() {
        let fine = refine(&ball(32), 1);
        let coarse = coarsen(&fine, 0.4);
        let longest = (coarse.triangles.iter())
            .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
            .map(|(a, b)| (coarse.vertices[a as usize] - coarse.vertices[b as usize]).norm())
            .fold(0.0, f64::max);
        assert!((0.4..1.0).contains(&longest), "{longest}");
        assert!(coarse.triangles.len() * 10 < fine.triangles.len());
        assert!(coarse.signed_volume() > 0.85 * fine.signed_volume());
    }

    #[test]
    fn coarsening_to_nothing_changes_nothing() {
        for edge in [0.0, -1.0, f64::NAN] {
            assert_eq!(coarsen(&cube(), edge), cube());
        }
    }
}
