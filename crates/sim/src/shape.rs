//! The one place where the project's meshes and poses become parry's.

use nalgebra::{Isometry3, Point3};
use palpate_model::TriangleMesh;
use parry3d_f64::math::{Pose, Rotation, Vector};
use parry3d_f64::shape::TriMesh;

/// A mesh prepared for exact distance queries.
///
/// # Errors
/// Parry's reason, if the mesh has no triangles.
pub(crate) fn tri_mesh(mesh: &TriangleMesh) -> Result<TriMesh, String> {
    let vertices = mesh.vertices.iter().map(to_vector).collect();
    TriMesh::new(vertices, mesh.triangles.clone()).map_err(|error| error.to_string())
}

pub(crate) fn to_vector(point: &Point3<f64>) -> Vector {
    Vector::new(point.x, point.y, point.z)
}

pub(crate) fn to_point(vector: Vector) -> Point3<f64> {
    Point3::new(vector.x, vector.y, vector.z)
}

pub(crate) fn to_pose(a_from_b: &Isometry3<f64>) -> Pose {
    let rotation = a_from_b.rotation.quaternion().coords;
    Pose::from_parts(
        to_vector(&a_from_b.translation.vector.into()),
        Rotation::from_xyzw(rotation.x, rotation.y, rotation.z, rotation.w),
    )
}
