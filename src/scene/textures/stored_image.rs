//! An image as a texture needs it: eight-bit texels, decoded when they are read, and the means of its squares for
//! patches that many texels lie on.
//!
//! Codes of colours are sRGB's (IEC 61966-2-1), decoded to linear light by a table of 256 entries; an image of shares,
//! made of one channel of another, has code / 255. Means take 6 % of the texels' memory in addition.
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

/// Share that each code stands for.
static SHARE: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|code| code as f32 / 255.0));

/// A decoded image.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
#[serde(from = "(Texels, Coding)", into = "(Texels, Coding)")]
pub struct Image {
    texels: Texels,
    coding: Coding,
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

/// What the codes of an image stand for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Coding {
    /// Linear light by the sRGB curve.
    Srgb,
    /// Shares of 1.
    Share,
}

/// Which number of a texel is a share.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Channel {
    /// Red, green or blue by number; of a grey image its grey.
    Colour(usize),
    /// Alpha; 1 where the image has none.
    Alpha,
    /// The mean of red, green and blue as coded.
    Luminance,
}

impl From<(Texels, Coding)> for Image {
    fn from((texels, coding): (Texels, Coding)) -> Image {
        Image::coded(texels, coding)
    }
}

impl From<Image> for (Texels, Coding) {
    fn from(image: Image) -> (Texels, Coding) {
        (image.texels, image.coding)
    }
}

impl Image {
    /// An image of colours.
    pub fn new(texels: Texels) -> Image {
        Image::coded(texels, Coding::Srgb)
    }

    /// The image of the shares that one channel of some texels gives.
    pub fn shares(of: &Texels, channel: Channel) -> Image {
        let codes = of.codes.chunks_exact(of.channels).map(|texel| share_code(texel, channel)).collect();
        Image::coded(Texels { width: of.width, height: of.height, channels: 1, codes }, Coding::Share)
    }

    /// Takes the texels and finds the means.
    fn coded(texels: Texels, coding: Coding) -> Image {
        let mut image = Image { texels, coding, means: Vec::new() };
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

    /// What its codes stand for.
    pub fn coding(&self) -> Coding {
        self.coding
    }

    /// Linear RGB of the texel in column x and row y, from the top left; the share in each channel of an image of
    /// shares.
    ///
    /// # Panics
    /// If there is no such texel.
    #[inline]
    pub fn colour(&self, x: usize, y: usize) -> Vec3 {
        let Texels { width, channels, codes, .. } = &self.texels;
        let first = (y * width + x) * channels;
        let decoded = if self.coding == Coding::Srgb { &LINEAR } else { &SHARE };
        let linear = |k: usize| decoded[codes[first + k] as usize];
        if *channels < 3 { Vec3::splat(linear(0)) } else { Vec3::new(linear(0), linear(1), linear(2)) }
    }

    /// Whether it has an alpha channel.
    pub fn has_alpha(&self) -> bool {
        self.texels.channels.is_multiple_of(2)
    }

    /// The least of all codes as a share of 1.
    pub(crate) fn least(&self) -> f32 {
        SHARE[self.texels.codes.iter().copied().min().unwrap_or(0) as usize]
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

/// The code of the share that a channel of a texel gives.
fn share_code(texel: &[u8], channel: Channel) -> u8 {
    match (channel, texel) {
        (Channel::Alpha, [.., alpha]) if texel.len().is_multiple_of(2) => *alpha,
        (Channel::Alpha, _) => u8::MAX,
        (Channel::Colour(k), [_, _, _, ..]) => texel[k.min(2)],
        (Channel::Luminance, [r, g, b, ..]) => ((u32::from(*r) + u32::from(*g) + u32::from(*b) + 1) / 3) as u8,
        _ => texel[0],
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
        self.texels == other.texels && self.coding == other.coding
    }
}

impl fmt::Debug for Image {
    /// Size and a number that distinguishes the texels from others (FNV-1a): what is kept of a scene is known by it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mix = |hash: u64, &code: &u8| (hash ^ u64::from(code)).wrapping_mul(0x0100_0000_01b3);
        let hash = self.texels.codes.iter().fold(0xcbf2_9ce4_8422_2325, mix);
        let kind = if self.coding == Coding::Srgb { "Image" } else { "Shares" };
        write!(f, "{kind} {}x{}x{} {hash:016x}", self.width(), self.height(), self.texels.channels)
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
        let share = |channel| Image::shares(image.texels(), channel).colour(1, 0).y;
        assert_eq!([Channel::Luminance, Channel::Alpha].map(share), [188.0 / 255.0, 1.0]);
    }

    #[test]
    fn shares_are_those_of_the_channel_requested() {
        let texels = Texels { width: 1, height: 1, channels: 4, codes: vec![10, 20, 31, 40] };
        for (channel, code) in
            [(Channel::Colour(0), 10), (Channel::Colour(2), 31), (Channel::Alpha, 40), (Channel::Luminance, 20)]
        {
            assert_eq!(Image::shares(&texels, channel).texels().codes, [code], "{channel:?}");
        }
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
