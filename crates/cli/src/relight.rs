//! `halflight relight`: a picture, the powers of lamps and the light at points for other strengths of the lamps, from
//! what was solved before, without a ray.
//!
//! Light is linear in E: the light of every lamp times its factor adds up to that of the dimmed scene. What is needed
//! is the report of `render --per luminaire --json`, or the EXR file of `render --layers luminaires` alone.
//!
//! Not handled: errors of what is dimmed, which are those of the parts; lamps that turn or move.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use serde::{Deserialize, Serialize};

use crate::console::Console;
use crate::error::CliError;
use crate::options::arguments::{Brightness, Common};
use crate::options::points::lux;
use halflight::pictures::{
    NamedPicture, Picture, Table, check_destination, check_extension, is_exr, make_directory, read_layers, rows,
    write_picture,
};
use halflight::render::{EmitterPower, LayerKind, STANDARD_ERROR, Uniformity};
use halflight_study::dimmed;

/// `halflight relight`
#[derive(Args, Debug)]
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

/// What was kept of a run: the parts of its report that hold the light of lamps.
#[derive(Default, Deserialize)]
struct Earlier {
    #[serde(default)]
    luminaires: Vec<EmitterPower>,
    #[serde(default)]
    points: Vec<EarlierPoint>,
    #[serde(default)]
    files: Vec<PathBuf>,
    /// Of a report of several modes.
    modes: Option<Vec<serde::de::IgnoredAny>>,
    #[serde(skip)]
    layers: Vec<NamedPicture<Picture>>,
}

/// A point of a report.
#[derive(Deserialize)]
struct EarlierPoint {
    name: Option<String>,
    position: [f64; 3],
    /// Whether it lies inside of a solid, where nobody measures.
    #[serde(default)]
    is_inside: bool,
    #[serde(default)]
    luminaires: BTreeMap<String, [f64; 3]>,
}

/// `halflight relight --json`
#[derive(Serialize)]
struct RelightReport {
    /// Factor of each lamp, channel by channel.
    factors: BTreeMap<String, [f64; 3]>,
    /// Powers with these factors.
    luminaires: Vec<EmitterPower>,
    points: Vec<RelitPoint>,
    /// Root mean square and largest difference to the illuminance wanted, lux.
    #[serde(skip_serializing_if = "Option::is_none")]
    left_over: Option<[f64; 2]>,
    files: Vec<PathBuf>,
}

/// A point with these factors.
#[derive(Serialize)]
struct RelitPoint {
    name: Option<String>,
    position: [f64; 3],
    /// W/m², and lux.
    irradiance: [f64; 3],
    illuminance: f64,
    is_inside: bool,
    /// Lux.
    #[serde(skip_serializing_if = "Option::is_none")]
    wanted: Option<f64>,
}

/// Mixes the lamps, and writes and says what comes of it.
pub fn run(own: &Relight, common: &Common, console: &Console) -> Result<(), CliError> {
    if let Some(path) = &own.output {
        check_extension(path)?;
        check_destination(path)?;
    }
    let earlier = Earlier::open(&own.file)?;
    let names = earlier.names();
    if names.is_empty() {
        return Err(refused(
            &own.file,
            "has no light of single lamps",
            "render the scene again: halflight render SCENE --mode MODE --per luminaire --json > report.json",
        ));
    }
    let mut factors = own.given(&names)?;
    let wanted = match &own.lux {
        Some(path) => Some(earlier.wanted(&own.file, path)?),
        None => None,
    };
    if let Some(wanted) = &wanted {
        earlier.aim(wanted, &names, &mut factors);
    }
    let factor = |name: &str| factors.get(name).copied().unwrap_or([1.0; 3]);
    let mut report = earlier.relit(factor, wanted.as_deref());
    report.factors = names.iter().map(|name| (name.clone(), factor(name))).collect();
    own.write(&earlier, common, &mut report)?;
    say(&report, console);
    console.report(&report)
}

impl Relight {
    /// The factors of the lamps that are named; an error for a lamp that is not there.
    fn given(&self, names: &[String]) -> Result<BTreeMap<String, [f64; 3]>, CliError> {
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
    fn write(&self, earlier: &Earlier, common: &Common, report: &mut RelightReport) -> Result<(), CliError> {
        let stem = self.file.file_stem().unwrap_or_default().to_string_lossy();
        let place = |end: &str| common.out.join(format!("{stem}-relit{end}"));
        let Some(first) = earlier.layers.first() else {
            if let Some(path) = &self.output {
                return Err(refused(
                    &self.file,
                    &format!("names no EXR file with layers of lamps to make {} from", path.display()),
                    "render again with --layers luminaires and an .exr file as --output",
                ));
            }
            return self.write_points(report, || place(".csv"), common);
        };
        let mut picture = Picture::new(first.picture.width, first.picture.height);
        for NamedPicture { name, picture: layer } in &earlier.layers {
            let factor =
                LayerKind::emitter(name).and_then(|lamp| report.factors.get(lamp)).copied().unwrap_or([1.0; 3]);
            let factor = glam::DVec3::from(factor).as_vec3();
            picture.pixels.iter_mut().zip(&layer.pixels).for_each(|(sum, p)| *sum += factor * *p);
        }
        if self.output.is_none() {
            make_directory(&common.out)?;
        }
        let path = self.output.clone().unwrap_or_else(|| place(".png"));
        write_picture(&path, &picture, self.brightness.exposure())?;
        report.files.push(path);
        self.write_points(report, || place(".csv"), common)
    }

    fn write_points(
        &self,
        report: &mut RelightReport,
        place: impl Fn() -> PathBuf,
        common: &Common,
    ) -> Result<(), CliError> {
        if report.points.is_empty() {
            return Ok(());
        }
        make_directory(&common.out)?;
        let mut table = Table::new("name,x,y,z,irradiance_r,irradiance_g,irradiance_b,illuminance");
        for point in &report.points {
            let name = point.name.clone().unwrap_or_default();
            let ([x, y, z], [r, g, b]) = (point.position, point.irradiance);
            table.row(&[&name, &x, &y, &z, &r, &g, &b, &point.illuminance]);
        }
        let path = place();
        table.write(&path)?;
        report.files.push(path);
        Ok(())
    }
}

impl Earlier {
    /// Reads a report, and the layers of the EXR file that it names; or those of an EXR file.
    fn open(path: &Path) -> Result<Earlier, CliError> {
        if is_exr(path) {
            let layers = read_layers(path)?;
            return Ok(Earlier { layers: lamps(layers), ..Earlier::default() });
        }
        let text = fs::read_to_string(path).map_err(|error| {
            refused(path, &format!("cannot be read: {error}"), "check the file's name and permissions")
        })?;
        let read: Result<Earlier, _> = serde_json::from_str(&text);
        let mut earlier = read.map_err(|error| {
            refused(path, &format!("is no report of `render --json`: {error}"), "name the report or an EXR file")
        })?;
        if earlier.modes.is_some() {
            return Err(refused(path, "is a report of several modes", "render one of them: --mode MODE"));
        }
        if let Some(own) = earlier.files.iter().find(|file| is_exr(file)) {
            let beside = path.parent().map(|folder| folder.join(own));
            let found = beside.filter(|path| path.is_file()).unwrap_or_else(|| own.clone());
            earlier.layers = lamps(read_layers(&found)?);
        }
        Ok(earlier)
    }

    /// The lamps of all that was kept.
    fn names(&self) -> Vec<String> {
        let of_points = self.points.iter().take(1).flat_map(|point| point.luminaires.keys().cloned());
        let of_layers = self.layers.iter().filter_map(|layer| LayerKind::emitter(&layer.name).map(str::to_owned));
        let mut names: Vec<String> = Vec::new();
        for name in self.luminaires.iter().map(|own| own.name.clone()).chain(of_points).chain(of_layers) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    /// The illuminance wanted at each point, of those that a table has; at least one.
    fn wanted(&self, file: &Path, path: &Path) -> Result<Vec<Option<f64>>, CliError> {
        if self.points.iter().all(|point| point.luminaires.is_empty()) {
            let help = "measure light at points by lamps: render --points FILE --per luminaire --json";
            return Err(refused(file, "has no points with the light of lamps", help));
        }
        let bytes = fs::read(path).map_err(|error| {
            refused(path, &format!("cannot be read: {error}"), "check the file's name and permissions")
        })?;
        let help = "give a table with the columns lux and name, or lux, x, y and z";
        let at = |line: usize, what: &str| refused(path, &format!("line {line}: {what}"), help);
        let rows = rows(&bytes).map_err(|(line, what)| at(line, &what))?;
        let Some((heads, rows)) = rows.split_first() else { return Err(at(1, "no table")) };
        let column = |name: &str| heads.fields.iter().position(|head| head.eq_ignore_ascii_case(name));
        let Some(lux) = column("lux") else { return Err(at(heads.line, "no column `lux`")) };
        let places = [column("x"), column("y"), column("z")];
        let mut wanted = vec![None; self.points.len()];
        for row in rows {
            let field = |k: Option<usize>| k.and_then(|k| row.fields.get(k)).map(String::as_str).unwrap_or_default();
            let number = |k: Option<usize>| field(k).parse::<f64>().ok().filter(|x| x.is_finite());
            let found = match column("name") {
                Some(name) => self.points.iter().position(|point| point.name.as_deref() == Some(field(Some(name)))),
                None => {
                    let place = places.map(number);
                    self.points
                        .iter()
                        .position(|point| (0..3).all(|d| place[d].is_some_and(|x| is_near(x, point.position[d]))))
                }
            };
            let Some(point) = found else {
                return Err(at(row.line, &format!("no point of {} is this one", file.display())));
            };
            let value = number(Some(lux)).filter(|x| *x >= 0.0);
            let value =
                value.ok_or_else(|| at(row.line, &format!("`{}` is not a number of 0 or more", field(Some(lux)))))?;
            wanted[point] = Some(value);
        }
        if wanted.iter().all(Option::is_none) {
            return Err(at(heads.line, "no point in it"));
        }
        Ok(wanted)
    }

    /// Sets the factors of the lamps that have none so that the points are lit as wanted.
    fn aim(&self, wanted: &[Option<f64>], names: &[String], factors: &mut BTreeMap<String, [f64; 3]>) {
        let free: Vec<&String> = names.iter().filter(|name| !factors.contains_key(*name)).collect();
        let goals = self.points.iter().zip(wanted).filter_map(|(point, wanted)| Some((point, (*wanted)?)));
        let (mut lit, mut goal) = (Vec::new(), Vec::new());
        for (point, wanted) in goals {
            let of = |name: &String| point.luminaires.get(name).copied().unwrap_or_default();
            let fixed = factors.iter().map(|(name, factor)| lux(&times(of(name), *factor))).sum::<f64>();
            lit.push(free.iter().map(|name| lux(&of(name))).collect::<Vec<f64>>());
            goal.push(wanted - fixed);
        }
        for (name, factor) in free.iter().zip(dimmed(&lit, &goal).unwrap_or_default()) {
            factors.insert((*name).clone(), [factor; 3]);
        }
    }

    /// Powers and points with some factors.
    fn relit(&self, factor: impl Fn(&str) -> [f64; 3], wanted: Option<&[Option<f64>]>) -> RelightReport {
        let power = |own: &EmitterPower| EmitterPower {
            name: own.name.clone(),
            emitted: times(own.emitted, factor(&own.name)),
            reflected: times(own.reflected, factor(&own.name)),
        };
        let point = |(k, point): (usize, &EarlierPoint)| {
            let each = point.luminaires.iter().map(|(name, light)| times(*light, factor(name)));
            let irradiance = each.fold([0.0; 3], |sum, light| [0, 1, 2].map(|c| sum[c] + light[c]));
            RelitPoint {
                name: point.name.clone(),
                position: point.position,
                is_inside: point.is_inside,
                irradiance,
                illuminance: lux(&irradiance),
                wanted: wanted.and_then(|wanted| wanted[k]),
            }
        };
        let points: Vec<RelitPoint> = self.points.iter().enumerate().map(point).collect();
        let apart: Vec<f64> = points.iter().filter_map(|p| Some((p.illuminance - p.wanted?).abs())).collect();
        let rms = (apart.iter().map(|d| d * d).sum::<f64>() / apart.len().max(1) as f64).sqrt();
        let left_over = (!apart.is_empty()).then(|| [rms, apart.iter().fold(0.0, |most: f64, d| most.max(*d))]);
        let luminaires = self.luminaires.iter().map(power).collect();
        RelightReport { factors: BTreeMap::new(), luminaires, points, left_over, files: Vec::new() }
    }
}

/// The layers of lamps.
fn lamps(layers: Vec<NamedPicture<Picture>>) -> Vec<NamedPicture<Picture>> {
    let is_lamp = |layer: &NamedPicture<Picture>| {
        LayerKind::emitter(&layer.name).is_some_and(|lamp| !lamp.ends_with(STANDARD_ERROR))
    };
    layers.into_iter().filter(is_lamp).collect()
}

fn times(light: [f64; 3], factor: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|c| light[c] * factor[c])
}

/// Whether two coordinates are one, as far as tables write them.
fn is_near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-6 * a.abs().max(b.abs()).max(1.0)
}

fn refused(path: &Path, what: &str, help: &str) -> CliError {
    CliError::Relight { message: format!("{} {what}", path.display()), help: help.to_owned() }
}

/// The factors, the powers, and how the points are lit.
fn say(report: &RelightReport, console: &Console) {
    for (name, [r, g, b]) in &report.factors {
        let factor = if r == g && g == b { format!("{r:.4}") } else { format!("{r:.4} {g:.4} {b:.4}") };
        let own = report.luminaires.iter().find(|power| power.name == *name);
        let power = own.map_or_else(String::new, |own| {
            let sum = |power: &[f64; 3]| power.iter().sum::<f64>();
            format!("  {:>11.4e} W emitted, {:>11.4e} W reflected", sum(&own.emitted), sum(&own.reflected))
        });
        console.say(format!("{name:<24} x {factor}{power}"));
    }
    if !report.points.is_empty() {
        let values = report.points.iter().map(|point| (!point.is_inside).then_some(point.illuminance));
        let Uniformity { count, mean, least, most, .. } = Uniformity::of(values);
        console.say(format!("{count} points: mean {mean:.2} lx, least {least:.2}, most {most:.2}"));
    }
    if let Some([rms, most]) = report.left_over {
        console.say(format!("left over: {rms:.2} lx in the root mean square, {most:.2} at most"));
    }
    report.files.iter().for_each(|file| console.say(file.display().to_string()));
}
