//! Draws a [`Chart`]: its series, the labels at their ends, and the legend.
//!
//! Not handled: points an axis cannot show, which interrupt their line.

use std::path::Path;

use glam::{DVec2, dvec2};

use crate::plot::axis::Range;
use crate::plot::chart::{Chart, Look, Series};
use crate::plot::drawing::{ChartError, Drawing};
use crate::plot::figure::{Figure, TICK_EM};
use crate::plot::labels;
use crate::plot::shapes::{Align, FAINT_INK, INK};

const MARKER_SIZE: f64 = 9.0;

impl Chart {
    /// The chart, drawn.
    pub fn drawing(&self) -> Drawing {
        draw(self)
    }

    /// Writes the chart, as SVG where the path ends in `.svg` and as PNG where it ends in `.png`.
    ///
    /// # Errors
    /// Another extension, a size out of range, a destination that cannot be written. Nothing is left behind.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), ChartError> {
        self.drawing().write(path.as_ref())
    }
}

/// Draws the whole chart.
fn draw(chart: &Chart) -> Drawing {
    let fits = |&(x, y): &(f64, f64)| chart.x.scale.coordinate(x).and(chart.y.scale.coordinate(y)).is_some();
    let points = chart.series.iter().flat_map(|s| &s.points).copied();
    let (xs, ys): (Vec<f64>, Vec<f64>) = points.filter(fits).unzip();
    let ranges = [Range::of(chart.x.scale, xs), Range::of(chart.y.scale, ys)];
    let mut figure = Figure::new(chart.size, [&chart.title, &chart.caption], ranges, 52.0);
    figure.x_ticks();
    figure.y_ticks();
    figure.axes([&chart.x.label, &chart.y.label]);
    for series in &chart.series {
        draw_series(series, &mut figure);
    }
    draw_labels(chart, &mut figure);
    let mut y = figure.top + 10.0;
    for series in &chart.series {
        let left = figure.right + 24.0;
        draw_line(series, &[dvec2(left, y), dvec2(left + 30.0, y)], &mut figure.drawing);
        draw_markers(series, &[dvec2(left + 15.0, y)], &mut figure.drawing);
        y = figure.entry(&series.name, y, 64.0);
    }
    figure.drawing
}

fn draw_series(series: &Series, figure: &mut Figure) {
    let places: Vec<_> = series.points.iter().map(|&(x, y)| figure.place(x, y)).collect();
    for piece in places.split(Option::is_none) {
        let piece: Vec<_> = piece.iter().flatten().copied().collect();
        draw_line(series, &piece, &mut figure.drawing);
        draw_markers(series, &piece, &mut figure.drawing);
    }
}

fn draw_line(series: &Series, points: &[DVec2], drawing: &mut Drawing) {
    match series.look {
        Look::Measured => drawing.line(points, series.rgb(), 2.0),
        Look::Bound => drawing.dashed(points, series.rgb(), 1.25, 5.0),
    }
}

fn draw_markers(series: &Series, points: &[DVec2], drawing: &mut Drawing) {
    if series.look == Look::Measured {
        points.iter().for_each(|&at| drawing.marker(series.marker(), at, MARKER_SIZE, series.rgb()));
    }
}

/// Words beside the last point of each series that has some, and below the middle where it shows no point at all.
fn draw_labels(chart: &Chart, figure: &mut Figure) {
    let places = |s: &Series| -> Vec<_> { s.points.iter().filter_map(|&(x, y)| figure.place(x, y)).collect() };
    let lines: Vec<_> = chart.series.iter().map(places).collect();
    let nowhere = dvec2(figure.left, figure.up(0.25));
    let label = |(series, line): (&Series, &Vec<_>)| {
        let text = format!("{} {}", series.name, series.label.as_ref()?);
        Some((text, line.last().copied().unwrap_or(nowhere)))
    };
    let labels: Vec<_> = chart.series.iter().zip(&lines).filter_map(label).collect();
    let plot = [figure.left, figure.top, figure.right, figure.bottom];
    for placed in labels::place(&labels, &lines, plot, TICK_EM) {
        if let Some(leader) = placed.leader {
            figure.drawing.line(&leader, FAINT_INK, 0.75);
        }
        figure.drawing.text(&placed.text, placed.at, TICK_EM, Align::Left, INK);
    }
}
