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

/// Half of the side of the piece of a plane that is drawn, m.
const PLANE_PIECE: f64 = 0.25;

/// The obstacle's triangles, of a plane those around `contact_in_root`.
pub fn of_obstacle(obstacle: &Obstacle, contact_in_root: &Point3<f64>) -> Vec<Facet> {
    let pose = &obstacle.root_from_obstacle;
    if let ObstacleKind::Plane {} = obstacle.kind {
        let middle = pose.inverse_transform_point(contact_in_root);
        let corner = |x: f64, y: f64| pose * Point3::new(middle.x + x, middle.y + y, 0.0);
        let p = PLANE_PIECE;
        let square = [corner(-p, -p), corner(p, -p), corner(p, p), corner(-p, p)];
        let normals = [pose * Vector3::z(); 4];
        return quad(square, normals).into();
    }
    let vertex = |direction: &Vector3<f64>| pose * support(&obstacle.kind, direction);
    let directions = sphere_directions();
    let mut facets = Vec::new();
    for rows in directions.windows(2) {
        for column in 0..COLUMNS {
            let next = (column + 1) % COLUMNS;
            let all = [
                rows[0][column],
                rows[1][column],
                rows[1][next],
                rows[0][next],
            ];
            let turned = all.map(|direction| pose * direction);
            facets.extend(quad(all.map(|direction| vertex(&direction)), turned));
        }
    }
    facets
}

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

/// The outermost point of a rounded convex body in a direction, in its frame.
fn support(kind: &ObstacleKind, direction: &Vector3<f64>) -> Point3<f64> {
    let core = match *kind {
        ObstacleKind::Sphere { .. } | ObstacleKind::Plane {} => Vector3::zeros(),
        ObstacleKind::Cylinder { half_length, .. } => Vector3::new(0.0, 0.0, half_length),
        ObstacleKind::Box {
            half_extents,
            fillet,
        } => Vector3::from(half_extents).add_scalar(-fillet),
    };
    let outermost = core.zip_map(direction, |half, d| half.copysign(d));
    Point3::from(outermost + direction * kind.rounding().unwrap_or(0.0))
}

/// Two triangles, counter-clockwise as the corners are.
fn quad(corners: [Point3<f64>; 4], normals: [Vector3<f64>; 4]) -> [Facet; 2] {
    [[0, 1, 2], [0, 2, 3]].map(|pick| Facet {
        corners: pick.map(|i: usize| corners[i]),
        normals: pick.map(|i: usize| normals[i]),
        material: Material::Obstacle,
    })
}
