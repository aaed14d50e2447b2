//! Mesh files, told apart by their extension.

mod dae;
mod dae_primitive;
mod obj;
mod stl;

use crate::{ModelError, TriangleMesh};

/// Reads a mesh file as it is: in its own frame and unit, not cleaned.
///
/// # Errors
/// If the extension of `uri` is unknown or the bytes break the rules of their format.
pub(crate) fn parse(uri: &str, bytes: &[u8]) -> Result<TriangleMesh, ModelError> {
    let extension = uri.rsplit_once('.').map_or("", |(_, extension)| extension);
    match extension.to_ascii_lowercase().as_str() {
        "dae" => dae::parse(bytes),
        "obj" => obj::parse(bytes),
        "stl" => stl::parse(bytes),
        _ => Err(ModelError::MeshKind {
            what: "mesh format",
            expected: ".obj, .stl or .dae",
            found: uri.to_owned(),
        }),
    }
}

#[cfg(test)]
mod tests;
