//! The font of charts and sheets, carried in the binary, so that no machine needs to have any: Ubuntu Light.
//!
//! Sizes are the em in pixels. Bitmaps are drawn with it; SVG names the family list [`FAMILY`], whose last entry every
//! browser has, and is laid out by its metrics. The font lacks ⁿ and ⁻, which bitmaps show as a small raised n and −.
//! Not handled: bold and italic, scripts beyond Latin, Greek and Cyrillic (a box is drawn instead).

use std::sync::Once;

use epaint_default_fonts::UBUNTU_LIGHT;
use plotters::style::{FontDesc, FontFamily, FontStyle, register_font};

/// The family as SVG names it: the embedded font where the reader has it, else a sans serif one.
pub const FAMILY: &str = "Ubuntu, Helvetica, Arial, sans-serif";

/// Height from ascender to descender over the em (the font's `hhea` table): plotters gives sizes in this height.
pub const HEIGHT: f64 = (932.0 + 189.0) / 1000.0;

/// A piece of a line that is drawn in one go.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// What is drawn.
    pub text: String,
    /// Its em over the line's.
    pub size: f64,
    /// How far its baseline is raised, in ems of the line.
    pub rise: f64,
}

impl Run {
    /// Width in pixels at an em of `em` pixels. Measured large, because plotters rounds to whole pixels.
    pub fn width(&self, em: f64) -> f64 {
        const MEASURED_AT: f64 = 1000.0;
        let box_size = font(MEASURED_AT * HEIGHT).box_size(&self.text);
        box_size.map_or(0.0, |(wide, _)| f64::from(wide) * self.size * em / MEASURED_AT)
    }
}

/// The font at `size` in plotters' unit, [`HEIGHT`] ems.
pub fn font(size: f64) -> FontDesc<'static> {
    static REGISTERED: Once = Once::new();
    REGISTERED.call_once(|| {
        // The bytes are compiled in and parse, or the tests below fail.
        let _ = register_font(FAMILY, FontStyle::Normal, UBUNTU_LIGHT);
    });
    FontDesc::new(FontFamily::Name(FAMILY), size, FontStyle::Normal)
}

/// The line cut into pieces, with stand-ins for the raised signs that the font lacks.
pub fn runs(line: &str) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for sign in line.chars() {
        let (shown, size, rise) = match sign {
            'ⁿ' => ('n', 0.66, 0.36),
            '⁻' => ('−', 0.6, 0.3),
            other => (other, 1.0, 0.0),
        };
        match runs.last_mut() {
            Some(last) if last.size == size => last.text.push(shown),
            _ => runs.push(Run { text: shown.to_string(), size, rise }),
        }
    }
    runs
}

/// Width of a line of text, pixels.
pub fn width(line: &str, em: f64) -> f64 {
    runs(line).iter().map(|run| run.width(em)).sum()
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

    fn ink(sign: char) -> Vec<(i32, i32, u32)> {
        let mut dots = Vec::new();
        let drawn = font(40.0).draw(&sign.to_string(), (0, 0), |x, y, cover| {
            dots.push((x, y, cover.to_bits()));
            Ok::<(), ()>(())
        });
        drawn.unwrap().unwrap();
        dots
    }

    #[test]
    fn every_sign_the_charts_use_is_in_the_font() {
        // The private use area holds no sign: this is the box drawn for a missing one.
        let missing = ink('\u{E123}');
        for run in runs("AZaz09⁰¹²³⁴⁵⁶⁷⁸⁹⁻ⁿ×≥≤ρατλΣ·/(),–≈∞°√−") {
            for sign in run.text.chars() {
                let drawn = ink(sign);
                assert!(!drawn.is_empty() && drawn != missing, "{sign}");
            }
        }
    }

    #[test]
    fn raised_signs_become_small_pieces() {
        let pieces = runs("KⁿE, 10⁻³");
        let texts: Vec<&str> = pieces.iter().map(|run| run.text.as_str()).collect();
        assert_eq!(texts, ["K", "n", "E, 10", "−", "³"]);
        assert!(pieces[1].rise > 0.0 && pieces[1].size < 1.0);
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
