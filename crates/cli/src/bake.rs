//! `halflight bake`: lightmaps of a scene with a glTF file that uses them, or an irradiance volume.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::console::Console;
use crate::console::progress::Aim;
use crate::console::warnings::words_of;
use crate::error::CliError;
use crate::options::arguments::{Common, Completion, MemoryLimit, ModeChoice, picture_error, unit_interval};
use crate::options::layers::PerEmitter;
use crate::pictures::check_place;
use halflight::Scene;
use halflight::light::{Mode, Transport};
use halflight::render::pixel;
use halflight_bake::{
    BakeGoal, BakeReport, Grid, Held, Kind, Lamps, LightMap, Model, VolumeGoal, VolumeReport, bake, volume, write_maps,
    write_volume,
};

/// `halflight bake`
#[derive(Args, Debug)]
#[command(next_help_heading = "Maps")]
pub struct Bake {
    /// A built-in scene (see `halflight scenes`), an .obj, .glb or .gltf file, or a .toml scene file
    #[arg(default_value = "cornell-box", help_heading = None::<&str>)]
    pub scene: String,
    /// Folder for the files, made if there is none [default: that of --out]
    #[arg(short, long, value_name = "FOLDER")]
    pub output: Option<PathBuf>,
    /// Texels to a side of the map
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = clap::value_parser!(u16).range(16..=8192))]
    pub texels: u16,
    /// Texels around every chart, filled from it
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u16).range(0..=64))]
    pub padding: u16,
    /// Relative RMS error over the texels to aim at; of a volume that of each irradiance
    #[arg(long, value_name = "T", default_value = "0.05", value_parser = picture_error)]
    pub tolerance: f64,
    /// Leave out what arrives straight from luminaires, where the viewer adds it
    #[arg(long)]
    pub indirect: bool,
    /// Whether every lamp has a map of its own as well.
    #[command(flatten)]
    pub per: PerEmitter,
    /// Add the standard error of every texel as a layer of the EXR files
    #[arg(long)]
    pub standard_error: bool,
    /// Bake an irradiance volume of so many cells in place of maps
    #[arg(long, value_name = "XxYxZ", value_parser = grid, conflicts_with_all = ["indirect", "standard_error"])]
    pub volume: Option<Grid>,
    /// What a volume keeps of each point
    #[arg(long, value_enum, value_name = "WHAT", default_value = "cube", requires = "volume")]
    pub keep: KindChoice,
    /// Illumination model [default: the scene file's, else global]
    #[arg(long, value_enum, help_heading = "Scene", conflicts_with_all = ["alpha", "tau"])]
    pub mode: Option<ModeChoice>,
    /// Interreflection, 0 to 1, instead of a mode [default: the scene file's, or 1]
    #[arg(long, value_name = "A", help_heading = "Scene", value_parser = unit_interval)]
    pub alpha: Option<f32>,
    /// Transmission, 0 to 1, instead of a mode [default: the scene file's, or 0]
    #[arg(long, value_name = "T", help_heading = "Scene", value_parser = unit_interval)]
    pub tau: Option<f32>,
    /// What its files do not say.
    #[command(flatten)]
    pub completion: Completion,
    /// Within which memory.
    #[command(flatten)]
    pub limit: MemoryLimit,
}

/// What a volume keeps of each point.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum KindChoice {
    /// Irradiance in six directions, as .ktx2 files that Bevy reads
    Cube,
    /// Spherical harmonics of second order, as .npz files
    Harmonics,
}

/// The most points of a volume.
const MOST_CELLS: usize = 1 << 20;

/// Cells along x, y and z.
fn grid(text: &str) -> Result<Grid, String> {
    let wrong = || format!("must be XxYxZ with each from 1 to 256 and {MOST_CELLS} in all at most, as in 16x8x16");
    let lengths: Option<Vec<usize>> =
        text.split(['x', 'X']).map(|n| n.parse().ok().filter(|n| (1..=256).contains(n))).collect();
    match lengths.as_deref() {
        Some(&[x, y, z]) if x * y * z <= MOST_CELLS => Ok([x, y, z]),
        _ => Err(wrong()),
    }
}

impl Bake {
    /// The (alpha, tau) that is baked: one.
    fn transport(&self, scene: &Scene) -> Result<Transport, CliError> {
        let base = scene.transport.unwrap_or_default();
        let mode = match self.mode {
            None if self.alpha.is_none() && self.tau.is_none() => return Ok(base),
            None => {
                return Ok(Transport { alpha: self.alpha.unwrap_or(base.alpha), tau: self.tau.unwrap_or(base.tau) });
            }
            Some(ModeChoice::Global) => Mode::Global,
            Some(ModeChoice::Shadowless) => Mode::Shadowless,
            Some(ModeChoice::OneBounce) => Mode::OneBounce,
            Some(ModeChoice::Local) => Mode::Local,
            Some(ModeChoice::All) => {
                return Err(CliError::Usage {
                    message: "a map holds the light of one mode, and --mode all is four".into(),
                    help: "name one: global, shadowless, one-bounce or local".into(),
                });
            }
        };
        Ok(mode.transport())
    }

    fn lamps(&self) -> Lamps {
        if self.per.per.is_some() { Lamps::Apart } else { Lamps::Together }
    }

    fn held(&self) -> Held {
        if self.indirect { Held::Reflected } else { Held::All }
    }
}

/// Bakes a scene, and writes and says what comes of it.
pub fn run(own: &Bake, common: &Common, console: &Console) -> Result<(), CliError> {
    if own.indirect && own.per.per.is_some() {
        return Err(CliError::Usage {
            message: "--indirect is known of all lamps together, not --per luminaire".into(),
            help: "leave one of them out; maps --per luminaire hold direct light too".into(),
        });
    }
    let folder = own.output.clone().unwrap_or_else(|| common.out.clone());
    let scene = own.completion.load(&own.scene, console)?;
    scene.require_emission()?;
    let transport = own.transport(&scene)?;
    if folder.is_dir() {
        check_place(&folder.join(format!("{}-lightmaps.json", scene.name)))?;
    }
    match own.volume {
        Some(grid) => bake_volume(own, (&scene, transport, grid), (&folder, common), console),
        None => bake_maps(own, (&scene, transport), (&folder, common), console),
    }
}

fn bake_maps(
    own: &Bake,
    (scene, transport): (&Scene, Transport),
    (folder, common): (&PathBuf, &Common),
    console: &Console,
) -> Result<(), CliError> {
    let texels = usize::from(own.texels);
    own.limit.check_pictures((texels, texels).into(), pixel::WITHIN)?;
    let model = Model::open(&own.scene, scene)?;
    model.left_out().iter().for_each(|what| console.warn(what));
    let goal = BakeGoal {
        transport,
        tolerance: own.tolerance,
        held: own.held(),
        lamps: own.lamps(),
        texels,
        padding: own.padding.into(),
        seed: common.seed,
        memory: own.limit.bytes(),
        watch: console,
    };
    console.aim(Aim { label: transport.label(), tolerance: own.tolerance, number: 0, of: 1 });
    let found = bake(scene, model.parts(), &goal)?;
    if let Some(unmet) = &found.unmet {
        console.warn(words_of(unmet));
    }
    let written =
        write_maps((folder, &scene.name), (scene, &model), &found, (own.held(), own.tolerance), own.standard_error)?;
    let (report, files) = written;
    say(&report, &found.maps, console);
    files.iter().for_each(|file| console.say(file.display().to_string()));
    console.report(&report)
}

/// A line on the maps, and one on each lamp.
fn say(report: &BakeReport, maps: &[LightMap], console: &Console) {
    console.say(format!(
        "{}: {} texels of {}² in {} charts, {:.1} a metre, in {:.2} s ({} patches), estimated error {:.2} %",
        report.scene,
        report.covered,
        report.texels,
        report.charts,
        report.texels_per_metre,
        report.seconds,
        report.patches,
        100.0 * maps[0].error,
    ));
    for map in &maps[1..] {
        let name = map.lamp.as_deref().unwrap_or_default();
        console.say(format!("{name:<24} RMS {:.4e} W/m², estimated error {:.2} %", map.rms, 100.0 * map.error));
    }
}

fn bake_volume(
    own: &Bake,
    (scene, transport, grid): (&Scene, Transport, Grid),
    (folder, common): (&PathBuf, &Common),
    console: &Console,
) -> Result<(), CliError> {
    let kind = match own.keep {
        KindChoice::Cube => Kind::Cube,
        KindChoice::Harmonics => Kind::Harmonics,
    };
    let goal = VolumeGoal {
        transport,
        tolerance: own.tolerance,
        grid,
        kind,
        lamps: own.lamps(),
        seed: common.seed,
        memory: own.limit.bytes(),
        watch: console,
    };
    let found = volume(scene, &goal)?;
    let (report, files) = write_volume((folder, &scene.name), scene, &found, own.tolerance)?;
    let VolumeReport { grid: [x, y, z], inside, met, seconds, kind, .. } = &report;
    console.say(format!(
        "{}: {x}x{y}x{z} points ({kind}), {inside} inside of solids, in {seconds:.2} s; {:.1} % within {:.2} %",
        report.scene,
        100.0 * met,
        100.0 * own.tolerance,
    ));
    files.iter().for_each(|file| console.say(file.display().to_string()));
    console.report(&report)
}
