//! `halflight explore`: a page to play with, one HTML file of a solved scene.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use serde::Serialize;

use crate::console::Console;
use crate::error::CliError;
use crate::options::arguments::{Common, Completion, MemoryLimit, tolerance};
use crate::pictures::check_place;
use halflight::pictures::{make_directory, write_whole};
use halflight::render::Fineness;
use halflight_explore::{Counts, DOUBTFUL, Limits, Page, PageEffort, TermsEffort, Words, page};

/// `halflight explore`
#[derive(Args, Debug)]
#[command(next_help_heading = "Page")]
pub struct Explore {
    /// A built-in scene (see `halflight scenes`), an .obj, .glb or .gltf file, or a .toml scene file
    #[arg(default_value = "cornell-box", help_heading = None::<&str>)]
    pub scene: String,
    /// The file to write [default: DIR/SCENE.html]
    #[arg(short, long, value_name = "PAGE.html")]
    pub output: Option<PathBuf>,
    /// What its files do not say.
    #[command(flatten)]
    pub completion: Completion,
    /// Look through the file's camera of this name (glTF) [default: the scene file's, or the first]
    #[arg(long, value_name = "NAME", help_heading = "Scene")]
    pub camera: Option<String>,
    /// What the page is called [default: the scene's name]
    #[arg(long, value_name = "TEXT")]
    pub title: Option<String>,
    /// Who made the scene, and its licence: stands in the page
    #[arg(long, value_name = "TEXT", default_value = "")]
    pub attribution: String,
    /// Open with the story alone: five cards, after which come the controls
    #[arg(long)]
    pub story: bool,
    /// About how many patches to cut the scene into
    #[arg(long, value_name = "N", default_value_t = 4000, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub patches: u32,
    /// Hemisphere rays from each patch
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(1..=1_048_576))]
    pub rays: u32,
    /// Terms of the series that are kept apart, E not counted
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u16).range(2..=32))]
    pub terms: u16,
    /// Values of tau that are solved; between them light is interpolated
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u16).range(2..=17))]
    pub taus: u16,
    /// How near its picture shall be to a rendered one, by the file's camera, as a share: cells of light are made finer
    /// where it is not, as long as the page is not too large
    #[arg(long, value_name = "E", default_value_t = 0.1, value_parser = tolerance)]
    pub tolerance: f64,
    /// How large finer cells may make the page
    #[arg(long, value_name = "MB", default_value_t = 8.0, value_parser = megabytes)]
    pub megabytes: f64,
    /// Within which memory.
    #[command(flatten)]
    pub limit: MemoryLimit,
}

/// `halflight explore --json`
#[derive(Serialize)]
struct ExploreReport {
    scene: String,
    #[serde(flatten)]
    counts: Counts,
    bytes: usize,
    /// Largest relative RMS error of reflected light between the taus that are solved.
    tau_error: f64,
    /// RMS difference of the page's picture from a rendered one.
    rms: Option<f64>,
    seconds: f64,
    files: Vec<PathBuf>,
}

/// A length in megabytes.
fn megabytes(text: &str) -> Result<f64, String> {
    let value: Option<f64> = text.parse().ok();
    value.filter(|mb| (0.1..=1000.0).contains(mb)).ok_or_else(|| format!("{text} is not a number from 0.1 to 1000"))
}

/// Makes a page.
pub fn run(own: &Explore, common: &Common, console: &Console) -> Result<(), CliError> {
    let start = Instant::now();
    let mut scene = own.completion.load(&own.scene, console)?;
    if let Some(name) = &own.camera {
        scene.look_through(name)?;
    }
    scene.require_emission()?;
    let file = match &own.output {
        Some(file) => file.clone(),
        None => {
            make_directory(&common.out)?;
            common.out.join(format!("{}.html", scene.name))
        }
    };
    check_place(&file)?;
    let title = own.title.clone().unwrap_or_else(|| scene.name.clone());
    let words = Words { title, attribution: own.attribution.clone(), story: own.story };
    let terms = TermsEffort {
        fineness: Fineness { patches: own.patches as usize, rays: own.rays },
        taus: own.taus.into(),
        terms: own.terms.into(),
        seed: common.seed,
        memory: own.limit.bytes(),
    };
    let effort = PageEffort { terms, limits: Limits { within: own.tolerance, bytes: (1e6 * own.megabytes) as usize } };
    let Page { html, counts, tau_error, rms } = page(&scene, &effort, &words, console)?;
    write_whole(&file, html.as_bytes())?;
    let (seconds, bytes) = (start.elapsed().as_secs_f64(), html.len());
    if let Some(rms) = rms.filter(|rms| *rms > DOUBTFUL) {
        console.warn(format!(
            "the page's picture is {:.0} % off a rendered one by the file's camera, and says so: larger --patches and \
             --megabytes, and a smaller --tolerance, bring it nearer",
            100.0 * rms
        ));
    }
    let apart = rms.map_or_else(String::new, |rms| format!(", its picture {:.1} % from a rendered one", 100.0 * rms));
    console.say(format!(
        "{}: {} patches, {} {}, {} terms, {} taus in {seconds:.1} s; between taus {:.2} % off at most{apart}: {} \
         ({:.1} MB)",
        scene.name,
        counts.patches,
        counts.lamps,
        if counts.lamps == 1 { "lamp" } else { "lamps" },
        own.terms,
        own.taus,
        100.0 * tau_error,
        file.display(),
        bytes as f64 / 1e6,
    ));
    console.report(&ExploreReport { scene: scene.name, counts, bytes, tau_error, rms, seconds, files: vec![file] })
}
