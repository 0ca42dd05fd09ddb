//! From radiance to what a screen shows: exposure in stops, a clamp, and the sRGB curve in eight bits.
//!
//! ```text
//! v = clamp(2^stops * radiance, 0, 1)
//! code = round(255 * (12.92 v                    where v <= 0.0031308
//!                     1.055 v^(1/2.4) - 0.055    elsewhere))
//! ```
//!
//! NaN becomes 0. Not handled: dithering, tone curves, other colour spaces.
//! Source: IEC 61966-2-1:1999.

use glam::DVec3;

use crate::light::Rgb;
use crate::pictures::picture::Picture;

/// Brightness of a shown picture, in photographic stops: radiance is multiplied by `2^stops`.
///
/// At 0 stops a radiance of 1 W/(m² sr) is white; each stop more doubles every value.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Exposure {
    /// Any real number, 0 for none.
    pub stops: f32,
}

/// CIE Y of linear sRGB (IEC 61966-2-1).
pub const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// Share of the pixels that show light which are no brighter than [`LIGHT`] at the exposure of a picture.
const SHARE: f64 = 0.9;
/// A luminance of which 1 is white: light, and not yet white.
const LIGHT: f64 = 0.5;

impl Exposure {
    /// The exposure that a picture is shown well at, `log2(LIGHT / Y)`: Y is the luminance, CIE Y of linear sRGB, that
    /// nine in ten of the pixels that show any light do not exceed. So lamps in view are white, and their strength and
    /// the unit of light change nothing. None where all is dark.
    pub fn of(picture: &Picture) -> Option<Exposure> {
        let luminance = |pixel: &Rgb| pixel.as_dvec3().dot(DVec3::from(LUMINANCE));
        let mut lit: Vec<f64> = picture.pixels.iter().map(luminance).filter(|y| *y > 0.0 && y.is_finite()).collect();
        lit.sort_by(f64::total_cmp);
        let rank = (SHARE * lit.len() as f64).ceil() as usize;
        let typical = lit.get(rank.checked_sub(1)?)?;
        Some(Exposure { stops: (LIGHT / typical).log2() as f32 })
    }

    /// The factor `2^stops`.
    pub fn factor(self) -> f32 {
        self.stops.exp2()
    }
}

/// Eight-bit sRGB pixels, three bytes each, row by row from the top left: what a PNG file holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bitmap {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `3 * width * height` codes.
    pub bytes: Vec<u8>,
}

impl Bitmap {
    /// A bitmap of one sRGB colour.
    pub fn filled(width: usize, height: usize, colour: [u8; 3]) -> Self {
        Bitmap { width, height, bytes: colour.repeat(width * height) }
    }

    /// The sRGB codes of a picture at an exposure.
    pub fn from_picture(picture: &Picture, exposure: Exposure) -> Self {
        let codes = |&pixel: &Rgb| (pixel * exposure.factor()).to_array().map(code);
        Bitmap { width: picture.width, height: picture.height, bytes: picture.pixels.iter().flat_map(codes).collect() }
    }

    /// The codes of column x in row y, where both are inside.
    pub fn get(&self, x: usize, y: usize) -> Option<[u8; 3]> {
        let first = 3 * (y * self.width + x);
        let inside = x < self.width && y < self.height;
        inside.then(|| [0, 1, 2].map(|channel| self.bytes[first + channel]))
    }

    /// Copies `other` to (left, top); what sticks out is cut off.
    pub fn paste(&mut self, other: &Bitmap, left: usize, top: usize) {
        let wide = other.width.min(self.width.saturating_sub(left));
        let high = other.height.min(self.height.saturating_sub(top));
        for row in 0..high {
            let from = 3 * row * other.width;
            let to = 3 * ((top + row) * self.width + left);
            self.bytes[to..to + 3 * wide].copy_from_slice(&other.bytes[from..from + 3 * wide]);
        }
    }
}

/// The sRGB signal of a linear value, both in 0..=1.
pub fn encode_srgb(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// The linear value of an sRGB signal, both in 0..=1.
pub fn decode_srgb(signal: f32) -> f32 {
    if signal <= 0.040_45 { signal / 12.92 } else { ((signal + 0.055) / 1.055).powf(2.4) }
}

/// The eight-bit code of a linear value; the cast takes NaN to 0.
fn code(linear: f32) -> u8 {
    (255.0 * encode_srgb(linear.clamp(0.0, 1.0))).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn code_at(linear: f32, stops: f32) -> u8 {
        let picture = Picture::filled(1, 1, Rgb::splat(linear));
        Bitmap::from_picture(&picture, Exposure { stops }).bytes[0]
    }

    #[test]
    fn a_picture_is_exposed_by_what_most_of_it_shows() {
        let shown = |scale: f32| {
            let mut picture = Picture::filled(10, 10, Rgb::splat(0.2 * scale));
            // A lamp in view, and what is dark.
            picture.pixels[..5].fill(Rgb::splat(100.0 * scale));
            picture.pixels[50..].fill(Rgb::ZERO);
            let exposure = Exposure::of(&picture).expect("some light");
            Bitmap::from_picture(&picture, exposure).bytes
        };
        let plain = shown(1.0);
        // 0.5 where the walls are: 188.
        assert_eq!([plain[0], plain[3 * 20], plain[3 * 60]], [255, 188, 0]);
        assert!([0.01, 60.0].iter().all(|&scale| shown(scale) == plain));
        assert_eq!(Exposure::of(&Picture::filled(2, 2, Rgb::ZERO)), None);
    }

    #[test]
    fn codes_are_those_of_the_standard() {
        // 255 (1.055 0.5^(1/2.4) - 0.055) = 187.52; 255 * 12.92 * 0.002 = 6.59; 0.18 gives 117.6 (middle grey).
        let expected = [(0.0, 0), (1.0, 255), (0.5, 188), (0.002, 7), (0.18, 118)];
        for (linear, code) in expected {
            assert_eq!(code_at(linear, 0.0), code, "{linear}");
        }
    }

    #[test]
    fn every_code_comes_back() {
        for code in 0..=255_u8 {
            assert_eq!(code_at(decode_srgb(f32::from(code) / 255.0), 0.0), code);
        }
    }

    #[test]
    fn a_stop_doubles_and_the_ends_clamp() {
        assert_eq!(code_at(0.25, 1.0), code_at(0.5, 0.0));
        assert_eq!(code_at(4.0, -3.0), code_at(0.5, 0.0));
        assert_eq!(code_at(7.0, 0.0), 255);
        assert_eq!(code_at(-1.0, 0.0), 0);
        assert_eq!(code_at(f32::NAN, 0.0), 0);
    }

    #[test]
    fn pasting_cuts_what_sticks_out() {
        let mut page = Bitmap::filled(3, 2, [1, 1, 1]);
        page.paste(&Bitmap::filled(2, 2, [9, 8, 7]), 2, 1);
        assert_eq!(page.get(2, 1), Some([9, 8, 7]));
        assert_eq!(page.bytes.iter().filter(|&&b| b != 1).count(), 3);
        page.paste(&Bitmap::filled(1, 1, [0, 0, 0]), 5, 5);
        assert_eq!(page.get(3, 0), None);
    }
}
