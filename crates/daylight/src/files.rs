//! What is written of daylight: coefficients, illuminance hour by hour, what a year is worth, and plans of it.
//!
//! | file | holds |
//! |---|---|
//! | `STEM-daylight.mtx` | D as Radiance's `dctimestep` reads it |
//! | `STEM-daylight.npy` | D, points × columns × channels, float64, sr |
//! | `STEM-daylight.npz` | D, `error`, `direct`, `direct_error`, `suns`; where columns lie |
//! | `STEM-daylight-sky.mtx` | the skies, a column a time, as `gendaymtx` writes them, without a colour |
//! | `STEM-daylight-hours.csv`, `.npy` | illuminance, lx: a row a time and a column a point; points × times |
//! | `STEM-daylight-points.csv` | each point with its mean illuminance, and what a year is worth there |
//! | `STEM-daylight-KIND.svg` | of a grid: plans of autonomy, sunlit hours, UDI, and the mean or the daylight factor |
//!
//! Not handled: plans of points that are no grid.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use halflight::pictures::{Table, make_directory, write_whole_by};
use halflight::scene::RadianceMatrix;
use halflight_export::{Array, Values, write_npz};
use halflight_lighting::{SensorLayout, Words, digits, plan_of};
use serde::Serialize;

use crate::annual::{Illuminance, Metrics, PointMetrics};
use crate::coefficients::{Coefficients, Way};
use crate::error::DaylightError;
use crate::matrix_file::write_matrix;
use crate::sky::Skies;

/// What there is to write.
pub struct DaylightFiles<'a> {
    /// Where the points are.
    pub layout: &'a SensorLayout,
    /// D.
    pub found: &'a Coefficients,
    /// Skies, and what they make of it; none where D alone was asked for.
    pub skies: Option<(&'a Skies, &'a Illuminance)>,
    /// What a year of them is worth, where they are a year.
    pub metrics: Option<&'a Metrics>,
    /// Horizontal illuminance outside of a sky without a time, lx: means over it are daylight factors.
    pub outside: Option<f64>,
    /// Asked for.
    pub tolerance: f64,
}

/// What is told of daylight.
#[derive(Clone, Debug, Serialize)]
pub struct DaylightReport {
    /// The scene's name.
    pub scene: String,
    /// Points.
    pub points: usize,
    /// Columns of D: the ground, and the patches of the sky.
    pub columns: usize,
    /// n of MF:n.
    pub division: usize,
    /// The relative error of points, and the part of it that the size of patches leaves.
    pub error: f64,
    /// See there.
    pub patch_error: f64,
    /// What was asked for.
    pub tolerance: f64,
    /// Whether it was met.
    pub met: bool,
    /// Patches at last.
    pub patches: usize,
    /// How the light on patches was found.
    pub way: Way,
    /// Whether direct parts are closed forms along meridians.
    pub exact: bool,
    /// The skies, in words.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sky: Option<String>,
    /// Mean illuminance over all points and times, lx.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean: Option<f64>,
    /// Daylight factor of each point, and its error.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub daylight_factors: Option<Vec<[f64; 2]>>,
    /// What a year is worth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub metrics: Option<Metrics>,
    /// What was written.
    pub files: Vec<PathBuf>,
    /// Seconds.
    pub seconds: f64,
}

impl DaylightFiles<'_> {
    /// Daylight factors, with their errors; none where there is no illuminance outside.
    fn factors(&self) -> Option<Vec<[f64; 2]>> {
        let (outside, (_, light)) = (self.outside?, self.skies?);
        Some(light.means.iter().map(|own| own.map(|lux| lux / outside)).collect())
    }

    fn report(&self, scene: &str, files: Vec<PathBuf>) -> DaylightReport {
        let found = self.found;
        let mean = |light: &Illuminance| light.means.iter().map(|own| own[0]).sum::<f64>() / found.points as f64;
        DaylightReport {
            scene: scene.to_owned(),
            points: found.points,
            columns: found.columns(),
            division: found.division.fineness(),
            error: found.error,
            patch_error: found.patch_error,
            tolerance: self.tolerance,
            met: found.met,
            patches: found.patches,
            way: found.way,
            exact: found.is_exact,
            sky: self.skies.map(|(skies, _)| skies.name.clone()),
            mean: self.skies.map(|(_, light)| mean(light)),
            daylight_factors: self.factors(),
            metrics: self.metrics.cloned(),
            files,
            seconds: found.seconds,
        }
    }
}

/// Writes all of it into a folder; returns what is told of it.
///
/// A destination that cannot be written.
pub fn write_daylight((folder, stem): (&Path, &str), own: &DaylightFiles) -> Result<DaylightReport, DaylightError> {
    make_directory(folder)?;
    let mut files = Vec::new();
    let mut file = |end: &str| {
        files.push(folder.join(format!("{stem}-daylight{end}")));
        files[files.len() - 1].clone()
    };
    write_matrix(&matrix(own.found), &file(".mtx"))?;
    let coefficients = numbers(own.found, |x, p| own.found.of(x, p));
    write_npy(&file(".npy"), &coefficients)?;
    write_npz(file(".npz"), &arrays(own.found, coefficients))?;
    if let Some((skies, light)) = own.skies {
        write_matrix(&sky_matrix(skies), &file("-sky.mtx"))?;
        hours(own.layout, skies, light).write(file("-hours.csv"))?;
        let shape = vec![own.found.points, light.skies];
        write_npy(&file("-hours.npy"), &Array { shape, values: Values::F32((&light.all[..]).into()) })?;
        points(own, light).write(file("-points.csv"))?;
        for (kind, values, words) in plans(own, light, stem) {
            let Some(grid) = &own.layout.grid else { break };
            let drawing = plan_of(own.layout, grid, &values, words).drawing();
            halflight::pictures::write_whole(file(&format!("-{kind}.svg")), drawing.svg().as_bytes())?;
        }
    }
    Ok(own.report(stem, files))
}

/// D as Radiance has it.
fn matrix(found: &Coefficients) -> RadianceMatrix {
    let columns = found.columns();
    let of = |k: usize| found.of(k / columns, k % columns).map(|own| own as f32);
    RadianceMatrix { rows: found.points, columns, values: (0..found.points * columns).map(of).collect() }
}

/// Skies as Radiance has them.
fn sky_matrix(skies: &Skies) -> RadianceMatrix {
    let rows = skies.radiances();
    let values = rows.iter().flatten().map(|own| [*own as f32; 3]).collect();
    RadianceMatrix { rows: rows.len(), columns: skies.skies.len(), values }
}

/// Three channels of every point and column.
fn numbers<'a>(found: &Coefficients, of: impl Fn(usize, usize) -> [f64; 3]) -> Array<'a> {
    let columns = found.columns();
    let values: Vec<f64> = (0..found.points * columns).flat_map(|k| of(k / columns, k % columns)).collect();
    Array { shape: vec![found.points, columns, 3], values: Values::F64(values.into()) }
}

fn write_npy(path: &Path, array: &Array) -> Result<(), DaylightError> {
    Ok(write_whole_by(path, |file| {
        let mut file = std::io::BufWriter::new(file);
        array.write_to(&mut file)?;
        std::io::Write::flush(&mut file)
    })?)
}

fn arrays<'a>(found: &'a Coefficients, coefficients: Array<'a>) -> Vec<(&'static str, Array<'a>)> {
    let patches = found.division.patches();
    let table =
        |values: &'a [f64]| Array { shape: vec![found.points, found.columns()], values: Values::F64(values.into()) };
    let of = |own: fn(&crate::division::SkyPatch) -> f64| {
        Array::vector(Values::F64(patches.iter().map(own).collect::<Vec<_>>().into()))
    };
    let suns: Vec<f64> = found.suns.iter().flatten().copied().collect();
    vec![
        ("D", coefficients),
        ("error", numbers(found, |x, p| found.error_of(x, p))),
        ("direct", table(&found.direct)),
        ("direct_error", table(&found.direct_error)),
        ("altitude", of(|patch| patch.altitude)),
        ("azimuth", of(|patch| patch.azimuth)),
        ("solid_angle", of(|patch| patch.solid_angle)),
        ("suns", Array { shape: vec![found.points, found.sun_count, 2], values: Values::F64(suns.into()) }),
    ]
}

/// The names of points; their numbers where they have none.
fn names(layout: &SensorLayout) -> Vec<String> {
    let name = |(k, name): (usize, &Option<String>)| name.clone().unwrap_or_else(|| k.to_string());
    layout.names.iter().enumerate().map(name).collect()
}

/// A row a time.
fn hours(layout: &SensorLayout, skies: &Skies, light: &Illuminance) -> Table {
    let head: Vec<String> = ["month", "day", "hour"].map(str::to_owned).into_iter().chain(names(layout)).collect();
    let mut table = Table::with_columns(&head);
    for (k, sky) in skies.skies.iter().enumerate() {
        let known = sky.time.map(|time| (time.month, time.day, time.hour));
        let cell = |of: fn((usize, usize, f64)) -> String| known.map(of).unwrap_or_default();
        let time = [cell(|t| t.0.to_string()), cell(|t| t.1.to_string()), cell(|t| t.2.to_string())];
        let values: Vec<String> =
            light.all.iter().skip(k).step_by(light.skies).map(|lux| format!("{lux:.2}")).collect();
        let cells: Vec<&dyn Display> = time.iter().chain(&values).map(|own| own as &dyn Display).collect();
        table.row(&cells);
    }
    table
}

/// A row a point.
fn points(own: &DaylightFiles, light: &Illuminance) -> Table {
    let mut head = "name,x,y,z,illuminance,error".to_owned();
    let factors = own.factors();
    if factors.is_some() {
        head += ",daylight_factor";
    }
    if own.metrics.is_some() {
        head += ",autonomy,sunlit_hours,below_100,100_to_300,300_to_3000,above_3000";
    }
    let mut table = Table::new(&head);
    for (k, (name, sensor)) in names(own.layout).iter().zip(&own.layout.sensors).enumerate() {
        let mut numbers = sensor.position.to_array().to_vec();
        numbers.extend(light.means[k]);
        numbers.extend(factors.as_ref().map(|all| all[k][0]));
        if let Some(metrics) = own.metrics {
            let PointMetrics { autonomy, sunlit, useful, .. } = metrics.points[k];
            numbers.extend([autonomy, sunlit]);
            numbers.extend(useful);
        }
        let cells: Vec<&dyn Display> =
            std::iter::once(name as &dyn Display).chain(numbers.iter().map(|own| own as &dyn Display)).collect();
        table.row(&cells);
    }
    table
}

/// The plans of a grid: kind, values, words.
fn plans(own: &DaylightFiles, light: &Illuminance, stem: &str) -> Vec<(&'static str, Vec<Option<f64>>, Words)> {
    let words = |what: &str, caption: String, unit: &str| Words {
        title: format!("{stem}, {what}"),
        caption,
        unit: unit.to_owned(),
    };
    let sky = own.skies.map(|(skies, _)| skies.name.clone()).unwrap_or_default();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    if let Some(factors) = own.factors() {
        let percent: Vec<f64> = factors.iter().map(|own| 100.0 * own[0]).collect();
        let caption = format!("Illuminance over that outside, {sky}: mean {} %.", digits(mean(&percent)));
        return vec![("factor", percent.into_iter().map(Some).collect(), words("daylight factor", caption, "%"))];
    }
    let lux: Vec<f64> = light.means.iter().map(|own| own[0]).collect();
    let caption = format!("Mean over all times, {sky}: {} lx over all points.", digits(mean(&lux)));
    let mut plans = vec![("mean", lux.into_iter().map(Some).collect(), words("mean illuminance", caption, "lx"))];
    if let Some(metrics) = own.metrics {
        let mut add = |kind, what: &str, caption: String, unit: &str, of: fn(&PointMetrics) -> f64| {
            plans.push((kind, metrics.points.iter().map(|own| Some(of(own))).collect(), words(what, caption, unit)));
        };
        let hours = digits(metrics.hours);
        let sda = format!(
            "Share of {hours} occupied hours with at least 300 lx. sDA 300/50 %: {:.1} % of points.",
            100.0 * metrics.sda
        );
        add("autonomy", "daylight autonomy", sda, "%", |own| 100.0 * own.autonomy);
        let ase = format!(
            "Of {hours} occupied hours those with at least 1000 lx of direct sunlight. ASE 1000/250: {:.1} % of points.",
            100.0 * metrics.ase
        );
        add("sunlit", "sunlit hours", ase, "h", |own| own.sunlit);
        let udi = format!("Share of {hours} occupied hours with 300 to 3000 lx.");
        add("udi", "useful daylight illuminance", udi, "%", |own| 100.0 * own.useful[2]);
    }
    plans
}
