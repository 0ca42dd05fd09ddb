//! Draws a [`Chart`]: title, plot with grid and axes, legend beside it, caption below.
//!
//! The legend has a column of its own, so that it never hides a line. Notes at the ends of series step aside for one
//! another and for lines.

use plotters::backend::DrawingBackend;
use plotters::style::RGBColor;

use crate::plot::axis::Range;
use crate::plot::canvas::{Align, Canvas};
use crate::plot::chart::{Chart, Look, Series};
use crate::plot::drawing::DrawError;
use crate::plot::{font, labels};

pub(crate) const INK: RGBColor = RGBColor(34, 34, 34);
pub(crate) const FAINT_INK: RGBColor = RGBColor(96, 96, 96);
pub(crate) const GRID: RGBColor = RGBColor(225, 225, 225);
pub(crate) const TITLE_EM: f64 = 19.0;
pub(crate) const LABEL_EM: f64 = 15.0;
pub(crate) const TICK_EM: f64 = 14.0;
pub(crate) const CAPTION_EM: f64 = 13.0;
const MARKER_SIZE: f64 = 9.0;
pub(crate) const LEGEND_WIDTH: f64 = 190.0;

/// The plot's edges and what its axes span.
pub(crate) struct Frame {
    pub left: f64,
    pub right: f64,
    pub top: f64,
    pub bottom: f64,
    x: Range,
    y: Range,
}

impl Frame {
    fn of(chart: &Chart, caption_lines: usize) -> Frame {
        let shown = chart.series.iter().flat_map(|s| shown(chart, s));
        let (xs, ys): (Vec<f64>, Vec<f64>) = shown.unzip();
        let x = Range::of(chart.x.scale, xs);
        let y = Range::of(chart.y.scale, ys);
        Frame::spanning(chart.size, caption_lines, (x, y))
    }

    /// The frame of a drawing of that size, with room for a legend and a caption.
    pub(crate) fn spanning(size: (u32, u32), caption_lines: usize, (x, y): (Range, Range)) -> Frame {
        let (width, height) = (f64::from(size.0), f64::from(size.1));
        let below = 62.0 + 1.4 * CAPTION_EM * caption_lines as f64;
        Frame { left: 84.0, right: width - LEGEND_WIDTH - 24.0, top: 52.0, bottom: height - below - 14.0, x, y }
    }

    fn across(&self, at: f64) -> f64 {
        self.left + at * (self.right - self.left)
    }

    fn up(&self, at: f64) -> f64 {
        self.bottom - at * (self.bottom - self.top)
    }

    pub(crate) fn place(&self, (x, y): (f64, f64)) -> Option<(f64, f64)> {
        let (x, y) = (self.x.position(x)?, self.y.position(y)?);
        Some((self.across(x), self.up(y)))
    }
}

/// The points of a series that both axes can show.
fn shown(chart: &Chart, series: &Series) -> Vec<(f64, f64)> {
    let points = series.points.iter().copied();
    let fits = |&(x, y): &(f64, f64)| {
        let (x, y) = (chart.x.scale.coordinate(x), chart.y.scale.coordinate(y));
        x.is_some() && y.is_some()
    };
    points.filter(fits).collect()
}

/// Draws the whole chart.
pub fn draw<B: DrawingBackend>(chart: &Chart, canvas: &mut Canvas<B>) -> Result<(), DrawError> {
    let (width, height) = (f64::from(chart.size.0), f64::from(chart.size.1));
    let caption = font::wrap(&chart.caption, CAPTION_EM, width - 84.0 - 24.0);
    let frame = Frame::of(chart, caption.len());
    canvas.rectangle((0.0, 0.0), (width, height), RGBColor(255, 255, 255))?;
    canvas.text(&chart.title, (frame.left, 32.0), TITLE_EM, Align::Left, INK)?;
    draw_axes([&chart.x.label, &chart.y.label], &frame, canvas)?;
    for series in &chart.series {
        draw_series(series, &frame, canvas)?;
    }
    draw_notes(chart, &frame, canvas)?;
    draw_legend(chart, &frame, canvas)?;
    draw_caption(&caption, &frame, canvas)
}

/// Lines of text below the plot.
pub(crate) fn draw_caption<B: DrawingBackend>(
    lines: &[String],
    frame: &Frame,
    canvas: &mut Canvas<B>,
) -> Result<(), DrawError> {
    for (line, number) in lines.iter().zip(0..) {
        let y = frame.bottom + 72.0 + 1.4 * CAPTION_EM * f64::from(number);
        canvas.text(line, (frame.left, y), CAPTION_EM, Align::Left, FAINT_INK)?;
    }
    Ok(())
}

/// Grid, ticks, frame and the labels of x and y.
pub(crate) fn draw_axes<B: DrawingBackend>(
    [x_label, y_label]: [&str; 2],
    frame: &Frame,
    canvas: &mut Canvas<B>,
) -> Result<(), DrawError> {
    let (left, right, top, bottom) = (frame.left, frame.right, frame.top, frame.bottom);
    for tick in frame.x.ticks(10) {
        let x = frame.across(tick.at);
        let length = if tick.label.is_some() { 6.0 } else { 3.0 };
        canvas.line((x, bottom), (x, bottom + length), INK, 1.0)?;
        if let Some(label) = tick.label {
            canvas.line((x, top), (x, bottom), GRID, 1.0)?;
            canvas.text(&label, (x, bottom + 22.0), TICK_EM, Align::Center, INK)?;
        }
    }
    for tick in frame.y.ticks(8) {
        let y = frame.up(tick.at);
        let length = if tick.label.is_some() { 6.0 } else { 3.0 };
        canvas.line((left - length, y), (left, y), INK, 1.0)?;
        if let Some(label) = tick.label {
            canvas.line((left, y), (right, y), GRID, 1.0)?;
            let at = (left - 11.0, y + 0.35 * TICK_EM);
            canvas.text(&label, at, TICK_EM, Align::Right, INK)?;
        }
    }
    // The frame goes over the grid.
    let corners = [(left, top), (left, bottom), (right, bottom)];
    canvas.path(&corners, INK, 1.25)?;
    let middle = (0.5 * (left + right), 0.5 * (top + bottom));
    let at = (middle.0, bottom + 46.0);
    canvas.text(x_label, at, LABEL_EM, Align::Center, INK)?;
    let at = (26.0, middle.1);
    canvas.text(y_label, at, LABEL_EM, Align::Upwards, INK)
}

fn draw_series<B: DrawingBackend>(series: &Series, frame: &Frame, canvas: &mut Canvas<B>) -> Result<(), DrawError> {
    // A point that cannot be shown interrupts the line.
    let places: Vec<_> = series.points.iter().map(|&p| frame.place(p)).collect();
    for piece in places.split(|place| place.is_none()) {
        let piece: Vec<_> = piece.iter().flatten().copied().collect();
        match series.look {
            Look::Measured => canvas.path(&piece, series.rgb(), 2.0)?,
            Look::Bound => canvas.dashed(&piece, series.rgb(), 1.25, 5.0)?,
        }
    }
    if series.look == Look::Measured {
        for place in places.into_iter().flatten() {
            canvas.marker(series.marker(), place, MARKER_SIZE, series.rgb())?;
        }
    }
    Ok(())
}

/// Words beside the last point of each series that has some, and below the middle where it shows no point at all.
fn draw_notes<B: DrawingBackend>(chart: &Chart, frame: &Frame, canvas: &mut Canvas<B>) -> Result<(), DrawError> {
    let places = |s: &Series| -> Vec<_> { s.points.iter().filter_map(|&p| frame.place(p)).collect() };
    let lines: Vec<_> = chart.series.iter().map(places).collect();
    let nowhere = (frame.left, frame.up(0.25));
    let mut notes = Vec::new();
    for (series, line) in chart.series.iter().zip(&lines) {
        if let Some(note) = &series.note {
            let point = line.last().copied().unwrap_or(nowhere);
            notes.push((format!("{} {note}", series.name), point));
        }
    }
    let plot = [frame.left, frame.top, frame.right, frame.bottom];
    for note in labels::place(&notes, &lines, plot, TICK_EM) {
        if let Some([from, to]) = note.leader {
            canvas.line(from, to, FAINT_INK, 0.75)?;
        }
        canvas.text(&note.text, note.at, TICK_EM, Align::Left, INK)?;
    }
    Ok(())
}

fn draw_legend<B: DrawingBackend>(chart: &Chart, frame: &Frame, canvas: &mut Canvas<B>) -> Result<(), DrawError> {
    let left = frame.right + 24.0;
    let mut y = frame.top + 10.0;
    for series in &chart.series {
        let sample = [(left, y), (left + 30.0, y)];
        match series.look {
            Look::Bound => canvas.dashed(&sample, series.rgb(), 1.25, 5.0)?,
            Look::Measured => {
                canvas.path(&sample, series.rgb(), 2.0)?;
                canvas.marker(series.marker(), (left + 15.0, y), MARKER_SIZE, series.rgb())?;
            }
        }
        for line in font::wrap(&series.name, TICK_EM, LEGEND_WIDTH - 42.0) {
            let at = (left + 40.0, y + 0.35 * TICK_EM);
            canvas.text(&line, at, TICK_EM, Align::Left, INK)?;
            y += 1.35 * TICK_EM;
        }
        y += 6.0;
    }
    Ok(())
}
