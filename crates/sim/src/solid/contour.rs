//! From a solid to triangles: surface nets on a grid, then vertices moved until the faces lie on the surface.
//!
//! Surface nets: S. F. Frisken Gibson, "Constrained Elastic Surface Nets", MICCAI 1998. The moving, which spreads the
//! vertices evenly and draws them onto sharp rims: Y. Ohtake and A. G. Belyaev, "Dual/Primal Mesh Optimization for
//! Polygonized Implicit Surfaces", SMA 2002.

use std::collections::HashMap;

use nalgebra::{Matrix3, Point3, Vector3};
use palpate_model::TriangleMesh;

use super::shape::Shape;

/// Half the edge (m) of the cube about the origin that is searched.
const REACH: f64 = 0.36;
/// Rounds of moving the vertices.
const ROUNDS: usize = 15;
/// Weight that holds a vertex to the middle of its faces, against 1 that holds it to their planes.
const MIDDLE_WEIGHT: f64 = 0.1;
/// How much longer than the other a quad's diagonal may be, a unit of its distance to the surface.
const DISTANCE_WEIGHT: f64 = 20.0;

type Cell = [i32; 3];

/// Triangles of the surface of `shape`, from a grid of cubes of edge `step` (m); coordinates rounded to the metre's
/// `parts`.
pub fn contour(shape: &Shape, step: f64, parts: f64) -> TriangleMesh {
    let mut net = Net::new(shape, step);
    for _ in 0..ROUNDS {
        net.relax(shape, step);
    }
    let rounded = |vertex: &Vector3<f64>| Point3::from(vertex.map(|x| (x * parts).round() / parts));
    let vertices: Vec<_> = net.vertices.iter().map(rounded).collect();
    let split = |quad| split(shape, &vertices, quad);
    let triangles = net.quads.iter().flat_map(split).collect();
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

    /// Moves every vertex to where the planes of the faces around it meet, or as near as it is held to their middle.
    fn relax(&mut self, shape: &Shape, step: f64) {
        let mut fits = vec![Fit::default(); self.vertices.len()];
        for quad in &self.quads {
            let sum: Vector3<f64> = quad.iter().map(|&v| self.vertices[v as usize]).sum();
            let middle = onto_surface(shape, 0.25 * sum);
            let normal = shape.gradient(middle).normalize();
            for &vertex in quad {
                fits[vertex as usize].add(middle, normal);
            }
        }
        for (vertex, fit) in self.vertices.iter_mut().zip(&fits) {
            *vertex = fit.vertex(step);
        }
    }
}

/// Sums over the planes that a vertex should lie on, each through a point, with a normal.
#[derive(Clone, Default)]
struct Fit {
    count: f64,
    points: Vector3<f64>,
    /// Σ n nᵀ
    normals: Matrix3<f64>,
    /// Σ n (nᵀ p)
    offsets: Vector3<f64>,
}

impl Fit {
    fn add(&mut self, point: Vector3<f64>, normal: Vector3<f64>) {
        self.count += 1.0;
        self.points += point;
        self.normals += normal * normal.transpose();
        self.offsets += normal * normal.dot(&point);
    }

    /// Least squares from the points' middle, no farther from it than `most`.
    fn vertex(&self, most: f64) -> Vector3<f64> {
        let middle = self.points / self.count;
        let residual = self.offsets - self.normals * middle;
        let matrix = self.normals + Matrix3::identity() * (MIDDLE_WEIGHT * self.count);
        let shift = solve(&matrix, &residual);
        middle + shift * (most / shift.norm().max(most))
    }
}

/// Cramer's rule, for a matrix that is positive definite.
fn solve(matrix: &Matrix3<f64>, right: &Vector3<f64>) -> Vector3<f64> {
    let [a, b, c] = [0, 1, 2].map(|column| matrix.column(column).into_owned());
    let determinant = a.dot(&b.cross(&c));
    let along = [b.cross(&c), c.cross(&a), a.cross(&b)].map(|normal| right.dot(&normal));
    Vector3::from(along) / determinant
}

fn onto_surface(shape: &Shape, mut point: Vector3<f64>) -> Vector3<f64> {
    for _ in 0..3 {
        let gradient = shape.gradient(point);
        point -= gradient * (shape.value(point) / gradient.norm_squared().max(0.1));
    }
    point
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

/// Splits a quad along the diagonal that is short, near the surface, and leaves no sliver.
fn split(shape: &Shape, vertices: &[Point3<f64>], quad: &[u32; 4]) -> [[u32; 3]; 2] {
    let &[a, b, c, d] = quad;
    let at = |vertex: u32| vertices[vertex as usize].coords;
    let cost = |triangles: &[[u32; 3]; 2]| {
        let [from, _, to] = triangles[0].map(at);
        let distance = shape.value(0.5 * (from + to)).abs();
        let [first, second] = triangles.map(|triangle| fullness(triangle.map(at)));
        ((to - from).norm() + DISTANCE_WEIGHT * distance) / first.min(second)
    };
    let splits = [[[a, b, c], [c, d, a]], [[b, c, d], [d, a, b]]];
    if cost(&splits[0]) <= cost(&splits[1]) {
        splits[0]
    } else {
        splits[1]
    }
}

/// Height of a triangle over its longest side, a unit of that side.
fn fullness([a, b, c]: [Vector3<f64>; 3]) -> f64 {
    let sides = [b - a, c - b, a - c].map(|side| side.norm_squared());
    (b - a).cross(&(c - a)).norm() / sides[0].max(sides[1]).max(sides[2])
}
