//! `--points`: light at sensors, as a table, with its mean, least, most and uniformity; and of a grid a plan.
//!
//! Not handled: plans of points that are no grid.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use clap::Args;
use glam::DVec3;
use serde::Serialize;

use crate::console::Console;
use crate::error::CliError;
use halflight::light::Transport;
use halflight::pictures::{Table, check_destination};
use halflight::render::{RenderError, Sensor, SensorError, SensorGrid, SensorLight, SensorLights, Solver, Uniformity};
use halflight::scene::{EFFICACY, Scene};
use halflight_plot::{Plan, PlanAxis};

/// Columns that every table has first.
const COLUMNS: &str = "name,x,y,z,nx,ny,nz,irradiance_r,irradiance_g,irradiance_b,error_r,error_g,error_b";
/// CIE Y of linear sRGB (IEC 61966-2-1).
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// Where light is measured.
#[derive(Args, Debug)]
pub struct Points {
    /// Measure irradiance at the points of a table (x, y, z, nx, ny, nz and, if there is one, a name), or on a grid
    /// over an object: grid:OBJECT@HEIGHT,SPACING; to the tolerance, at each point
    #[arg(long, value_name = "FILE|GRID", conflicts_with_all = ["patches", "rays", "samples"])]
    pub points: Option<String>,
    /// Give illuminance at points as well: 683 lm/W times CIE Y of linear sRGB
    #[arg(long, requires = "points")]
    pub lux: bool,
    /// Have columns for the irradiance by each bounce in the table of points; `bounces` always has them
    #[arg(long, requires = "points")]
    pub by_bounce: bool,
}

/// The sensors of one run.
pub struct Sensors {
    list: Vec<Sensor>,
    grid: Option<NamedGrid>,
    lux: bool,
    by_bounce: bool,
}

/// A grid over an object.
struct NamedGrid {
    grid: SensorGrid,
    object: String,
    height: f64,
}

/// One point of a report.
#[derive(Serialize)]
pub struct PointReport {
    name: Option<String>,
    position: [f64; 3],
    #[serde(flatten)]
    light: SensorLight,
    /// Illuminance in lux, and its standard error.
    #[serde(skip_serializing_if = "Option::is_none")]
    illuminance: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    illuminance_error: Option<f64>,
}

/// The points of a mode, and how light is spread over them.
#[derive(Serialize)]
pub struct MeasuredReport {
    points: Vec<PointReport>,
    uniformity: UniformityReport,
}

/// How evenly a value is spread.
#[derive(Serialize)]
struct UniformityReport {
    /// `illuminance`, or `irradiance`, the mean of the channels.
    of: &'static str,
    unit: &'static str,
    #[serde(flatten)]
    uniformity: Uniformity,
}

impl Points {
    /// Reads the table, or lays the grid; none where none is requested.
    pub fn sensors(&self, scene: &Scene) -> Result<Option<Sensors>, CliError> {
        let Some(given) = &self.points else { return Ok(None) };
        let grid = given.strip_prefix("grid:").map(|text| {
            let (object, height, spacing) = grid_of(text).ok_or_else(|| CliError::Usage {
                message: format!("`{given}` is no grid"),
                help: "name an object, a height over it and a spacing: --points grid:floor@0.8,0.25".into(),
            })?;
            let grid = SensorGrid::over(scene, object, height, spacing)?;
            Ok::<_, CliError>(NamedGrid { grid, object: object.to_owned(), height })
        });
        let grid = grid.transpose()?;
        let list = match &grid {
            Some(own) => own.grid.sensors.clone(),
            None => Sensor::read(Path::new(given))?,
        };
        Ok(Some(Sensors { list, grid, lux: self.lux, by_bounce: self.by_bounce }))
    }
}

/// Object, height and spacing of `OBJECT@HEIGHT,SPACING`.
fn grid_of(text: &str) -> Option<(&str, f64, f64)> {
    let (object, numbers) = text.rsplit_once('@')?;
    let (height, spacing) = numbers.split_once(',')?;
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| x.is_finite());
    Some((object, number(height)?, number(spacing).filter(|&x| x > 0.0)?))
}

impl Sensors {
    /// These sensors, with columns for bounces in their table.
    pub fn by_bounce(self) -> Sensors {
        Sensors { by_bounce: true, ..self }
    }

    /// Where a file of a mode goes.
    fn place(directory: &Path, stem: &str, transport: Transport, extension: &str) -> PathBuf {
        directory.join(format!("{stem}-points-{}.{extension}", transport.file_name()))
    }

    /// What is written for each mode.
    fn extensions(&self) -> &[&str] {
        if self.grid.is_some() { &["csv", "svg", "png"] } else { &["csv"] }
    }

    /// Makes sure that all files can be written, before the work that is to fill them.
    pub fn check(&self, directory: &Path, stem: &str, transports: &[Transport]) -> Result<(), CliError> {
        halflight::pictures::make_directory(directory)?;
        let files = transports.iter().flat_map(|&mode| self.extensions().iter().map(move |end| (mode, end)));
        let mut places = files.map(|(mode, end)| Sensors::place(directory, stem, mode, end));
        Ok(places.try_for_each(check_destination)?)
    }

    /// Measures light in a mode, writes its table and its plan, and says how it is spread; none where the series
    /// diverges.
    pub fn measure(
        &self,
        (solver, transport, tolerance): (&Solver, Transport, f64),
        (directory, stem): (&Path, &str),
        console: &Console,
    ) -> Result<Option<(MeasuredReport, Vec<PathBuf>)>, CliError> {
        let found = match solver.points(transport, &self.list).watch(console).tolerance(tolerance) {
            Ok(found) => found,
            // Whatever else is made of the mode has said why.
            Err(RenderError::Diverges(_)) => return Ok(None),
            Err(RenderError::Memory(unfit)) => return Err(unfit.into()),
        };
        let uniformity = Uniformity::of(found.points.iter().map(|light| self.value_outside(light)));
        let place = |end: &str| Sensors::place(directory, stem, transport, end);
        let paths: Vec<PathBuf> = self.extensions().iter().map(|end| place(end)).collect();
        self.table(&found).write(&paths[0])?;
        if let Some(grid) = &self.grid {
            let title = format!("{stem}, {}: {} at {} over {}", transport.label(), self.of(), grid.height, grid.object);
            let plan = self.plan(grid, &found, (title, &uniformity)).drawing();
            paths[1..].iter().try_for_each(|path| plan.write(path))?;
        }
        self.say((&found, &uniformity), (transport, tolerance), &paths, console);
        let reports = self.list.iter().zip(found.points).map(|(sensor, light)| PointReport {
            name: sensor.name.clone(),
            position: sensor.position.to_array(),
            illuminance: self.lux.then(|| lux(&light.irradiance)),
            illuminance_error: self.lux.then(|| lux(&light.error)),
            light,
        });
        let uniformity = UniformityReport { of: self.of(), unit: self.unit(), uniformity };
        Ok(Some((MeasuredReport { points: reports.collect(), uniformity }, paths)))
    }

    /// What is shown of the light at a point.
    fn value(&self, light: &SensorLight) -> f64 {
        if self.lux { lux(&light.irradiance) } else { light.irradiance.iter().sum::<f64>() / 3.0 }
    }

    /// What is shown of the light at a point; none inside of a solid.
    fn value_outside(&self, light: &SensorLight) -> Option<f64> {
        (!light.is_inside).then(|| self.value(light))
    }

    /// Its name and unit.
    fn of(&self) -> &'static str {
        if self.lux { "illuminance" } else { "irradiance" }
    }

    fn unit(&self) -> &'static str {
        if self.lux { "lx" } else { "W/m²" }
    }

    fn table(&self, found: &SensorLights) -> Table {
        let first = found.points.first();
        let bounces = if self.by_bounce { first.map_or(0, |light| light.bounces.len()) } else { 0 };
        let luminaires = first.map_or_else(Vec::new, |light| light.luminaires.keys().cloned().collect());
        let mut names: Vec<String> = COLUMNS.split(',').map(str::to_owned).collect();
        if self.lux {
            names.extend(["illuminance", "illuminance_error"].map(str::to_owned));
        }
        names.push("inside".to_owned());
        let more = (0..bounces).map(|n| format!("bounce_{n}")).chain(luminaires);
        names.extend(more.flat_map(|name| ["r", "g", "b"].map(|channel| format!("{name}_{channel}"))));
        let mut table = Table::with_columns(&names);
        for (sensor, light) in self.list.iter().zip(&found.points) {
            let name = sensor.name.clone().unwrap_or_default();
            let (position, normal) = (sensor.position.to_array(), sensor.normal.to_array());
            let lux = [lux(&light.irradiance), lux(&light.error)];
            let mut numbers: Vec<&f64> =
                [&position, &normal, &light.irradiance, &light.error].into_iter().flatten().collect();
            if self.lux {
                numbers.extend(&lux);
            }
            let inside = u8::from(light.is_inside);
            let parts = light.bounces[..bounces].iter().chain(light.luminaires.values()).flatten();
            let mut cells: Vec<&dyn Display> = vec![&name];
            cells.extend(numbers.into_iter().map(|number| number as &dyn Display));
            cells.push(&inside);
            cells.extend(parts.map(|number| number as &dyn Display));
            table.row(&cells);
        }
        table
    }

    /// The plan of a grid; points inside of solids are left out.
    fn plan(&self, named: &NamedGrid, found: &SensorLights, (title, all): (String, &Uniformity)) -> Plan {
        let SensorGrid { sensors, cells, size, axes, spacing } = &named.grid;
        let mut values = vec![None; size[0] * size[1]];
        for (&[column, row], light) in cells.iter().zip(&found.points) {
            values[row * size[0] + column] = self.value_outside(light);
        }
        let unit = self.unit();
        let [mean, least, most] = [all.mean, all.least, all.most].map(digits);
        let caption = format!(
            "Mean {mean} {unit}, least {least}, most {most}; uniformity least/mean {:.3}, least/most {:.3}. {} points, \
             {} apart in the file's units; {} inside of solids are left out.",
            all.least_over_mean, all.least_over_most, all.count, spacing, all.left_out
        );
        let axis =
            |k: usize| plan_axis(axes[k], sensors[0].position.dot(axes[k]) - cells[0][k] as f64 * spacing, *spacing);
        Plan { title, caption, unit: unit.to_owned(), axes: [axis(0), axis(1)], size: *size, values }
    }

    /// A line on how light is spread over the points.
    fn say(
        &self,
        (found, all): (&SensorLights, &Uniformity),
        (transport, tolerance): (Transport, f64),
        paths: &[PathBuf],
        console: &Console,
    ) {
        let (label, count) = (transport.label(), found.points.len());
        let [mean, least, most] = [all.mean, all.least, all.most].map(digits);
        let left_out =
            if all.left_out > 0 { format!(", {} inside of solids left out", all.left_out) } else { String::new() };
        let files: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
        console.say(format!(
            "{label:<11} {count} points in {:.2} s ({} patches){left_out}: mean {mean} {}, least {least}, most {most}, \
             least/mean {:.3}, least/most {:.3}: {}",
            found.seconds,
            found.patches,
            self.unit(),
            all.least_over_mean,
            all.least_over_most,
            files.join(" "),
        ));
        if found.met < 1.0 {
            let missed = ((1.0 - found.met) * count as f64).round();
            console.warn(format!(
                "{label}: the error of {missed} of {count} points is above the {:.2} % asked for; the table has each",
                100.0 * tolerance
            ));
        }
    }
}

/// Four digits that count.
fn digits(value: f64) -> String {
    let after = (3.0 - value.abs().max(f64::MIN_POSITIVE).log10().floor()).clamp(0.0, 9.0) as usize;
    if value == 0.0 { "0".to_owned() } else { format!("{value:.after$}") }
}

/// An axis of a plan along a direction, whose first point has a coordinate along it.
fn plan_axis(direction: DVec3, first: f64, step: f64) -> PlanAxis {
    let names = ["x", "y", "z"];
    let own = (0..3).find(|&k| direction[k].abs() > 1.0 - 1e-9);
    // Along an axis of the file, either way, it is that coordinate.
    let (name, sign) = own.map_or(("along", 1.0), |k| (names[k], direction[k].signum()));
    PlanAxis { name: format!("{name}, the file's units"), first: sign * first, step: sign * step }
}

/// Illuminance of an irradiance, lm/m².
pub fn lux(irradiance: &[f64; 3]) -> f64 {
    EFFICACY * irradiance.iter().zip(LUMINANCE).map(|(e, y)| e * y).sum::<f64>()
}

impl From<SensorError> for CliError {
    fn from(error: SensorError) -> CliError {
        CliError::Sensor(error)
    }
}
