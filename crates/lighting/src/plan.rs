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
    let mut values = vec![None; grid.size[0] * grid.size[1]];
    for (&[column, row], light) in grid.cells.iter().zip(&found.points) {
        values[row * grid.size[0] + column] = quantity.at(light);
    }
    let (all, unit) = (quantity.uniformity(found), quantity.unit());
    let [mean, least, most] = [all.mean, all.least, all.most].map(digits);
    let caption = format!(
        "Mean {mean} {unit}, least {least}, most {most}; uniformity least/mean {:.3}, least/most {:.3}. {} points, \
         {} apart in the file's units; {} inside of solids are left out.",
        all.least_over_mean, all.least_over_most, all.count, grid.spacing, all.left_out
    );
    let (first, cell) = (layout.sensors[0].position, grid.cells[0]);
    let start = |k: usize| first.dot(grid.axes[k]) - cell[k] as f64 * grid.spacing;
    let axes = [0, 1].map(|k| axis(grid.axes[k], start(k), grid.spacing));
    Plan { title, caption, unit: unit.to_owned(), axes, size: grid.size, values }
}

/// An axis along a direction, whose first point has a coordinate along it.
fn axis(direction: DVec3, first: f64, step: f64) -> PlanAxis {
    let names = ["x", "y", "z"];
    let own = (0..3).find(|&k| direction[k].abs() > 1.0 - 1e-9);
    // Along an axis of the file, either way, it is that coordinate.
    let (name, sign) = own.map_or(("along", 1.0), |k| (names[k], direction[k].signum()));
    PlanAxis { name: format!("{name}, the file's units"), first: sign * first, step: sign * step }
}
