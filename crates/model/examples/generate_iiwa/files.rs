//! The files of the robot, as text.

use std::fmt::Write;

use palpate_model::TriangleMesh;

use crate::{contour, inertia, links, shape::Shape, urdf};

/// Paths (relative to the package) and contents: one OBJ a link, then the URDF.
pub fn files() -> Vec<(String, String)> {
    let mut files = Vec::new();
    let mut inertias = Vec::new();
    for (index, (&cell, &mass)) in links::CELLS.iter().zip(&links::MASSES).enumerate() {
        let solid = links::link(index);
        let mesh = contour::contour(&solid, cell);
        inertias.push(inertia::inertia(&mesh, mass));
        files.push((
            format!("meshes/link_{index}.obj"),
            obj(index, &mesh, &solid),
        ));
    }
    files.push(("urdf/iiwa14.urdf".to_owned(), urdf::urdf(&inertias)));
    files
}

/// Wavefront OBJ with the solid's normals.
fn obj(index: usize, mesh: &TriangleMesh, solid: &Shape) -> String {
    let mut text = format!("# lbr_link_{index}, metres, written by generate_iiwa\n");
    for vertex in &mesh.vertices {
        let [x, y, z] = vertex.coords.map(no_minus_zero).into();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "v {x:.5} {y:.5} {z:.5}");
    }
    for vertex in &mesh.vertices {
        let normal = solid.gradient(vertex.coords).normalize();
        let [x, y, z] = normal
            .map(|x| no_minus_zero((x * 1e3).round() / 1e3))
            .into();
        let _ = writeln!(text, "vn {x:.3} {y:.3} {z:.3}");
    }
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|vertex| vertex + 1);
        let _ = writeln!(text, "f {a}//{a} {b}//{b} {c}//{c}");
    }
    text
}

fn no_minus_zero(value: f64) -> f64 {
    if value == 0.0 { 0.0 } else { value }
}
