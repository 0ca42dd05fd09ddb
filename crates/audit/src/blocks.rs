//! Where a picture is off: blocks of pixels as small as the difference there is certain.
//!
//! ```text
//! signed:  sum of D - B over a block against its standard error       brighter or darker than the scene is
//! squared: sum of q over a block against its standard error           off at all, as at edges that are moved
//! ```
//!
//! From the whole picture down, each block is halved both ways. A block whose sum is [`CERTAIN`] shows its own mean; of
//! a block some of whose quarters are certain the others show what is left for them if that is certain, and else
//! nothing; all others show what they are part of.
//!
//! Not handled: blocks that follow the shapes of things.

use glam::DVec3;

use crate::crossed::{PixelMean, Variances};
use halflight::light::Rgb;
use halflight::pictures::{Picture, Size};

/// Standard errors beyond which chance is no explanation: of normal ones one block in 1.7 million.
const CERTAIN: f64 = 5.0;
/// Pixels along a side of the smallest blocks, as the variance of a few estimates of one pixel is hardly known.
const SMALLEST: usize = 4;
/// Halvings from the smallest blocks' pixels.
const LEVEL: usize = SMALLEST.ilog2() as usize;

/// Sums over pixels that count.
#[derive(Clone, Copy, Default)]
pub(crate) struct Sums {
    /// Of `D - B`.
    pub apart: DVec3,
    /// Variance of the sum of its channels.
    pub variance: f64,
    /// Of B, channels added.
    pub light: f64,
    /// Of crossed squares.
    pub squared: f64,
    pub variances: Variances,
    pub pixels: f64,
}

impl Sums {
    /// One pixel.
    pub(crate) fn of(shown: DVec3, mean: &PixelMean, squared: f64, variance: f64) -> Sums {
        let mut variances = Variances::default();
        variances.add(variance);
        let light = mean.mean.element_sum();
        Sums { apart: shown - mean.mean, variance: mean.variance_of_sum, light, squared, variances, pixels: 1.0 }
    }

    pub(crate) fn plus(self, other: Sums) -> Sums {
        Sums {
            apart: self.apart + other.apart,
            variance: self.variance + other.variance,
            light: self.light + other.light,
            squared: self.squared + other.squared,
            variances: self.variances.plus(other.variances),
            pixels: self.pixels + other.pixels,
        }
    }
}

/// What of sums is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Look {
    /// `D - B`, W/(m² sr).
    Signed,
    /// Root of the mean of crossed squares over pixels and channels, W/(m² sr).
    Squared,
}

impl Look {
    fn is_certain(self, sums: &Sums) -> bool {
        match self {
            Look::Signed => sums.apart.element_sum().abs() > CERTAIN * sums.variance.sqrt() && sums.variance > 0.0,
            Look::Squared => sums.squared > CERTAIN * sums.variances.stated().sqrt() && sums.squared > 0.0,
        }
    }

    fn value(self, sums: &Sums) -> Rgb {
        let pixels = sums.pixels.max(1.0);
        match self {
            Look::Signed => (sums.apart / pixels).as_vec3(),
            Look::Squared => Rgb::splat((sums.squared.max(0.0) / (3.0 * pixels)).sqrt() as f32),
        }
    }
}

/// Sums over blocks of 1, 2, 4, ... pixels a side.
pub(crate) struct Blocks {
    size: Size,
    levels: Vec<(Size, Vec<Sums>)>,
}

impl Blocks {
    /// Of the sums of pixels, row by row.
    pub(crate) fn new(size: Size, pixels: Vec<Sums>) -> Blocks {
        let mut levels = vec![(size, pixels)];
        while let Some((Size { width, height }, last)) = levels.last()
            && (width.max(height) > &1 || levels.len() <= LEVEL)
        {
            let half = Size { width: width.div_ceil(2), height: height.div_ceil(2) };
            let mut sums = vec![Sums::default(); half.width * half.height];
            for (k, own) in last.iter().enumerate() {
                let sum = &mut sums[(k / width / 2) * half.width + k % width / 2];
                *sum = sum.plus(*own);
            }
            levels.push((half, sums));
        }
        Blocks { size, levels }
    }

    /// The sums over the whole picture.
    pub(crate) fn whole(&self) -> Sums {
        self.levels.last().and_then(|(_, all)| all.first().copied()).unwrap_or_default()
    }

    /// The sums of a rectangle of pixels.
    pub(crate) fn within(&self, columns: std::ops::Range<usize>, rows: std::ops::Range<usize>) -> Sums {
        let pixels = &self.levels[0].1;
        let all = rows.flat_map(|y| columns.clone().map(move |x| y * self.size.width + x));
        all.fold(Sums::default(), |sum, k| sum.plus(pixels[k]))
    }

    /// The picture of what is certain; black where nothing is.
    pub(crate) fn map(&self, look: Look) -> Picture {
        let mut map = Picture::new(self.size.width, self.size.height);
        self.settle(look, (self.levels.len() - 1, 0, 0), Rgb::ZERO, &mut map);
        map
    }

    fn at(&self, (level, x, y): (usize, usize, usize)) -> Option<&Sums> {
        let (size, all) = &self.levels[level];
        (x < size.width && y < size.height).then(|| &all[y * size.width + x])
    }

    /// Fills a block of a map, `given` what it shows if nothing of its own is certain.
    fn settle(&self, look: Look, (level, x, y): (usize, usize, usize), given: Rgb, map: &mut Picture) {
        let Some(own) = self.at((level, x, y)) else { return };
        let shown = if look.is_certain(own) { look.value(own) } else { given };
        if level <= LEVEL {
            return self.fill((level, x, y), shown, map);
        }
        let quarters = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| (level - 1, 2 * x + i, 2 * y + j));
        let is_certain = |at| self.at(at).is_some_and(|sums| look.is_certain(sums));
        let others = quarters.iter().filter(|at| !is_certain(**at)).filter_map(|at| self.at(*at));
        let rest = others.fold(Sums::default(), |sum, own| sum.plus(*own));
        let given = match quarters.iter().any(|at| is_certain(*at)) {
            false => shown,
            true if look.is_certain(&rest) => look.value(&rest),
            true => Rgb::ZERO,
        };
        quarters.into_iter().for_each(|at| self.settle(look, at, given, map));
    }

    /// Fills the pixels of a block that count.
    fn fill(&self, (level, x, y): (usize, usize, usize), shown: Rgb, map: &mut Picture) {
        let Size { width, height } = self.size;
        for row in (y << level)..((y + 1) << level).min(height) {
            for k in (row * width + (x << level))..(row * width + ((x + 1) << level).min(width)) {
                if self.levels[0].1[k].pixels > 0.0 {
                    map.pixels[k] = shown;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pixels of light 1 known to a hundredth, off by what is said of each.
    fn blocks(width: usize, height: usize, off: impl Fn(usize, usize) -> f64) -> Blocks {
        let pixel = |k: usize| {
            let d = off(k % width, k / width);
            let mean = PixelMean { mean: DVec3::ONE, variance: DVec3::splat(1e-4), variance_of_sum: 3e-4 };
            Sums::of(DVec3::splat(1.0 + d), &mean, 3.0 * d * d, 1e-8)
        };
        Blocks::new((width, height).into(), (0..width * height).map(pixel).collect())
    }

    #[test]
    fn a_difference_is_shown_where_it_is() {
        let found = blocks(37, 21, |x, y| if x < 8 && (4..12).contains(&y) { -0.5 } else { 0.0 });
        for look in [Look::Signed, Look::Squared] {
            let map = found.map(look);
            for (k, shown) in map.pixels.iter().enumerate() {
                let (x, y) = (k % 37, k / 37);
                let here = x < 8 && (4..12).contains(&y);
                let expected = if here { if look == Look::Signed { -0.5 } else { 0.5 } } else { 0.0 };
                assert!((shown.x - expected).abs() < 1e-6, "{look:?} {x} {y}: {shown}");
            }
        }
    }

    /// Both signs within the smallest blocks: nothing is brighter or darker, and all of it is off.
    #[test]
    fn edges_that_are_moved_are_off_and_neither_brighter_nor_darker() {
        let found = blocks(16, 16, |x, _| if x % 2 == 0 { 0.1 } else { -0.1 });
        assert!(found.map(Look::Signed).pixels.iter().all(|shown| *shown == Rgb::ZERO));
        assert!(found.map(Look::Squared).pixels.iter().all(|shown| (shown.x - 0.1).abs() < 1e-6));
    }

    #[test]
    fn what_no_block_of_its_own_is_certain_of_is_shown_by_larger_ones() {
        // 16 pixels are off by four standard errors of theirs, 64 by eight.
        let found = blocks(32, 32, |_, _| 4.0 * 3e-4_f64.sqrt() / 3.0 / 4.0);
        let map = found.map(Look::Signed);
        assert!(map.pixels.iter().all(|shown| *shown == map.pixels[0] && shown.x > 0.0));
    }
}
