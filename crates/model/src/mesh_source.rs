//! Where meshes come from: the addresses that a URDF gives, and the bytes behind them.

use std::path::{Path, PathBuf};

use crate::ModelError;

/// Gives the bytes behind a mesh's address.
pub trait MeshSource {
    /// Reads the mesh at `uri`, as the URDF writes it.
    ///
    /// # Errors
    /// If there is no such mesh, or it cannot be read.
    fn read(&self, uri: &str) -> Result<Vec<u8>, ModelError>;
}

/// Meshes in files: `package://`, `file://`, absolute, and relative to the URDF.
///
/// `package://name/path` is looked for, in this order, as `path` in a package folder that is itself called `name`, as
/// `name/path` in each package folder, as `share/name/path` under each ament prefix, as `path` in a folder called
/// `name` that the URDF lies in, however deep, and as `path` beside the URDF's folder, which is where a ROS package has
/// it, whatever the folder of a checkout is called.
#[derive(Clone, Debug, Default)]
pub struct MeshFiles {
    urdf_dir: PathBuf,
    package_dirs: Vec<PathBuf>,
    ament_prefixes: Vec<PathBuf>,
}

impl MeshFiles {
    /// Meshes of a URDF that lies in `urdf_dir`. Reads no environment: the caller gives the ament prefixes.
    pub fn new(
        urdf_dir: PathBuf,
        package_dirs: Vec<PathBuf>,
        ament_prefixes: Vec<PathBuf>,
    ) -> Self {
        Self {
            urdf_dir,
            package_dirs,
            ament_prefixes,
        }
    }

    /// The places where the mesh at `uri` may be, best first.
    fn candidates(&self, uri: &str) -> Result<Vec<PathBuf>, ModelError> {
        match uri.split_once("://") {
            None => Ok(vec![self.urdf_dir.join(uri)]),
            Some(("file", path)) => Ok(vec![self.urdf_dir.join(path)]),
            Some(("package", path)) => Ok(self.in_packages(path)),
            Some(_) => Err(ModelError::MeshKind {
                what: "kind of mesh address",
                expected: "package://, file:// or a path",
                found: uri.to_owned(),
            }),
        }
    }

    fn in_packages(&self, path: &str) -> Vec<PathBuf> {
        let (package, path) = path.split_once('/').unwrap_or((path, ""));
        let is_package = |dir: &&Path| dir.file_name().is_some_and(|name| name == package);
        let own = self
            .package_dirs
            .iter()
            .map(PathBuf::as_path)
            .filter(is_package);
        let below = self.package_dirs.iter().map(|dir| dir.join(package));
        let share = (self.ament_prefixes.iter()).map(|prefix| prefix.join("share").join(package));
        let around = self.urdf_dir.ancestors().filter(is_package);
        own.map(Path::to_owned)
            .chain(below)
            .chain(share)
            .chain(around.map(Path::to_owned))
            .chain(self.urdf_dir.parent().map(Path::to_owned))
            .map(|dir| dir.join(path))
            .collect()
    }
}

impl MeshSource for MeshFiles {
    fn read(&self, uri: &str) -> Result<Vec<u8>, ModelError> {
        let candidates = self.candidates(uri)?;
        let Some(path) = candidates.iter().find(|path| path.is_file()) else {
            let searched: Vec<_> = (candidates.iter())
                .map(|path| path.display().to_string())
                .collect();
            return Err(ModelError::MeshNotFound {
                searched: if searched.is_empty() {
                    "the package folders and ament prefixes, of which none are given".to_owned()
                } else {
                    searched.join(", ")
                },
            });
        };
        std::fs::read(path).map_err(|source| ModelError::Read {
            path: path.display().to_string(),
            source,
        })
    }
}

/// Meshes inside the program: pairs of address and bytes.
#[derive(Clone, Copy, Debug)]
pub struct EmbeddedMeshes(pub &'static [(&'static str, &'static [u8])]);

impl MeshSource for EmbeddedMeshes {
    fn read(&self, uri: &str) -> Result<Vec<u8>, ModelError> {
        match self.0.iter().find(|(name, _)| *name == uri) {
            Some((_, bytes)) => Ok(bytes.to_vec()),
            None => Err(ModelError::MeshNotFound {
                searched: self
                    .0
                    .iter()
                    .map(|(name, _)| *name)
                    .collect::<Vec<_>>()
                    .join(", "),
            }),
        }
    }
}
