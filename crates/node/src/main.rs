//! The ROS 2 node: joint states and external torques in, the contact out.
//!
//! Three threads: this one takes messages and pairs them, one estimates, one draws. The first never waits for the
//! second, nor the second for the third.

mod clock;
mod description;
mod diagnostics;
mod drawing;
mod estimation;
mod messages;
mod order;
mod parameter_services;
mod parameters;
mod reader;
mod services;
mod topics;

use std::io::IsTerminal as _;
use std::panic;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context as _, anyhow};
use signal_hook::consts::{SIGINT, SIGTERM};
use tracing_subscriber::EnvFilter;

/// Exit codes: something wrong with the arguments or parameters, and anything else.
const BAD_PARAMETERS: u8 = 2;
const FAILURE: u8 = 1;

fn main() -> ExitCode {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("info"));
    tracing_subscriber::fmt()
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .with_env_filter(filter)
        .init();
    let (mut node, settings, stop) = match start() {
        Ok(started) => started,
        Err(error) => return report(&error, BAD_PARAMETERS),
    };
    let robot = match description::from_settings(&settings) {
        Ok(robot) => robot,
        Err(error) => return report(&error, BAD_PARAMETERS),
    };
    match topics::run(&mut node, robot, settings, &stop) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error)
            if error.is::<palpate_filter::ParameterError>()
                || error.is::<palpate_model::ModelError>() =>
        {
            report(&error, BAD_PARAMETERS)
        }
        Err(error) => report(&error, FAILURE),
    }
}

type Started = (r2r::Node, palpate_filter::Settings, Arc<AtomicBool>);

fn start() -> anyhow::Result<Started> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&stop))
            .context("cannot watch for signals")?;
    }
    let node =
        r2r::Node::create(create_context()?, "palpate", "").context("cannot create the node")?;
    let settings = parameters::read(&node)?;
    reader::check_source(&settings.input)?;
    Ok((node, settings, stop))
}

/// r2r panics where rcl refuses an argument.
fn create_context() -> anyhow::Result<r2r::Context> {
    parameters::check_files(std::env::args())?;
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

fn report(error: &anyhow::Error, code: u8) -> ExitCode {
    eprintln!("palpate_node: {error:#}");
    ExitCode::from(code)
}

/// Whether a signal asked to end.
fn stopped(stop: &AtomicBool) -> bool {
    stop.load(Ordering::Relaxed)
}
