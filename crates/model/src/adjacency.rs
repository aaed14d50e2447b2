//! Which triangles of a mesh meet at its vertices and edges.

use nalgebra::Vector3;

use crate::TriangleMesh;
use crate::lists::Lists;
use crate::triangle::NONE;

/// An edge, seen from one of its ends.
pub(crate) struct Spoke {
    /// From this end to the other, m.
    pub(crate) edge: Vector3<f64>,
    /// The triangles on both sides; [`NONE`] on the rim of a hole.
    pub(crate) triangles: [u32; 2],
}

/// The triangles that have each vertex.
pub(crate) fn triangles_around_vertices(mesh: &TriangleMesh) -> Lists<u32> {
    let mut around = vec![Vec::new(); mesh.vertices.len()];
    for (index, triangle) in (0..).zip(&mesh.triangles) {
        for &vertex in triangle {
            around[vertex as usize].push(index);
        }
    }
    let mut lists = Lists::default();
    around.into_iter().for_each(|list| lists.push(list));
    lists
}

/// The triangle across each edge of one, or [`NONE`].
pub(crate) fn triangles_across_edges(
    mesh: &TriangleMesh,
    around: &Lists<u32>,
    index: usize,
) -> [u32; 3] {
    let vertices = mesh.triangles[index];
    [0, 1, 2].map(|edge| {
        let (from, to) = (vertices[edge], vertices[(edge + 1) % 3]);
        let shares = |&&other: &&u32| {
            other as usize != index && mesh.triangles[other as usize].contains(&to)
        };
        let mut others = around.get(from as usize).iter();
        others.find(shares).copied().unwrap_or(NONE)
    })
}

/// The edges that leave a vertex. Where more than two triangles meet at one, it comes more than once.
pub(crate) fn spokes_of(mesh: &TriangleMesh, vertex: u32, around: &[u32]) -> Vec<Spoke> {
    let others = |&index: &u32| {
        let ends = mesh.triangles[index as usize].into_iter();
        ends.filter(move |&end| end != vertex)
            .map(move |end| (end, index))
    };
    let mut ends: Vec<(u32, u32)> = around.iter().flat_map(others).collect();
    ends.sort_unstable();
    ends.chunk_by(|a, b| a.0 == b.0)
        .flat_map(|same_end| same_end.chunks(2))
        .map(|pair| Spoke {
            edge: mesh.vertices[pair[0].0 as usize] - mesh.vertices[vertex as usize],
            triangles: [pair[0].1, pair.get(1).map_or(NONE, |second| second.1)],
        })
        .collect()
}
