//! Draws a [`Map`] as a filled contour chart: bands of the spectral radius, the two frontiers, the four modes at the corners.
//!
//! Since radius(alpha, tau) = alpha r(tau), the contour of a level is the curve alpha = level / r(tau); log r is joined
//! by straight lines between the columns. Colours are viridis, which rises evenly in lightness (S. van der Walt, N.
//! Smith 2015). Not handled: the gap of the bounds, which is narrower than a line.

use std::path::Path;

use crate::plot::canvas::Backend;
use crate::plot::canvas::{Colour, viridis};

use crate::light::Mode;
use crate::operator::Bounds;
use crate::pictures::{write_bitmap, write_whole};
use crate::plot::axis::Range;
use crate::plot::canvas::{Align, Canvas};
use crate::plot::drawing::{draw_bitmap, draw_svg};
use crate::plot::lines::{CAPTION_EM, Frame, INK, LEGEND_WIDTH, TICK_EM, TITLE_EM, draw_axes, draw_caption};
use crate::plot::{ChartError, DrawError, Marker, Scale, font};
use crate::study::map::stability::{Column, Map};

const SIZE: (u32, u32) = (880, 700);
const PAPER: Colour = Colour(255, 255, 255);
/// Pieces a curve has between two columns.
const PIECES: usize = 8;
/// Bands at most.
const BANDS: f64 = 16.0;

/// A map and the words around it.
pub struct MapChart<'a> {
    /// What is drawn.
    pub map: &'a Map,
    /// In one line above.
    pub title: String,
    /// Below; wrapped.
    pub caption: String,
}

/// A level of the radius as a curve: alpha for each of many tau.
struct Curve {
    taus: Vec<f64>,
    alphas: Vec<f64>,
}

impl MapChart<'_> {
    /// Writes the chart, as SVG where the path ends in `.svg` and as PNG where it ends in `.png`.
    ///
    /// # Errors
    /// Another extension, or a destination that cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), ChartError> {
        let path = path.as_ref();
        let extension = path.extension().unwrap_or_default();
        if extension.eq_ignore_ascii_case("svg") {
            write_whole(path, self.svg()?.as_bytes())?;
        } else {
            write_bitmap(path, &draw_bitmap(SIZE, |canvas| self.draw(canvas))?)?;
        }
        Ok(())
    }

    /// The chart as an SVG document.
    ///
    /// # Errors
    /// Where the backend fails.
    pub fn svg(&self) -> Result<String, DrawError> {
        draw_svg(SIZE, |canvas| self.draw(canvas))
    }

    fn draw<B: Backend>(&self, canvas: &mut Canvas<B>) -> Result<(), DrawError> {
        let (width, height) = (f64::from(SIZE.0), f64::from(SIZE.1));
        let caption = font::wrap(&self.caption, CAPTION_EM, width - 84.0 - 24.0);
        let unit = || Range::of(Scale::Linear, [0.0, 1.0]);
        let frame = Frame::spanning(SIZE, caption.len(), (unit(), unit()));
        canvas.rectangle((0.0, 0.0), (width, height), PAPER)?;
        canvas.text(&self.title, (frame.left, 22.0), TITLE_EM, Align::Left, INK)?;
        let labels = ["alpha: interreflection", "tau: transmission"];
        draw_axes(labels, &frame, canvas)?;
        let levels = self.levels();
        self.draw_bands(&levels, &frame, canvas)?;
        self.draw_frontiers(&frame, canvas)?;
        draw_corners(&frame, canvas)?;
        self.draw_legend(&levels, &frame, canvas)?;
        draw_caption(&caption, &frame, canvas)
    }

    /// The lower edges of the bands, and the upper edge of the last.
    fn levels(&self) -> Vec<f64> {
        let uppers = self.map.columns.iter().map(|c| c.radius.upper);
        let highest = uppers.fold(1.0, f64::max);
        let decades = (-2..6).flat_map(|k| [1.0, 2.0, 5.0].map(|m| m * 10_f64.powi(k)));
        let fits = |step: &f64| highest / step <= BANDS;
        let step = { decades }.find(fits).unwrap_or(highest / BANDS);
        let count = (highest / step).ceil() as usize;
        (0..=count).map(|k| k as f64 * step).collect()
    }

    /// From the lowest band up, each drawn over all that is above its level, so that no seam shows.
    fn draw_bands<B: Backend>(&self, levels: &[f64], frame: &Frame, canvas: &mut Canvas<B>) -> Result<(), DrawError> {
        for (k, &level) in levels[..levels.len() - 1].iter().enumerate() {
            let curve = Curve::new(&self.map.columns, |c| c.radius, |r| level / r);
            let inside: Vec<f64> = curve.alphas.iter().map(|a| a.min(1.0)).collect();
            if inside.iter().all(|&a| a >= 1.0) {
                continue;
            }
            let mut corners: Vec<_> = inside.into_iter().zip(curve.taus).collect();
            corners.extend([(1.0, 1.0), (1.0, 0.0)]);
            let corners: Vec<_> = corners.iter().filter_map(|&p| frame.place(p)).collect();
            canvas.polygon(&corners, colour(k, levels))?;
        }
        Ok(())
    }

    fn draw_frontiers<B: Backend>(&self, frame: &Frame, canvas: &mut Canvas<B>) -> Result<(), DrawError> {
        let columns = &self.map.columns;
        let mean = Curve::new(columns, |c| c.radius, |r| 1.0 / r);
        for piece in mean.inside(frame) {
            canvas.path(&piece, INK, 5.0)?;
            canvas.path(&piece, PAPER, 2.5)?;
        }
        let variance = Curve::new(columns, |c| c.squares, |r| 1.0 / r.sqrt());
        for piece in variance.inside(frame) {
            canvas.dashed(&piece, INK, 4.0, 7.0)?;
            canvas.dashed(&piece, PAPER, 2.0, 7.0)?;
        }
        Ok(())
    }

    /// The colour bar with the frontier on it, and what the lines mean.
    fn draw_legend<B: Backend>(&self, levels: &[f64], frame: &Frame, canvas: &mut Canvas<B>) -> Result<(), DrawError> {
        let left = frame.right + 36.0;
        let (top, bottom) = (frame.top + 200.0, frame.bottom);
        let highest = levels[levels.len() - 1];
        let y = |level: f64| bottom - (bottom - top) * level / highest;
        for (k, pair) in levels.windows(2).enumerate() {
            canvas.rectangle((left, y(pair[1])), (left + 22.0, y(pair[0])), colour(k, levels))?;
        }
        let digits = if levels[1] < 0.1 { 2 } else { 1 };
        for &level in levels {
            canvas.line((left + 22.0, y(level)), (left + 27.0, y(level)), INK, 1.0)?;
            let at = (left + 33.0, y(level) + 0.35 * TICK_EM);
            canvas.text(&format!("{level:.digits$}"), at, TICK_EM, Align::Left, INK)?;
        }
        canvas.line((left - 5.0, y(1.0)), (left + 27.0, y(1.0)), INK, 4.0)?;
        canvas.line((left - 5.0, y(1.0)), (left + 27.0, y(1.0)), PAPER, 2.0)?;
        let at = (left, top - 14.0);
        canvas.text("spectral radius of K", at, TICK_EM, Align::Left, INK)?;
        let variance = if self.map.grey {
            "beyond: the path tracer's variance is infinite"
        } else {
            "inside: the path tracer's variance is finite"
        };
        let entries = [("radius = 1: beyond, the series diverges", false), (variance, true)];
        let mut y = frame.top + 10.0;
        for (words, dashed) in entries {
            let sample = [(left - 12.0, y), (left + 18.0, y)];
            canvas.path(&sample, INK, 5.0)?;
            if dashed {
                canvas.path(&sample, PAPER, 6.0)?;
                canvas.dashed(&sample, INK, 4.0, 7.0)?;
            } else {
                canvas.path(&sample, PAPER, 2.5)?;
            }
            for line in font::wrap(words, TICK_EM, LEGEND_WIDTH - 50.0) {
                let at = (left + 26.0, y + 0.35 * TICK_EM);
                canvas.text(&line, at, TICK_EM, Align::Left, INK)?;
                y += 1.35 * TICK_EM;
            }
            y += 8.0;
        }
        Ok(())
    }
}

/// The colour of band k, by the middle of its levels.
fn colour(k: usize, levels: &[f64]) -> Colour {
    let bands = (levels.len() - 1) as f64;
    viridis((k as f64 + 0.5) / bands)
}

/// A disc and the mode's name in every corner.
fn draw_corners<B: Backend>(frame: &Frame, canvas: &mut Canvas<B>) -> Result<(), DrawError> {
    for mode in Mode::ALL {
        let at = mode.transport();
        let Some((x, y)) = frame.place((at.alpha.into(), at.tau.into())) else {
            continue;
        };
        canvas.marker(Marker::Disc, (x, y), 13.0, INK)?;
        canvas.marker(Marker::Disc, (x, y), 8.0, PAPER)?;
        // Above the square nothing is hidden; below it are the ticks.
        if at.tau > 0.5 {
            canvas.text(mode.name(), (x, y - 11.0), TICK_EM, Align::Center, INK)?;
            continue;
        }
        let wide = font::width(mode.name(), TICK_EM) + 12.0;
        let left = if at.alpha > 0.5 { x - 10.0 - wide } else { x + 10.0 };
        let base = y - 14.0;
        canvas.rectangle((left, base - 15.0), (left + wide, base + 6.0), PAPER)?;
        canvas.text(mode.name(), (left + 6.0, base), TICK_EM, Align::Left, INK)?;
    }
    Ok(())
}

impl Curve {
    /// alpha over tau, from the radius of each column.
    fn new(columns: &[Column], of: fn(&Column) -> Bounds, alpha: impl Fn(f64) -> f64) -> Curve {
        let middle = |c: &Column| 0.5 * (of(c).lower + of(c).upper);
        let (mut taus, mut alphas) = (Vec::new(), Vec::new());
        for pair in columns.windows(2) {
            for piece in 0..=PIECES {
                let share = piece as f64 / PIECES as f64;
                let [a, b] = [&pair[0], &pair[1]];
                let radius = middle(a).powf(1.0 - share) * middle(b).powf(share);
                taus.push(a.tau + (b.tau - a.tau) * share);
                alphas.push(alpha(radius));
            }
        }
        Curve { taus, alphas }
    }

    /// The parts of the curve inside the square, as drawn.
    fn inside(&self, frame: &Frame) -> Vec<Vec<(f64, f64)>> {
        let points: Vec<_> = self.alphas.iter().zip(&self.taus).collect();
        let pieces = points.split(|(alpha, _)| **alpha > 1.0);
        let placed = pieces.map(|piece| {
            let place = |&(&alpha, &tau): &(&f64, &f64)| frame.place((alpha, tau));
            piece.iter().filter_map(place).collect()
        });
        placed.filter(|piece: &Vec<_>| piece.len() > 1).collect()
    }
}
