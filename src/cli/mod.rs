//! The command line: one file a command, one table of exit codes.
//!
//! | code | meaning |
//! |------|---------|
//! | 0 | done (for `bounces`, also where a series diverges: that is its answer) |
//! | 1 | a file could not be written |
//! | 2 | the arguments are wrong |
//! | 3 | the scene is wrong (not found, not readable, or it fails a check), or two pictures cannot be read or compared |
//! | 4 | the bounce series of the mode asked for diverges, or overflows while traced: there is no picture |
//! | 5 | K or the pictures would not fit in memory: the message has the number of patches or pixels that would |
//! | 6 | undecided: the bounds on the spectral radius enclose 1, so no picture can be proved to be the sum |
//! | 101 | a fault of the program |
//! | 130 | interrupted: finished files are whole, the others were not written |

pub(crate) mod bounces;
pub(crate) mod chart;
pub(crate) mod compare;
pub(crate) mod console;
pub(crate) mod diff;
pub(crate) mod effort;
pub(crate) mod factors;
pub(crate) mod frontier;
pub(crate) mod interrupt;
pub(crate) mod map;
pub(crate) mod memory;
pub(crate) mod options;
pub(crate) mod pictures;
pub(crate) mod render;
pub(crate) mod report;
pub(crate) mod scenes;
pub(crate) mod trace;
pub(crate) mod unmet;
pub(crate) mod values;
pub(crate) mod variance;

use std::io::{IsTerminal, Write as _, stderr};
use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches};
use miette::{Diagnostic, MietteHandlerOpts};

use crate::pictures::{ImageError, MetricError, WriteError};
use crate::plot::ChartError;
use crate::reference::Overflow;
use crate::render::{PictureUnfit, Unfit};
use crate::scene::SceneError;
use crate::solve::{Diverges, Verdict};

/// Everything that can end a command early.
#[derive(Debug, thiserror::Error, Diagnostic)]
pub enum CliError {
    /// The scene is wrong: exit code 3.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Scene(#[from] SceneError),
    /// No picture: exit code 4, or 6 where neither convergence nor divergence is proved.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Diverges(#[from] Diverges),
    /// K does not fit in memory: exit code 5.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Memory(#[from] Unfit),
    /// Pictures do not fit in memory: exit code 5.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Pictures(#[from] PictureUnfit),
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
            CliError::Diverges(e) if e.verdict == Verdict::Undecided => 6,
            CliError::Diverges(_) | CliError::Overflow(_) => 4,
            CliError::Memory(_) | CliError::Pictures(_) => 5,
        }
    }
}

/// Runs the program with the process's arguments.
pub fn main() -> ExitCode {
    let arguments = arguments();
    set_error_form();
    crate::cli::interrupt::end_cleanly();
    match run(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let code = error.exit_code();
            let _ = writeln!(stderr(), "{:?}", miette::Report::new(error));
            ExitCode::from(code)
        }
    }
}

/// The process's arguments. A negative number is a value, to be judged as one, and not an option nobody knows.
fn arguments() -> crate::cli::options::Cli {
    let numbers = |arg: clap::Arg| match arg.get_long() {
        Some(_) if arg.get_action().takes_values() => arg.allow_negative_numbers(true),
        _ => arg,
    };
    let command = crate::cli::options::Cli::command().mut_args(numbers);
    let matches = command.mut_subcommands(|c| c.mut_args(numbers)).get_matches();
    crate::cli::options::Cli::from_arg_matches(&matches).unwrap_or_else(|e| e.exit())
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

fn run(cli: crate::cli::options::Cli) -> Result<(), CliError> {
    crate::cli::options::use_threads(cli.common.threads)?;
    match &cli.command {
        crate::cli::options::Command::Render(own) => crate::cli::render::run(own, &cli.common),
        crate::cli::options::Command::Bounces(own) => crate::cli::bounces::run(own, &cli.common),
        crate::cli::options::Command::Chart(own) => crate::cli::chart::run(own, &cli.common),
        crate::cli::options::Command::Compare(own) => crate::cli::compare::run(own, &cli.common),
        crate::cli::options::Command::Diff(own) => crate::cli::diff::run(own, &cli.common),
        crate::cli::options::Command::Factors(own) => crate::cli::factors::run(own, &cli.common),
        crate::cli::options::Command::Trace(own) => crate::cli::trace::run(own, &cli.common),
        crate::cli::options::Command::Frontier(own) => crate::cli::frontier::run(own, &cli.common),
        crate::cli::options::Command::Map(own) => crate::cli::map::run(own, &cli.common),
        crate::cli::options::Command::Scenes => crate::cli::scenes::run(&cli.common),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operator::Bounds;

    /// The codes at the start of a table's rows.
    fn codes(text: &str, before: &str) -> Vec<u8> {
        let rows = text.lines().filter_map(|line| line.strip_prefix(before));
        let word = |row: &str| row.split_whitespace().next()?.parse().ok();
        rows.filter_map(word).collect()
    }

    #[test]
    fn the_help_has_every_code_of_the_table() {
        let table = codes(include_str!("mod.rs"), "//! | ");
        assert_eq!(table, [0, 1, 2, 3, 4, 5, 6, 101, crate::cli::interrupt::INTERRUPTED]);
        let help = crate::cli::options::Cli::command().render_long_help().to_string();
        let (_, listed) = help.split_once("Exit codes:").unwrap();
        assert_eq!(codes(listed, "  "), table);
    }

    #[test]
    fn what_is_not_proved_has_its_own_code_and_words() {
        let error = |verdict, lower| Diverges {
            verdict,
            radius: Bounds { lower, upper: 1.2 },
            alpha_limit: 0.8,
            uniform: true,
        };
        let (open, shut) = (error(Verdict::Undecided, 0.9), error(Verdict::Diverges, 1.1));
        assert!(open.to_string().contains("is undecided") && shut.to_string().contains("diverges"));
        let help = |e: &Diverges| e.help().unwrap().to_string();
        assert!(help(&open).contains("enclose 1") && help(&shut).contains("no finite value"));
        assert_eq!(CliError::from(open).exit_code(), 6);
        assert_eq!(CliError::from(shut).exit_code(), 4);
    }
}
