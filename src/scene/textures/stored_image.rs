//! An image as a texture needs it: eight-bit texels, decoded to linear light when they are read, and the means of its
//! squares for patches that many texels lie on.
//!
//! Colours are sRGB codes (IEC 61966-2-1) decoded by a table of 256 entries; single channels are shares, code / 255.
//! Means take 6 % of the texels' memory in addition.
//!
//! Not handled: interpolation between texels and what lies beyond the image's edge
//! ([`crate::scene::textures::texture`]).

use std::fmt;
use std::sync::LazyLock;

use glam::Vec3;
use rayon::prelude::*;

use crate::pictures::{Size, Texels, decode_srgb};

/// Texels to a side of the smallest squares that means are kept of.
const SQUARE: usize = 8;
/// Squares to a side of the next larger ones.
const LARGER: usize = 4;

/// Linear light of each sRGB code.
static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|code| decode_srgb(code as f32 / 255.0)));

/// A decoded image.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
#[serde(from = "Texels", into = "Texels")]
pub struct Image {
    texels: Texels,
    /// Means over squares, the smallest first; the last one is the mean of all.
    means: Vec<Cells>,
}

/// Mean colours over the cells of an even grid, row by row.
#[derive(Clone)]
pub(crate) struct Cells {
    pub width: usize,
    pub height: usize,
    colours: Vec<Vec3>,
}

/// Which number of a texel is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Channel {
    /// Red, green or blue by number; of a grey image its grey.
    Colour(usize),
    /// Alpha; 1 where the image has none.
    Alpha,
    /// The mean of red, green and blue as coded.
    Luminance,
}

impl From<Texels> for Image {
    fn from(texels: Texels) -> Image {
        Image::new(texels)
    }
}

impl From<Image> for Texels {
    fn from(image: Image) -> Texels {
        image.texels
    }
}

impl Image {
    /// Takes the texels and finds the means.
    pub fn new(texels: Texels) -> Image {
        let mut image = Image { texels, means: Vec::new() };
        let (mut width, mut height, mut factor) = (image.width(), image.height(), SQUARE);
        while width * height > 1 {
            (width, height) = (width.div_ceil(factor), height.div_ceil(factor));
            let size = Size { width, height };
            let cells = match image.means.last() {
                Some(finer) => shrunk(|x, y| finer.at(x, y), (finer.width, finer.height).into(), size),
                None => shrunk(|x, y| image.colour(x, y), (image.width(), image.height()).into(), size),
            };
            image.means.push(cells);
            factor = LARGER;
        }
        image
    }

    /// The texels as they are coded.
    pub fn texels(&self) -> &Texels {
        &self.texels
    }

    /// Texels in a row.
    pub fn width(&self) -> usize {
        self.texels.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.texels.height
    }

    /// Linear RGB of the texel in column x and row y, from the top left.
    ///
    /// # Panics
    /// If there is no such texel.
    #[inline]
    pub fn colour(&self, x: usize, y: usize) -> Vec3 {
        let Texels { width, channels, codes, .. } = &self.texels;
        let first = (y * width + x) * channels;
        let linear = |k: usize| LINEAR[codes[first + k] as usize];
        if *channels < 3 { Vec3::splat(linear(0)) } else { Vec3::new(linear(0), linear(1), linear(2)) }
    }

    /// One channel of a texel as a share of 1, not decoded.
    ///
    /// # Panics
    /// If there is no such texel.
    #[inline]
    pub fn share(&self, x: usize, y: usize, channel: Channel) -> f32 {
        let Texels { width, channels, codes, .. } = &self.texels;
        let first = (y * width + x) * channels;
        let code = |k: usize| f32::from(codes[first + k]) / 255.0;
        match channel {
            Channel::Alpha if self.has_alpha() => code(channels - 1),
            Channel::Alpha => 1.0,
            _ if *channels < 3 => code(0),
            Channel::Colour(k) => code(k.min(2)),
            Channel::Luminance => (code(0) + code(1) + code(2)) / 3.0,
        }
    }

    /// Whether it has an alpha channel.
    pub fn has_alpha(&self) -> bool {
        self.texels.channels.is_multiple_of(2)
    }

    /// The least share of a channel over all texels.
    pub(crate) fn least(&self, channel: Channel) -> f32 {
        let all = (0..self.width() * self.height()).map(|k| (k % self.width(), k / self.width()));
        all.map(|(x, y)| self.share(x, y, channel)).fold(f32::INFINITY, f32::min)
    }

    /// Whether all texels are the same.
    pub fn is_even(&self) -> bool {
        let Texels { channels, codes, .. } = &self.texels;
        codes.chunks_exact(*channels).all(|texel| texel == &codes[..*channels])
    }

    /// The mean colour of all texels.
    pub fn mean(&self) -> Vec3 {
        self.means.last().map_or_else(|| self.colour(0, 0), |cells| cells.at(0, 0))
    }

    /// Means over squares, from the smallest squares to the largest.
    pub(crate) fn means(&self) -> &[Cells] {
        &self.means
    }
}

impl Cells {
    /// The mean of the cell in column x and row y.
    #[inline]
    pub(crate) fn at(&self, x: usize, y: usize) -> Vec3 {
        self.colours[y * self.width + x]
    }
}

/// Area means of a grid over the cells of a coarser one, which need not be made of whole cells of the finer.
fn shrunk(
    finer: impl Fn(usize, usize) -> Vec3 + Sync,
    Size { width: columns, height: rows }: Size,
    Size { width, height }: Size,
) -> Cells {
    let across: Vec<Vec<(usize, f32)>> = (0..width).map(|x| shares(x, width, columns)).collect();
    let row = |y: usize| {
        let down = shares(y, height, rows);
        let cell = |own: &Vec<(usize, f32)>| -> Vec3 {
            let line = |&(j, down): &(usize, f32)| down * own.iter().map(|&(i, a)| a * finer(i, j)).sum::<Vec3>();
            down.iter().map(line).sum()
        };
        across.iter().map(cell).collect::<Vec<Vec3>>()
    };
    let colours = (0..height).into_par_iter().flat_map_iter(row).collect();
    Cells { width, height, colours }
}

/// The finer cells along one axis that cell k of n lies on, of `finer` in all, and the share of the cell on each.
fn shares(k: usize, n: usize, finer: usize) -> Vec<(usize, f32)> {
    let (low, high) = (k as f64 * finer as f64 / n as f64, (k + 1) as f64 * finer as f64 / n as f64);
    let cells = low.floor() as usize..(high.ceil() as usize).min(finer);
    let within = |i: usize| ((i as f64 + 1.0).min(high) - (i as f64).max(low)) / (high - low);
    cells.map(|i| (i, within(i) as f32)).filter(|(_, share)| *share > 0.0).collect()
}

impl PartialEq for Image {
    fn eq(&self, other: &Image) -> bool {
        self.texels == other.texels
    }
}

impl fmt::Debug for Image {
    /// Size and a number that distinguishes the texels from others (FNV-1a): what is kept of a scene is known by it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mix = |hash: u64, &code: &u8| (hash ^ u64::from(code)).wrapping_mul(0x0100_0000_01b3);
        let hash = self.texels.codes.iter().fold(0xcbf2_9ce4_8422_2325, mix);
        write!(f, "Image {}x{}x{} {hash:016x}", self.width(), self.height(), self.texels.channels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(width: usize, height: usize, code: impl Fn(usize, usize) -> u8) -> Image {
        let codes = (0..width * height).map(|k| code(k % width, k / width)).collect();
        Image::new(Texels { width, height, channels: 1, codes })
    }

    #[test]
    fn codes_are_decoded_by_the_srgb_curve() {
        let image = grey(3, 1, |x, _| [0, 188, 255][x]);
        assert_eq!((image.colour(0, 0).x, image.colour(2, 0).x), (0.0, 1.0));
        // ((188/255 + 0.055)/1.055)^2.4.
        assert!((image.colour(1, 0).x - 0.502_886_5).abs() < 1e-6);
        assert_eq!(image.share(1, 0, Channel::Luminance), 188.0 / 255.0);
        assert_eq!(image.share(1, 0, Channel::Alpha), 1.0);
    }

    #[test]
    fn means_of_squares_add_up_to_that_of_all_texels_whatever_the_size() {
        for (width, height) in [(1, 1), (8, 8), (37, 13), (300, 2), (5, 641)] {
            let image = grey(width, height, |x, y| (x * 31 + y * 17) as u8);
            let texels = (0..width * height).map(|k| f64::from(image.colour(k % width, k / width).x));
            let mean = texels.sum::<f64>() / (width * height) as f64;
            // A few thousand roundings of f32.
            assert!((f64::from(image.mean().x) - mean).abs() < 1e-4 * mean.max(1e-3), "{width}x{height}");
        }
    }
}
