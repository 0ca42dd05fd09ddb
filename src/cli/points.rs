//! `--points`: light at sensors, as a table, and of a grid its mean, least and uniformity.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use crate::cli::console::Console;
use crate::cli::error::CliError;
use crate::light::Transport;
use crate::pictures::{Table, check_destination};
use crate::render::{RenderError, Sensor, SensorError, SensorGrid, SensorLight, SensorLights, Solver};
use crate::scene::{EFFICACY, Scene};

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
}

/// The sensors of one run.
pub struct Sensors {
    list: Vec<Sensor>,
    lux: bool,
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

impl Points {
    /// Reads the table, or lays the grid; none where none is requested.
    pub fn sensors(&self, scene: &Scene) -> Result<Option<Sensors>, CliError> {
        let Some(given) = &self.points else { return Ok(None) };
        let list = match given.strip_prefix("grid:") {
            Some(grid) => {
                let (object, height, spacing) = grid_of(grid).ok_or_else(|| CliError::Usage {
                    message: format!("`{given}` is no grid"),
                    help: "name an object, a height over it and a spacing: --points grid:floor@0.8,0.25".into(),
                })?;
                SensorGrid::over(scene, object, height, spacing)?.sensors
            }
            None => Sensor::read(Path::new(given))?,
        };
        Ok(Some(Sensors { list, lux: self.lux }))
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
    /// Where the table of a mode goes.
    fn place(directory: &Path, stem: &str, transport: Transport) -> PathBuf {
        directory.join(format!("{stem}-points-{}.csv", transport.label().replace(' ', "-")))
    }

    /// Makes sure that the tables can be written, before the work that is to fill them.
    pub fn check(&self, directory: &Path, stem: &str, transports: &[Transport]) -> Result<(), CliError> {
        crate::pictures::make_directory(directory)?;
        Ok(transports.iter().try_for_each(|&mode| check_destination(Sensors::place(directory, stem, mode)))?)
    }

    /// Measures light in a mode, writes its table, and says how it is spread; none where the series diverges.
    pub fn measure(
        &self,
        (solver, transport, tolerance): (&Solver, Transport, f64),
        (directory, stem): (&Path, &str),
        console: &Console,
    ) -> Result<Option<(Vec<PointReport>, PathBuf)>, CliError> {
        let found = match solver.points(transport, &self.list).watch(console).tolerance(tolerance) {
            Ok(found) => found,
            // The picture of the mode has said why.
            Err(RenderError::Diverges(_)) => return Ok(None),
            Err(RenderError::Memory(unfit)) => return Err(unfit.into()),
        };
        let path = Sensors::place(directory, stem, transport);
        self.table(&found).write(&path)?;
        self.say(&found, transport, tolerance, &path, console);
        let reports = self.list.iter().zip(found.points).map(|(sensor, light)| PointReport {
            name: sensor.name.clone(),
            position: sensor.position.to_array(),
            illuminance: self.lux.then(|| lux(&light.irradiance)),
            illuminance_error: self.lux.then(|| lux(&light.error)),
            light,
        });
        Ok(Some((reports.collect(), path)))
    }

    fn table(&self, found: &SensorLights) -> Table {
        let own = "irradiance_r,irradiance_g,irradiance_b,error_r,error_g,error_b";
        let more = if self.lux { ",illuminance,illuminance_error" } else { "" };
        let mut table = Table::new(&format!("name,x,y,z,nx,ny,nz,{own}{more}"));
        for (sensor, light) in self.list.iter().zip(&found.points) {
            let name = sensor.name.clone().unwrap_or_default();
            let ([x, y, z], [a, b, c]) = (sensor.position.to_array(), sensor.normal.to_array());
            let ([r, g, blue], [dr, dg, db]) = (light.irradiance, light.error);
            let (value, error) = (lux(&light.irradiance), lux(&light.error));
            let mut cells: Vec<&dyn std::fmt::Display> =
                vec![&name, &x, &y, &z, &a, &b, &c, &r, &g, &blue, &dr, &dg, &db];
            if self.lux {
                cells.extend([&value as &dyn std::fmt::Display, &error]);
            }
            table.row(&cells);
        }
        table
    }

    /// A line on how light is spread over the points.
    fn say(&self, found: &SensorLights, transport: Transport, tolerance: f64, path: &Path, console: &Console) {
        let value = |light: &SensorLight| {
            if self.lux { lux(&light.irradiance) } else { light.irradiance.iter().sum::<f64>() / 3.0 }
        };
        let all: Vec<f64> = found.points.iter().map(value).collect();
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        let (least, most) = all.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), &x| (low.min(x), high.max(x)));
        let unit = if self.lux { "lx" } else { "W/m²" };
        let uniformity = if mean > 0.0 { least / mean } else { 0.0 };
        console.say(format!(
            "{:<11} {} points in {:.2} s ({} patches): mean {mean:.4} {unit}, least {least:.4}, most {most:.4}, \
             uniformity {uniformity:.3}: {}",
            transport.label(),
            all.len(),
            found.seconds,
            found.patches,
            path.display(),
        ));
        if found.met < 1.0 {
            let missed = ((1.0 - found.met) * all.len() as f64).round();
            console.warn(format!(
                "{}: the error of {missed} of {} points is above the {:.2} % asked for; the table has each",
                transport.label(),
                all.len(),
                100.0 * tolerance
            ));
        }
    }
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
