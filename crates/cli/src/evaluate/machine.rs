//! Where and with what an evaluation was made.

use std::path::Path;
use std::process::Command;

/// Facts for a report, as names and values.
pub fn facts() -> Vec<(&'static str, String)> {
    let cores = std::thread::available_parallelism().map_or(0, usize::from);
    let mut facts = vec![
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        (
            "commit",
            commit().unwrap_or_else(|| "not from a checkout".to_owned()),
        ),
        (
            "machine",
            format!(
                "{}, {cores} cores available, {}",
                processor(),
                std::env::consts::OS
            ),
        ),
    ];
    if cfg!(debug_assertions) {
        facts.push((
            "build",
            "with debug assertions: slower than a release".to_owned(),
        ));
    }
    facts
}

/// The processor's name.
fn processor() -> String {
    let told = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = (told.lines())
        .filter_map(|line| line.split_once(':'))
        .find(|(name, _)| name.trim() == "model name");
    model.map_or(std::env::consts::ARCH.to_owned(), |(_, name)| {
        name.trim().to_owned()
    })
}

/// The commit of the checkout that this program was built in, if it still lies there.
fn commit() -> Option<String> {
    let program = std::env::current_exe().ok()?;
    let folder = program.parent()?;
    let hash = git(folder, &["rev-parse", "--short=12", "HEAD"])?;
    let changed = !git(folder, &["status", "--porcelain", "--untracked-files=no"])?.is_empty();
    Some(match changed {
        true => format!("{hash}, with changes"),
        false => hash,
    })
}

fn git(folder: &Path, arguments: &[&str]) -> Option<String> {
    let output = Command::new("git")
        .arg("-C")
        .arg(folder)
        .args(arguments)
        .output()
        .ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}
