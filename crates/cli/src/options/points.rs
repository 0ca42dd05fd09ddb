//! `--points`: light at sensors, as a table, with its mean, least, most and uniformity; and of a grid a plan.
//!
//! Not handled: plans of points that are no grid.

use std::path::{Path, PathBuf};

use clap::Args;
use glam::DVec3;

use crate::console::Console;
use crate::error::CliError;
use halflight::light::Transport;
use halflight::pictures::check_destination;
use halflight::render::{RenderError, Sensor, SensorLight, SensorLights, Solver};
use halflight::scene::Scene;
use halflight_lighting::{
    Columns, Fluence, Measured, Quantity, SensorLayout, all_around, digits, of_point, plan, table,
};

/// Turns the directions that light from all around is measured in.
const SET: u32 = 1;

/// Where light is measured.
#[derive(Args, Debug)]
#[command(next_help_heading = "Light at points")]
pub struct Points {
    /// Measure irradiance at the points of a table (columns by its head; without one x, y, z, nx, ny, nz and, if there
    /// is a seventh, a name), on a grid over an object, grid:OBJECT@HEIGHT,SPACING, or in the cells of the scene's box,
    /// volume:XxYxZ; to the tolerance, at each point
    #[arg(long, value_name = "FILE|GRID", conflicts_with_all = ["patches", "rays", "samples"])]
    pub points: Option<String>,
    /// Give illuminance at points as well: 683 lm/W times CIE Y of linear sRGB
    #[arg(long, requires = "points")]
    pub lux: bool,
    /// Have columns for light from all around as well: scalar, cylindrical and semicylindrical irradiance, about a
    /// vertical that is x, y or z [default: y]
    #[arg(long, value_name = "UP", requires = "points", num_args = 0..=1, require_equals = true,
        default_missing_value = "y", value_parser = ["x", "y", "z"])]
    pub fluence: Option<String>,
    /// Have columns for the irradiance by each bounce in the table of points; `bounces` always has them
    #[arg(long, requires = "points")]
    pub by_bounce: bool,
}

/// The sensors of one run, and what is told of each.
pub struct Sensors {
    layout: SensorLayout,
    columns: Columns,
    /// Upwards, where light from all around is asked for.
    around: Option<DVec3>,
}

impl Points {
    /// Reads the table, or lays the grid; none where none is requested.
    pub fn sensors(&self, scene: &Scene) -> Result<Option<Sensors>, CliError> {
        let Some(given) = &self.points else { return Ok(None) };
        let around = self.fluence.as_deref().map(|up| match up {
            "x" => DVec3::X,
            "z" => DVec3::Z,
            _ => DVec3::Y,
        });
        let layout = layout_of(scene, given, around.unwrap_or(DVec3::Y))?;
        let quantity = if self.lux { Quantity::Illuminance } else { Quantity::Irradiance };
        Ok(Some(Sensors { layout, columns: Columns { quantity, by_bounce: self.by_bounce }, around }))
    }
}

/// The sensors of a table, of a grid over an object, or of the cells of the scene's box, which face `up`.
pub fn layout_of(scene: &Scene, given: &str, up: DVec3) -> Result<SensorLayout, CliError> {
    if let Some(text) = given.strip_prefix("volume:") {
        let cells: Vec<usize> = text.split('x').filter_map(|n| n.parse().ok().filter(|n| *n > 0)).collect();
        let cells = <[usize; 3]>::try_from(cells).ok().filter(|_| text.split('x').count() == 3);
        let cells = cells.ok_or_else(|| CliError::Usage {
            message: format!("`{given}` is no volume"),
            help: "give the cells along x, y and z: --points volume:8x4x8".into(),
        })?;
        return Ok(SensorLayout::through(scene, cells, up)?);
    }
    let Some(text) = given.strip_prefix("grid:") else { return Ok(SensorLayout::read(Path::new(given))?) };
    let (object, height, spacing) = grid_of(text).ok_or_else(|| CliError::Usage {
        message: format!("`{given}` is no grid"),
        help: "name an object, a height over it and a spacing: --points grid:floor@0.8,0.25".into(),
    })?;
    Ok(SensorLayout::over(scene, object, height, spacing)?)
}

/// The light at points, and from all around each, of the sensors of both; points are within the tolerance by their
/// scalar irradiance.
fn taken_together(
    (points, up): (&[Sensor], DVec3),
    found: SensorLights,
    tolerance: f64,
) -> (SensorLights, Vec<Fluence>) {
    let each = found.points.len() / points.len().max(1);
    let all = points.iter().zip(found.points.chunks_exact(each.max(1)));
    let (points, fluence): (Vec<_>, Vec<Fluence>) = all.map(|(point, own)| of_point(point, up, own)).unzip();
    let sum = |channels: [f64; 3]| channels.iter().sum::<f64>();
    let is_met = |(point, own): (&SensorLight, &Fluence)| {
        point.is_inside || sum(own.scalar_error) <= tolerance * sum(own.scalar)
    };
    let met = points.iter().zip(&fluence).filter(|pair| is_met(*pair)).count() as f64 / points.len().max(1) as f64;
    (SensorLights { points, met, ..found }, fluence)
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
        Sensors { columns: Columns { by_bounce: true, ..self.columns }, ..self }
    }

    /// Where a file of a mode goes.
    fn place(directory: &Path, stem: &str, transport: Transport, extension: &str) -> PathBuf {
        directory.join(format!("{stem}-points-{}.{extension}", transport.file_name()))
    }

    /// What is written for each mode.
    fn extensions(&self) -> &[&str] {
        if self.layout.grid.is_some() { &["csv", "svg", "png"] } else { &["csv"] }
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
    ) -> Result<Option<(Measured, Vec<PathBuf>)>, CliError> {
        let sensors = match self.around {
            Some(up) => &all_around(&self.layout.sensors, up, SET),
            None => &self.layout.sensors,
        };
        let found = match solver.points(transport, sensors).watch(console).tolerance(tolerance) {
            Ok(found) => found,
            // Whatever else is made of the mode has said why.
            Err(RenderError::Diverges(_)) => return Ok(None),
            Err(RenderError::Memory(unfit)) => return Err(unfit.into()),
        };
        let Sensors { layout, columns, around } = self;
        let (found, fluence) = match around {
            Some(up) => taken_together((&layout.sensors, *up), found, tolerance),
            None => (found, Vec::new()),
        };
        let place = |end: &str| Sensors::place(directory, stem, transport, end);
        let paths: Vec<PathBuf> = self.extensions().iter().map(|end| place(end)).collect();
        table(layout, *columns, &found, &fluence).write(&paths[0])?;
        if let Some(grid) = &layout.grid {
            let (label, of) = (transport.label(), columns.quantity.name());
            let title = format!("{stem}, {label}: {of} at {} over {}", grid.height, grid.object);
            let plan = plan(layout, grid, columns.quantity, (&found, title)).drawing();
            paths[1..].iter().try_for_each(|path| plan.write(path))?;
        }
        self.say(&found, (transport, tolerance), &paths, console);
        Ok(Some((Measured::new(layout, columns.quantity, found, &fluence), paths)))
    }

    /// A line on how light is spread over the points.
    fn say(
        &self,
        found: &SensorLights,
        (transport, tolerance): (Transport, f64),
        paths: &[PathBuf],
        console: &Console,
    ) {
        let (label, count, quantity) = (transport.label(), found.points.len(), self.columns.quantity);
        let all = quantity.uniformity(found);
        let [mean, least, most] = [all.mean, all.least, all.most].map(digits);
        let left_out =
            if all.left_out > 0 { format!(", {} inside of solids left out", all.left_out) } else { String::new() };
        let files: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
        console.say(format!(
            "{label:<11} {count} points in {:.2} s ({} patches){left_out}: mean {mean} {}, least {least}, most {most}, \
             least/mean {:.3}, least/most {:.3}: {}",
            found.seconds,
            found.patches,
            quantity.unit(),
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
