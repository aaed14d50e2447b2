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

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn write(dir: &Path, name: &str) {
        let path = dir.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, name).unwrap();
    }

    /// Files whose content is their own path in the folder.
    fn folder(names: &[&str]) -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        names.iter().for_each(|name| write(dir.path(), name));
        dir
    }

    fn read(files: &MeshFiles, uri: &str) -> String {
        String::from_utf8(files.read(uri).unwrap()).unwrap()
    }

    #[test]
    fn paths_are_relative_to_the_urdf_or_absolute() {
        let dir = folder(&["urdf/meshes/a.stl"]);
        let files = MeshFiles::new(dir.path().join("urdf"), Vec::new(), Vec::new());
        let absolute = dir.path().join("urdf/meshes/a.stl").display().to_string();
        for uri in [
            "meshes/a.stl",
            "../urdf/meshes/a.stl",
            "file://meshes/a.stl",
            &absolute,
            &format!("file://{absolute}"),
        ] {
            assert_eq!(read(&files, uri), "urdf/meshes/a.stl", "{uri}");
        }
    }

    #[test]
    fn packages_are_found_in_each_place() {
        let names = [
            "given/one/a.stl",
            "two/b.stl",
            "ament/share/three/c.stl",
            "four/urdf/deep/robot.urdf",
            "four/d.stl",
        ];
        let dir = folder(&names);
        let at = |name: &str| dir.path().join(name);
        let packages = vec![at("given"), at("two")];
        let files = MeshFiles::new(
            at("four/urdf/deep"),
            packages,
            vec![at("none"), at("ament")],
        );
        assert_eq!(read(&files, "package://one/a.stl"), names[0]);
        assert_eq!(read(&files, "package://two/b.stl"), names[1]);
        assert_eq!(read(&files, "package://three/c.stl"), names[2]);
        assert_eq!(read(&files, "package://four/d.stl"), names[4]);
    }

    #[test]
    fn given_folders_come_before_ament_prefixes() {
        let dir = folder(&["given/one/a.stl", "ament/share/one/a.stl"]);
        let at = |name: &str| dir.path().join(name);
        let files = MeshFiles::new(PathBuf::new(), vec![at("given")], vec![at("ament")]);
        assert_eq!(read(&files, "package://one/a.stl"), "given/one/a.stl");
    }

    #[test]
    fn what_is_absent_is_said_with_the_places_searched() {
        let files = MeshFiles::new("a".into(), vec!["b".into()], vec!["c".into()]);
        let error = files.read("package://robot/d.stl").unwrap_err().to_string();
        let searched = ["b/robot/d.stl", "c/share/robot/d.stl"];
        assert!(searched.iter().all(|path| error.contains(path)), "{error}");
        let error = files.read("https://robot/d.stl").unwrap_err().to_string();
        assert!(error.contains("https://robot/d.stl"), "{error}");
        // A folder is no mesh.
        assert!(
            MeshFiles::new(".".into(), Vec::new(), Vec::new())
                .read("")
                .is_err()
        );
    }

    #[test]
    fn embedded_meshes_are_found_by_their_whole_name() {
        let meshes = EmbeddedMeshes(&[("meshes/a.obj", b"a"), ("b.obj", b"b")]);
        assert_eq!(meshes.read("b.obj").unwrap(), b"b");
        let error = meshes.read("a.obj").unwrap_err().to_string();
        assert!(error.contains("meshes/a.obj"), "{error}");
    }
}
