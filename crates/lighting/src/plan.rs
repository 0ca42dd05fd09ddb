//! The plan of a grid of sensors: what each measures, where it lies.
//!
//! Not handled: plans of points that are no grid.

use glam::DVec3;
use halflight::render::SensorLights;
use halflight_plot::{Plan, PlanAxis};

use crate::quantity::{Quantity, digits};
use crate::sensors::{Grid, SensorLayout};

/// The plan of a quantity over the grid of a layout, with its mean, least, most and uniformity below a title. Points
/// inside of solids are left out.
pub fn plan(layout: &SensorLayout, grid: &Grid, quantity: Quantity, (found, title): (&SensorLights, String)) -> Plan {
    let values: Vec<Option<f64>> = found.points.iter().map(|light| quantity.at(light)).collect();
    let (all, unit) = (quantity.uniformity(found), quantity.unit());
    let [mean, least, most] = [all.mean, all.least, all.most].map(digits);
    let caption = format!(
        "Mean {mean} {unit}, least {least}, most {most}; uniformity least/mean {:.3}, least/most {:.3}. {} points, \
         {} apart in the file's units; {} inside of solids are left out.",
        all.least_over_mean, all.least_over_most, all.count, grid.spacing, all.left_out
    );
    plan_of(layout, grid, &values, Words { title, caption, unit: unit.to_owned() })
}

/// What stands around a plan.
pub struct Words {
    /// In one line above.
    pub title: String,
    /// Below.
    pub caption: String,
    /// Over the legend.
    pub unit: String,
}

/// The plan of a value of each sensor over the grid of a layout; those that have none are left out.
pub fn plan_of(layout: &SensorLayout, grid: &Grid, of: &[Option<f64>], words: Words) -> Plan {
    let mut values = vec![None; grid.size[0] * grid.size[1]];
    for (&[column, row], value) in grid.cells.iter().zip(of) {
        values[row * grid.size[0] + column] = *value;
    }
    let (first, cell) = (layout.sensors[0].position, grid.cells[0]);
    let start = |k: usize| first.dot(grid.axes[k]) - cell[k] as f64 * grid.spacing;
    let axes = [0, 1].map(|k| axis(grid.axes[k], start(k), grid.spacing));
    let Words { title, caption, unit } = words;
    Plan { title, caption, unit, axes, size: grid.size, values }
}

/// An axis along a direction, whose first point has a coordinate along it.
fn axis(direction: DVec3, first: f64, step: f64) -> PlanAxis {
    let names = ["x", "y", "z"];
    let own = (0..3).find(|&k| direction[k].abs() > 1.0 - 1e-9);
    // Along an axis of the file, either way, it is that coordinate.
    let (name, sign) = own.map_or(("along", 1.0), |k| (names[k], direction[k].signum()));
    PlanAxis { name: format!("{name}, the file's units"), first: sign * first, step: sign * step }
}
