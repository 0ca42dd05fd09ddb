//! The command line: the commands and their help, one file a command, one table of exit codes.
//!
//! | code | meaning |
//! |------|---------|
//! | 0 | done (for `bounces`, also where a series diverges: that is its answer) |
//! | 1 | a file could not be written |
//! | 2 | the arguments are wrong |
//! | 3 | the scene is wrong (not found, unreadable, or it fails a check), or two pictures cannot be read or compared |
//! | 4 | the bounce series of the requested mode diverges, or overflows while traced: there is no picture |
//! | 5 | K or the pictures would not fit in memory: the message has the number of patches or pixels that would |
//! | 6 | undecided: the bounds on the spectral radius enclose 1, so no picture can be proved to be the sum |
//! | 7 | the error of an audited picture is certainly more than `--at-most` |
//! | 101 | a fault of the program |
//! | 130 | interrupted: finished files are whole, the others were not written |
//!
//! An interrupt ends the program at once: the handler runs in a thread of its own, so a loop over all cores need not
//! look for it. SIGTERM and SIGHUP count the same. Where one of the three is already ignored or handled, as under
//! `nohup`, all three stay as they are. Only place for `ctrlc`.

pub(crate) mod audit;
pub(crate) mod bake;
pub(crate) mod bounces;
pub(crate) mod console;
pub(crate) mod daylight;
pub(crate) mod diff;
pub(crate) mod error;
pub(crate) mod explore;
pub(crate) mod factors;
pub(crate) mod map;
pub(crate) mod options;
pub(crate) mod pictures;
pub(crate) mod relight;
pub(crate) mod render;
pub(crate) mod report;
pub(crate) mod studies;
pub(crate) mod trace;

use std::io::{Write as _, stderr};
use std::path::Path;
use std::process::ExitCode;
use std::thread::sleep;
use std::time::Duration;

use clap::error::{ContextKind, ContextValue};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use clap_complete::Shell;
use halflight_team as team;
use serde::Serialize;

use crate::audit::AuditArguments;
use crate::bake::Bake;
use crate::bounces::Bounces;
use crate::console::Console;
use crate::daylight::DaylightArguments;
use crate::diff::Diff;
use crate::error::{CliError, show};
use crate::explore::Explore;
use crate::factors::Factors;
use crate::map::MapArguments;
use crate::options::arguments::{Common, use_threads};
use crate::relight::Relight;
use crate::render::Render;
use crate::report::ReportArguments;
use crate::studies::{Chart, Compare};
use crate::trace::Trace;
use halflight::pictures::abandon_files;
use halflight::scene::{Scene, builtin, is_scene_file};

/// Where more is said, which help ends with.
const MANUAL: &str = "Manual: docs/commands.md, and `halflight man | man -l -`";

/// What long help ends with.
const EXAMPLES: &str = "\
Examples:
  halflight render                                     the Cornell box in all four modes, into out/
  halflight render room.obj --mode global -o room.exr  one picture, as numbers
  halflight render furnished-room --alpha 0.5 --tau 1  between the modes
  halflight bounces furnished-room --mode shadowless   a series that diverges

Manual: docs/commands.md, and `halflight man | man -l -`

Exit codes:
  0  done (for `bounces`, also where a series diverges)
  1  a file could not be written
  2  the arguments are wrong
  3  the scene is wrong (not found, not readable, or it fails a check), or pictures cannot be
     read or compared
  4  the bounce series of the mode asked for diverges: there is no picture
  5  K or the pictures would not fit in memory: the message has the number of patches or
     pixels that would
  6  undecided: the bounds on the spectral radius enclose 1
  7  the error of an audited picture is certainly more than --at-most
  101  a fault of the program
  130  interrupted (Ctrl-C): finished files are whole, the others were not written";

/// Light transport with vector-valued light: L = E + K L for diffuse scenes.
///
/// Global illumination, shadowless, one-bounce and local shading from one equation and two numbers:
/// alpha (interreflection) and tau (transmission).
#[derive(Parser, Debug)]
#[command(version, arg_required_else_help = true, after_help = MANUAL, after_long_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    common: Common,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Render a scene: the visible half of L
    Render(Render),
    /// Study the bounce series E, KE, K²E, ... of a scene
    Bounces(Bounces),
    /// Tell the error of any picture of a scene, and where it is: no reference is rendered
    Audit(AuditArguments),
    /// Bake lightmaps, or an irradiance volume, with a glTF file that uses them: no GPU is needed
    Bake(Bake),
    /// Chart speed against accuracy: error over time of every method and setting, and where the time goes
    Chart(Chart),
    /// Compare Neumann, shooting and path tracing on one scene: error against time, and whether they agree
    Compare(Compare),
    /// How much of each patch of the sky reaches points, with errors; a year's illuminance by a weather file
    Daylight(DaylightArguments),
    /// Compare two pictures, number by number
    Diff(Diff),
    /// A page to play with: one HTML file in which bounces, modes and lamps can be moved
    Explore(Explore),
    /// Form factors between the objects of a scene, with their errors
    Factors(Factors),
    /// Dim or recolour the lamps of what was solved, or find how far to dim them: no ray is cast
    Relight(Relight),
    /// Render a scene by path tracing, a witness to the solver
    Trace(Trace),
    /// Map where the series converges over the (alpha, tau) square
    Map(MapArguments),
    /// List the scenes that are built in
    Scenes,
    /// Print what to attach to a report of a fault: version, features, machine, command; nothing private
    Report(ReportArguments),
    /// Print what a shell needs to complete commands and options
    Completions {
        /// bash, zsh, fish, elvish or powershell
        shell: Shell,
    },
    /// Print the manual page
    Man,
}

/// The shells' 128 + 2 for a program ended by SIGINT.
const INTERRUPTED: u8 = 130;

/// Runs the program with the process's arguments.
fn main() -> ExitCode {
    let _connection = team::connect();
    let arguments = match arguments() {
        Ok(arguments) => arguments,
        Err(error) => {
            if team::speaks() {
                let _ = error.print();
            }
            return ExitCode::from(error.exit_code() as u8);
        }
    };
    end_cleanly();
    match run(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            if !team::speaks() {
                sleep(FIRST_SPEAKS);
            }
            show(&error);
            team::abort_others(error.exit_code());
            ExitCode::from(error.exit_code())
        }
    }
}

/// Time for the first of several processes to say what is wrong and to end all of them, where all see the same.
const FIRST_SPEAKS: Duration = Duration::from_secs(2);

/// The process's arguments. A negative number is a value, to be judged as one, and not an option nobody knows.
fn arguments() -> Result<Cli, clap::Error> {
    let numbers = |arg: clap::Arg| match arg.get_long() {
        Some(_) if arg.get_action().takes_values() => arg.allow_negative_numbers(true),
        _ => arg,
    };
    let command = Cli::command().mut_args(numbers);
    let matches = command.mut_subcommands(|c| c.mut_args(numbers).after_help(MANUAL)).try_get_matches();
    matches.and_then(|matches| Cli::from_arg_matches(&matches)).map_err(with_render_before_scenes)
}

/// An error that says how a scene is rendered, where one stands in the place of a command.
fn with_render_before_scenes(mut error: clap::Error) -> clap::Error {
    let Some(ContextValue::String(given)) = error.get(ContextKind::InvalidSubcommand) else { return error };
    if is_scene_file(Path::new(given)) || builtin::find(given).is_some() {
        let tip = format!("a scene is rendered by `halflight render {given}`");
        error.remove(ContextKind::SuggestedSubcommand);
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.into()]));
    }
    error
}

/// From here on an interrupt ends the program cleanly: finished files stay whole, and nothing unfinished is left.
fn end_cleanly() {
    // Where it cannot be set the system's own way of ending stays, which is what there was before.
    let _ = ctrlc::try_set_handler(|| {
        // Never released: what is not finished stays unwritten until the process is gone.
        let _held = abandon_files();
        if team::speaks() {
            let _ = writeln!(stderr(), "interrupted: finished files are whole, the others were not written");
        }
        std::process::exit(INTERRUPTED.into());
    });
}

fn run(Cli { command, common }: Cli) -> Result<(), CliError> {
    if let Some(threads) = common.threads {
        use_threads(threads)?;
    }
    if matches!(command, Command::Chart(_) | Command::Compare(_)) && !team::is_alone() {
        return Err(CliError::Usage {
            message: "times of methods are not compared by several processes".into(),
            help: "run chart and compare without mpirun".into(),
        });
    }
    let console = Console::new(common.json, common.quiet);
    if let Some(count) = team::strangers() {
        console.warn(format!(
            "this is one of {count} tasks that do not know of each other, and each does all the work; for one solve by \
             all of them build with --features mpi and start them by mpirun or srun --mpi=pmix"
        ));
    }
    match &command {
        Command::Render(own) => render::run(own, &common, &console),
        Command::Bounces(own) => bounces::run(own, &common, &console),
        Command::Audit(own) => audit::run(own, &common, &console),
        Command::Bake(own) => bake::run(own, &common, &console),
        Command::Chart(own) => studies::chart(own, &common, &console),
        Command::Compare(own) => studies::compare(own, &common, &console),
        Command::Daylight(own) => daylight::run(own, &common, &console),
        Command::Diff(own) => diff::run(own, &common, &console),
        Command::Explore(own) => explore::run(own, &common, &console),
        Command::Factors(own) => factors::run(own, &common, &console),
        Command::Relight(own) => relight::run(own, &common, &console),
        Command::Trace(own) => trace::run(own, &common, &console),
        Command::Map(own) => map::run(own, &common, &console),
        Command::Scenes => scenes(&console),
        Command::Report(own) => report::run(own, &Cli::command(), &console),
        Command::Completions { shell } => {
            let mut text = Vec::new();
            clap_complete::generate(*shell, &mut Cli::command(), "halflight", &mut text);
            print(&console, &text)
        }
        Command::Man => {
            let mut text = Vec::new();
            clap_mangen::Man::new(Cli::command()).render(&mut text).expect("memory takes all that is written");
            print(&console, &text)
        }
    }
}

/// Prints a text that other programs read, which `--quiet` does not hold back.
fn print(console: &Console, text: &[u8]) -> Result<(), CliError> {
    console.print(String::from_utf8_lossy(text).trim_end());
    console.end()
}

/// Lists the built-in scenes.
fn scenes(console: &Console) -> Result<(), CliError> {
    #[derive(Serialize)]
    struct Listed {
        name: &'static str,
        description: &'static str,
        triangles: u32,
    }
    let mut list = Vec::new();
    for (name, description) in builtin::listed() {
        let triangles = Scene::open(name)?.solid_faces();
        console.say(format!("{name:<18} {triangles:>6} triangles  {description}"));
        list.push(Listed { name, description, triangles });
    }
    console.report(&list)
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
        let table = codes(include_str!("main.rs"), "//! | ");
        assert_eq!(table, [0, 1, 2, 3, 4, 5, 6, 7, 101, INTERRUPTED]);
        let help = Cli::command().render_long_help().to_string();
        let (_, listed) = help.split_once("Exit codes:").unwrap();
        assert_eq!(codes(listed, "  "), table);
    }

    #[test]
    fn arguments_are_consistent() {
        Cli::command().debug_assert();
    }
}
