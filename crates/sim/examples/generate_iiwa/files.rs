//! The files of the robot, as text.

use std::collections::{HashMap, hash_map::Entry};
use std::fmt::Write;

use nalgebra::Vector3;
use palpate_model::TriangleMesh;

use palpate_sim::solid::{self, Shape};

use crate::{inertia, urdf};

/// Coordinates are written to so many parts of a metre.
const PARTS: f64 = 1e5;
/// A corner whose normals differ by more than this cosine (about 25°) lies on a rim.
const RIM_COSINE: f64 = 0.9;

/// Paths (relative to the package) and contents: one OBJ a link, then the URDF.
pub fn files() -> Vec<(String, String)> {
    let mut files = Vec::new();
    let mut inertias = Vec::new();
    for (index, (&cell, &mass)) in solid::CELLS.iter().zip(&solid::MASSES).enumerate() {
        let solid = solid::link(index);
        let mesh = solid::contour(&solid, cell, PARTS);
        inertias.push(inertia::inertia(&mesh, mass));
        files.push((
            format!("meshes/link_{index}.obj"),
            obj(index, &mesh, &solid),
        ));
    }
    files.push(("urdf/iiwa14.urdf".to_owned(), urdf::urdf(&inertias)));
    files
}

/// Wavefront OBJ. Corners have the solid's normal; at rims, where there are two, the one on their triangle's side.
fn obj(index: usize, mesh: &TriangleMesh, solid: &Shape) -> String {
    let of_vertices: Vec<_> = (mesh.vertices.iter())
        .map(|vertex| solid.gradient(vertex.coords).normalize())
        .collect();
    let (mut normals, mut faces) = (Normals::default(), String::new());
    for (triangle, vertices) in mesh.triangles.iter().enumerate() {
        let corners = mesh.corners(triangle).map(|corner| corner.coords);
        let [a, b, c] = corners;
        let flat = (b - a).cross(&(c - a)).normalize();
        let middle = (a + b + c) / 3.0;
        // Writing to a string cannot fail.
        let _ = write!(faces, "f");
        for (&vertex, corner) in vertices.iter().zip(corners) {
            let smooth = of_vertices[vertex as usize];
            let is_rim = smooth.dot(&flat) < RIM_COSINE;
            let beside = || solid.gradient(0.5 * (corner + middle)).normalize();
            let normal = normals.number(if is_rim { beside() } else { smooth });
            let _ = write!(faces, " {}//{normal}", vertex + 1);
        }
        let _ = writeln!(faces);
    }
    let mut text = format!("# lbr_link_{index}, metres, written by generate_iiwa\n");
    for vertex in &mesh.vertices {
        let [x, y, z] = vertex.coords.map(no_minus_zero).into();
        let _ = writeln!(text, "v {x:.5} {y:.5} {z:.5}");
    }
    text + &normals.text + &faces
}

/// The `vn` lines of an OBJ, none twice.
#[derive(Default)]
struct Normals {
    text: String,
    numbers: HashMap<String, usize>,
}

impl Normals {
    /// Number of a normal, counted from one, which is added if it is new.
    fn number(&mut self, normal: Vector3<f64>) -> usize {
        let thousandths = normal.map(|x| no_minus_zero((x * 1e3).round() / 1e3));
        let [x, y, z] = thousandths.into();
        let line = format!("vn {x:.3} {y:.3} {z:.3}\n");
        let next = self.numbers.len() + 1;
        match self.numbers.entry(line) {
            Entry::Occupied(old) => *old.get(),
            Entry::Vacant(new) => {
                self.text.push_str(new.key());
                *new.insert(next)
            }
        }
    }
}

fn no_minus_zero(value: f64) -> f64 {
    if value == 0.0 { 0.0 } else { value }
}
