//! The body of the iiwa that ships with the project: the solids that its meshes are made from.

mod contour;
mod links;
mod shape;

use palpate_model::{Robot, TriangleMesh};

pub use contour::contour;
pub use links::{CELLS, HEIGHTS, MASSES, SEAM_RADII, link};
pub use shape::Shape;

/// Vertices are rounded to so many parts of a metre: far finer than any mesh.
const PARTS: f64 = 1e9;

/// The shipped iiwa with the mesh of one of its links replaced by one with triangles that many times smaller, made from
/// the solid itself: nearer to the body that a real arm would have. None for a link that is not one of the iiwa's.
pub fn with_finer_body(robot: &Robot, link_index: usize, finer: f64) -> Option<Robot> {
    let mut robot = robot.clone();
    let touched = robot.links.get_mut(link_index)?;
    let number: usize = touched.name.strip_prefix("lbr_link_")?.parse().ok()?;
    touched.mesh = Some(body(number, CELLS.get(number)? / finer));
    Some(robot)
}

fn body(number: usize, step: f64) -> TriangleMesh {
    contour(&link(number), step, PARTS)
}
