//! Writes the robot that ships with the project, `urdf/iiwa14.urdf` and `meshes/link_0.obj` to `link_7.obj`, into the
//! folder given as argument, else into the repository.
//!
//! `cargo run --release -p palpate-sim --example generate_iiwa`

mod files;
mod inertia;
mod urdf;

use std::path::{Path, PathBuf};

fn main() -> std::io::Result<()> {
    let repository = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let folder = std::env::args_os().nth(1).map_or(repository, PathBuf::from);
    for (path, text) in files::files() {
        let path = folder.join(path);
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent)?;
        }
        std::fs::write(&path, text)?;
        println!("{}", path.display());
    }
    Ok(())
}
