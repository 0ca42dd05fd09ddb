//! What every chart has: a title, a plot with two axes and a grid, a legend in a column of its own that never hides a
//! line, a caption; and how an axis maps values to positions and ticks.
//!
//! A logarithmic axis covers whole decades, labelled 10⁻³, 10⁰, 10²; a linear one steps by 1, 2 or 5 times a power of
//! ten. Values a scale cannot show (NaN, infinities, and on a logarithmic one zero and below) take no part in it.

use glam::{DVec2, dvec2};

use crate::drawing::{Align, Colour, Drawing, FAINT_INK, INK, PAPER};
use crate::font;
use halflight::pictures::Size;

/// How values spread along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences, equal distances.
    Linear,
    /// Equal ratios, equal distances.
    Log,
}

/// A tick of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// Position, 0 at the start and 1 at the end of the axis.
    pub at: f64,
    /// Its label; minor ticks have none.
    pub label: Option<String>,
}

/// The range of an axis. On a logarithmic one both ends are decimal logarithms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    scale: Scale,
    low: f64,
    high: f64,
}

impl Scale {
    /// The coordinate that runs evenly along the axis; `None` for a value that cannot be shown.
    pub fn coordinate(self, value: f64) -> Option<f64> {
        match self {
            Scale::Linear => Some(value).filter(|v| v.is_finite()),
            Scale::Log => Some(value.log10()).filter(|v| v.is_finite()),
        }
    }
}

impl Range {
    /// The range that shows all `values` that can be shown; one unit or decade where there are none or only one.
    pub fn of(scale: Scale, values: impl IntoIterator<Item = f64>) -> Range {
        let shown = values.into_iter().filter_map(|v| scale.coordinate(v));
        let ends = shown.fold(None, |ends: Option<(f64, f64)>, v| {
            Some(ends.map_or((v, v), |(low, high)| (v.min(low), v.max(high))))
        });
        let (low, high) = ends.unwrap_or((0.0, 1.0));
        let (low, high) = match scale {
            Scale::Linear => (low, high),
            Scale::Log => (low.floor(), high.ceil()),
        };
        // A single value stands in the middle.
        let pad = if low == high { low.abs().max(1.0) } else { 0.0 };
        Range { scale, low: low - pad, high: high + pad }
    }

    /// Where a value stands, 0 at the start and 1 at the end; `None` for a value that cannot be shown.
    pub fn position(&self, value: f64) -> Option<f64> {
        self.scale.coordinate(value).map(|c| self.along(c))
    }

    fn along(&self, coordinate: f64) -> f64 {
        // Halved first: the length of the range may exceed f64.
        (0.5 * coordinate - 0.5 * self.low) / (0.5 * self.high - 0.5 * self.low)
    }

    /// The ticks, at most about `most` of them labelled.
    pub fn ticks(&self, most: usize) -> Vec<Tick> {
        match self.scale {
            Scale::Linear => self.linear_ticks(most),
            Scale::Log => self.decades(most),
        }
    }

    fn linear_ticks(&self, most: usize) -> Vec<Tick> {
        let step = round_step((self.high - self.low) / most.max(1) as f64);
        let digits = (-step.log10().floor()).clamp(0.0, 12.0) as usize;
        let (first, last) = ((self.low / step).ceil(), (self.high / step).floor());
        let count = (last - first).clamp(0.0, 2.0 * most as f64) as usize;
        let values = (0..=count).map(|i| (first + i as f64) * step);
        values.map(|value| Tick { at: self.along(value), label: Some(format!("{value:.digits$}")) }).collect()
    }

    fn decades(&self, most: usize) -> Vec<Tick> {
        let (low, high) = (self.low as i32, self.high as i32);
        let step = ((high - low) as usize).div_ceil(most.max(1)).max(1);
        let mut ticks = Vec::new();
        for decade in low..=high {
            let labelled = decade.rem_euclid(step as i32) == 0;
            if !labelled && step > 10 {
                continue;
            }
            ticks.push(Tick {
                at: self.along(f64::from(decade)),
                label: labelled.then(|| format!("10{}", superscript(decade))),
            });
            if step == 1 && decade < high {
                let minor = (2..10).map(|digit| f64::from(decade) + f64::from(digit).log10());
                ticks.extend(minor.map(|c| Tick { at: self.along(c), label: None }));
            }
        }
        ticks
    }
}

/// The smallest of 1, 2, 5 times a power of ten that is at least `step`; 1 where there is no such thing.
pub fn round_step(step: f64) -> f64 {
    let power = 10_f64.powf(step.log10().floor());
    let found = [1.0, 2.0, 5.0, 10.0].map(|m| m * power);
    let fits = found.into_iter().find(|&s| s >= step * (1.0 - 1e-9));
    fits.filter(|s| s.is_finite() && *s > 0.0).unwrap_or(1.0)
}

/// An integer in raised digits, as in 10⁻³ and K²E.
pub fn superscript(number: i32) -> String {
    let raised = |sign| match sign {
        '-' => '⁻',
        digit => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][digit as usize - '0' as usize],
    };
    number.to_string().chars().map(raised).collect()
}

/// Text sizes in pixels.
pub const TICK_EM: f64 = 14.0;
const TITLE_EM: f64 = 19.0;
const LABEL_EM: f64 = 15.0;
const CAPTION_EM: f64 = 13.0;
const GRID: Colour = [225; 3];
const LEGEND_WIDTH: f64 = 190.0;

/// A drawing, the edges of the plot in it, and what its axes span. Axes, ticks and grid stand on the middle of pixels,
/// which keeps lines of one pixel sharp.
pub struct Frame {
    pub drawing: Drawing,
    pub left: f64,
    pub right: f64,
    pub top: f64,
    pub bottom: f64,
    x: Range,
    y: Range,
}

impl Frame {
    /// A title and a wrapped caption, and between them room for a plot that begins `above` pixels down.
    pub fn new(size: Size, [title, caption]: [&str; 2], [x, y]: [Range; 2], above: f64) -> Frame {
        let (width, height) = (size.width as f64, size.height as f64);
        let lines = font::wrap(caption, CAPTION_EM, width - 84.0 - 24.0);
        let mut drawing = Drawing::new(size, PAPER);
        let (left, right) = (84.5, width.floor() - LEGEND_WIDTH - 23.5);
        let bottom = sharp(height - 76.0 - 1.4 * CAPTION_EM * lines.len() as f64);
        drawing.text(title, dvec2(left, 32.0), TITLE_EM, Align::Left, INK);
        for (line, number) in lines.iter().zip(0..) {
            let y = bottom + 72.0 + 1.4 * CAPTION_EM * f64::from(number);
            drawing.text(line, dvec2(left, y), CAPTION_EM, Align::Left, FAINT_INK);
        }
        Frame { drawing, left, right, top: sharp(above), bottom, x, y }
    }

    /// The pixel at a share of the plot's width.
    pub fn across(&self, share: f64) -> f64 {
        self.left + share * (self.right - self.left)
    }

    /// The pixel at a share of the plot's height, from the bottom.
    pub fn up(&self, share: f64) -> f64 {
        self.bottom - share * (self.bottom - self.top)
    }

    /// Where values of the two axes are in the drawing, pixels; `None` where an axis cannot show it.
    pub fn place(&self, x: f64, y: f64) -> Option<DVec2> {
        Some(dvec2(self.across(self.x.position(x)?), self.up(self.y.position(y)?)))
    }

    /// The horizontal axis' ticks, their labels and their lines of the grid.
    pub fn x_ticks(&mut self) {
        for Tick { at, label } in self.x.ticks(10) {
            let x = sharp(self.across(at));
            let length = if label.is_some() { 6.0 } else { 3.0 };
            self.drawing.line(&[dvec2(x, self.bottom), dvec2(x, self.bottom + length)], INK, 1.0);
            if let Some(label) = label {
                self.drawing.line(&[dvec2(x, self.top), dvec2(x, self.bottom)], GRID, 1.0);
                self.drawing.text(&label, dvec2(x, self.bottom + 22.0), TICK_EM, Align::Center, INK);
            }
        }
    }

    /// The vertical axis' ticks, their labels and their lines of the grid.
    pub fn y_ticks(&mut self) {
        for Tick { at, label } in self.y.ticks(8) {
            let y = sharp(self.up(at));
            let length = if label.is_some() { 6.0 } else { 3.0 };
            self.drawing.line(&[dvec2(self.left - length, y), dvec2(self.left, y)], INK, 1.0);
            if let Some(label) = label {
                self.drawing.line(&[dvec2(self.left, y), dvec2(self.right, y)], GRID, 1.0);
                let at = dvec2(self.left - 11.0, y + 0.35 * TICK_EM);
                self.drawing.text(&label, at, TICK_EM, Align::Right, INK);
            }
        }
    }

    /// The axes themselves, over grid and bars, and what they measure.
    pub fn axes(&mut self, [x, y]: [&str; 2]) {
        let corners = [dvec2(self.left, self.top), dvec2(self.left, self.bottom), dvec2(self.right, self.bottom)];
        self.drawing.line(&corners, INK, 1.0);
        self.drawing.text(x, dvec2(self.across(0.5), self.bottom + 46.0), LABEL_EM, Align::Center, INK);
        self.drawing.text(y, dvec2(26.0, self.up(0.5)), LABEL_EM, Align::Upwards, INK);
    }

    /// An entry of the legend at height `y`, wrapped and `indent` pixels from the plot; gives the next one's height.
    pub fn entry(&mut self, words: &str, mut y: f64, indent: f64) -> f64 {
        for line in font::wrap(words, TICK_EM, LEGEND_WIDTH + 22.0 - indent) {
            self.drawing.text(&line, dvec2(self.right + indent, y + 0.35 * TICK_EM), TICK_EM, Align::Left, INK);
            y += 1.35 * TICK_EM;
        }
        y + 6.0
    }
}

/// The middle of a pixel.
fn sharp(at: f64) -> f64 {
    at.floor() + 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(range: Range, most: usize) -> Vec<String> {
        let ticks = range.ticks(most).into_iter();
        ticks.filter_map(|tick| tick.label).collect()
    }

    #[test]
    fn log_axes_cover_whole_decades() {
        let range = Range::of(Scale::Log, [0.02, 3.0, 0.0, -1.0, f64::NAN, f64::INFINITY]);
        assert_eq!(labels(range, 8), ["10⁻²", "10⁻¹", "10⁰", "10¹"]);
        assert_eq!(range.position(1.0), Some(2.0 / 3.0));
        assert_eq!(range.position(0.0), None);
        assert_eq!(range.ticks(8).len(), 4 + 3 * 8);
    }

    #[test]
    fn huge_ranges_keep_few_labels() {
        let range = Range::of(Scale::Log, [1e-300, 1e300]);
        let labels = labels(range, 8);
        assert!((5..=9).contains(&labels.len()), "{labels:?}");
        assert!(labels.contains(&"10⁰".to_owned()));
        let wide = Range::of(Scale::Linear, [f64::MIN, f64::MAX]);
        assert_eq!(wide.position(0.0), Some(0.5));
    }

    #[test]
    fn one_value_stands_in_the_middle_and_none_is_no_trouble() {
        let one = Range::of(Scale::Log, [1000.0]);
        assert_eq!(one.position(1000.0), Some(0.5));
        let zero = Range::of(Scale::Linear, [0.0]);
        assert_eq!(zero.position(0.0), Some(0.5));
        assert!(!labels(Range::of(Scale::Log, []), 8).is_empty());
    }

    #[test]
    fn linear_ticks_step_by_one_two_five() {
        let bounces = Range::of(Scale::Linear, [0.0, 12.0]);
        assert_eq!(labels(bounces, 8), ["0", "2", "4", "6", "8", "10", "12"]);
        let fine = Range::of(Scale::Linear, [0.0, 0.1]);
        assert_eq!(labels(fine, 5), ["0.00", "0.02", "0.04", "0.06", "0.08", "0.10"]);
    }

    #[test]
    fn raised_numbers() {
        assert_eq!(superscript(-120), "⁻¹²⁰");
        assert_eq!(superscript(3), "³");
    }
}
