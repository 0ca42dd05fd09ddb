//! Arguments of all commands.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

use crate::cli::CliError;
use crate::cli::effort::Effort;
use crate::cli::memory::MemoryLimit;
use crate::cli::values::{ModeChoice, NextEventChoice, Size, seconds, size, stops, unit_interval};
use crate::light::{Mode, Transport};
use crate::scene::{LoadOptions, Scene, Sides};

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
    Chart(crate::cli::chart::ChartCommand),
    /// Compare Neumann, shooting and path tracing on one scene: error against time, and whether they agree
    Compare(Compare),
    /// Compare two pictures, number by number
    Diff(Diff),
    /// Form factors between the objects of a scene, with their errors
    Factors(crate::cli::factors::Factors),
    /// Render a scene by path tracing, a witness to the solver
    Trace(Trace),
    /// Map where the series converges over the (alpha, tau) square
    Map(crate::cli::map::MapArguments),
    /// Show what each method does on both sides of the frontier where the series starts to diverge
    Frontier(crate::cli::frontier::Frontier),
    /// List the scenes that are built in
    Scenes,
}

/// Arguments of every command.
#[derive(Args, Debug)]
#[command(next_help_heading = "Options of every command")]
pub struct Common {
    /// Print one JSON report on stdout; text for people goes to stderr
    #[arg(long, global = true)]
    pub json: bool,
    /// Directory for the files written, made if there is none
    #[arg(long, global = true, value_name = "DIR", default_value = "out")]
    pub out: PathBuf,
    /// Chooses the sample points; the same seed gives the same bytes
    #[arg(long, global = true, value_name = "N", default_value_t = 0)]
    pub seed: u32,
    /// Threads to use [default: all cores]; results do not depend on it
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Say nothing but errors
    #[arg(long, short, global = true)]
    pub quiet: bool,
}

/// The scene and its modes.
#[derive(Args, Debug)]
pub struct Subject {
    /// A built-in scene (see `halflight scenes`), a .toml scene file or an .obj file
    #[arg(default_value = "cornell-box")]
    pub scene: String,
    /// Illumination model [default: the scene file's, or all]
    #[arg(long, value_enum, conflicts_with_all = ["alpha", "tau"])]
    pub mode: Option<ModeChoice>,
    /// Interreflection, 0 to 1, instead of a mode [default: the scene file's, or 1]
    #[arg(long, value_name = "A", value_parser = unit_interval)]
    pub alpha: Option<f32>,
    /// Transmission, 0 to 1, instead of a mode [default: the scene file's, or 0]
    #[arg(long, value_name = "T", value_parser = unit_interval)]
    pub tau: Option<f32>,
    /// Let the backs of faces reflect and emit as well; without it they are black
    #[arg(long)]
    pub two_sided: bool,
    /// Brighten PNG files by so many stops (factors of two); EXR files stay as they are
    #[arg(
        long,
        value_name = "STOPS",
        default_value_t = 0.0,
        allow_negative_numbers = true,
        value_parser = stops
    )]
    pub exposure: f32,
}

/// The scene, its modes, and how finely it is solved.
#[derive(Args, Debug)]
pub struct Problem {
    /// What is asked.
    #[command(flatten)]
    pub subject: Subject,
    /// How accurately.
    #[command(flatten)]
    pub effort: Effort,
    /// Where a tolerance is aimed at, begin no finer round that would not end within so many seconds, for each mode
    #[arg(long, value_name = "SECONDS", value_parser = seconds, conflicts_with_all = ["patches", "rays", "samples"])]
    pub time: Option<f64>,
}

/// `halflight render`
#[derive(Args, Debug)]
pub struct Render {
    /// What to solve.
    #[command(flatten)]
    pub problem: Problem,
    /// Size of the picture
    #[arg(long, value_name = "WxH", default_value = "512x512", value_parser = size)]
    pub size: Size,
    /// Picture to write, .png or .exr [default: <out>/<scene>-<mode>.png]; with several modes the mode is added
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Add the standard error of every pixel as a layer of the EXR file
    #[arg(long)]
    pub standard_error: bool,
}

/// `halflight bounces`
#[derive(Args, Debug)]
pub struct Bounces {
    /// What to solve.
    #[command(flatten)]
    pub problem: Problem,
    /// Terms in the table, the chart and the sheet, E not counted
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub count: u16,
    /// Size of each picture in the sheet
    #[arg(long, value_name = "WxH", default_value = "160x160", value_parser = size)]
    pub size: Size,
}

/// `halflight compare`
#[derive(Args, Debug)]
pub struct Compare {
    /// What is solved.
    #[command(flatten)]
    pub subject: Subject,
    /// Size of the pictures
    #[arg(long, value_name = "WxH", default_value = "128x128", value_parser = size)]
    pub size: Size,
    /// Seconds each method may take, for each mode
    #[arg(long, value_name = "SECONDS", default_value_t = 8.0, value_parser = seconds)]
    pub time: f64,
    /// Within which memory.
    #[command(flatten)]
    pub limit: MemoryLimit,
}

/// `halflight diff`
#[derive(Args, Debug)]
pub struct Diff {
    /// The picture: .exr, .hdr or .png
    pub picture: PathBuf,
    /// What it is compared with
    pub reference: PathBuf,
    /// Figure to write, .png [default: <out>/<picture>-minus-<reference>.png]
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Brighten the two pictures in the figure by so many stops
    #[arg(
        long,
        value_name = "STOPS",
        default_value_t = 0.0,
        allow_negative_numbers = true,
        value_parser = stops
    )]
    pub exposure: f32,
}

/// `halflight trace`
#[derive(Args, Debug)]
pub struct Trace {
    /// What to render.
    #[command(flatten)]
    pub subject: Subject,
    /// Size of the picture
    #[arg(long, value_name = "WxH", default_value = "512x512", value_parser = size)]
    pub size: Size,
    /// Picture to write, .png or .exr [default: <out>/<scene>-traced-<mode>.png]; with several modes the mode is added
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Paths for each pixel [default: 256, or as many as --time allows]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=16_777_216))]
    pub samples: Option<u32>,
    /// Look for emitters at every vertex, or wait until paths meet them, as in the paper
    #[arg(long, value_enum, default_value_t = NextEventChoice::On)]
    pub next_event: NextEventChoice,
    /// End every path after so many reflections; the light of later ones is missing
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub max_bounces: u32,
    /// Begin no pass of samples that would not end within so many seconds, for each mode
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub time: Option<f64>,
    /// Within which memory.
    #[command(flatten)]
    pub limit: MemoryLimit,
}

impl Subject {
    /// Reads and checks the scene.
    pub fn load(&self) -> Result<Scene, CliError> {
        let sides = if self.two_sided { Sides::Two } else { Sides::One };
        let scene = Scene::open(&self.scene, LoadOptions { two_sided: sides })?;
        scene.require_emission()?;
        Ok(scene)
    }

    /// The (alpha, tau) asked for: one, or the four modes.
    pub fn transports(&self, scene: &Scene) -> Vec<Transport> {
        if self.alpha.is_some() || self.tau.is_some() {
            let base = scene.transport.unwrap_or_default();
            let alpha = self.alpha.unwrap_or(base.alpha);
            let tau = self.tau.unwrap_or(base.tau);
            return vec![Transport { alpha, tau }];
        }
        let one = |mode: Mode| vec![mode.transport()];
        match self.mode {
            Some(ModeChoice::Global) => one(Mode::Global),
            Some(ModeChoice::Shadowless) => one(Mode::Shadowless),
            Some(ModeChoice::OneBounce) => one(Mode::OneBounce),
            Some(ModeChoice::Local) => one(Mode::Local),
            Some(ModeChoice::All) => Mode::ALL.map(Mode::transport).to_vec(),
            None => match scene.transport {
                Some(own) => vec![own],
                None => Mode::ALL.map(Mode::transport).to_vec(),
            },
        }
    }
}

/// Fixes the number of threads for everything that follows.
pub fn use_threads(threads: Option<u16>) -> Result<(), CliError> {
    let Some(threads) = threads else {
        return Ok(());
    };
    rayon::ThreadPoolBuilder::new().num_threads(threads as usize).build_global().map_err(|error| CliError::Usage {
        message: format!("cannot start {threads} threads: {error}"),
        help: "pass a smaller number to --threads".into(),
    })
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
