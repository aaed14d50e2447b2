//! Wavefront OBJ, by tobj.

use std::fmt::Write;

use nalgebra::Point3;

use crate::{ModelError, TriangleMesh};

/// Reads positions and faces; polygons become fans of triangles.
pub(super) fn parse(bytes: &[u8]) -> Result<TriangleMesh, ModelError> {
    let text = positions_and_faces(&String::from_utf8_lossy(bytes));
    let options = tobj::LoadOptions {
        single_index: true,
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
    };
    let no_materials = |_: &std::path::Path| Err(tobj::LoadError::OpenFileFailed);
    let (models, _) = tobj::load_obj_buf(&mut text.as_bytes(), &options, no_materials)
        .map_err(|error| malformed(&text, error))?;
    let mut mesh = TriangleMesh::default();
    for model in &models {
        let (positions, _) = model.mesh.positions.as_chunks::<3>();
        let (triangles, _) = model.mesh.indices.as_chunks::<3>();
        mesh.append(&TriangleMesh {
            vertices: positions
                .iter()
                .map(|&position| Point3::from(position))
                .collect(),
            triangles: triangles.to_vec(),
        });
    }
    Ok(mesh)
}

/// The file without colours, normals, textures, groups and materials: a fault in those must not cost the shape.
fn positions_and_faces(text: &str) -> String {
    let joined = text.replace("\\\r\n", " ").replace("\\\n", " ");
    let mut kept = String::with_capacity(joined.len());
    for line in joined.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                kept.push('v');
                words.take(3).for_each(|word| _ = write!(kept, " {word}"));
            }
            Some("f") => {
                kept.push('f');
                for word in words {
                    let position = word.split('/').next().unwrap_or_default();
                    _ = write!(kept, " {position}");
                }
            }
            _ => continue,
        }
        kept.push('\n');
    }
    kept
}

fn malformed(text: &str, error: tobj::LoadError) -> ModelError {
    let count = |start: char| text.lines().filter(|line| line.starts_with(start)).count();
    ModelError::MeshFile {
        format: "OBJ",
        reason: format!(
            "{error} (found {} vertices and {} faces)",
            count('v'),
            count('f')
        ),
    }
}
