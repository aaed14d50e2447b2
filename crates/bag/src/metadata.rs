//! Which files a bag consists of: rosbag2's `metadata.yaml`, read leniently, or what lies in the folder.

use std::path::{Path, PathBuf};

use serde_yaml_ng::Value;

use crate::BagError;

/// Files of the bag at `path`, in their order of recording. Adds to `warnings` what had to be guessed.
pub(crate) fn files_of(path: &Path, warnings: &mut Vec<String>) -> Result<Vec<PathBuf>, BagError> {
    let failed = |source| BagError::File {
        path: path.to_owned(),
        source,
    };
    if !path.metadata().map_err(failed)?.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let metadata = path.join("metadata.yaml");
    let listed = if metadata.is_file() {
        listed_files(path, &metadata, warnings)?
    } else {
        Vec::new()
    };
    if !listed.is_empty() {
        return Ok(listed);
    }
    let mut found = Vec::new();
    for entry in path.read_dir().map_err(failed)? {
        let entry = entry.map_err(failed)?.path();
        if entry.is_file() && is_bag_name(&entry) {
            found.push(entry);
        }
    }
    found.sort_by_key(|path| natural_order(path));
    if found.is_empty() {
        return Err(BagError::NotABag {
            path: path.to_owned(),
            found: names_in(path),
        });
    }
    Ok(found)
}

/// The files that the metadata lists, if it can be understood and any of them exists.
fn listed_files(
    folder: &Path,
    metadata: &Path,
    warnings: &mut Vec<String>,
) -> Result<Vec<PathBuf>, BagError> {
    let text = std::fs::read(metadata).map_err(|source| BagError::File {
        path: metadata.to_owned(),
        source,
    })?;
    let Some(names) = relative_paths(&String::from_utf8_lossy(&text)) else {
        let metadata = metadata.display();
        warnings.push(format!(
            "{metadata}: no relative_file_paths in it; taking the folder's files in the order of their names"
        ));
        return Ok(Vec::new());
    };
    let mut files = Vec::new();
    for name in names {
        match existing(folder, &name) {
            Some(file) => files.push(file),
            None => warnings.push(format!(
                "{}: lists {name}, which is not there",
                metadata.display()
            )),
        }
    }
    Ok(files)
}

fn relative_paths(text: &str) -> Option<Vec<String>> {
    let yaml: Value = serde_yaml_ng::from_str(text).ok()?;
    let paths = yaml
        .get("rosbag2_bagfile_information")?
        .get("relative_file_paths")?
        .as_sequence()?;
    paths
        .iter()
        .map(|path| Some(path.as_str()?.to_owned()))
        .collect()
}

/// The listed file: as listed, without the folder's name in front (as old versions wrote it), and with `.zstd` added
/// or taken away.
fn existing(folder: &Path, name: &str) -> Option<PathBuf> {
    let bare = Path::new(name).file_name()?.to_str()?;
    let unpacked = bare.strip_suffix(".zstd").unwrap_or(bare);
    [
        folder.join(name),
        folder.join(bare),
        folder.join(unpacked),
        folder.join(format!("{unpacked}.zstd")),
    ]
    .into_iter()
    .find(|path| path.is_file())
}

fn is_bag_name(path: &Path) -> bool {
    let name = path.to_string_lossy();
    [".mcap", ".db3", ".mcap.zstd", ".db3.zstd"]
        .iter()
        .any(|ending| name.ends_with(ending))
}

/// Sorts `bag_10` after `bag_9`: by length first, then by name.
fn natural_order(path: &Path) -> (usize, PathBuf) {
    (path.as_os_str().len(), path.to_owned())
}

fn names_in(folder: &Path) -> String {
    let names: Vec<_> = folder
        .read_dir()
        .into_iter()
        .flatten()
        .filter_map(|entry| Some(entry.ok()?.file_name().to_string_lossy().into_owned()))
        .take(8)
        .collect();
    if names.is_empty() {
        "nothing".to_owned()
    } else {
        names.join(", ")
    }
}
