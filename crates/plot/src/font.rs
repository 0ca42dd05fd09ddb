//! The font of charts and sheets, carried in the binary, so that no machine needs to have any: Ubuntu Light.
//!
//! Sizes are the em in pixels. Bitmaps are drawn with it; SVG names the family list [`FAMILY`], whose last entry every
//! browser has, and is laid out by its metrics. The font lacks ⁿ and ⁻, which bitmaps show as a small raised n and −.
//! Not handled: kerning, bold and italic, scripts beyond Latin, Greek and Cyrillic (a box is drawn instead).

use std::fmt::Write as _;
use std::sync::LazyLock;

use epaint_default_fonts::UBUNTU_LIGHT;
use ttf_parser::{Face, GlyphId, OutlineBuilder};

/// The family as SVG names it: the embedded font where the reader has it, else a sans serif one.
pub const FAMILY: &str = "Ubuntu, Helvetica, Arial, sans-serif";

static FACE: LazyLock<Face> = LazyLock::new(|| Face::parse(UBUNTU_LIGHT, 0).expect("a font, compiled in"));

/// A sign as it is drawn.
struct Glyph {
    id: GlyphId,
    /// Ems of the line over the font's units.
    scale: f64,
    /// How far its baseline is raised, in ems of the line.
    rise: f64,
}

impl Glyph {
    /// The glyph of a sign; missing ones have the box that the font holds for them.
    fn of(sign: char) -> Glyph {
        let (shown, size, rise) = match sign {
            'ⁿ' => ('n', 0.66, 0.36),
            '⁻' => ('−', 0.6, 0.3),
            other => (other, 1.0, 0.0),
        };
        let scale = size / f64::from(FACE.units_per_em());
        Glyph { id: FACE.glyph_index(shown).unwrap_or_default(), scale, rise }
    }

    /// How far it moves the next glyph on, in ems of the line.
    fn advance(&self) -> f64 {
        f64::from(FACE.glyph_hor_advance(self.id).unwrap_or(0)) * self.scale
    }
}

/// Writes outlines as SVG path data.
struct Pen<F> {
    path: String,
    place: F,
}

impl<F: Fn(f64, f64) -> (f64, f64)> Pen<F> {
    fn add(&mut self, command: char, points: &[(f32, f32)]) {
        self.path.push(command);
        for (x, y) in points {
            let (x, y) = (self.place)(f64::from(*x), f64::from(*y));
            let _ = write!(self.path, "{x:.2} {y:.2} ");
        }
    }
}

impl<F: Fn(f64, f64) -> (f64, f64)> OutlineBuilder for Pen<F> {
    fn move_to(&mut self, x: f32, y: f32) {
        self.add('M', &[(x, y)]);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.add('L', &[(x, y)]);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.add('Q', &[(x1, y1), (x, y)]);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.add('C', &[(x1, y1), (x2, y2), (x, y)]);
    }

    fn close(&mut self) {
        self.path.push('Z');
    }
}

/// The outline of a line of text as SVG path data: `place` gives the page's point for pixels along the baseline and
/// above it.
pub fn outline(line: &str, em: f64, place: impl Fn(f64, f64) -> (f64, f64)) -> String {
    let (mut path, mut along) = (String::new(), 0.0);
    for glyph in line.chars().map(Glyph::of) {
        let scaled = |x: f64, y: f64| place(em * (along + x * glyph.scale), em * (glyph.rise + y * glyph.scale));
        let mut pen = Pen { path, place: scaled };
        FACE.outline_glyph(glyph.id, &mut pen);
        path = pen.path;
        along += glyph.advance();
    }
    path
}

/// Width of a line of text, pixels.
pub fn width(line: &str, em: f64) -> f64 {
    em * line.chars().map(|sign| Glyph::of(sign).advance()).sum::<f64>()
}

/// Breaks text at spaces into lines at most `limit` pixels wide; a single word may be wider.
pub fn wrap(text: &str, em: f64, limit: f64) -> Vec<String> {
    broken(text, |line| width(line, em) <= limit)
}

/// Breaks text at spaces into lines, each as long as it fits; a word that does not fit has a line of its own.
pub fn broken(text: &str, fits: impl Fn(&str) -> bool) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        let longer = lines.last().map(|line| format!("{line} {word}"));
        match (longer, lines.last_mut()) {
            (Some(longer), Some(last)) if fits(&longer) => *last = longer,
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sign_the_charts_use_is_in_the_font() {
        for sign in "AZaz09⁰¹²³⁴⁵⁶⁷⁸⁹⁻ⁿ×≥≤ρατλΣ·/(),–≈∞°√−".chars() {
            assert_ne!(Glyph::of(sign).id, GlyphId(0), "{sign}");
            assert!(!outline(&sign.to_string(), 20.0, |x, y| (x, y)).is_empty(), "{sign}");
        }
    }

    #[test]
    fn raised_signs_are_small() {
        assert!(width("Kⁿ", 20.0) < width("Kn", 20.0) && width("Kⁿ", 20.0) > width("K", 20.0));
    }

    #[test]
    fn lines_keep_to_the_limit_and_lose_no_word() {
        let text = "diverges: spectral radius at least 1.05 by Collatz and Wielandt";
        let lines = wrap(text, 20.0, 150.0);
        assert!(lines.len() > 2);
        assert!(lines.iter().all(|line| width(line, 20.0) <= 150.0));
        assert_eq!(lines.join(" "), text);
        assert_eq!(wrap("unbreakable", 20.0, 1.0), ["unbreakable"]);
        assert!(wrap("", 20.0, 100.0).is_empty());
    }
}
