//! The sky of one time as a scene file has it: a file of patch radiances, and the sun as parallel light.
//!
//! Radiances are luminances over 683 lm/W in all channels alike, and the sun's irradiance of a plane that faces it its
//! illuminance over the same, as luminaires by LM-63 are taken: `--lux` of the picture's points gives illuminance back.
//!
//! Not handled: colours; the sun's disc, whose shadows are sharp; scenes that are scene files already, to which lines
//! are added by hand.

use std::fmt::Write as _;
use std::path::{Component, Path, PathBuf};

use glam::DVec3;
use halflight::pictures::write_whole;
use halflight::scene::EFFICACY;
use serde::Serialize;

use crate::division::Compass;
use crate::error::DaylightError;
use crate::sky::{Skies, Sky, SkyTime};

/// Which sky of several.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SkyChoice {
    /// The number, from 1.
    Number(usize),
    /// That of the time nearest to this one, if it stands for it.
    Time(SkyTime),
}

/// What was written of a sky.
#[derive(Clone, Debug, Serialize)]
pub struct SceneSkyReport {
    /// When; none of a sky without a time.
    pub time: Option<SkyTime>,
    /// Illuminance of the horizontal by the sky alone, lx.
    pub diffuse: f64,
    /// Illuminance of a plane that faces the sun, lx; 0 where it does not shine.
    pub direct: f64,
    /// Whether the scene file is whole, or lines to put into one.
    pub whole: bool,
    /// The scene file, and the patches.
    pub files: [PathBuf; 2],
}

impl Skies {
    /// The number from 0 of the sky that is chosen.
    ///
    /// That there is none such, and what there is.
    pub fn find(&self, choice: SkyChoice) -> Result<usize, DaylightError> {
        let none = |message: String| DaylightError::NoSuchSky { sky: self.name.clone(), message };
        let count = self.skies.len();
        let wanted = match choice {
            SkyChoice::Number(k) if (1..=count).contains(&k) => return Ok(k - 1),
            SkyChoice::Number(k) => return Err(none(format!("sky {k} of {count}; they count from 1"))),
            SkyChoice::Time(wanted) => wanted,
        };
        let apart = |own: &SkyTime| {
            let is_day = (own.month, own.day) == (wanted.month, wanted.day);
            if is_day { (own.hour - wanted.hour).abs() } else { f64::INFINITY }
        };
        let times = self.skies.iter().enumerate().filter_map(|(k, sky)| Some((k, sky.time?)));
        let Some((k, nearest)) = times.min_by(|a, b| apart(&a.1).total_cmp(&apart(&b.1))) else {
            return Err(none("a time: give the number of a sky, from 1".into()));
        };
        if apart(&nearest) > 0.5 * self.hours + 1e-6 {
            let there = if apart(&nearest).is_finite() { format!("; {nearest} is nearest") } else { String::new() };
            return Err(none(format!("{wanted}{there}")));
        }
        Ok(k)
    }
}

/// Writes `STEM-sky.txt`, the radiances of a sky, and `STEM-sky.toml`: a scene file of a file of geometry under it, or
/// without that the lines for one.
///
/// A destination that cannot be written.
pub fn write_scene_sky(
    (folder, stem): (&Path, &str),
    (skies, at): (&Skies, usize),
    compass: &Compass,
    geometry: Option<&Path>,
) -> Result<SceneSkyReport, DaylightError> {
    let sky = &skies.skies[at];
    let patches = format!("{stem}-sky.txt");
    let files = [folder.join(format!("{stem}-sky.toml")), folder.join(&patches)];
    let when = sky.time.map_or_else(|| format!("sky {}", at + 1), |time| time.to_string());
    let title = format!("{}, {when}", skies.name).replace(|c: char| c.is_control(), " ");
    write_whole(&files[1], rows(sky, &title, skies.division.fineness()).as_bytes())?;
    let geometry = geometry.map(|file| from_folder(file, folder));
    let text = scene_file(sky, (&title, &patches), compass, geometry.as_deref());
    write_whole(&files[0], text.as_bytes())?;
    let own = skies.division.patches();
    let of = |(l, patch): (&f64, &crate::division::SkyPatch)| l * patch.altitude.sin() * patch.solid_angle;
    Ok(SceneSkyReport {
        time: sky.time,
        diffuse: sky.luminance.iter().zip(&own).skip(1).map(of).sum(),
        direct: sun(sky).map_or(0.0, |(_, illuminance)| illuminance),
        whole: geometry.is_some(),
        files,
    })
}

/// Where the sun shines from above the horizon: the direction to it, and illuminance of a plane that faces it, lx.
fn sun(sky: &Sky) -> Option<(DVec3, f64)> {
    sky.sun.filter(|sun| sun.towards.z > 0.0).map(|sun| (sun.towards, sun.illuminance))
}

fn rows(sky: &Sky, title: &str, n: usize) -> String {
    let mut text = format!(
        "# {title}: radiance R G B, W/(m² sr), luminance over {EFFICACY} lm/W, without a colour\n\
         # the ground, then the patches of MF:{n} from the horizon up, from north clockwise\n"
    );
    for luminance in &sky.luminance {
        let radiance = luminance / EFFICACY;
        let _ = writeln!(text, "{radiance:.7e} {radiance:.7e} {radiance:.7e}");
    }
    text
}

fn scene_file(sky: &Sky, (title, patches): (&str, &str), compass: &Compass, geometry: Option<&Path>) -> String {
    let quoted = |text: &str| serde_json::Value::from(text).to_string();
    let vector = |own: DVec3| format!("[{}, {}, {}]", own.x, own.y, own.z);
    let up = format!("up = {}", vector(compass.up));
    let mut text = match geometry {
        Some(file) => {
            let file = file.to_string_lossy().replace('\\', "/");
            format!("# {title}\nobj = {}\n{up}\n", quoted(&file))
        }
        None => format!("# {title}: lines for a scene file; this one before its tables:\n# {up}\n"),
    };
    let _ = write!(text, "\n[sky]\npatches = {}\nnorth = {}\n", quoted(patches), vector(compass.north));
    if let Some((towards, illuminance)) = sun(sky) {
        let (way, e) = (vector(-compass.vector(towards)), illuminance / EFFICACY);
        let light = format!("direction = {way}\nintensity = [{e:.7}, {e:.7}, {e:.7}]  # W/m², {illuminance:.0} lx");
        let _ = write!(text, "\n[[lights]]\ntype = \"directional\"\nname = \"sun\"\n{light}\n");
    }
    text
}

/// A path to a file from a folder; the whole path where they share nothing.
fn from_folder(file: &Path, folder: &Path) -> PathBuf {
    let whole = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let (file, folder) = (whole(file), whole(folder));
    let shared = file.components().zip(folder.components()).take_while(|(a, b)| a == b).count();
    if shared == 0 {
        return file;
    }
    let out = folder.components().skip(shared).map(|_| Component::ParentDir);
    out.chain(file.components().skip(shared)).collect()
}
