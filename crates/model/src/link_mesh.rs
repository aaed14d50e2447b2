//! The mesh of one link, from all its geometry elements.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use crate::clean::clean;
use crate::exposed::exposed;
use crate::split::split;
use crate::{Cleaning, LinkReport, LoadOptions, MeshSource, ModelError, TriangleMesh};
use crate::{mesh_file, shape};

/// The area vectors of a closed surface sum to zero, whatever its triangles. A surface whose sum is at most this share
/// of its area (a box without its lid has a fifth) has an inside and an outside for the winding to be checked by.
const NEARLY_CLOSED: f64 = 0.25;

/// Builds a link's mesh in the link's frame: each element loaded, scaled, moved by its origin, cleaned and turned
/// outwards; then all of them as one, split, without what they enclose.
pub(crate) fn build(
    link: &str,
    elements: &[(&urdf_rs::Pose, &urdf_rs::Geometry)],
    meshes: &dyn MeshSource,
    options: &LoadOptions,
) -> Result<(Option<TriangleMesh>, LinkReport), ModelError> {
    let mut report = LinkReport {
        name: link.to_owned(),
        elements: elements.len(),
        ..LinkReport::default()
    };
    let mut merged = TriangleMesh::default();
    for (origin, geometry) in elements {
        let element = element(origin, geometry, meshes, options, &mut report)
            .map_err(|source| in_geometry(link, describe(geometry), source))?;
        merged.append(&element);
    }
    if elements.is_empty() {
        return Ok((None, report));
    }
    let (mut mesh, cleaning) = clean(&merged);
    report.cleaning += cleaning;
    let edges = mesh.edges();
    report.open_edges = edges.open;
    report.inconsistent_edges = edges.inconsistent;
    report.split_edges = split(&mut mesh, options.max_edge)
        .map_err(|source| in_geometry(link, "its mesh".to_owned(), source))?;
    let mesh = without_enclosed(mesh, &mut report);
    report.triangles = mesh.triangles.len();
    report.vertices = mesh.vertices.len();
    Ok((Some(mesh), report))
}

fn without_enclosed(mesh: TriangleMesh, report: &mut LinkReport) -> TriangleMesh {
    let Some(exposed) = exposed(&mesh) else {
        let warning =
            "its triangles all enclose each other, as nothing else can be touched they are kept";
        report.warnings.push(warning.to_owned());
        return mesh;
    };
    report.enclosed_triangles = mesh.triangles.len() - exposed.triangles.len();
    exposed
}

/// One element's mesh in the link's frame, cleaned and turned outwards.
fn element(
    origin: &urdf_rs::Pose,
    geometry: &urdf_rs::Geometry,
    meshes: &dyn MeshSource,
    options: &LoadOptions,
    report: &mut LinkReport,
) -> Result<TriangleMesh, ModelError> {
    let mut mesh = in_own_frame(geometry, meshes, options)?;
    report.triangles_read += mesh.triangles.len();
    mesh.transform(&pose("origin", origin)?);
    let (mut mesh, cleaning) = clean(&mesh);
    report.cleaning += cleaning;
    if mesh.triangles.is_empty() {
        return Err(ModelError::MeshEmpty {
            found: format!(
                "{} degenerate and {} invalid ones",
                cleaning.degenerate_triangles, cleaning.invalid_triangles
            ),
        });
    }
    if faces_inwards(&mesh) {
        mesh.flip();
        report.warnings.push(format!(
            "{}: its triangles faced inwards and were turned over",
            describe(geometry)
        ));
    }
    Ok(mesh)
}

fn in_own_frame(
    geometry: &urdf_rs::Geometry,
    meshes: &dyn MeshSource,
    options: &LoadOptions,
) -> Result<TriangleMesh, ModelError> {
    use urdf_rs::Geometry;
    Ok(match geometry {
        Geometry::Box { size } => shape::cuboid(&positive("size", &size.0)?.into()),
        Geometry::Cylinder { radius, length } => {
            let [radius, length] = positive("radius and length", &[*radius, *length])?;
            shape::cylinder(radius, length, options.max_edge)
        }
        Geometry::Capsule { radius, length } => {
            let [radius, length] = positive("radius and length", &[*radius, *length])?;
            shape::capsule(radius, length, options.max_edge)
        }
        Geometry::Sphere { radius } => {
            let [radius] = positive("radius", &[*radius])?;
            shape::sphere(radius, options.max_edge)
        }
        Geometry::Mesh { filename, scale } => {
            let mut mesh = mesh_file::parse(filename, &meshes.read(filename)?)?;
            if let Some(scale) = scale {
                mesh.scale(&scale_factors(&scale.0)?);
            }
            mesh
        }
    })
}

fn faces_inwards(mesh: &TriangleMesh) -> bool {
    let area = mesh.area();
    let nearly_closed = mesh.area_vector().norm() <= NEARLY_CLOSED * area;
    // A flat sheet has no volume but for rounding.
    nearly_closed && mesh.signed_volume() < -1e-6 * area.powf(1.5)
}

fn positive<const N: usize>(name: &str, values: &[f64; N]) -> Result<[f64; N], ModelError> {
    if values.iter().all(|value| value.is_finite() && *value > 0.0) {
        return Ok(*values);
    }
    Err(number(name, "lengths above zero", values))
}

fn scale_factors(values: &[f64; 3]) -> Result<Vector3<f64>, ModelError> {
    if values
        .iter()
        .all(|value| value.is_finite() && *value != 0.0)
    {
        return Ok((*values).into());
    }
    Err(number(
        "scale",
        "three finite factors other than zero",
        values,
    ))
}

/// The URDF's pose as a transform: roll, pitch and yaw about the fixed axes.
pub(crate) fn pose(name: &str, pose: &urdf_rs::Pose) -> Result<Isometry3<f64>, ModelError> {
    let [roll, pitch, yaw] = finite(&format!("{name} rpy"), &pose.rpy.0)?;
    let rotation = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
    let translation = Translation3::from(finite(&format!("{name} xyz"), &pose.xyz.0)?);
    Ok(Isometry3::from_parts(translation, rotation))
}

fn finite(name: &str, values: &[f64; 3]) -> Result<[f64; 3], ModelError> {
    if values.iter().all(|value| value.is_finite()) {
        return Ok(*values);
    }
    Err(number(name, "three finite numbers", values))
}

fn number(name: &str, expected: &'static str, found: &[f64]) -> ModelError {
    let found: Vec<_> = found.iter().map(f64::to_string).collect();
    ModelError::Number {
        name: name.to_owned(),
        expected,
        found: found.join(" "),
    }
}

fn in_geometry(link: &str, geometry: String, source: ModelError) -> ModelError {
    ModelError::Geometry {
        link: link.to_owned(),
        geometry,
        source: Box::new(source),
    }
}

fn describe(geometry: &urdf_rs::Geometry) -> String {
    use urdf_rs::Geometry;
    match geometry {
        Geometry::Box { .. } => "box".to_owned(),
        Geometry::Cylinder { .. } => "cylinder".to_owned(),
        Geometry::Capsule { .. } => "capsule".to_owned(),
        Geometry::Sphere { .. } => "sphere".to_owned(),
        Geometry::Mesh { filename, .. } => format!("mesh `{filename}`"),
    }
}

impl std::ops::AddAssign for Cleaning {
    fn add_assign(&mut self, other: Self) {
        self.duplicate_vertices += other.duplicate_vertices;
        self.degenerate_triangles += other.degenerate_triangles;
        self.duplicate_triangles += other.duplicate_triangles;
        self.invalid_triangles += other.invalid_triangles;
    }
}
