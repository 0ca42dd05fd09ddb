//! Filled paths, lines and text: each as an element of an SVG document, and filled into a bitmap.
//!
//! A bitmap's pixel takes the share of the colour that the shape covers of it, on sRGB codes, as is conventional for
//! line art. Text is `<text>` in a document, set by the reader's program, and the embedded font's outlines in a bitmap.
//! Not handled: transparency, gradients, clipping.

use std::fmt::Write as _;

use glam::DVec2;
use zeno::{Join, Mask, Placement, Stroke};

use crate::pictures::Bitmap;
use crate::plot::font;

/// sRGB codes.
pub type Colour = [u8; 3];

pub const PAPER: Colour = [255; 3];
pub const INK: Colour = [34; 3];
pub const FAINT_INK: Colour = [88; 3];

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

/// What a drawing consists of; paths are SVG path data.
#[derive(Clone, Debug)]
pub enum Shape {
    /// The inside of a path.
    Fill { path: String },
    /// A path of some width; dashes and gaps of length `dash`, or neither where it is 0.
    Line { path: String, width: f64, dash: f64 },
    /// A line of text.
    Text { line: String, at: DVec2, em: f64, align: Align },
}

impl Marker {
    /// Its outline about a point as SVG path data, for a radius of about `r`.
    pub fn path(self, at: DVec2, r: f64) -> String {
        let DVec2 { x, y } = at;
        if self == Marker::Disc {
            let arc = |end: f64| format!("A{r} {r} 0 0 1 {end:.2} {y:.2}");
            return format!("M{:.2} {y:.2}{}{}Z", x - r, arc(x + r), arc(x - r));
        }
        let corners: Vec<_> = self.corners().iter().map(|(dx, dy)| DVec2::new(x + r * dx, y + r * dy)).collect();
        joined(&corners) + "Z"
    }

    /// Its corners about (0, 0) for a marker about 2 across; a disc has none.
    fn corners(self) -> &'static [(f64, f64)] {
        match self {
            Marker::Disc => &[],
            Marker::Square => &[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)],
            Marker::Triangle => &[(0.0, -1.2), (1.1, 0.8), (-1.1, 0.8)],
            Marker::Diamond => &[(0.0, -1.25), (1.25, 0.0), (0.0, 1.25), (-1.25, 0.0)],
            Marker::Wedge => &[(0.0, 1.2), (1.1, -0.8), (-1.1, -0.8)],
            #[rustfmt::skip]
            Marker::Cross => &[
                (-0.4, -1.2), (0.4, -1.2), (0.4, -0.4), (1.2, -0.4), (1.2, 0.4), (0.4, 0.4),
                (0.4, 1.2), (-0.4, 1.2), (-0.4, 0.4), (-1.2, 0.4), (-1.2, -0.4), (-0.4, -0.4),
            ],
        }
    }
}

impl Shape {
    /// Its element of an SVG document.
    pub fn element(&self, colour: &str) -> String {
        match self {
            Shape::Fill { path } => format!("<path d=\"{path}\" fill=\"{colour}\"/>"),
            Shape::Line { path, width, dash } => {
                let dash = if *dash > 0.0 { format!(" stroke-dasharray=\"{dash}\"") } else { String::new() };
                format!("<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\"{dash}/>")
            }
            Shape::Text { line, at: DVec2 { x, y }, em, align } => {
                let line = line.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
                let (anchor, turn) = match align {
                    Align::Left => ("start", String::new()),
                    Align::Center => ("middle", String::new()),
                    Align::Right => ("end", String::new()),
                    Align::Upwards => ("middle", format!(" transform=\"rotate(-90 {x:.2} {y:.2})\"")),
                };
                format!(
                    "<text x=\"{x:.2}\" y=\"{y:.2}\" font-size=\"{em}\" text-anchor=\"{anchor}\" \
                     fill=\"{colour}\"{turn}>{line}</text>"
                )
            }
        }
    }

    /// Mixes the colour into the pixels by how much of each the shape covers.
    pub fn fill(&self, page: &mut Bitmap, colour: Colour) {
        let (cover, place) = self.cover();
        let (wide, high) = (page.width as i32, page.height as i32);
        for (row, y) in cover.chunks_exact(place.width.max(1) as usize).zip(place.top..high) {
            for (&share, x) in row.iter().zip(place.left..wide) {
                if share > 0 && x >= 0 && y >= 0 {
                    let first = 3 * (y as usize * page.width + x as usize);
                    mix(&mut page.bytes[first..first + 3], colour, share);
                }
            }
        }
    }

    /// How much of each pixel it covers, of 255, and where these pixels are.
    fn cover(&self) -> (Vec<u8>, Placement) {
        match self {
            Shape::Fill { path } => Mask::new(path.as_str()).render(),
            Shape::Line { path, width, dash } => {
                let dashes = [*dash as f32; 2];
                let dashes = if *dash > 0.0 { &dashes[..] } else { &[] };
                let mut stroke = Stroke::new(*width as f32);
                stroke.join(Join::Round).dash(dashes, 0.0);
                Mask::new(path.as_str()).style(stroke).render()
            }
            Shape::Text { line, at: DVec2 { x, y }, em, align } => {
                let back = font::width(line, *em)
                    * match align {
                        Align::Left => 0.0,
                        Align::Center | Align::Upwards => 0.5,
                        Align::Right => 1.0,
                    };
                let path = font::outline(line, *em, |along, up| match align {
                    Align::Upwards => (x - up, y + back - along),
                    _ => (x - back + along, y - up),
                });
                Mask::new(path.as_str()).render()
            }
        }
    }
}

/// Moves codes towards a colour by share/255.
fn mix(codes: &mut [u8], colour: Colour, share: u8) {
    for (code, own) in codes.iter_mut().zip(colour) {
        let sum = u32::from(*code) * u32::from(255 - share) + u32::from(own) * u32::from(share);
        *code = ((sum + 127) / 255) as u8;
    }
}

/// Path data of straight lines from point to point.
pub fn joined(points: &[DVec2]) -> String {
    let mut path = String::new();
    for DVec2 { x, y } in points {
        let _ = write!(path, "{}{x:.2} {y:.2}", if path.is_empty() { 'M' } else { 'L' });
    }
    path
}

/// The colour as SVG names it.
pub fn hex([red, green, blue]: Colour) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}
