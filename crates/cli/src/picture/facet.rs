//! The triangles to draw: those of the arm and of the obstacle.

use std::f64::consts::{PI, TAU};

use nalgebra::{Isometry3, Point3, Vector3};
use palpate_model::{Kinematics, Robot, TriangleMesh};
use palpate_sim::{Obstacle, ObstacleKind};

/// What a triangle belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Material {
    Arm,
    TouchedLink,
    Obstacle,
}

/// A triangle in the root frame with the surface's normals at its corners.
#[derive(Clone, Debug)]
pub struct Facet {
    pub corners: [Point3<f64>; 3],
    pub normals: [Vector3<f64>; 3],
    pub material: Material,
}

impl Facet {
    pub fn centre(&self) -> Point3<f64> {
        let [a, b, c] = &self.corners;
        Point3::from((a.coords + b.coords + c.coords) / 3.0)
    }

    pub fn mean_normal(&self) -> Vector3<f64> {
        let [a, b, c] = &self.normals;
        (a + b + c).normalize()
    }

    /// Whether the front side is towards a viewer in direction `out`.
    pub fn faces(&self, out: &Vector3<f64>) -> bool {
        let [a, b, c] = &self.corners;
        (b - a).cross(&(c - a)).dot(out) > 0.0
    }

    /// Four smaller ones, whose normals follow the surface.
    pub fn quarters(&self) -> [Self; 4] {
        let middle = |i: usize, j: usize| {
            (
                nalgebra::center(&self.corners[i], &self.corners[j]),
                (self.normals[i] + self.normals[j]).normalize(),
            )
        };
        let corner = |i: usize| (self.corners[i], self.normals[i]);
        let (ab, bc, ca) = (middle(0, 1), middle(1, 2), middle(2, 0));
        let facet = |all: [(Point3<f64>, Vector3<f64>); 3]| Self {
            corners: all.map(|(point, _)| point),
            normals: all.map(|(_, normal)| normal),
            material: self.material,
        };
        [
            facet([corner(0), ab, ca]),
            facet([ab, corner(1), bc]),
            facet([ca, bc, corner(2)]),
            facet([ab, bc, ca]),
        ]
    }
}

/// The arm's triangles at a configuration.
pub fn of_arm(robot: &Robot, kinematics: &Kinematics, touched: usize) -> Vec<Facet> {
    let mut facets = Vec::new();
    for (index, link) in robot.links.iter().enumerate() {
        let material = match index == touched {
            true => Material::TouchedLink,
            false => Material::Arm,
        };
        if let Some(mesh) = &link.mesh {
            let root_from_link = kinematics.root_from_link(index);
            facets.extend(of_mesh(mesh, root_from_link, material));
        }
    }
    facets
}

fn of_mesh<'a>(
    mesh: &'a TriangleMesh,
    root_from_mesh: &'a Isometry3<f64>,
    material: Material,
) -> impl Iterator<Item = Facet> + 'a {
    let normals = corner_normals(mesh);
    (0..mesh.triangles.len()).map(move |triangle| Facet {
        corners: mesh.corners(triangle).map(|corner| root_from_mesh * corner),
        normals: normals[triangle].map(|normal| root_from_mesh * normal),
        material,
    })
}

/// Normals at the corners of each triangle: the mean of the triangles around, but for those beyond a sharp edge.
fn corner_normals(mesh: &TriangleMesh) -> Vec<[Vector3<f64>; 3]> {
    const SMOOTH_COS: f64 = 0.8;
    let weighted: Vec<Vector3<f64>> = (0..mesh.triangles.len())
        .map(|triangle| {
            let [a, b, c] = mesh.corners(triangle);
            (b - a).cross(&(c - a))
        })
        .collect();
    let mut around = vec![Vec::new(); mesh.vertices.len()];
    for (triangle, corners) in mesh.triangles.iter().enumerate() {
        for &vertex in corners {
            around[vertex as usize].push(triangle);
        }
    }
    let normal_at = |triangle: usize, vertex: u32| {
        let own = weighted[triangle].normalize();
        let smooth = |other: &&Vector3<f64>| other.normalize().dot(&own) > SMOOTH_COS;
        let neighbours = around[vertex as usize].iter().map(|&t| &weighted[t]);
        neighbours.filter(smooth).sum::<Vector3<f64>>().normalize()
    };
    (mesh.triangles.iter().enumerate())
        .map(|(triangle, corners)| corners.map(|vertex| normal_at(triangle, vertex)))
        .collect()
}

/// The obstacle's triangles, of a plane those around `contact_in_root`.
pub fn of_obstacle(obstacle: &Obstacle, contact_in_root: &Point3<f64>) -> Vec<Facet> {
    if let ObstacleKind::Plane {} = obstacle.kind {
        return plane_piece(obstacle, contact_in_root);
    }
    let rows: Vec<Vec<_>> = (sphere_directions().iter())
        .map(|row| {
            row.iter()
                .map(|direction| skin(obstacle, direction))
                .collect()
        })
        .collect();
    let mut facets = Vec::new();
    for pair in rows.windows(2) {
        for column in 0..COLUMNS {
            let next = (column + 1) % COLUMNS;
            facets.extend(quad([
                pair[0][column],
                pair[1][column],
                pair[1][next],
                pair[0][next],
            ]));
        }
    }
    // The ends, which a box has as faces.
    for column in 1..COLUMNS - 1 {
        let (top, bottom) = (&rows[0], &rows[ROWS - 1]);
        facets.push(triangle([top[0], top[column], top[column + 1]]));
        facets.push(triangle([bottom[0], bottom[column + 1], bottom[column]]));
    }
    facets
}

/// A corner of a triangle and the normal there, in the root frame.
type Corner = (Point3<f64>, Vector3<f64>);

const ROWS: usize = 24;
const COLUMNS: usize = 48;

/// Directions over the sphere, in rows from the top to the bottom; none lies on a plane of symmetry.
fn sphere_directions() -> Vec<Vec<Vector3<f64>>> {
    let row = |row: usize| {
        let (sin, cos) = (PI * row as f64 / (ROWS - 1) as f64).sin_cos();
        let column = move |column: usize| {
            let angle = TAU * (column as f64 + 0.5) / COLUMNS as f64;
            Vector3::new(sin * angle.cos(), sin * angle.sin(), cos)
        };
        (0..COLUMNS).map(column).collect()
    };
    (0..ROWS).map(row).collect()
}

/// The outermost point of a rounded convex body in a direction of its frame.
fn skin(obstacle: &Obstacle, direction: &Vector3<f64>) -> Corner {
    let core = match obstacle.kind {
        ObstacleKind::Sphere { .. } | ObstacleKind::Plane {} => Vector3::zeros(),
        ObstacleKind::Cylinder { half_length, .. } => Vector3::new(0.0, 0.0, half_length),
        ObstacleKind::Box {
            half_extents,
            fillet,
        } => Vector3::from(half_extents).add_scalar(-fillet),
    };
    let outermost = core.zip_map(direction, |half, d| half.copysign(d));
    let rounding = obstacle.kind.rounding().unwrap_or(0.0);
    let pose = &obstacle.root_from_obstacle;
    (
        pose * Point3::from(outermost + direction * rounding),
        pose * direction,
    )
}

/// A square piece of a plane about a point, with both its sides.
fn plane_piece(plane: &Obstacle, about_in_root: &Point3<f64>) -> Vec<Facet> {
    const HALF: f64 = 0.2;
    let pose = &plane.root_from_obstacle;
    let middle = pose.inverse_transform_point(about_in_root);
    let corner = |x: f64, y: f64| {
        let point = Point3::new(middle.x + x * HALF, middle.y + y * HALF, 0.0);
        (pose * point, pose * Vector3::z())
    };
    let [a, b, c, d] = [
        corner(-1.0, -1.0),
        corner(1.0, -1.0),
        corner(1.0, 1.0),
        corner(-1.0, 1.0),
    ];
    let below = |(point, normal): Corner| (point, -normal);
    (quad([a, b, c, d]).into_iter())
        .chain(quad([d, c, b, a].map(below)))
        .collect()
}

/// Two triangles, counter-clockwise as the corners are.
fn quad([a, b, c, d]: [Corner; 4]) -> [Facet; 2] {
    [triangle([a, b, c]), triangle([a, c, d])]
}

fn triangle(corners: [Corner; 3]) -> Facet {
    Facet {
        corners: corners.map(|(point, _)| point),
        normals: corners.map(|(_, normal)| normal),
        material: Material::Obstacle,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area_and_volume(kind: ObstacleKind) -> (f64, f64) {
        let root_from_obstacle = Isometry3::translation(0.3, 0.2, 0.1);
        let obstacle = Obstacle {
            kind,
            root_from_obstacle,
        };
        let facets = of_obstacle(&obstacle, &Point3::origin());
        let doubled = |f: &Facet| {
            let [a, b, c] = &f.corners;
            (b - a).cross(&(c - a))
        };
        let area: f64 = facets.iter().map(|f| 0.5 * doubled(f).norm()).sum();
        let volume: f64 = (facets.iter())
            .map(|f| f.corners[0].coords.dot(&doubled(f)) / 6.0)
            .sum();
        (area, volume)
    }

    fn assert_near((area, volume): (f64, f64), expected_area: f64, expected_volume: f64) {
        assert!(
            (area / expected_area - 1.0).abs() < 0.02,
            "{area} {expected_area}"
        );
        assert!(
            (volume / expected_volume - 1.0).abs() < 0.02,
            "{volume} {expected_volume}"
        );
    }

    #[test]
    fn obstacles_are_closed_and_face_outwards() {
        let r: f64 = 0.05;
        let (ball_area, ball) = (4.0 * PI * r * r, 4.0 / 3.0 * PI * r.powi(3));
        assert_near(
            area_and_volume(ObstacleKind::Sphere { radius: r }),
            ball_area,
            ball,
        );
        let pole = ObstacleKind::Cylinder {
            radius: r,
            half_length: 0.2,
            axis: None,
        };
        assert_near(
            area_and_volume(pole),
            ball_area + TAU * r * 0.4,
            ball + PI * r * r * 0.4,
        );
        let cube = ObstacleKind::Box {
            half_extents: [0.1, 0.2, 0.3],
            fillet: 1e-4,
        };
        assert_near(
            area_and_volume(cube),
            8.0 * (0.02 + 0.03 + 0.06),
            8.0 * 0.006,
        );
    }

    #[test]
    fn a_piece_of_a_plane_has_two_sides() {
        let (area, volume) = area_and_volume(ObstacleKind::Plane {});
        assert!((area - 0.32).abs() < 1e-12, "{area}");
        assert!(volume.abs() < 1e-12, "{volume}");
    }
}
