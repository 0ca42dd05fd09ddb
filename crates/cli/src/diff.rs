//! `halflight diff`: two pictures compared, in numbers and in a figure.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use crate::console::Console;
use crate::error::CliError;
use crate::options::arguments::{Common, stops};
use halflight::pictures::{
    Exposure, Largest, Picture, check_extension, largest_difference, make_directory, mean_difference, mean_e_pixel,
    read_picture, relative_rms,
};
use halflight_plot::{Cell, Heading, Page, Shown, difference_cells, difference_scale};

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

#[derive(Serialize)]
struct DiffReport {
    /// Relative RMS error.
    rms: f64,
    /// The paper's mean e_pixel, after clamping to 0..1.
    e_pixel: f64,
    /// Mean of picture less reference, per channel, W/(m² sr).
    mean_difference: [f64; 3],
    largest: Largest,
    files: Vec<PathBuf>,
}

/// Compares a picture with a reference.
pub fn run(own: &Diff, common: &Common, console: &Console) -> Result<(), CliError> {
    if let Some(path) = &own.output {
        check_extension(path)?;
    }
    let picture = read_picture(&own.picture)?;
    let reference = read_picture(&own.reference)?;
    let rms = relative_rms(&picture, &reference, None, None)?;
    let mean = mean_difference(&picture, &reference, None)?;
    let report = DiffReport {
        rms,
        e_pixel: mean_e_pixel(&picture, &reference)?,
        mean_difference: mean.absolute,
        largest: largest_difference(&picture, &reference)?,
        files: vec![figure(own, common, &picture, &reference)?],
    };
    say(console, &report, mean.relative);
    console.report(&report)
}

fn say(console: &Console, r: &DiffReport, relative: [Option<f64>; 3]) {
    let [red, green, blue] = r.mean_difference;
    let percent = relative.map(|r| r.map_or("-".into(), |r| format!("{:+.3} %", 100.0 * r)));
    console.say(format!("relative RMS error   {:.4} %", 100.0 * r.rms));
    console.say(format!("mean e_pixel         {:.4} %", 100.0 * r.e_pixel));
    console.say(format!("mean difference      {red:+.3e} {green:+.3e} {blue:+.3e}  ({})", percent.join(", ")));
    let Largest { value, x, y } = r.largest;
    console.say(format!("largest difference   {value:.4} at column {x}, row {y}"));
    for file in &r.files {
        console.say(file.display().to_string());
    }
}

/// Writes both pictures and their signed difference side by side.
fn figure(own: &Diff, common: &Common, picture: &Picture, reference: &Picture) -> Result<PathBuf, CliError> {
    let exposure = Exposure { stops: own.exposure };
    let names = [&own.picture, &own.reference].map(|p| name(p));
    let scale = difference_scale(picture, reference);
    let cell = |picture, name: &str| Cell::new(Heading::new(name, ""), Shown::image(picture, exposure));
    let mut cells = vec![cell(picture, &names[0]), cell(reference, &names[1])];
    cells.extend(difference_cells(picture, reference, scale));
    let sheet = Page::sheet(format!("{} − {}: red where brighter, blue where darker", names[0], names[1]), cells, 2);
    let path = own.output.clone().unwrap_or_else(|| common.out.join(format!("{}-minus-{}.png", names[0], names[1])));
    if own.output.is_none() {
        make_directory(&common.out)?;
    }
    sheet.drawing().write(&path)?;
    Ok(path)
}

fn name(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}
