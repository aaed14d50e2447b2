//! What the sources of the crates must not contain.

// Helpers of tests may fail as tests do.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};

fn crates() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Files below a folder, with what they say before their tests.
fn sources(folder: &Path) -> Vec<(String, String)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs")
            && !path.ends_with("tests.rs")
        {
            let text = fs::read_to_string(&path).unwrap();
            let text = text.split("#[cfg(test)]").next().unwrap().to_owned();
            found.push((path.file_name().unwrap().to_str().unwrap().to_owned(), text));
        }
    }
    found
}

#[test]
fn only_the_node_depends_on_r2r() {
    let mut dependents = Vec::new();
    for entry in fs::read_dir(crates()).unwrap() {
        let folder = entry.unwrap().path();
        let manifest = fs::read_to_string(folder.join("Cargo.toml")).unwrap();
        if manifest.lines().any(|line| line.starts_with("r2r")) {
            dependents.push(folder.file_name().unwrap().to_owned());
        }
    }
    assert_eq!(dependents, ["node"]);
}

/// Nor random numbers but those of a seed.
#[test]
fn model_and_filter_read_no_clock_and_no_environment() {
    for name in ["model", "filter"] {
        let sources = sources(&crates().join(name).join("src"));
        assert!(sources.len() > 10);
        for (file, text) in sources {
            for word in [
                "Instant",
                "SystemTime",
                "env::",
                "rand::rng(",
                "thread_rng",
                "from_os_rng",
                "rand::random",
            ] {
                assert!(!text.contains(word), "{name}: {file} has {word}");
            }
        }
    }
}

#[test]
fn model_and_filter_open_files_only_in_their_loaders() {
    const LOADERS: [&str; 3] = ["urdf.rs", "mesh_source.rs", "settings.rs"];
    for name in ["model", "filter"] {
        for (file, text) in sources(&crates().join(name).join("src")) {
            let opens = text.contains("fs::") || text.contains("File::");
            assert!(
                !opens || LOADERS.contains(&file.as_str()),
                "{name}: {file} opens files"
            );
        }
    }
}
