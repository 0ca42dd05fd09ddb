//! Arguments that several commands share: where output goes, which scene and modes, and how finely they are solved.
//!
//! Not handled: the arguments of one command, which stand in its own file.

use std::path::PathBuf;

use clap::Args;

use crate::cli::effort::Effort;
use crate::cli::error::CliError;
use crate::cli::values::{ModeChoice, reflectance, seconds, stops, unit_interval};
use crate::light::{Mode, Transport};
use crate::scene::{AddedLight, LoadOptions, Scene, Sides};

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

/// What a scene is given that its files do not say.
#[derive(Args, Debug)]
pub struct Completion {
    /// Let the backs of faces reflect and emit as well; without it they are black
    #[arg(long)]
    pub two_sided: bool,
    /// Reflectance, 0 to below 1, of faces whose material the files lack
    #[arg(long, value_name = "RHO", default_value_t = 0.5, value_parser = reflectance)]
    pub reflectance: f32,
    /// Add a luminaire or a sky to the scene
    #[arg(long, value_enum)]
    pub light: Option<AddedLight>,
    /// Show highlights of direct light, by Ks and Ns of the MTL
    #[arg(long)]
    pub highlights: bool,
}

/// The scene and its modes.
#[derive(Args, Debug)]
pub struct Subject {
    /// A built-in scene (see `halflight scenes`), an .obj, .glb or .gltf file, or a .toml scene file
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
    /// What its files do not say.
    #[command(flatten)]
    pub completion: Completion,
    /// Look through the file's camera of this name (glTF) [default: the scene file's, or the first]
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
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
    /// Where a tolerance is aimed at, begin nothing finer that would not end within so many seconds, for each mode
    #[arg(long, value_name = "SECONDS", value_parser = seconds, conflicts_with_all = ["patches", "rays", "samples"])]
    pub time: Option<f64>,
}

impl Completion {
    /// Reads and checks the scene of that name or path, and tells its warnings to `warn`.
    pub fn load(&self, scene: &str, warn: impl FnMut(&String)) -> Result<Scene, CliError> {
        let two_sided = if self.two_sided { Sides::Two } else { Sides::One };
        let Completion { reflectance, light, highlights, .. } = *self;
        let options = LoadOptions { two_sided, reflectance, light, highlights };
        let scene = Scene::open_with(scene, options)?;
        scene.warnings.iter().for_each(warn);
        Ok(scene)
    }
}

impl Subject {
    /// Reads and checks the scene, which must emit, and tells its warnings to `warn`.
    pub fn load(&self, warn: impl FnMut(&String)) -> Result<Scene, CliError> {
        let mut scene = self.completion.load(&self.scene, warn)?;
        if let Some(name) = &self.camera {
            scene.look_through(name)?;
        }
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
