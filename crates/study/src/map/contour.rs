//! Draws a [`Map`] as a filled contour chart: bands of the spectral radius, the two frontiers, the four modes at the
//! corners.
//!
//! Since radius(alpha, tau) = alpha r(tau), the contour of a level is the curve alpha = level / r(tau); log r is joined
//! by straight lines between the columns. Colours are viridis, which rises evenly in lightness (S. van der Walt, N.
//! Smith 2015). Not handled: the gap of the bounds, which is narrower than a line.

use glam::{DVec2, dvec2};

use crate::map::stability::{Column, Map};
use halflight::light::Mode;
use halflight::operator::Bounds;
use halflight::pictures::Size;
use halflight_plot::axes::{Frame, Range, TICK_EM};
use halflight_plot::drawing::{Align, Colour, Drawing, INK, PAPER};
use halflight_plot::viridis::viridis;
use halflight_plot::{Marker, Scale, font};

const SIZE: Size = Size { width: 880, height: 720 };
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
    /// The chart, drawn.
    pub fn drawing(&self) -> Drawing {
        let unit = || Range::of(Scale::Linear, [0.0, 1.0]);
        let mut frame = Frame::new(SIZE, [&self.title, &self.caption], [unit(), unit()], 72.0);
        frame.x_ticks();
        frame.y_ticks();
        let levels = self.levels();
        self.draw_bands(&levels, &mut frame);
        frame.axes(["alpha: interreflection", "tau: transmission"]);
        self.draw_frontiers(&mut frame);
        draw_corners(&mut frame);
        draw_colours(&levels, &mut frame);
        self.draw_meanings(&mut frame);
        frame.drawing
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
    fn draw_bands(&self, levels: &[f64], frame: &mut Frame) {
        for (k, &level) in levels[..levels.len() - 1].iter().enumerate() {
            let curve = Curve::new(&self.map.columns, |c| c.radius, |r| level / r);
            let inside: Vec<f64> = curve.alphas.iter().map(|a| a.min(1.0)).collect();
            if inside.iter().all(|&a| a >= 1.0) {
                continue;
            }
            let corners = inside.into_iter().zip(curve.taus).chain([(1.0, 1.0), (1.0, 0.0)]);
            let corners: Vec<_> = corners.filter_map(|(alpha, tau)| frame.place(alpha, tau)).collect();
            frame.drawing.polygon(&corners, colour(k, levels));
        }
    }

    fn draw_frontiers(&self, frame: &mut Frame) {
        let columns = &self.map.columns;
        for piece in Curve::new(columns, |c| c.radius, |r| 1.0 / r).inside(frame) {
            mean_line(&piece, &mut frame.drawing);
        }
        for piece in Curve::new(columns, |c| c.squares, |r| 1.0 / r.sqrt()).inside(frame) {
            frame.drawing.dashed(&piece, INK, 4.0, 7.0);
            frame.drawing.dashed(&piece, PAPER, 2.0, 7.0);
        }
    }

    /// What the lines mean.
    fn draw_meanings(&self, frame: &mut Frame) {
        let sample = |frame: &Frame, y: f64| [24.0, 54.0].map(|across| dvec2(frame.right + across, y));
        let y = frame.top + 10.0;
        mean_line(&sample(frame, y), &mut frame.drawing);
        let y = frame.entry("radius = 1: beyond, the series diverges", y, 62.0);
        frame.drawing.dashed(&sample(frame, y), INK, 4.0, 7.0);
        let words = if self.map.grey {
            "beyond: the path tracer's variance is infinite"
        } else {
            "inside: the path tracer's variance is finite"
        };
        frame.entry(words, y, 62.0);
    }
}

/// The frontier of the series: paper between two lines of ink.
fn mean_line(points: &[DVec2], drawing: &mut Drawing) {
    drawing.line(points, INK, 5.0);
    drawing.line(points, PAPER, 2.5);
}

/// The colour bar with the frontier on it.
fn draw_colours(levels: &[f64], frame: &mut Frame) {
    let left = frame.right.floor() + 36.0;
    let (top, bottom) = (frame.top.floor() + 200.0, frame.bottom.ceil());
    let y = |level: f64| bottom - (bottom - top) * level / levels[levels.len() - 1];
    let digits = if levels[1] < 0.1 { 2 } else { 1 };
    for (k, &level) in levels[..levels.len() - 1].iter().enumerate() {
        frame.drawing.rectangle(dvec2(left, y(level)), dvec2(left + 22.0, top), colour(k, levels));
    }
    for &level in levels {
        frame.drawing.line(&[dvec2(left + 22.0, y(level)), dvec2(left + 27.0, y(level))], INK, 1.0);
        let at = dvec2(left + 33.0, y(level) + 0.35 * TICK_EM);
        frame.drawing.text(&format!("{level:.digits$}"), at, TICK_EM, Align::Left, INK);
    }
    mean_line(&[dvec2(left - 5.0, y(1.0)), dvec2(left + 27.0, y(1.0))], &mut frame.drawing);
    frame.drawing.text("spectral radius of K", dvec2(left, top - 14.0), TICK_EM, Align::Left, INK);
}

/// The colour of band k, by the middle of its levels, from dark blue to yellow.
fn colour(k: usize, levels: &[f64]) -> Colour {
    viridis((k as f64 + 0.5) / (levels.len() - 1) as f64)
}

/// A disc and the mode's name in every corner.
fn draw_corners(frame: &mut Frame) {
    for mode in Mode::ALL {
        let at = mode.transport();
        let Some(DVec2 { x, y }) = frame.place(at.alpha.into(), at.tau.into()) else {
            continue;
        };
        frame.drawing.marker(Marker::Disc, dvec2(x, y), 13.0, INK);
        frame.drawing.marker(Marker::Disc, dvec2(x, y), 8.0, PAPER);
        // Above the square nothing is hidden; below it are the ticks.
        if at.tau > 0.5 {
            frame.drawing.text(mode.name(), dvec2(x, y - 11.0), TICK_EM, Align::Center, INK);
            continue;
        }
        let wide = font::width(mode.name(), TICK_EM) + 12.0;
        let left = if at.alpha > 0.5 { x - 10.0 - wide } else { x + 10.0 };
        let base = y - 14.0;
        frame.drawing.rectangle(dvec2(left, base - 15.0), dvec2(left + wide, base + 6.0), PAPER);
        frame.drawing.text(mode.name(), dvec2(left + 6.0, base), TICK_EM, Align::Left, INK);
    }
}

impl Curve {
    /// alpha over tau, from the radius of each column.
    fn new(columns: &[Column], of: fn(&Column) -> Bounds, alpha: impl Fn(f64) -> f64) -> Curve {
        let (mut taus, mut alphas) = (Vec::new(), Vec::new());
        for pair in columns.windows(2) {
            for piece in 0..=PIECES {
                let share = piece as f64 / PIECES as f64;
                let [a, b] = [&pair[0], &pair[1]];
                let radius = of(a).middle().powf(1.0 - share) * of(b).middle().powf(share);
                taus.push(a.tau + (b.tau - a.tau) * share);
                alphas.push(alpha(radius));
            }
        }
        Curve { taus, alphas }
    }

    /// The parts of the curve inside the square, as drawn.
    fn inside(&self, frame: &Frame) -> Vec<Vec<DVec2>> {
        let points: Vec<_> = self.alphas.iter().zip(&self.taus).collect();
        let pieces = points.split(|(alpha, _)| **alpha > 1.0);
        let placed = pieces.map(|piece| {
            let place = |&(&alpha, &tau): &(&f64, &f64)| frame.place(alpha, tau);
            piece.iter().filter_map(place).collect()
        });
        placed.filter(|piece: &Vec<_>| piece.len() > 1).collect()
    }
}
