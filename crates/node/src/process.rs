//! A ROS 2 node as a process: its log, its end by a signal, its arguments.

use std::io::IsTerminal as _;
use std::panic;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context as _, anyhow};
use signal_hook::consts::{SIGINT, SIGTERM};
use tracing_subscriber::EnvFilter;

/// Logs to stderr, as the environment variable `RUST_LOG` says, else from info on.
pub fn log() {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("info"));
    tracing_subscriber::fmt()
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .with_env_filter(filter)
        .init();
}

/// What SIGINT and SIGTERM set: see [`stopped`].
///
/// # Errors
/// If the system does not let signals be watched.
pub fn watch_signals() -> anyhow::Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&stop))
            .context("cannot watch for signals")?;
    }
    Ok(stop)
}

/// Whether a signal asked to end.
pub fn stopped(stop: &AtomicBool) -> bool {
    stop.load(Ordering::Relaxed)
}

/// A node of this name, unless the process' arguments give it another.
///
/// # Errors
/// If ROS 2 refuses the arguments, or a parameter file among them cannot be read.
pub fn create_node(name: &str) -> anyhow::Result<r2r::Node> {
    r2r::Node::create(create_context()?, name, "").context("cannot create the node")
}

/// r2r panics where rcl refuses an argument.
fn create_context() -> anyhow::Result<r2r::Context> {
    check_files(std::env::args())?;
    let hook = panic::take_hook();
    panic::set_hook(Box::new(|_| {}));
    let created = panic::catch_unwind(r2r::Context::create);
    panic::set_hook(hook);
    created
        .map_err(|refusal| match refusal.downcast::<String>() {
            Ok(reason) => anyhow!("{}", reason.replace('\n', " ")),
            Err(_) => anyhow!("ROS 2 refuses the arguments"),
        })?
        .context("cannot start ROS 2")
}

/// Looks at the parameter files among the arguments, as ROS 2 itself ends the process over one that is missing.
fn check_files(arguments: impl Iterator<Item = String>) -> anyhow::Result<()> {
    let arguments: Vec<_> = arguments.collect();
    for pair in arguments.windows(2) {
        if let [option, file] = pair
            && option == "--params-file"
        {
            std::fs::read(file)
                .with_context(|| format!("cannot read the parameter file {file}"))?;
        }
    }
    Ok(())
}
