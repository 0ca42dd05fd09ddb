//! Charts: series of numbers on linear or logarithmic axes, as SVG and PNG from one drawing.
//!
//! A point whose value an axis cannot show (0 on a logarithmic one, NaN, infinity) is left out; a series can say why in
//! a note at its last point. Colours are those of Okabe and Ito, told apart by colour-blind readers too, and every
//! series of measurements has a marker shape of its own. Not handled: error bars, several panels.
//!
//! Source of the palette: M. Okabe, K. Ito, *Color Universal Design*, 2008.

use std::path::Path;

use plotters::style::RGBColor;

use super::axis::{Scale, superscript};
use super::canvas::{DrawError, Marker, draw_bitmap, draw_svg};
use super::plot;
use crate::image::{Bitmap, ImageError, WriteError, write_bitmap, write_whole};

/// A chart.
#[derive(Clone, Debug)]
pub struct Chart {
    /// What is shown, in one line above the plot.
    pub title: String,
    /// Scene and settings, below the plot; wrapped.
    pub caption: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// What is drawn, the first at the bottom.
    pub series: Vec<Series>,
    /// Width and height in pixels.
    pub size: (u32, u32),
}

/// An axis: what it measures, and how.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Quantity and unit.
    pub label: String,
    /// Linear or logarithmic.
    pub scale: Scale,
}

/// A line of a chart.
#[derive(Clone, Debug)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// (x, y), in the order in which they are joined.
    pub points: Vec<(f64, f64)>,
    /// How it is drawn.
    pub look: Look,
    /// Which of the palette's colours and marker shapes it has; beyond the last they begin again.
    pub colour: usize,
    /// Words beside its last point, such as why it ends there.
    pub note: Option<String>,
}

/// What a series stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    /// Values: a marker at each point, joined by a line.
    Measured,
    /// A proven bound: a thin dashed line without markers.
    Bound,
}

/// A chart cannot be written.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum ChartError {
    /// It cannot be drawn.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Draw(#[from] DrawError),
    /// Its bitmap cannot be written.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Image(#[from] ImageError),
    /// Its SVG cannot be written.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Write(#[from] WriteError),
}

/// Okabe and Ito's palette without black and yellow, dark ones first.
const PALETTE: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];

const MARKERS: [Marker; 5] = [
    Marker::Disc,
    Marker::Square,
    Marker::Triangle,
    Marker::Diamond,
    Marker::Wedge,
];

impl Series {
    /// The norms of the terms `KⁿE`, n = 0, 1, 2 ..., noting where they become exactly 0 or leave the numbers.
    ///
    /// Terms after such an end are dropped.
    pub fn bounces(name: impl Into<String>, colour: usize, norms: &[f64]) -> Series {
        let end = norms.iter().position(|v| *v == 0.0 || !v.is_finite());
        let note = end.map(|n| match norms[n] == 0.0 {
            true => format!("ends: {} = 0", term(n)),
            false => format!("diverges: {} is beyond all numbers", term(n)),
        });
        let shown = &norms[..end.unwrap_or(norms.len())];
        Series {
            name: name.into(),
            points: (0..).map(f64::from).zip(shown.iter().copied()).collect(),
            look: Look::Measured,
            colour,
            note,
        }
    }

    /// A proven bound at the given points, in the colour of the series it bounds.
    pub fn bound(name: impl Into<String>, colour: usize, points: Vec<(f64, f64)>) -> Series {
        Series {
            name: name.into(),
            points,
            look: Look::Bound,
            colour,
            note: None,
        }
    }

    /// Its colour on paper.
    pub fn rgb(&self) -> RGBColor {
        PALETTE[self.colour % PALETTE.len()]
    }

    /// Its marker shape.
    pub fn marker(&self) -> Marker {
        MARKERS[self.colour % MARKERS.len()]
    }
}

/// `E`, `KE`, `K²E` and so on.
pub(super) fn term(n: usize) -> String {
    match n {
        0 => "E".into(),
        1 => "KE".into(),
        n => format!("K{}E", superscript(n.min(i32::MAX as usize) as i32)),
    }
}

impl Chart {
    /// A chart of bounce series: the norm of `KⁿE` over n, logarithmic, 960 by 600 pixels.
    pub fn of_bounces(
        title: impl Into<String>,
        caption: impl Into<String>,
        series: Vec<Series>,
    ) -> Chart {
        Chart {
            title: title.into(),
            caption: caption.into(),
            x: Axis {
                label: "bounce n".into(),
                scale: Scale::Linear,
            },
            y: Axis {
                label: "norm of KⁿE, W/(m² sr)".into(),
                scale: Scale::Log,
            },
            series,
            size: (960, 600),
        }
    }

    /// The chart as an SVG document.
    ///
    /// # Errors
    /// A size out of range.
    pub fn svg(&self) -> Result<String, DrawError> {
        draw_svg(self.size, |canvas| plot::draw(self, canvas))
    }

    /// The chart as pixels.
    ///
    /// # Errors
    /// A size out of range.
    pub fn bitmap(&self) -> Result<Bitmap, DrawError> {
        draw_bitmap(self.size, |canvas| plot::draw(self, canvas))
    }

    /// Writes the chart, as SVG where the path ends in `.svg` and as PNG where it ends in `.png`.
    ///
    /// # Errors
    /// Another extension, a size out of range, a destination that cannot be written. Nothing is left behind.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), ChartError> {
        let path = path.as_ref();
        let extension = path.extension().unwrap_or_default();
        if extension.eq_ignore_ascii_case("svg") {
            write_whole(path, self.svg()?.as_bytes())?;
        } else {
            write_bitmap(path, &self.bitmap()?)?;
        }
        Ok(())
    }
}
