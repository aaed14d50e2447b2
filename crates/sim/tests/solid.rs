//! The shipped robot's files are what the generator writes from the solids, and a finer mesh is nearer to these.

#![allow(clippy::unwrap_used)]

#[path = "../examples/generate_iiwa/files.rs"]
mod files;
#[path = "../examples/generate_iiwa/inertia.rs"]
mod inertia;
#[path = "../examples/generate_iiwa/urdf.rs"]
mod urdf;

use std::path::Path;

use palpate_model::{LoadOptions, TriangleMesh, iiwa14};
use palpate_sim::solid::{link, with_finer_body};

#[test]
fn files_are_what_the_generator_writes() {
    let repository = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let files = files::files();
    assert_eq!(files.len(), 9);
    for (path, text) in files {
        let shipped = std::fs::read_to_string(repository.join(&path)).unwrap();
        assert!(shipped == text, "{path} is not what generate_iiwa writes");
    }
}

/// Greatest angle between triangles' normals and the solid's beneath their middles, of nine in ten, rad.
fn wrong_normals(mesh: &TriangleMesh, number: usize) -> f64 {
    let solid = link(number);
    let mut angles: Vec<f64> = (0..mesh.triangles.len())
        .map(|index| {
            let [a, b, c] = mesh.corners(index);
            let middle = (a.coords + b.coords + c.coords) / 3.0;
            let normal = (b - a).cross(&(c - a));
            let sides = [a, b, c]
                .map(|corner| solid.gradient(corner.coords).angle(&solid.gradient(middle)));
            normal.angle(&solid.gradient(middle)) + sides.into_iter().fold(0.0, f64::max)
        })
        .collect();
    angles.sort_by(f64::total_cmp);
    angles[angles.len() * 9 / 10]
}

#[test]
fn a_finer_body_turns_less_from_triangle_to_triangle() {
    let robot = iiwa14(&LoadOptions::default()).unwrap();
    let index = robot.link_index("lbr_link_7").unwrap();
    let finer = with_finer_body(&robot, index, 2.0).unwrap();
    let [own, finer] = [&robot, &finer].map(|robot| robot.links[index].mesh.as_ref().unwrap());
    assert!(finer.triangles.len() > 3 * own.triangles.len());
    let [coarse, fine] = [own, finer].map(|mesh| wrong_normals(mesh, 7));
    assert!(fine < 0.7 * coarse, "{fine} {coarse}");
}
