//! The command line: one file a command, one table of exit codes.
//!
//! | code | meaning |
//! |------|---------|
//! | 0 | done (for `bounces`, also where a series diverges: that is its answer) |
//! | 1 | a file could not be written |
//! | 2 | the arguments are wrong |
//! | 3 | the scene is wrong (not found, unreadable, or it fails a check), or two pictures cannot be read or compared |
//! | 4 | the bounce series of the mode asked for diverges, or overflows while traced: there is no picture |
//! | 5 | K or the pictures would not fit in memory: the message has the number of patches or pixels that would |
//! | 6 | undecided: the bounds on the spectral radius enclose 1, so no picture can be proved to be the sum |
//! | 101 | a fault of the program |
//! | 130 | interrupted: finished files are whole, the others were not written |

pub(crate) mod backs;
pub(crate) mod bounces;
pub(crate) mod chart;
pub(crate) mod command;
pub(crate) mod compare;
pub(crate) mod console;
pub(crate) mod diff;
pub(crate) mod effort;
pub(crate) mod error;
pub(crate) mod factors;
pub(crate) mod figure;
pub(crate) mod figure_four;
pub(crate) mod figure_report;
pub(crate) mod frontier;
pub(crate) mod interrupt;
pub(crate) mod map;
pub(crate) mod memory;
pub(crate) mod message;
pub(crate) mod options;
pub(crate) mod pictures;
pub(crate) mod render;
pub(crate) mod report;
pub(crate) mod scenes;
pub(crate) mod study;
pub(crate) mod trace;
pub(crate) mod unmet;
pub(crate) mod values;
pub(crate) mod variance;

use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches};

use crate::cli::command::{Cli, Command};
use crate::cli::error::CliError;
use crate::cli::interrupt::end_cleanly;
use crate::cli::message::show;
use crate::cli::options::use_threads;

/// Runs the program with the process's arguments.
pub fn main() -> ExitCode {
    let arguments = arguments();
    end_cleanly();
    match run(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            show(&error);
            ExitCode::from(error.exit_code())
        }
    }
}

/// The process's arguments. A negative number is a value, to be judged as one, and not an option nobody knows.
fn arguments() -> Cli {
    let numbers = |arg: clap::Arg| match arg.get_long() {
        Some(_) if arg.get_action().takes_values() => arg.allow_negative_numbers(true),
        _ => arg,
    };
    let command = Cli::command().mut_args(numbers);
    let matches = command.mut_subcommands(|c| c.mut_args(numbers)).get_matches();
    Cli::from_arg_matches(&matches).unwrap_or_else(|e| e.exit())
}

fn run(cli: Cli) -> Result<(), CliError> {
    use_threads(cli.common.threads)?;
    match &cli.command {
        Command::Render(own) => render::run(own, &cli.common),
        Command::Bounces(own) => bounces::run(own, &cli.common),
        Command::Chart(own) => chart::run(own, &cli.common),
        Command::Compare(own) => compare::run(own, &cli.common),
        Command::Diff(own) => diff::run(own, &cli.common),
        Command::Factors(own) => factors::run(own, &cli.common),
        Command::Figure(own) => figure::run(own, &cli.common),
        Command::Trace(own) => trace::run(own, &cli.common),
        Command::Frontier(own) => frontier::run(own, &cli.common),
        Command::Map(own) => map::run(own, &cli.common),
        Command::Scenes => scenes::run(&cli.common),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let help = Cli::command().render_long_help().to_string();
        let (_, listed) = help.split_once("Exit codes:").unwrap();
        assert_eq!(codes(listed, "  "), table);
    }
}
