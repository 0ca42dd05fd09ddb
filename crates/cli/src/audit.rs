//! `halflight audit`: the error of any picture of a scene, without a reference, and where it is.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use crate::console::Console;
use crate::console::warnings::check_variance;
use crate::error::CliError;
use crate::options::arguments::{Common, MemoryLimit, Subject, picture_error, seconds, unit_interval};
use halflight::light::{Rgb, Transport};
use halflight::pictures::{
    Exposure, NamedPicture, Picture, Shows, Size, check_destination, check_extension, encode_srgb, is_exr,
    make_directory, read_picture, write_layered,
};
use halflight::rays::Rays;
use halflight::scene::Scene;
use halflight_audit::{Audit, AuditError, AuditGoal, Cause, Estimated, MeanError, Part, Verdict, audit, verdict};
use halflight_plot::{Cell, Heading, Page, Shown, difference_cells, difference_scale};

/// `halflight audit`
#[derive(Args, Debug)]
#[command(next_help_heading = "Accuracy")]
pub struct AuditArguments {
    /// The picture: .exr or .hdr, linear; or .png, sRGB at --exposure
    #[arg(help_heading = None::<&str>)]
    pub picture: PathBuf,
    /// What it is a picture of.
    #[command(flatten)]
    pub subject: Subject,
    /// Say whether the error is at most this: sampling ends when that is certain, and exit code 7 says that it is not
    #[arg(long, value_name = "E", value_parser = picture_error)]
    pub at_most: Option<f64>,
    /// Standard error of the error to aim at, a share of it
    #[arg(long, value_name = "SHARE", default_value_t = 0.1, value_parser = share, conflicts_with = "at_most")]
    pub resolve: f32,
    /// An error that is certainly below this is not resolved further
    #[arg(long, value_name = "T", default_value = "0.01", value_parser = picture_error, conflicts_with = "at_most")]
    pub tolerance: f64,
    /// Begin no round of samples that would end after so many seconds of sampling
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub time: Option<f64>,
    /// Map to write, .png (a figure) or .exr (numbers) [default: both, <out>/<picture>-audit.png and .exr]
    #[arg(short, long, value_name = "FILE", help_heading = "Picture")]
    pub output: Option<PathBuf>,
    /// Within which memory.
    #[command(flatten)]
    pub limit: MemoryLimit,
}

/// A share above 0.
fn share(text: &str) -> Result<f32, String> {
    let words = "must be a number above 0, up to 1";
    unit_interval(text).ok().filter(|share| *share > 0.0).ok_or_else(|| words.into())
}

/// Bytes that are kept of a pixel.
const EACH: f64 = 1000.0;
/// Share of the squared error that a cause explains before it is said.
const WORTH_SAYING: f64 = 0.2;

/// `halflight audit --json`
#[derive(Serialize)]
struct AuditReport {
    scene: String,
    picture: PathBuf,
    alpha: f32,
    tau: f32,
    width: usize,
    height: usize,
    /// Relative RMS error over the pixels that see no luminaire, and its standard error.
    error: Estimated,
    /// Its square, which is what is estimated without bias, and below 0 where chance is more than the error.
    squared_error: Estimated,
    /// Three standard errors of the square below and above.
    range: [f64; 2],
    /// Pixels that carry the standard error.
    effective_pixels: f64,
    /// Pixels that count.
    pixels: usize,
    /// RMS of the scene over them, W/(m² sr).
    rms: f64,
    /// Light of the picture less that of the scene, relative to that.
    mean_error: MeanError,
    /// What would explain the error, the most first.
    causes: Vec<Cause>,
    /// Parts of the picture that have much of it.
    #[serde(rename = "where")]
    parts: Vec<Part>,
    /// Whether the error is known as well as was asked for.
    met: bool,
    /// The error asked about, and whether it is at most that.
    at_most: Option<f64>,
    verdict: Option<Verdict>,
    /// Samples of a pixel in the mean.
    samples: f64,
    rays: u64,
    /// To prepare the scene, and to sample.
    seconds: [f64; 2],
    files: Vec<PathBuf>,
}

/// Tells the error of a picture.
pub fn run(own: &AuditArguments, common: &Common, console: &Console) -> Result<(), CliError> {
    let places = places(own, common)?;
    let picture = read(own, console)?;
    own.limit.check_pictures(picture.size(), EACH)?;
    let scene = own.subject.load(console)?;
    let transport = one_mode(own, &scene)?;
    check_series(console, &scene, transport, common.seed)?;
    let goal = AuditGoal {
        resolve: f64::from(own.resolve),
        tolerance: own.tolerance,
        at_most: own.at_most,
        seconds: own.time,
        seed: common.seed,
    };
    let told = audit(&scene, transport, &picture, &goal, console)?;
    let files = write(own, &places, &picture, &told)?;
    let report = report(own, (&scene, transport, picture.size()), &told, files);
    say(console, &report, transport);
    console.report(&report)?;
    match report.verdict {
        Some(Verdict::Above) => {
            Err(CliError::Above { error: told.error.relative(), most: goal.at_most.unwrap_or(0.0) })
        }
        _ => Ok(()),
    }
}

/// Where the maps go, which must be writable before the work.
fn places(own: &AuditArguments, common: &Common) -> Result<Vec<PathBuf>, CliError> {
    if let Some(path) = &own.output {
        check_extension(path)?;
        check_destination(path)?;
        return Ok(vec![path.clone()]);
    }
    make_directory(&common.out)?;
    let stem = name(&own.picture);
    let places = ["png", "exr"].map(|end| common.out.join(format!("{stem}-audit.{end}")));
    places.iter().try_for_each(check_destination)?;
    Ok(places.to_vec())
}

/// Reads the picture; of a PNG file the exposure is taken back.
fn read(own: &AuditArguments, console: &Console) -> Result<Picture, CliError> {
    let picture = read_picture(&own.picture)?;
    let is_png = own.picture.extension().is_some_and(|end| end.eq_ignore_ascii_case("png"));
    if !is_png {
        return Ok(picture);
    }
    let exposure = own.subject.exposure();
    let white = picture.pixels.iter().filter(|pixel| encode_srgb(pixel.max_element()) >= 1.0).count();
    console.warn(format!(
        "{}: read as sRGB at an exposure of {} stops (--exposure), to half of one of 255 codes; {:.1} % of its pixels are \
         clipped. An EXR file says more",
        own.picture.display(),
        exposure.stops,
        100.0 * white as f64 / picture.pixels.len().max(1) as f64,
    ));
    Ok(picture.scaled(1.0 / exposure.factor()))
}

/// The mode that the picture is of.
fn one_mode(own: &AuditArguments, scene: &Scene) -> Result<Transport, CliError> {
    match own.subject.transports(scene)[..] {
        [one] => Ok(one),
        _ => Err(CliError::Usage {
            message: format!("{} may show {} in any of several modes", own.picture.display(), scene.name),
            help: "say which: --mode global, or --alpha A --tau T".into(),
        }),
    }
}

/// A series that is seen to diverge has no picture; where nothing lets light through and all absorbs, it converges.
fn check_series(console: &Console, scene: &Scene, transport: Transport, seed: u32) -> Result<(), CliError> {
    let passes = scene.transports(transport).iter().any(|own| own.tau > 0.0 && own.alpha > 0.0);
    let absorbs = scene.materials.iter().all(|material| material.rho.max_element() < 1.0);
    if !passes && absorbs {
        return Ok(());
    }
    if check_variance(console, scene, &Rays::new(scene), transport, seed).diverges() {
        return Err(AuditError::Endless.into());
    }
    Ok(())
}

fn report(
    own: &AuditArguments,
    (scene, transport, Size { width, height }): (&Scene, Transport, Size),
    told: &Audit,
    files: Vec<PathBuf>,
) -> AuditReport {
    let error = &told.error;
    AuditReport {
        scene: scene.name.clone(),
        picture: own.picture.clone(),
        alpha: transport.alpha,
        tau: transport.tau,
        width,
        height,
        error: error.relative(),
        squared_error: error.squared,
        range: [error.at(-halflight_audit::SURE), error.at(halflight_audit::SURE)],
        effective_pixels: error.effective_pixels,
        pixels: error.pixels,
        rms: error.rms,
        mean_error: told.mean,
        causes: told.causes.clone(),
        parts: told.parts.clone(),
        met: told.met,
        at_most: own.at_most,
        verdict: own.at_most.map(|most| verdict(error, most)),
        samples: told.samples,
        rays: told.rays,
        seconds: told.seconds,
        files,
    }
}

fn say(console: &Console, report: &AuditReport, transport: Transport) {
    let r = report;
    let files: Vec<String> = r.files.iter().map(|file| file.display().to_string()).collect();
    console.say(format!(
        "{:<11} error {}, mean error {}; {:.0} samples a pixel in {:.2} s, {:.0} of {} pixels carry the uncertainty: {}",
        transport.label(),
        percent(r.error),
        signed(r.mean_error.total),
        r.samples,
        r.seconds.iter().sum::<f64>(),
        r.effective_pixels,
        r.pixels,
        files.join(" "),
    ));
    for cause in r.causes.iter().filter(|cause| cause.explains() >= WORTH_SAYING) {
        console.say(format!("  {:.0} % of its square is explained {}", 100.0 * cause.explains(), words(cause)));
    }
    for Part { columns, rows, share, mean } in &r.parts {
        console.say(format!(
            "  {:.0} % of its square in columns {} to {}, rows {} to {}, mean error {} there",
            100.0 * share,
            columns.start,
            columns.end - 1,
            rows.start,
            rows.end - 1,
            signed(*mean),
        ));
    }
    warn(console, r);
}

fn warn(console: &Console, r: &AuditReport) {
    if let (Some(Verdict::Open), Some(most)) = (r.verdict, r.at_most) {
        let [least, largest] = r.range.map(|e| format!("{:.2}", 100.0 * e));
        console.warn(format!(
            "whether the error is at most {:.2} % is not certain: it is {least} to {largest} %; more --time tells",
            100.0 * most
        ));
    } else if !r.met {
        console.warn("the error is not known as well as --resolve asks for; more --time tells");
    }
}

fn words(cause: &Cause) -> String {
    let number = |e: Estimated| format!("{:.3} ± {:.3}", e.value, e.standard_error);
    match *cause {
        Cause::Brightness { factor, .. } => format!("by brightness: the picture is {} times as bright", number(factor)),
        Cause::Gamma { gamma, .. } => {
            format!("by a gamma: the picture is the scene's to the power of {}", number(gamma))
        }
        Cause::Shift { right, down, .. } => {
            format!("by a shift: {} pixels to the right, {} down", number(right), number(down))
        }
    }
}

fn percent(e: Estimated) -> String {
    format!("{:.2} % ± {:.2} %", 100.0 * e.value, 100.0 * e.standard_error)
}

fn signed(e: Estimated) -> String {
    format!("{:+.2} % ± {:.2} %", 100.0 * e.value, 100.0 * e.standard_error)
}

/// Writes the maps.
fn write(own: &AuditArguments, places: &[PathBuf], picture: &Picture, told: &Audit) -> Result<Vec<PathBuf>, CliError> {
    for path in places {
        if is_exr(path) {
            write_layered(path, &told.signed, &layers(told), Exposure::default())?;
        } else {
            figure(own, picture, told).drawing().write(path)?;
        }
    }
    Ok(places.to_vec())
}

/// The layers of the EXR file beside the signed difference.
fn layers(told: &Audit) -> [NamedPicture<&Picture>; 4] {
    let layer = |name: &str, shows, picture| NamedPicture { name: name.into(), shows, picture };
    [
        layer("rms error", Shows::Light, &told.squared),
        layer("estimate", Shows::Light, &told.estimate),
        layer("estimate", Shows::StandardError, &told.standard_error),
        layer("mask", Shows::Light, &told.mask),
    ]
}

/// The picture, what paths found, and both maps.
fn figure(own: &AuditArguments, picture: &Picture, told: &Audit) -> Page {
    let exposure = Exposure::of(picture).unwrap_or_default();
    let cell = |title: &str, shown: &Picture| Cell::new(Heading::new(title, ""), Shown::image(shown, exposure));
    let mut cells = vec![cell(&name(&own.picture), picture), cell("independent paths", &told.estimate)];
    let black = Picture::new(picture.width, picture.height);
    for (title, map) in [("picture − scene", &told.signed), ("RMS error", &told.squared)] {
        let [mut shown, mut legend] = difference_cells(map, &black, scale(map));
        shown.above = Heading::new(title, "");
        legend.below = format!("W/(m² sr); the RMS of the scene is {:.3}", told.error.rms);
        cells.extend([shown, legend]);
    }
    // Maps above their legends.
    cells.swap(3, 4);
    let error = percent(told.error.relative());
    Page::sheet(format!("{} is {error} off: where that is certain", name(&own.picture)), cells, 2)
}

/// The scale of what a map shows, which may be little of it.
fn scale(map: &Picture) -> f32 {
    let shown: Vec<Rgb> = map.pixels.iter().copied().filter(|pixel| *pixel != Rgb::ZERO).collect();
    let line = Picture { width: shown.len(), height: 1, pixels: shown };
    difference_scale(&line, &Picture::new(line.width, 1))
}

fn name(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}
