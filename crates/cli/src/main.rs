//! The `palpate` command: where something touches a robot arm, from joint positions and joint torques.

mod demo;
mod estimates_csv;
mod evaluate;
mod inspect;
mod last_second;
mod measured;
mod picture;
mod progress;
mod recorder;
mod replay;
mod robot_args;
mod simulate;
mod table;
mod told;
mod track;

use std::error::Error;
use std::io::{self, IsTerminal};
use std::path::Path;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use palpate_bag::BagError;
use palpate_filter::{ParameterError, SettingsError};
use palpate_model::ModelError;
use palpate_sim::SimError;

/// palpate tells where something touches a robot arm, from joint positions and joint torques alone.
///
/// Exit codes: 0 done; 2 wrong usage; 3 wrong data (bag, URDF, parameters, scenario); 1 anything else.
#[derive(Parser)]
#[command(version, max_term_width = 110)]
struct Cli {
    /// Say more on stderr: -v what is done, -vv every detail. The variable RUST_LOG, where set, decides instead
    #[arg(short, long, global = true, action = clap::ArgAction::Count, display_order = 1000)]
    verbose: u8,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Demo(demo::Demo),
    Replay(replay::Replay),
    Simulate(simulate::Simulate),
    Inspect(inspect::Inspect),
    Evaluate(evaluate::Evaluate),
}

/// Options that contradict the data or each other, found after parsing.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct Usage(String);

/// An input file that cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("cannot read {path}: {source}")]
struct Unreadable {
    path: String,
    source: io::Error,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    listen(cli.verbose);
    let done = match &cli.command {
        Command::Demo(demo) => demo.run(),
        Command::Replay(replay) => replay.run(),
        Command::Simulate(simulate) => simulate.run(),
        Command::Inspect(inspect) => inspect.run(),
        Command::Evaluate(evaluate) => evaluate.run(),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        // Whoever reads the output has seen enough.
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("palpate: {}", in_one_line(&error));
            ExitCode::from(code(&error))
        }
    }
}

/// Reads a text file of the user's.
fn read_text(path: &Path) -> Result<String, Unreadable> {
    std::fs::read_to_string(path).map_err(|source| Unreadable {
        path: path.display().to_string(),
        source,
    })
}

fn listen(verbose: u8) {
    let level = match verbose {
        0 => "warn",
        1 => "info",
        _ => "debug",
    };
    let filter = tracing_subscriber::EnvFilter::try_from_default_env();
    tracing_subscriber::fmt()
        .with_env_filter(filter.unwrap_or_else(|_| level.into()))
        .with_writer(io::stderr)
        .with_ansi(io::stderr().is_terminal())
        .with_target(false)
        .without_time()
        .init();
}

/// The one place of exit codes.
fn code(error: &anyhow::Error) -> u8 {
    let wrong_data = |cause: &(dyn Error + 'static)| match cause.downcast_ref::<BagError>() {
        Some(BagError::Write { .. }) => false,
        Some(_) => true,
        None => {
            cause.is::<ModelError>()
                || cause.is::<SettingsError>()
                || cause.is::<ParameterError>()
                || cause.is::<SimError>()
                || cause.is::<Unreadable>()
        }
    };
    if error.chain().any(|cause| cause.is::<Usage>()) {
        2
    } else if error.chain().any(wrong_data) {
        3
    } else {
        1
    }
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    let kind = |cause: &(dyn Error + 'static)| cause.downcast_ref().map(io::Error::kind);
    error
        .chain()
        .any(|cause| kind(cause) == Some(io::ErrorKind::BrokenPipe))
}

/// An error and its causes, those left out that the words before already tell.
fn in_one_line(error: &anyhow::Error) -> String {
    let mut line = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if line.is_empty() {
            line = cause;
        } else if !line.contains(&cause) {
            line = format!("{line}: {cause}");
        }
    }
    line.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn causes_are_told_once_and_in_one_line() {
        let cause = io::Error::other("disk\nfull");
        let error = anyhow::Error::new(cause).context("cannot write: disk\nfull");
        assert_eq!(in_one_line(&error), "cannot write: disk full");
        assert_eq!(
            in_one_line(&error.context("demo")),
            "demo: cannot write: disk full"
        );
    }

    #[test]
    fn each_kind_of_error_has_its_code() {
        let data = anyhow::Error::new(SimError::Immovable {
            link: "base".into(),
        });
        assert_eq!(code(&data.context("while simulating")), 3);
        assert_eq!(code(&Usage("--link 9".into()).into()), 2);
        assert_eq!(code(&anyhow::anyhow!("disk full")), 1);
    }
}
