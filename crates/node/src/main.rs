//! The ROS 2 node: joint states and external torques in, the contact out.
//!
//! Three threads: this one takes messages and pairs them, one estimates, one draws. The first never waits for the
//! second, nor the second for the third.

mod clock;
mod description;
mod diagnostics;
mod drawing;
mod estimation;
mod order;
mod parameter_services;
mod parameters;
mod reader;
mod services;
mod topics;

use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use palpate_node::{process, realtime};

/// Exit codes: something wrong with the arguments or parameters, and anything else.
const BAD_PARAMETERS: u8 = 2;
const FAILURE: u8 = 1;

fn main() -> ExitCode {
    process::log();
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
    let stop = process::watch_signals()?;
    let node = process::create_node("palpate")?;
    let settings = parameters::read(&node)?;
    reader::check_source(&settings.input)?;
    // The threads that estimate inherit it from this one, which takes messages.
    for refusal in realtime::claim(&settings.realtime) {
        tracing::warn!("{refusal}");
    }
    Ok((node, settings, stop))
}

fn report(error: &anyhow::Error, code: u8) -> ExitCode {
    eprintln!("palpate_node: {error:#}");
    ExitCode::from(code)
}
