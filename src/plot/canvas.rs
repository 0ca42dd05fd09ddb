//! Lines, marks and text on any plotters backend, in logical pixels.
//!
//! Backends place things on whole pixels. A [`Canvas`] therefore draws [`FINENESS`] times larger each way: bitmaps are
//! averaged down, which anti-aliases them, and SVG is told to show itself smaller. The same drawing gives both.
//! Text stands on its baseline, because plotters places its other anchors differently in SVG and bitmaps.

pub(crate) use plotters::backend::DrawingBackend as Backend;
use plotters::backend::DrawingBackend;
pub(crate) use plotters::style::RGBColor as Colour;
use plotters::style::colors::colormaps::ViridisRGB;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontTransform, RGBColor, ShapeStyle, TextStyle};

use crate::plot::drawing::DrawError;
use crate::plot::font;

/// Backend pixels per logical pixel.
pub const FINENESS: u32 = 4;

/// Where a text stands relative to its point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// It starts there.
    Left,
    /// It is centred there.
    Center,
    /// It ends there.
    Right,
    /// It is centred there and runs upwards.
    Upwards,
}

/// The shape of a data point, so that series differ in more than colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marker {
    /// A disc.
    Disc,
    /// A square.
    Square,
    /// A triangle, point up.
    Triangle,
    /// A diamond.
    Diamond,
    /// A triangle, point down.
    Wedge,
    /// An upright cross.
    Cross,
}

/// How a backend treats text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextBy {
    /// The reader's browser draws whole lines, in the first family it has.
    Browser,
    /// plotters draws glyphs of the embedded font, one run at a time.
    Glyphs,
}

/// A drawing surface in logical pixels, (0, 0) at the top left.
pub struct Canvas<'a, B: DrawingBackend> {
    backend: &'a mut B,
    text_by: TextBy,
}

fn fine(value: f64) -> i32 {
    (value * f64::from(FINENESS)).round() as i32
}

fn stroke(colour: RGBColor, width: f64) -> ShapeStyle {
    colour.stroke_width(fine(width).max(1) as u32)
}

impl<'a, B: DrawingBackend> Canvas<'a, B> {
    /// A canvas on a backend [`FINENESS`] times its size.
    pub fn new(backend: &'a mut B, text_by: TextBy) -> Self {
        Canvas { backend, text_by }
    }

    /// A straight line.
    pub fn line(&mut self, from: (f64, f64), to: (f64, f64), colour: RGBColor, width: f64) -> Result<(), DrawError> {
        let path = [from, to].map(|(x, y)| (fine(x), fine(y)));
        let style = stroke(colour, width);
        self.backend.draw_path(path, &style).map_err(DrawError::new)
    }

    /// A line through all points, straight between them.
    pub fn path(&mut self, points: &[(f64, f64)], colour: RGBColor, width: f64) -> Result<(), DrawError> {
        points.windows(2).try_for_each(|pair| self.line(pair[0], pair[1], colour, width))
    }

    /// The same, dashed: `dash` pixels drawn, `dash` left out, carried on round the corners.
    pub fn dashed(&mut self, points: &[(f64, f64)], colour: RGBColor, width: f64, dash: f64) -> Result<(), DrawError> {
        let mut walked = 0.0;
        for pair in points.windows(2) {
            let [(x0, y0), (x1, y1)] = [pair[0], pair[1]];
            let length = (x1 - x0).hypot(y1 - y0);
            let at = |s: f64| (x0 + (x1 - x0) * s / length, y0 + (y1 - y0) * s / length);
            let first = (walked / (2.0 * dash)).floor() as i64;
            let last = ((walked + length) / (2.0 * dash)).ceil() as i64;
            for number in first..last {
                let start = 2.0 * dash * number as f64 - walked;
                let (from, to) = (start.max(0.0), (start + dash).min(length));
                if from < to {
                    self.line(at(from), at(to), colour, width)?;
                }
            }
            walked += length;
        }
        Ok(())
    }

    /// A filled rectangle.
    pub fn rectangle(
        &mut self,
        (left, top): (f64, f64),
        (right, bottom): (f64, f64),
        colour: RGBColor,
    ) -> Result<(), DrawError> {
        let corners = [(left, top), (right, bottom)].map(|(x, y)| (fine(x), fine(y)));
        self.backend.draw_rect(corners[0], corners[1], &colour, true).map_err(DrawError::new)
    }

    /// A filled polygon.
    pub fn polygon(&mut self, corners: &[(f64, f64)], colour: RGBColor) -> Result<(), DrawError> {
        let corners = corners.iter().map(|(x, y)| (fine(*x), fine(*y)));
        self.backend.fill_polygon(corners, &colour).map_err(DrawError::new)
    }

    /// A marker of about `size` pixels across: one circle or polygon.
    pub fn marker(&mut self, marker: Marker, (x, y): (f64, f64), size: f64, colour: RGBColor) -> Result<(), DrawError> {
        let r = 0.5 * size;
        let corners: &[(f64, f64)] = match marker {
            Marker::Disc => {
                let (at, radius) = ((fine(x), fine(y)), fine(r) as u32);
                let drawn = self.backend.draw_circle(at, radius, &colour.filled(), true);
                return drawn.map_err(DrawError::new);
            }
            Marker::Square => &[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)],
            Marker::Triangle => &[(0.0, -1.2), (1.1, 0.8), (-1.1, 0.8)],
            Marker::Diamond => &[(0.0, -1.25), (1.25, 0.0), (0.0, 1.25), (-1.25, 0.0)],
            Marker::Wedge => &[(0.0, 1.2), (1.1, -0.8), (-1.1, -0.8)],
            Marker::Cross => &[
                (-0.4, -1.2),
                (0.4, -1.2),
                (0.4, -0.4),
                (1.2, -0.4),
                (1.2, 0.4),
                (0.4, 0.4),
                (0.4, 1.2),
                (-0.4, 1.2),
                (-0.4, 0.4),
                (-1.2, 0.4),
                (-1.2, -0.4),
                (-0.4, -0.4),
            ],
        };
        let corner = |(dx, dy): &(f64, f64)| (x + r * dx, y + r * dy);
        let corners: Vec<_> = corners.iter().map(corner).collect();
        self.polygon(&corners, colour)
    }

    /// A line of text whose baseline passes through the point, at an em of `em` pixels.
    pub fn text(
        &mut self,
        line: &str,
        (x, y): (f64, f64),
        em: f64,
        align: Align,
        colour: RGBColor,
    ) -> Result<(), DrawError> {
        if self.text_by == TextBy::Browser {
            return self.browser_text(line, (x, y), em, align, colour);
        }
        let back = font::width(line, em)
            * match align {
                Align::Left => 0.0,
                Align::Center | Align::Upwards => 0.5,
                Align::Right => 1.0,
            };
        let mut along = -back;
        for run in font::runs(line) {
            // plotters puts the baseline of a text anchored at its top half a font height below the anchor.
            let height = em * run.size * font::HEIGHT;
            let down = -0.5 * height - em * run.rise;
            let (at, turn) = match align {
                Align::Upwards => ((x + down, y - along), FontTransform::Rotate270),
                _ => ((x + along, y + down), FontTransform::None),
            };
            let font = font::font(height * f64::from(FINENESS)).transform(turn);
            let style = TextStyle::from(font).color(&colour);
            let drawn = self.backend.draw_text(&run.text, &style, (fine(at.0), fine(at.1)));
            drawn.map_err(DrawError::new)?;
            along += run.width(em);
        }
        Ok(())
    }

    /// SVG text: plotters gives it an em of size/1.24 and, anchored at the top, a baseline 0.76 em below.
    fn browser_text(
        &mut self,
        line: &str,
        (x, y): (f64, f64),
        em: f64,
        align: Align,
        colour: RGBColor,
    ) -> Result<(), DrawError> {
        let anchor = match align {
            Align::Left => HPos::Left,
            Align::Center | Align::Upwards => HPos::Center,
            Align::Right => HPos::Right,
        };
        let (at, turn) = match align {
            Align::Upwards => ((x - 0.76 * em, y), FontTransform::Rotate270),
            _ => ((x, y - 0.76 * em), FontTransform::None),
        };
        let font = font::font(1.24 * em * f64::from(FINENESS));
        let style = TextStyle::from(font.transform(turn)).color(&colour).pos(Pos::new(anchor, VPos::Top));
        let drawn = self.backend.draw_text(line, &style, (fine(at.0), fine(at.1)));
        drawn.map_err(DrawError::new)
    }
}

/// A colour of the viridis scale, from 0 (dark blue) to 1 (yellow).
pub(crate) fn viridis(share: f64) -> Colour {
    ViridisRGB::get_color(share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pictures::Bitmap;
    use crate::plot::drawing::{draw_bitmap, draw_svg};

    const INK: RGBColor = RGBColor(0, 0, 0);

    /// The box of everything that is not white: left, top, right, bottom.
    fn inked(page: &Bitmap) -> [usize; 4] {
        let mut found = [usize::MAX, usize::MAX, 0, 0];
        for (i, pixel) in page.bytes.chunks_exact(3).enumerate() {
            if pixel != [255; 3] {
                let (x, y) = (i % page.width, i / page.width);
                found = [found[0].min(x), found[1].min(y), found[2].max(x), found[3].max(y)];
            }
        }
        found
    }

    #[test]
    fn text_stands_on_its_baseline_and_ends_where_told() {
        let page = draw_bitmap((200, 100), |canvas| canvas.text("HEH", (150.0, 60.0), 20.0, Align::Right, INK));
        let [left, top, right, bottom] = inked(&page.unwrap());
        // Capitals are 0.69 em high; one pixel of anti-aliasing and side bearings of up to 0.1 em.
        assert!((59..=60).contains(&bottom), "{bottom}");
        assert!((45..=47).contains(&top), "{top}");
        assert!((146..=150).contains(&right), "{right}");
        let width = font::width("HEH", 20.0);
        assert!((left as f64 - (150.0 - width)).abs() <= 3.0, "{left} {width}");
    }

    #[test]
    fn upward_text_is_centred_beside_its_baseline() {
        let page = draw_bitmap((100, 200), |canvas| canvas.text("HEH", (60.0, 100.0), 20.0, Align::Upwards, INK));
        let [left, top, right, bottom] = inked(&page.unwrap());
        assert!((45..=47).contains(&left), "{left}");
        assert!((59..=60).contains(&right), "{right}");
        let middle = 0.5 * (top + bottom + 1) as f64;
        assert!((middle - 100.0).abs() <= 2.0, "{middle}");
    }

    #[test]
    fn dashes_cover_half_of_a_bent_line() {
        let corner = [(10.0, 10.0), (10.0, 83.0), (90.0, 83.0)];
        let svg = draw_svg((100, 100), |canvas| canvas.dashed(&corner, INK, 1.0, 5.0)).unwrap();
        // 153 pixels are 15.3 periods; the dash that turns the corner counts twice.
        assert_eq!(svg.matches("<polyline").count(), 16 + 1);
    }
}
