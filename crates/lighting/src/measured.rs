//! Light that was measured at sensors: as a report, with how evenly it is spread, and as a table.
//!
//! Not handled: errors of single bounces and emitters, which sensors have none of.

use std::fmt::Display;

use halflight::pictures::{Table, known};
use halflight::render::{SensorLight, SensorLights};
use serde::Serialize;

use crate::fluence::Fluence;
use crate::quantity::{Quantity, lux};
use crate::sensors::SensorLayout;
use crate::uniformity::Uniformity;

/// Columns that every table has first.
const COLUMNS: &str = "name,x,y,z,nx,ny,nz,irradiance_r,irradiance_g,irradiance_b,error_r,error_g,error_b";

/// What is told of each sensor.
#[derive(Clone, Copy, Debug)]
pub struct Columns {
    /// Irradiance alone, or illuminance as well.
    pub quantity: Quantity,
    /// Whether the irradiance by each bounce has columns.
    pub by_bounce: bool,
}

/// One point of a report.
#[derive(Debug, Serialize)]
struct PointReport {
    name: Option<String>,
    position: [f64; 3],
    #[serde(flatten)]
    light: SensorLight,
    /// Illuminance in lux, and its standard error.
    #[serde(skip_serializing_if = "Option::is_none")]
    illuminance: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    illuminance_error: Option<f64>,
    /// Light from all around, where it was asked for.
    #[serde(flatten)]
    fluence: Option<Fluence>,
}

/// The light at sensors, and how it is spread over them.
#[derive(Debug, Serialize)]
pub struct Measured {
    points: Vec<PointReport>,
    uniformity: UniformityReport,
}

/// How evenly a quantity is spread.
#[derive(Debug, Serialize)]
struct UniformityReport {
    of: &'static str,
    unit: &'static str,
    #[serde(flatten)]
    uniformity: Uniformity,
}

impl Measured {
    /// The report of what was found at sensors, and of light from all around at each, if that was asked for.
    pub fn new(layout: &SensorLayout, quantity: Quantity, found: SensorLights, fluence: &[Fluence]) -> Measured {
        let uniformity = quantity.uniformity(&found);
        let is_lux = quantity == Quantity::Illuminance;
        let all = layout.names.iter().zip(&layout.sensors).zip(found.points).enumerate();
        let points = all.map(|(k, ((name, sensor), light))| PointReport {
            fluence: fluence.get(k).copied(),
            name: name.clone(),
            position: sensor.position.to_array(),
            illuminance: is_lux.then(|| lux(&light.irradiance)),
            illuminance_error: is_lux.then(|| lux(&light.error)),
            light,
        });
        let points = points.collect();
        Measured { points, uniformity: UniformityReport { of: quantity.name(), unit: quantity.unit(), uniformity } }
    }
}

/// The table of what was found at sensors, and of light from all around at each, if that was asked for: a row each.
pub fn table(layout: &SensorLayout, columns: Columns, found: &SensorLights, fluence: &[Fluence]) -> Table {
    let first = found.points.first();
    let bounces = if columns.by_bounce { first.map_or(0, |light| light.bounces.len()) } else { 0 };
    let is_lux = columns.quantity == Quantity::Illuminance;
    let mut heads = names(first, bounces, is_lux);
    if !fluence.is_empty() {
        heads.extend(fluence_names(is_lux));
    }
    let mut table = Table::with_columns(&heads);
    for (k, ((name, sensor), light)) in layout.names.iter().zip(&layout.sensors).zip(&found.points).enumerate() {
        let name = name.clone().unwrap_or_default();
        let (position, normal) = (sensor.position.to_array(), sensor.normal.to_array());
        let lux = [lux(&light.irradiance), lux(&light.error)];
        let mut numbers: Vec<&f64> =
            [&position, &normal, &light.irradiance, &light.error].into_iter().flatten().collect();
        if is_lux {
            numbers.extend(&lux);
        }
        let inside = u8::from(light.is_inside);
        let parts = light.bounces[..bounces].iter().chain(light.luminaires.values()).flatten();
        let mut cells: Vec<&dyn Display> = vec![&name];
        cells.extend(numbers.into_iter().map(|number| number as &dyn Display));
        cells.push(&inside);
        cells.extend(parts.map(|number| number as &dyn Display));
        let around = fluence.get(k).map(|own| fluence_cells(own, is_lux)).unwrap_or_default();
        cells.extend(around.iter().map(|cell| cell as &dyn Display));
        table.row(&cells);
    }
    table
}

/// Names of the columns of light from all around.
fn fluence_names(is_lux: bool) -> Vec<String> {
    let kinds = ["scalar", "cylindrical", "semicylindrical"];
    let of = |kind: &str| {
        let channels = ["", "error_"].map(|part| ["r", "g", "b"].map(|c| format!("{kind}_{part}{c}")));
        let lux = is_lux.then(|| [format!("{kind}_illuminance"), format!("{kind}_illuminance_error")]);
        channels.into_iter().flatten().chain(lux.into_iter().flatten()).collect::<Vec<_>>()
    };
    kinds.into_iter().flat_map(of).collect()
}

/// Their cells; empty where nothing is faced.
fn fluence_cells(own: &Fluence, is_lux: bool) -> Vec<String> {
    let semi = own.semicylindrical.zip(own.semicylindrical_error);
    let kinds = [Some((own.scalar, own.scalar_error)), Some((own.cylindrical, own.cylindrical_error)), semi];
    let of = |pair: Option<([f64; 3], [f64; 3])>| {
        let numbers = pair.map(|(value, error)| {
            let both = value.into_iter().chain(error);
            both.chain([lux(&value), lux(&error)].into_iter().take(if is_lux { 2 } else { 0 })).collect::<Vec<f64>>()
        });
        let count = if is_lux { 8 } else { 6 };
        (0..count).map(move |k| known(numbers.as_ref().map(|own| own[k]))).collect::<Vec<_>>()
    };
    kinds.into_iter().flat_map(of).collect()
}

/// The columns' names.
fn names(first: Option<&SensorLight>, bounces: usize, is_lux: bool) -> Vec<String> {
    let luminaires = first.map_or_else(Vec::new, |light| light.luminaires.keys().cloned().collect());
    let mut names: Vec<String> = COLUMNS.split(',').map(str::to_owned).collect();
    if is_lux {
        names.extend(["illuminance", "illuminance_error"].map(str::to_owned));
    }
    names.push("inside".to_owned());
    let more = (0..bounces).map(|n| format!("bounce_{n}")).chain(luminaires);
    names.extend(more.flat_map(|name| ["r", "g", "b"].map(|channel| format!("{name}_{channel}"))));
    names
}
