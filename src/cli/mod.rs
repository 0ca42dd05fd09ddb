//! The command line: one file a command, one table of exit codes.
//!
//! | code | meaning |
//! |------|---------|
//! | 0 | done (for `bounces`, also where a series diverges: that is its answer) |
//! | 1 | a file could not be written |
//! | 2 | the arguments are wrong |
//! | 3 | the scene is wrong (not found, not readable, or it fails a check), or two pictures cannot be read or compared |
//! | 4 | the bounce series of the mode asked for diverges, or overflows while traced: there is no picture |

mod bounces;
mod compare;
mod console;
mod diff;
mod effort;
mod factors;
mod frontier;
mod map;
mod options;
mod pictures;
mod render;
mod report;
mod scenes;
mod trace;
mod values;

use std::io::{IsTerminal, Write as _, stderr};
use std::process::ExitCode;

use clap::Parser;
use miette::{Diagnostic, MietteHandlerOpts};

use crate::image::{ImageError, MetricError, WriteError};
use crate::reference::Overflow;
use crate::scene::SceneError;
use crate::solve::Diverges;
use crate::study::ChartError;

/// Everything that can end a command early.
#[derive(Debug, thiserror::Error, Diagnostic)]
pub enum CliError {
    /// The scene is wrong: exit code 3.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Scene(#[from] SceneError),
    /// No picture: exit code 4.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Diverges(#[from] Diverges),
    /// A traced picture overflows: exit code 4.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Overflow(#[from] Overflow),
    /// A picture could not be written: exit code 1; its format is unknown: 2; it could not be read: 3.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Image(#[from] ImageError),
    /// A file could not be written: exit code 1.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Write(#[from] WriteError),
    /// A chart could not be drawn: exit code 1.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Chart(#[from] ChartError),
    /// Two pictures cannot be compared: exit code 3.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Metric(#[from] MetricError),
    /// The arguments contradict each other or the machine: exit code 2.
    #[error("{message}")]
    #[diagnostic(code(halflight::usage))]
    Usage {
        /// What is wrong.
        message: String,
        /// What to do.
        #[help]
        help: String,
    },
}

impl CliError {
    fn exit_code(&self) -> u8 {
        match self {
            CliError::Image(ImageError::Extension { .. }) | CliError::Usage { .. } => 2,
            CliError::Image(ImageError::Read { .. } | ImageError::Decode { .. }) => 3,
            CliError::Image(_) | CliError::Write(_) | CliError::Chart(_) => 1,
            CliError::Scene(_) | CliError::Metric(_) => 3,
            CliError::Diverges(_) | CliError::Overflow(_) => 4,
        }
    }
}

/// Runs the program with the process's arguments.
pub fn main() -> ExitCode {
    let arguments = options::Cli::parse();
    set_error_form();
    match run(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let code = error.exit_code();
            let _ = writeln!(stderr(), "{:?}", miette::Report::new(error));
            ExitCode::from(code)
        }
    }
}

/// Messages name their causes themselves; lines are wrapped on a terminal only, so that a path stays in one piece.
fn set_error_form() {
    let wrap = stderr().is_terminal();
    let form = move || {
        let form = MietteHandlerOpts::new().without_cause_chain();
        form.wrap_lines(wrap).build()
    };
    // Set once, before anything reports: it cannot be taken.
    let _ = miette::set_hook(Box::new(move |_| Box::new(form())));
}

fn run(cli: options::Cli) -> Result<(), CliError> {
    options::use_threads(cli.common.threads)?;
    match &cli.command {
        options::Command::Render(own) => render::run(own, &cli.common),
        options::Command::Bounces(own) => bounces::run(own, &cli.common),
        options::Command::Compare(own) => compare::run(own, &cli.common),
        options::Command::Diff(own) => diff::run(own, &cli.common),
        options::Command::Factors(own) => factors::run(own, &cli.common),
        options::Command::Trace(own) => trace::run(own, &cli.common),
        options::Command::Frontier(own) => frontier::run(own, &cli.common),
        options::Command::Map(own) => map::run(own, &cli.common),
        options::Command::Scenes => scenes::run(&cli.common),
    }
}
