//! The commands and their help: what clap reads the process's arguments into.

use clap::{Parser, Subcommand};

use crate::cli::bounces::Bounces;
use crate::cli::chart::ChartCommand;
use crate::cli::compare::Compare;
use crate::cli::diff::Diff;
use crate::cli::factors::Factors;
use crate::cli::figure::FigureArguments;
use crate::cli::frontier::Frontier;
use crate::cli::map::MapArguments;
use crate::cli::options::Common;
use crate::cli::render::Render;
use crate::cli::trace::Trace;

/// What long help ends with.
const EXAMPLES: &str = "\
Examples:
  halflight render                                     the Cornell box in all four modes, into out/
  halflight render room.obj --mode global -o room.exr  one picture, as numbers
  halflight render furnished-room --alpha 0.5 --tau 1  between the modes
  halflight bounces furnished-room --mode shadowless   a series that diverges

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
  101  a fault of the program
  130  interrupted (Ctrl-C): finished files are whole, the others were not written";

/// Light transport with vector-valued light: L = E + K L for diffuse scenes.
///
/// Global illumination, shadowless, one-bounce and local shading from one equation and two numbers:
/// alpha (interreflection) and tau (transmission).
#[derive(Parser, Debug)]
#[command(version, arg_required_else_help = true, after_long_help = EXAMPLES)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
    /// Arguments of every command.
    #[command(flatten)]
    pub common: Common,
}

/// The commands.
#[derive(Subcommand, Debug)]
pub enum Command {
    /// Render a scene: the visible half of L
    Render(Render),
    /// Study the bounce series E, KE, K²E, ... of a scene
    Bounces(Bounces),
    /// Chart speed against accuracy: error over time of every method and setting, and where the time goes
    Chart(ChartCommand),
    /// Compare Neumann, shooting and path tracing on one scene: error against time, and whether they agree
    Compare(Compare),
    /// Compare two pictures, number by number
    Diff(Diff),
    /// Form factors between the objects of a scene, with their errors
    Factors(Factors),
    /// Make a labelled figure for print: the four modes, successive approximation, or what lies between the modes
    Figure(FigureArguments),
    /// Render a scene by path tracing, a witness to the solver
    Trace(Trace),
    /// Map where the series converges over the (alpha, tau) square
    Map(MapArguments),
    /// Show what each method does on both sides of the frontier where the series starts to diverge
    Frontier(Frontier),
    /// List the scenes that are built in
    Scenes,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn arguments_are_consistent() {
        Cli::command().debug_assert();
    }
}
