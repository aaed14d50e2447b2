//! From a solid to triangles: surface nets on a grid, then vertices spread evenly and moved onto the surface.
//!
//! Surface nets: S. F. Frisken Gibson, "Constrained Elastic Surface Nets", MICCAI 1998.

use std::collections::HashMap;

use nalgebra::{Point3, Vector3};
use palpate_model::TriangleMesh;

use crate::shape::Shape;

/// Half the edge (m) of the cube about the origin that is searched.
const REACH: f64 = 0.36;
/// Rounds of spreading the vertices.
const ROUNDS: usize = 12;

type Cell = [i32; 3];

/// Triangles of the surface of `shape`, from a grid of cubes of edge `step` (m); coordinates rounded to 1e-5 m.
pub fn contour(shape: &Shape, step: f64) -> TriangleMesh {
    let mut net = Net::new(shape, step);
    let neighbors = neighbors(net.vertices.len(), &net.quads);
    for _ in 0..ROUNDS {
        spread(shape, &mut net.vertices, &neighbors);
    }
    let vertices: Vec<_> = net
        .vertices
        .iter()
        .map(|v| Point3::from(v.map(rounded)))
        .collect();
    let triangles = net
        .quads
        .iter()
        .flat_map(|quad| split(quad, &vertices))
        .collect();
    TriangleMesh {
        vertices,
        triangles,
    }
}

/// Vertices, one a cell that the surface crosses, and quads, one a grid edge that it crosses.
struct Net {
    vertices: Vec<Vector3<f64>>,
    quads: Vec<[u32; 4]>,
    vertex_of_cell: HashMap<Cell, u32>,
}

impl Net {
    fn new(shape: &Shape, step: f64) -> Self {
        // Truncation is meant: the number of cells from the middle to the border.
        let cells = (REACH / step) as i32;
        let position =
            |cell: Cell| Vector3::from(cell.map(|index| (f64::from(index) - 0.5) * step));
        let mut net = Self {
            vertices: Vec::new(),
            quads: Vec::new(),
            vertex_of_cell: HashMap::new(),
        };
        let inside = Inside::new(shape, cells, position);
        for cell in inside.cells() {
            for axis in 0..3 {
                let (here, there) = (inside.at(cell), inside.at(neighbor(cell, axis, 1)));
                if here != there {
                    let around = around(cell, axis).map(|cell| net.vertex(cell, &position, step));
                    let [a, b, c, d] = around;
                    net.quads
                        .push(if here { [a, b, c, d] } else { [d, c, b, a] });
                }
            }
        }
        net
    }

    fn vertex(&mut self, cell: Cell, position: &impl Fn(Cell) -> Vector3<f64>, step: f64) -> u32 {
        let vertices = &mut self.vertices;
        *self.vertex_of_cell.entry(cell).or_insert_with(|| {
            vertices.push(position(cell).add_scalar(0.5 * step));
            u32::try_from(vertices.len() - 1).unwrap_or(u32::MAX)
        })
    }
}

/// Which grid points lie inside.
struct Inside {
    cells: i32,
    flags: Vec<bool>,
}

impl Inside {
    fn new(shape: &Shape, cells: i32, position: impl Fn(Cell) -> Vector3<f64>) -> Self {
        let mut inside = Self {
            cells,
            flags: Vec::new(),
        };
        inside.flags = inside
            .cells()
            .map(|cell| shape.value(position(cell)) < 0.0)
            .collect();
        inside
    }

    fn cells(&self) -> impl Iterator<Item = Cell> + use<> {
        let range = -self.cells..self.cells;
        let plane = move |z: i32, range: std::ops::Range<i32>| {
            let line = range.clone();
            range.flat_map(move |y| line.clone().map(move |x| [x, y, z]))
        };
        range.clone().flat_map(move |z| plane(z, range.clone()))
    }

    fn at(&self, cell: Cell) -> bool {
        let size = 2 * self.cells;
        let [x, y, z] = cell.map(|index| index + self.cells);
        let index = (z * size + y) * size + x;
        [x, y, z].iter().all(|index| (0..size).contains(index))
            && usize::try_from(index).is_ok_and(|index| self.flags[index])
    }
}

fn neighbor(mut cell: Cell, axis: usize, offset: i32) -> Cell {
    cell[axis] += offset;
    cell
}

/// The four cells about the grid edge that goes from the lowest corner of `cell` along `axis`, counter-clockwise.
fn around(cell: Cell, axis: usize) -> [Cell; 4] {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let (left, below) = (neighbor(cell, u, -1), neighbor(cell, v, -1));
    [neighbor(left, v, -1), below, cell, left]
}

fn neighbors(vertices: usize, quads: &[[u32; 4]]) -> Vec<Vec<u32>> {
    let mut neighbors = vec![Vec::new(); vertices];
    for quad in quads {
        for side in 0..4 {
            neighbors[quad[side] as usize].push(quad[(side + 1) % 4]);
        }
    }
    neighbors
}

/// Moves every vertex to the middle of its neighbours, along the surface, and then onto the surface.
fn spread(shape: &Shape, vertices: &mut [Vector3<f64>], neighbors: &[Vec<u32>]) {
    let old = vertices.to_vec();
    for (vertex, neighbors) in vertices.iter_mut().zip(neighbors) {
        let sum: Vector3<f64> = neighbors.iter().map(|&other| old[other as usize]).sum();
        *vertex = sum / neighbors.len() as f64;
        for _ in 0..3 {
            let gradient = shape.gradient(*vertex);
            *vertex -= gradient * (shape.value(*vertex) / gradient.norm_squared().max(0.1));
        }
    }
}

/// Splits a quad along its shorter diagonal.
fn split(quad: &[u32; 4], vertices: &[Point3<f64>]) -> [[u32; 3]; 2] {
    let &[a, b, c, d] = quad;
    let length =
        |from: u32, to: u32| (vertices[from as usize] - vertices[to as usize]).norm_squared();
    if length(a, c) <= length(b, d) {
        [[a, b, c], [a, c, d]]
    } else {
        [[a, b, d], [b, c, d]]
    }
}

fn rounded(coordinate: f64) -> f64 {
    (coordinate * 1e5).round() / 1e5
}
