//! Arguments that several commands share: where output goes, which scene and modes, how finely they are solved and
//! within which memory; and how the text of values is read and checked.
//!
//! Not handled: the arguments of one command, which stand in its own file.

use std::cell::OnceCell;
use std::hash::{DefaultHasher, Hasher};
use std::ops::RangeBounds;
use std::path::PathBuf;
use std::str::FromStr;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use halflight_team as team;

use crate::console::Console;
use crate::error::CliError;
use halflight::light::{Mode, Transport};
use halflight::pictures::{Exposure, Picture, Size};
use halflight::render::{Fineness, Solver, check_pictures, usable_memory};
use halflight::scene::{About, AddedLight, LengthUnit, LoadOptions, Scene, Sides, Winding, builtin};
use halflight_export::scene_to_bytes;
use halflight_study::compare::{Ladder, Method};

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
#[command(next_help_heading = "Scene")]
pub struct Completion {
    /// Let the backs of faces reflect and emit as well, of all materials or of those named; without it they are black
    #[arg(long, value_name = "MATERIAL,...", num_args = 0..=1, require_equals = true, default_missing_value = "",
        value_delimiter = ',')]
    pub two_sided: Option<Vec<String>>,
    /// Leave rooms whose faces look outward as they are; without it a closed one that the camera is in is turned
    #[arg(long)]
    pub as_modelled: bool,
    /// Reflectance, 0 to below 1, of faces whose material the files lack [default: 0.5, in glTF 0.8]
    #[arg(long, value_name = "RHO", value_parser = reflectance)]
    pub reflectance: Option<f32>,
    /// Add a luminaire or a sky to the scene
    #[arg(long, value_parser = added_light())]
    pub light: Option<AddedLight>,
    /// Show highlights of direct light, by Ks and Ns of the MTL
    #[arg(long)]
    pub highlights: bool,
    /// Unit of positions in the files, which lights without area need [default: the scene file's, or m]
    #[arg(long, value_name = "UNIT", value_parser = length_unit())]
    pub unit: Option<LengthUnit>,
}

/// The scene and its modes.
#[derive(Args, Debug)]
#[command(next_help_heading = "Scene")]
pub struct Subject {
    /// A built-in scene (see `halflight scenes`), an .obj, .glb or .gltf file, or a .toml scene file
    #[arg(default_value = "cornell-box", help_heading = None::<&str>)]
    pub scene: String,
    /// Illumination model [default: the scene file's, else global; all four of a built-in scene]
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
    /// How bright PNG files are.
    #[command(flatten)]
    pub brightness: Brightness,
}

/// How bright PNG files are.
#[derive(Args, Debug)]
#[command(next_help_heading = "Picture")]
pub struct Brightness {
    /// Brighten PNG files by so many stops (factors of two); at 0 a radiance of 1 is white. EXR files stay as they are
    /// [default: 0 for a built-in scene, else by what the first picture shows]
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, value_parser = stops)]
    exposure: Option<f32>,
}

impl Brightness {
    /// How PNG files are shown where no picture is looked at.
    pub fn exposure(&self) -> Exposure {
        Exposure { stops: self.exposure.unwrap_or(0.0) }
    }
}

/// How the PNG files of one run are shown: as requested, or by what the first picture shows, so that they compare.
pub struct Exposing {
    chosen: OnceCell<Exposure>,
}

impl Exposing {
    /// The exposure of a picture of the run.
    pub fn of(&self, picture: &Picture) -> Exposure {
        *self.chosen.get_or_init(|| Exposure::of(picture).unwrap_or_default())
    }

    /// That of what is made of all pictures.
    pub fn of_all(&self) -> Exposure {
        self.chosen.get().copied().unwrap_or_default()
    }
}

/// The scene, its modes, and how finely it is solved.
#[derive(Args, Debug)]
#[command(next_help_heading = "Accuracy")]
pub struct Problem {
    /// The scene and its modes.
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
    /// Reads and checks the scene of that name or path, and prints its warnings.
    pub fn load(&self, scene: &str, console: &Console) -> Result<Scene, CliError> {
        let scene = self.read(scene)?;
        scene.warnings.iter().for_each(|warning| console.warn(&warning.text));
        Ok(scene)
    }

    /// What [`Completion::load`] does for what depends on shapes alone: of its warnings those of shapes.
    pub fn load_shape(&self, scene: &str, console: &Console) -> Result<Scene, CliError> {
        let scene = self.read(scene)?;
        let of_shape = scene.warnings.iter().filter(|warning| matches!(warning.about, About::Shape(_)));
        of_shape.for_each(|warning| console.warn(&warning.text));
        Ok(scene)
    }

    fn read(&self, scene: &str) -> Result<Scene, CliError> {
        let named = self.two_sided.as_deref().unwrap_or_default();
        let is_for_all = matches!(named, [all] if all.is_empty());
        let two_sided = if is_for_all { Sides::Two } else { Sides::One };
        let winding = if self.as_modelled { Winding::AsModelled } else { Winding::Turned };
        let Completion { reflectance, light, highlights, unit, .. } = *self;
        let options = LoadOptions { two_sided, reflectance, light, highlights, unit, winding };
        let mut scene = Scene::open_with(scene, options)?;
        named.iter().filter(|_| !is_for_all).try_for_each(|name| give_two_sides(&mut scene, name))?;
        check_team(&scene)?;
        Ok(scene)
    }
}

/// Gives the materials of some name two sides.
fn give_two_sides(scene: &mut Scene, name: &str) -> Result<(), CliError> {
    let known: Vec<String> = scene.materials.iter().map(|material| material.name.clone()).collect();
    let mut named = scene.materials.iter_mut().filter(|material| material.name == name).peekable();
    if named.peek().is_none() {
        return Err(CliError::Usage {
            message: format!("--two-sided: {} has no material `{name}`", scene.name),
            help: format!("its materials are {}; --two-sided alone is for all", known.join(", ")),
        });
    }
    named.for_each(|material| material.sides = Sides::Two);
    Ok(())
}

/// Checks that all of several processes were asked for the same and read the same: they could not work together.
fn check_team(scene: &Scene) -> Result<(), CliError> {
    if team::is_alone() {
        return Ok(());
    }
    let arguments: Vec<_> = std::env::args_os().skip(1).collect();
    let mut sum = DefaultHasher::new();
    sum.write(&scene_to_bytes(scene));
    let all = team::all((format!("{arguments:?}"), sum.finish()));
    let Some(rank) = all.iter().position(|own| *own != all[0]) else { return Ok(()) };
    let what = if all[rank].0 == all[0].0 { "reads another scene" } else { "has other arguments" };
    Err(CliError::Usage {
        message: format!("process {rank} of {} {what} than process 0", all.len()),
        help: "start the same command in all of them, with files that all of their machines see alike".into(),
    })
}

impl Subject {
    /// Reads and checks the scene, which must emit, and prints its warnings.
    pub fn load(&self, console: &Console) -> Result<Scene, CliError> {
        let mut scene = self.completion.load(&self.scene, console)?;
        if let Some(name) = &self.camera {
            scene.look_through(name)?;
        }
        scene.require_emission()?;
        Ok(scene)
    }

    fn is_built_in(&self) -> bool {
        builtin::find(&self.scene).is_some()
    }

    /// How its PNG files are shown where no picture is looked at.
    pub fn exposure(&self) -> Exposure {
        self.brightness.exposure()
    }

    /// How its PNG files are shown.
    pub fn exposing(&self) -> Exposing {
        let is_fixed = self.brightness.exposure.is_some() || self.is_built_in();
        let chosen = if is_fixed { OnceCell::from(self.exposure()) } else { OnceCell::new() };
        Exposing { chosen }
    }

    /// The requested (alpha, tau): one, or the four modes. A file without a request is rendered once, as people expect.
    pub fn transports(&self, scene: &Scene) -> Vec<Transport> {
        if self.alpha.is_some() || self.tau.is_some() {
            let base = scene.transport.unwrap_or_default();
            let alpha = self.alpha.unwrap_or(base.alpha);
            let tau = self.tau.unwrap_or(base.tau);
            return vec![Transport { alpha, tau }];
        }
        let one = match (self.mode, scene.transport) {
            (Some(ModeChoice::Global), _) => Mode::Global.transport(),
            (Some(ModeChoice::Shadowless), _) => Mode::Shadowless.transport(),
            (Some(ModeChoice::OneBounce), _) => Mode::OneBounce.transport(),
            (Some(ModeChoice::Local), _) => Mode::Local.transport(),
            (None, Some(own)) => own,
            (None, None) if !self.is_built_in() => Mode::Global.transport(),
            (Some(ModeChoice::All), _) | (None, None) => return Mode::ALL.map(Mode::transport).to_vec(),
        };
        vec![one]
    }
}

/// Fixes the number of threads for everything that follows.
pub fn use_threads(threads: u16) -> Result<(), CliError> {
    rayon::ThreadPoolBuilder::new().num_threads(threads as usize).build_global().map_err(|error| CliError::Usage {
        message: format!("cannot start {threads} threads: {error}"),
        help: "pass a smaller number to --threads".into(),
    })
}

/// Hemisphere rays for each pixel where other effort is given, but not this.
const SAMPLES: u32 = 128;

/// The wanted accuracy, or the effort itself.
#[derive(Args, Debug)]
#[command(next_help_heading = "Accuracy")]
pub struct Effort {
    /// Error to aim at, a share of the picture's RMS radiance; for bounces, of each term's power [default: 0.01]
    #[arg(long, value_name = "T", value_parser = picture_error, conflicts_with_all = ["patches", "rays", "samples"])]
    pub tolerance: Option<f64>,
    /// Cut the scene into about so many patches, whatever the error [default with --rays or --samples: 4000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub patches: Option<u32>,
    /// Cast so many hemisphere rays from each patch [default with --patches or --samples: 256]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_048_576))]
    pub rays: Option<u32>,
    /// Cast so many hemisphere rays for each pixel, rounded up to a power of two [default with --patches or --rays:
    /// 128]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_048_576))]
    pub samples: Option<u32>,
    /// Within which memory.
    #[command(flatten)]
    pub limit: MemoryLimit,
}

/// What [`Effort`] requests.
#[derive(Clone, Copy, Debug)]
pub enum Precision {
    /// An error.
    Within(f64),
    /// Patches, rays, and hemisphere rays for each pixel.
    Fixed(Fineness, u32),
}

impl Effort {
    /// The tolerance, unless some effort is given, or there is one: that of the folder which F comes from.
    pub fn precision(&self, kept: Option<Fineness>) -> Precision {
        let is_given = kept.is_some() || self.patches.is_some() || self.rays.is_some() || self.samples.is_some();
        if self.tolerance.is_some() || !is_given {
            return Precision::Within(self.tolerance.unwrap_or(0.01));
        }
        let default = kept.unwrap_or_default();
        let patches = self.patches.map_or(default.patches, |n| n as usize);
        let fineness = Fineness { patches, rays: self.rays.unwrap_or(default.rays) };
        Precision::Fixed(fineness, self.samples.unwrap_or(SAMPLES))
    }
}

pub use halflight::render::pixel;

/// How much memory may be used.
#[derive(Args, Debug)]
#[command(next_help_heading = "Accuracy")]
pub struct MemoryLimit {
    /// Memory that K or the pictures may take; what needs more is refused [default: four fifths of what is free]
    #[arg(long, value_name = "GIB", value_parser = gibibytes)]
    pub memory: Option<f64>,
}

impl MemoryLimit {
    /// As requested, else what there is.
    pub fn bytes(&self) -> f64 {
        let requested = self.memory.map(|gib| gib * f64::from(1 << 30));
        requested.unwrap_or_else(usable_memory)
    }

    /// Checks that pictures of a size fit, of which a command keeps `each` bytes a pixel.
    pub fn check_pictures(&self, size: Size, each: f64) -> Result<(), CliError> {
        Ok(check_pictures(size, each, self.bytes())?)
    }

    /// A scene ready to be solved within this memory.
    pub fn solver(&self, scene: &Scene, seed: u32) -> Solver {
        Solver::new(scene).seed(seed).memory(self.bytes())
    }
}

/// Whether emitters are sampled at every vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum NextEventChoice {
    /// Every vertex draws a point on an emitter
    On,
    /// Emitters are found by chance only
    Off,
}

/// The four modes, or all of them.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum ModeChoice {
    /// Shadows and interreflection
    Global,
    /// Interreflection, no shadows; may diverge
    Shadowless,
    /// Shadows, no interreflection
    OneBounce,
    /// Neither: OpenGL-style local shading
    Local,
    /// All four
    All,
}

/// Reads the name of something that is charted.
pub fn ladder() -> impl TypedValueParser<Value = Ladder> {
    let value = |ladder: &Ladder| {
        let (name, help) = charted(ladder.method)?;
        Some(PossibleValue::new(name).help(help))
    };
    let of_name = |name: String| {
        let is_named = |ladder: &Ladder| charted(ladder.method).is_some_and(|(own, _)| own == name);
        Ladder::CHARTED.into_iter().find(is_named).ok_or("no ladder")
    };
    PossibleValuesParser::new(Ladder::CHARTED.iter().filter_map(value)).try_map(of_name)
}

/// How a method's ladder is named where it is charted, and what it varies.
fn charted(method: Method) -> Option<(&'static str, &'static str)> {
    match method {
        Method::Tolerance => Some(("tolerance", "The error asked for")),
        Method::Patches => Some(("patches", "The number of patches, the rest fine")),
        Method::Rays => Some(("rays", "Rays a patch, the rest fine")),
        Method::Samples => Some(("samples", "Rays a pixel, the rest fine")),
        Method::ShootingRays => Some(("shooting", "Progressive shooting, all finer together")),
        Method::NextEvent => Some(("paths", "Samples of the path tracer")),
        Method::Neumann | Method::ShootingAssembled | Method::Paths => None,
    }
}

/// Reads what is added to a scene.
fn added_light() -> impl TypedValueParser<Value = AddedLight> {
    let ceiling = PossibleValue::new("ceiling").help("A rectangle below the ceiling, or above an open scene");
    let sky = PossibleValue::new("sky").help("A sky of radiance 1 all around, for scenes that are open");
    PossibleValuesParser::new([ceiling, sky]).map(|name| match &name[..] {
        "sky" => AddedLight::Sky,
        _ => AddedLight::Ceiling,
    })
}

/// Reads a number of a range, which `words` describe.
fn number<T: FromStr + PartialOrd>(text: &str, range: impl RangeBounds<T>, words: &str) -> Result<T, String> {
    text.parse().ok().filter(|value| range.contains(value)).ok_or_else(|| words.into())
}

/// A number from 0 to 1.
pub fn unit_interval(text: &str) -> Result<f32, String> {
    number(text, 0.0..=1.0, "must be a number from 0 to 1")
}

/// A number from 0 to below 1.
fn reflectance(text: &str) -> Result<f32, String> {
    number(text, 0.0..1.0, "must be a number from 0 to below 1")
}

/// A unit of length by its symbol.
fn length_unit() -> impl TypedValueParser<Value = LengthUnit> {
    let symbols = PossibleValuesParser::new(LengthUnit::ALL.map(|(symbol, _)| symbol));
    symbols.try_map(|symbol| symbol.parse::<LengthUnit>())
}

/// Factors of two that a picture is brightened by.
pub fn stops(text: &str) -> Result<f32, String> {
    number(text, -100.0..=100.0, "must be a number from -100 to 100")
}

/// A relative error of a picture.
pub fn picture_error(text: &str) -> Result<f64, String> {
    let words = "must be a number from 0.0001 to 0.5, or from 0.01% to 50%";
    match text.strip_suffix('%') {
        Some(percent) => number(percent.trim_end(), 1e-2..=50.0, words).map(|percent: f64| percent / 100.0),
        None => number(text, 1e-4..=0.5, words),
    }
}

/// A relative error.
pub fn tolerance(text: &str) -> Result<f64, String> {
    number(text, 1e-9..=1.0, "must be a number from 1e-9 to 1")
}

/// A time limit.
pub fn seconds(text: &str) -> Result<f64, String> {
    number(text, f64::MIN_POSITIVE..=f64::MAX, "must be a number of seconds above 0")
}

/// Memory.
fn gibibytes(text: &str) -> Result<f64, String> {
    number(text, f64::MIN_POSITIVE..=f64::MAX, "write a number of GiB above 0, such as 4 or 0.5")
}

/// WIDTHxHEIGHT in pixels, or one number for both.
pub fn size(text: &str) -> Result<Size, String> {
    const LARGEST: usize = 16_384;
    let wrong = || format!("must be WIDTHxHEIGHT, each from 1 to {LARGEST}, as in 640x480, or one number for both");
    let (width, height) = text.split_once(['x', 'X']).unwrap_or((text, text));
    let number = |t: &str| t.parse().ok().filter(|n| (1..=LARGEST).contains(n));
    match (number(width), number(height)) {
        (Some(width), Some(height)) => Ok(Size { width, height }),
        _ => Err(wrong()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brightness_stays_within_floats() {
        assert_eq!(stops("-1.5"), Ok(-1.5));
        for wrong in ["nan", "inf", "1e9", "bright"] {
            assert!(stops(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn errors_are_shares_or_percent() {
        assert_eq!(["0.02", "2%", "2 %", "0.5%"].map(picture_error), [Ok(0.02), Ok(0.02), Ok(0.02), Ok(0.005)]);
        for wrong in ["0", "60%", "0.001%", "%", "nan%"] {
            assert!(picture_error(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn sizes_are_checked() {
        assert_eq!(size("640x480").map(|s| (s.width, s.height)), Ok((640, 480)));
        assert_eq!(size("640").map(|s| (s.width, s.height)), Ok((640, 640)));
        for wrong in ["", "0", "0x4", "axb", "640x", "99999x1", "-1x4"] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
    }
}
