//! The links of the LBR iiwa 14 R820 as solids, from its published dimensions.
//!
//! Solids are described standing: in the arm's zero pose, straight up, with the link's origin at zero, x to the front,
//! y to the side along the swivel axes, z up. `standing_from_link` then turns the link's own frame into that one.

use nalgebra::Vector3;

use super::shape::Shape;

/// Heights (m) of joint k + 1 over joint k's frame, the last that of the flange over joint 7.
pub const HEIGHTS: [f64; 8] = [0.1575, 0.2025, 0.2045, 0.2155, 0.1845, 0.2155, 0.081, 0.045];
/// Masses (kg), 29.9 in all, shared out like the links' sizes.
pub const MASSES: [f64; 8] = [5.0, 5.7, 5.9, 3.6, 3.5, 3.1, 2.1, 1.0];
/// Grid steps (m) that give each link its number of triangles.
pub const CELLS: [f64; 8] = [
    0.0111, 0.0110, 0.0106, 0.0100, 0.0098, 0.0086, 0.0080, 0.0054,
];

/// Radii (m) of the housings that turn about z at the seams A1, A3, A5, A7.
pub const SEAM_RADII: [f64; 4] = [0.086, 0.068, 0.068, 0.050];
/// Width (m) over which the rims of the parts are worn.
const EDGE: f64 = 0.002;

/// The solid of a link in its own frame.
pub fn link(index: usize) -> Shape {
    let standing = match index {
        0 => base(),
        1 => elbow(0.081, 0.112, SEAM_RADII[0], HEIGHTS[1]).seen_from(hanging(-1.0, HEIGHTS[1])),
        2 => elbow(0.081, 0.126, SEAM_RADII[1], HEIGHTS[2]),
        3 => elbow(0.0645, 0.110, SEAM_RADII[1], HEIGHTS[3]).seen_from(hanging(1.0, HEIGHTS[3])),
        4 => elbow(0.0645, 0.110, SEAM_RADII[2], HEIGHTS[4]).seen_from(|p| mirrored(p, -1.0)),
        5 => forearm(),
        6 => wrist(),
        _ => flange(),
    };
    standing.seen_from(move |point| standing_from_link(index, point))
}

/// Standing coordinates of a point of a link's frame while the arm is straight up.
fn standing_from_link(index: usize, point: Vector3<f64>) -> Vector3<f64> {
    let [x, y, z] = point.into();
    match index {
        2 | 6 => Vector3::new(-x, z, y),
        4 => Vector3::new(x, -z, y),
        5 => Vector3::new(-x, -y, z),
        _ => point,
    }
}

fn mirrored(point: Vector3<f64>, side: f64) -> Vector3<f64> {
    Vector3::new(point.x, side * point.y, point.z)
}

/// Turns an elbow upside down: its swivel axis at `height`, its neck down to zero, its drum to one side.
fn hanging(side: f64, height: f64) -> impl Fn(Vector3<f64>) -> Vector3<f64> {
    move |point| Vector3::new(point.x, side * point.y, height - point.z)
}

/// A drum about y, of one radius and `depth` to the side y > 0, whose neck bends up to a round seam at `height`.
/// The next link's drum turns at y < 0.
fn elbow(radius: f64, depth: f64, seam_radius: f64, height: f64) -> Shape {
    let drum = Shape::drum(
        [0.0, -0.1, 0.0],
        [0.0, depth, 0.0],
        [radius; 2],
        0.8 * radius,
    );
    let top = Shape::drum(
        [0.0, 0.0, height - 0.065],
        [0.0, 0.0, height + 0.1],
        [seam_radius; 2],
        0.04,
    );
    let bend = Shape::capsule(
        [0.0, depth - 0.95 * seam_radius, 0.0],
        [0.0, 0.0, height - 0.03],
        [0.9 * seam_radius; 2],
    );
    let room = |gap: f64, end: f64| {
        Shape::drum([0.0, -0.3, 0.0], [0.0, end, 0.0], [radius + gap; 2], EDGE)
    };
    let neck = top.or(bend, 0.02).without(room(0.012, 0.0), 0.06);
    neck.or(drum.and(Shape::half_space(1, -1.0, 0.0), EDGE), 0.03)
        .without(room(0.004, -0.004), 0.012)
        .without(room(0.0, 0.0), EDGE)
        .and(Shape::half_space(2, 1.0, height), EDGE)
}

/// A cone on four feet, and the box for the cables at the back.
fn base() -> Shape {
    let height = HEIGHTS[0];
    let cone = Shape::drum([0.0; 3], [0.0, 0.0, height], [0.102, SEAM_RADII[0]], EDGE);
    let foot =
        |x: f64, y: f64| Shape::drum([x, y, 0.0], [0.6 * x, 0.6 * y, 0.11], [0.030, 0.015], 0.008);
    let cables = Shape::block([-0.136, -0.052, 0.0], [-0.03, 0.052, 0.118], 0.012);
    let feet = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
    (feet.iter().fold(cone, |solid, (x, y)| {
        solid.or(foot(0.082 * x, 0.082 * y), 0.02)
    }))
    .or(cables, 0.015)
    .and(Shape::half_space(2, -1.0, 0.0), EDGE)
    .and(Shape::half_space(2, 1.0, height), EDGE)
}

/// Housing of A5 that thins to a blade beside the wrist.
fn forearm() -> Shape {
    let height = HEIGHTS[5];
    let housing = Shape::drum(
        [0.0, 0.0, -0.1],
        [0.0, 0.0, 0.072],
        [SEAM_RADII[2]; 2],
        0.035,
    );
    let shoulder = Shape::capsule([0.0, -0.010, 0.03], [0.0, -0.066, 0.125], [0.054, 0.024]);
    let blade = Shape::block([-0.035, -0.096, 0.05], [0.035, -0.066, height], 0.014)
        .seen_from(|p| Vector3::new(p.x, p.y - 0.25 * (0.17 - p.z).max(0.0), p.z));
    let disc = Shape::drum(
        [0.0, -0.098, height],
        [0.0, -0.063, height],
        [0.049; 2],
        0.010,
    );
    let room = Shape::drum([0.0, -0.063, height], [0.0, 0.3, height], [0.095; 2], 0.004);
    (housing.or(shoulder, 0.02).or(blade, 0.04).or(disc, 0.03))
        .without(room, 0.02)
        .and(Shape::half_space(2, -1.0, 0.0), EDGE)
}

/// The compact wrist that swivels on the forearm's blade.
fn wrist() -> Shape {
    let height = HEIGHTS[6];
    let drum = Shape::drum(
        [0.0, -0.15, -0.014],
        [0.0, 0.062, -0.014],
        [0.060; 2],
        0.048,
    );
    let neck = Shape::drum([0.0, 0.0, -0.03], [0.0, 0.0, 0.2], [0.062, 0.042], 0.01);
    drum.or(neck, 0.04)
        .and(Shape::half_space(1, -1.0, -0.062), EDGE)
        .and(Shape::half_space(2, 1.0, height), EDGE)
}

/// The flange that carries the tool.
fn flange() -> Shape {
    let ring = Shape::drum([0.0; 3], [0.0, 0.0, 0.028], [SEAM_RADII[3]; 2], EDGE);
    let face = Shape::drum([0.0; 3], [0.0, 0.0, HEIGHTS[7]], [0.042; 2], EDGE);
    ring.or(face, EDGE)
        .and(Shape::half_space(2, -1.0, 0.0), EDGE)
}
