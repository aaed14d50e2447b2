//! The robot that ships with the project: a KUKA LBR iiwa 14 R820, embedded.

use crate::{EmbeddedMeshes, LoadOptions, ModelError, Robot};

/// The URDF of the robot that ships with the project. Its meshes are [`IIWA14_MESHES`].
pub const IIWA14_URDF: &str = include_str!("../../../urdf/iiwa14.urdf");

/// Address and bytes of a file of the package.
macro_rules! mesh {
    ($path:literal) => {
        (
            concat!("package://palpate/", $path),
            include_bytes!(concat!("../../../", $path)),
        )
    };
}

/// The meshes that [`IIWA14_URDF`] names, as Wavefront OBJ.
pub const IIWA14_MESHES: EmbeddedMeshes = EmbeddedMeshes(&[
    mesh!("meshes/link_0.obj"),
    mesh!("meshes/link_1.obj"),
    mesh!("meshes/link_2.obj"),
    mesh!("meshes/link_3.obj"),
    mesh!("meshes/link_4.obj"),
    mesh!("meshes/link_5.obj"),
    mesh!("meshes/link_6.obj"),
    mesh!("meshes/link_7.obj"),
]);

/// A KUKA LBR iiwa 14 R820 from its published dimensions: links `lbr_link_0` to `lbr_link_7` and `lbr_link_ee` (the
/// flange), joints `lbr_A1` to `lbr_A7`; at zero it stands straight up along z. Opens no file.
///
/// # Errors
/// If `options` are out of range.
pub fn iiwa14(options: &LoadOptions) -> Result<Robot, ModelError> {
    let (robot, _) = Robot::from_urdf(IIWA14_URDF, &IIWA14_MESHES, options)?;
    Ok(robot)
}
