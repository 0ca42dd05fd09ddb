//! `halflight relight`: a picture, the powers of lamps and the light at points for other strengths of the lamps, from
//! what was solved before, without a ray.
//!
//! Light is linear in E: the light of every lamp times its factor adds up to that of the dimmed scene. What is needed
//! is the report of `render --per luminaire --json`, or the EXR file of `render --layers luminaires` alone.
//!
//! Not handled: errors of powers and of light at points; lamps that turn or move.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use crate::console::Console;
use crate::error::CliError;
use crate::options::arguments::{Brightness, Common};
use crate::pictures::check_place;
use halflight::pictures::{check_extension, make_directory, write_picture};
use halflight_lighting::{Factors, LampLight, Relit, Uniformity, aims};

/// `halflight relight`
#[derive(Args, Debug)]
#[command(next_help_heading = "Light of lamps")]
pub struct Relight {
    /// The report of `render --per luminaire --json`, or an EXR file with layers of lamps
    pub file: PathBuf,
    /// A factor on a lamp, NAME=F or NAME=R,G,B; the others stay as they are
    #[arg(long = "lamp", value_name = "NAME=F", value_parser = lamp)]
    pub lamps: Vec<(String, [f64; 3])>,
    /// Find the factors from 0 to 1 of all other lamps that light points as wanted, in lux: a table with the columns
    /// lux and name, or lux, x, y and z
    #[arg(long, value_name = "FILE")]
    pub lux: Option<PathBuf>,
    /// Picture to write, .png or .exr [default: <out>/<file>-relit.png]
    #[arg(short, long, value_name = "PICTURE")]
    pub output: Option<PathBuf>,
    /// How bright a PNG file is.
    #[command(flatten)]
    pub brightness: Brightness,
}

/// A lamp and its factor.
fn lamp(text: &str) -> Result<(String, [f64; 3]), String> {
    let wrong = || format!("`{text}` is not NAME=F or NAME=R,G,B with factors of 0 or more");
    let (name, factors) = text.rsplit_once('=').ok_or_else(wrong)?;
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| (0.0..f64::INFINITY).contains(x));
    let factors: Vec<f64> = factors.split(',').map(number).collect::<Option<_>>().ok_or_else(wrong)?;
    let factors = match factors[..] {
        [all] => [all; 3],
        [r, g, b] => [r, g, b],
        _ => return Err(wrong()),
    };
    Ok((name.to_owned(), factors))
}

/// `halflight relight --json`
#[derive(Serialize)]
struct RelightReport {
    #[serde(flatten)]
    relit: Relit,
    files: Vec<PathBuf>,
}

/// Mixes the lamps, and writes and says what comes of it.
pub fn run(own: &Relight, common: &Common, console: &Console) -> Result<(), CliError> {
    if let Some(path) = &own.output {
        check_extension(path)?;
        check_place(path)?;
    }
    let lamps = LampLight::open(&own.file)?;
    let names = lamps.names();
    let mut factors = own.given(&names)?;
    let wanted = own.lux.as_ref().map(|path| wanted(&own.file, &lamps, path)).transpose()?;
    if let Some(wanted) = &wanted {
        factors = lamps.aimed(wanted, &factors);
    }
    let relit = lamps.relit(&factors, wanted.as_deref());
    let files = own.write(&lamps, &relit, common)?;
    let report = RelightReport { relit, files };
    say(&report, console);
    console.report(&report)
}

impl Relight {
    /// The factors of the lamps that are named; an error for a lamp that is not there.
    fn given(&self, names: &[String]) -> Result<Factors, CliError> {
        let unknown = self.lamps.iter().find(|(name, _)| !names.contains(name));
        match unknown {
            Some((name, _)) => Err(CliError::Usage {
                message: format!("there is no lamp `{name}` in {}", self.file.display()),
                help: format!("its lamps: {}", names.join(", ")),
            }),
            None => Ok(self.lamps.iter().cloned().collect()),
        }
    }

    /// Writes the picture, where there are layers to make it from, and the table of the points.
    fn write(&self, lamps: &LampLight, relit: &Relit, common: &Common) -> Result<Vec<PathBuf>, CliError> {
        let stem = self.file.file_stem().unwrap_or_default().to_string_lossy();
        let place = |end: &str| common.out.join(format!("{stem}-relit{end}"));
        let mut files = Vec::new();
        match (lamps.picture(&relit.factors), &self.output) {
            (Some(picture), output) => {
                if output.is_none() {
                    make_directory(&common.out)?;
                }
                let path = output.clone().unwrap_or_else(|| place(".png"));
                write_picture(&path, &picture, self.brightness.exposure())?;
                files.push(path);
            }
            (None, Some(output)) => {
                return Err(refused(
                    &self.file,
                    &format!("names no EXR file with layers of lamps to make {} from", output.display()),
                    "render again with --layers luminaires and an .exr file as --output",
                ));
            }
            (None, None) => (),
        }
        if !relit.points.is_empty() {
            make_directory(&common.out)?;
            relit.table().write(place(".csv"))?;
            files.push(place(".csv"));
        }
        Ok(files)
    }
}

/// The illuminance wanted at each point, of those that a table has.
fn wanted(file: &Path, lamps: &LampLight, path: &Path) -> Result<Vec<Option<f64>>, CliError> {
    if lamps.points().iter().all(|point| point.luminaires.is_empty()) {
        let help = "measure light at points by lamps: render --points FILE --per luminaire --json";
        return Err(refused(file, "has no points with the light of lamps", help));
    }
    let table = fs::read(path)
        .map_err(|error| refused(path, &format!("cannot be read: {error}"), "check the file's name and permissions"))?;
    let help = "give a table with the columns lux and name, or lux, x, y and z";
    let at = |(line, what)| refused(path, &format!("line {line}: {what}"), help);
    aims(&table, lamps.points()).map_err(at)
}

fn refused(path: &Path, what: &str, help: &str) -> CliError {
    CliError::Relight { message: format!("{} {what}", path.display()), help: help.to_owned() }
}

/// The factors, the powers, and how the points are lit.
fn say(RelightReport { relit, files }: &RelightReport, console: &Console) {
    for (name, [r, g, b]) in &relit.factors {
        let factor = if r == g && g == b { format!("{r:.4}") } else { format!("{r:.4} {g:.4} {b:.4}") };
        let own = relit.luminaires.iter().find(|power| power.name == *name);
        let power = own.map_or_else(String::new, |own| {
            let sum = |power: &[f64; 3]| power.iter().sum::<f64>();
            format!("  {:>11.4e} W emitted, {:>11.4e} W reflected", sum(&own.emitted), sum(&own.reflected))
        });
        console.say(format!("{name:<24} x {factor}{power}"));
    }
    if !relit.points.is_empty() {
        let Uniformity { count, mean, least, most, .. } = relit.uniformity();
        console.say(format!("{count} points: mean {mean:.2} lx, least {least:.2}, most {most:.2}"));
    }
    if let Some([rms, most]) = relit.left_over {
        console.say(format!("left over: {rms:.2} lx in the root mean square, {most:.2} at most"));
    }
    if let Some(error) = relit.error {
        console.say(format!("estimated error of the picture: {:.2} %", 100.0 * error));
    }
    files.iter().for_each(|file| console.say(file.display().to_string()));
}
