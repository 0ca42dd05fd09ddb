//! What every chart has: a title above, a plot with two axes and a grid, a legend beside it, a caption below.
//!
//! The legend has a column of its own, so that it never hides a line. Axes, ticks and grid stand on the middle of
//! pixels, which keeps lines of one pixel sharp. Not handled: what is drawn inside, and the legend's samples.

use glam::{DVec2, dvec2};

use crate::pictures::Size;
use crate::plot::axis::{Range, Tick};
use crate::plot::drawing::Drawing;
use crate::plot::font;
use crate::plot::shapes::{Align, Colour, FAINT_INK, INK, PAPER};

pub const TICK_EM: f64 = 14.0;
const TITLE_EM: f64 = 19.0;
const LABEL_EM: f64 = 15.0;
const CAPTION_EM: f64 = 13.0;
const GRID: Colour = [225; 3];
const LEGEND_WIDTH: f64 = 190.0;

/// A drawing, the edges of the plot in it, and what its axes span.
pub struct Figure {
    pub drawing: Drawing,
    pub left: f64,
    pub right: f64,
    pub top: f64,
    pub bottom: f64,
    x: Range,
    y: Range,
}

impl Figure {
    /// A title and a wrapped caption, and between them room for a plot that begins `above` pixels down.
    pub fn new(size: Size, [title, caption]: [&str; 2], [x, y]: [Range; 2], above: f64) -> Figure {
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
        Figure { drawing, left, right, top: sharp(above), bottom, x, y }
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
