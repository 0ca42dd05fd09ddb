//! The squared error of a picture from the errors of its pixels in two halves, over blocks as small as their noise
//! allows.
//!
//! With `a` and `b` the sums of a block's errors in the halves, the squared error is the mean over blocks of
//! `a . b / area`, whose expectation has no noise in it. Small blocks see what changes sign in larger ones, but a
//! single pixel whose paths are noisy hides all others. So blocks are parted where that costs little: a picture's
//! blocks need not be of one size (a tree is pruned to the least cost: Breiman et al., *Classification and Regression
//! Trees*, 1984).
//!
//! Not handled: errors that change sign within blocks that noise keeps whole.

use glam::DVec3;

/// Levels of blocks, from single pixels on, each twice as wide as the one before.
pub(crate) const LEVELS: usize = 5;

/// A squared error and its standard error.
#[derive(Clone, Copy, Debug, Default)]
pub struct SquaredError {
    /// The mean over pixels and channels, (W/(m² sr))²; may be negative by chance.
    pub value: f64,
    /// Its standard error.
    pub deviation: f64,
}

/// Errors of a picture's pixels in two halves, and their sums over blocks of every level.
#[derive(Clone, Debug)]
pub(crate) struct ErrorBlocks {
    /// From single pixels on.
    levels: Vec<Level>,
}

/// The blocks of one size, row by row.
#[derive(Clone, Debug)]
struct Level {
    columns: usize,
    rows: usize,
    blocks: Vec<Block>,
}

/// Sums of the errors of a block's pixels.
#[derive(Clone, Copy, Debug, Default)]
struct Block {
    halves: [DVec3; 2],
    /// Pixels.
    area: f64,
}

/// A sum of blocks' squared errors, and its variance.
#[derive(Clone, Copy, Debug, Default)]
struct Told {
    value: f64,
    variance: f64,
}

impl ErrorBlocks {
    /// Of pixels row by row, `width` to a row.
    pub fn new(pixels: impl Iterator<Item = [DVec3; 2]>, width: usize) -> ErrorBlocks {
        let blocks: Vec<Block> = pixels.map(|halves| Block { halves, area: 1.0 }).collect();
        let mut levels = vec![Level { columns: width, rows: blocks.len() / width.max(1), blocks }];
        for k in 1..LEVELS {
            levels.push(levels[k - 1].joined());
        }
        ErrorBlocks { levels }
    }

    /// Over blocks of each size, from single pixels on.
    pub fn of_sizes(&self) -> impl Iterator<Item = SquaredError> {
        self.levels.iter().map(|level| self.mean(level.blocks.iter().map(Block::told).sum()))
    }

    /// The mean error of all pixels and channels, W/(m² sr).
    pub fn mean_error(&self) -> f64 {
        let halves = self.levels[0].blocks.iter().flat_map(|block| block.halves);
        halves.map(DVec3::element_sum).sum::<f64>() / (6.0 * self.area())
    }

    /// Over blocks as small as leaves a standard error of at most `wanted`; else over those that tell it best.
    pub fn within(&self, wanted: f64) -> SquaredError {
        let limit = (wanted * self.area()).powi(2);
        // What parting may add to the variance: anything, all of the limit, and so on down to a pixel's part of it.
        let halved = (0..=self.area().log2() as i32).map(|k| limit * 0.5_f64.powi(k));
        let mut told = std::iter::once(f64::INFINITY).chain(halved).map(|cost| self.parted(cost));
        self.mean(told.find(|told| told.variance <= limit).unwrap_or_else(|| self.parted(0.0)))
    }

    /// Over blocks parted wherever that adds at most `cost` to the variance.
    fn parted(&self, cost: f64) -> Told {
        let top = &self.levels[LEVELS - 1];
        let places = (0..top.rows).flat_map(|y| (0..top.columns).map(move |x| (x, y)));
        places.map(|(x, y)| self.parted_block(LEVELS - 1, x, y, cost)).sum()
    }

    fn parted_block(&self, level: usize, x: usize, y: usize, cost: f64) -> Told {
        let Level { columns, ref blocks, .. } = self.levels[level];
        let whole = blocks[y * columns + x].told();
        let Some(below) = level.checked_sub(1) else { return whole };
        let Level { columns, rows, .. } = self.levels[below];
        let within = |(x, y): &(usize, usize)| *x < columns && *y < rows;
        let parts = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(u, v)| (2 * x + u, 2 * y + v));
        let parts: Told = parts.into_iter().filter(within).map(|(x, y)| self.parted_block(below, x, y, cost)).sum();
        if parts.variance - whole.variance <= cost { parts } else { whole }
    }

    /// Pixels of the picture.
    fn area(&self) -> f64 {
        self.levels[0].blocks.len().max(1) as f64
    }

    fn mean(&self, told: Told) -> SquaredError {
        let area = self.area();
        SquaredError { value: told.value / area, deviation: told.variance.sqrt() / area }
    }
}

impl Level {
    /// Blocks twice as wide.
    fn joined(&self) -> Level {
        let (columns, rows) = (self.columns.div_ceil(2), self.rows.div_ceil(2));
        let mut blocks = vec![Block::default(); columns * rows];
        for (k, own) in self.blocks.iter().enumerate() {
            let (x, y) = (k % self.columns, k / self.columns);
            let block = &mut blocks[y / 2 * columns + x / 2];
            for (sum, half) in block.halves.iter_mut().zip(own.halves) {
                *sum += half;
            }
            block.area += own.area;
        }
        Level { columns, rows, blocks }
    }
}

impl Block {
    /// The product of both halves, channels in the mean.
    fn told(&self) -> Told {
        let [a, b] = self.halves;
        let size = 3.0 * self.area;
        // The halves' difference tells their noise: the product's is as large as this within a factor of sqrt 2,
        // whether noise or error is the larger.
        let noise = 0.5 * (a - b).length_squared() / size;
        let square = 0.5 * (a.length_squared() + b.length_squared()) / size;
        Told { value: a.dot(b) / size, variance: noise * square }
    }
}

impl std::iter::Sum for Told {
    fn sum<I: Iterator<Item = Told>>(all: I) -> Told {
        all.fold(Told::default(), |sum, one| Told {
            value: sum.value + one.value,
            variance: sum.variance + one.variance,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::sobol::Stream;

    const WIDTH: usize = 37;
    const HEIGHT: usize = 21;

    /// Errors of 1 whose sign changes from pixel to pixel, with uniform noise of the variance `noise(k)` in either
    /// half.
    fn alternating(noise: impl Fn(usize) -> f64, seed: u32) -> ErrorBlocks {
        let mut random = Stream::new(seed);
        let mut half = |k: usize, error: f64| {
            let uniform = 2.0 * f64::from(random.uniform()) - 1.0;
            DVec3::splat(error + (3.0 * noise(k)).sqrt() * uniform)
        };
        let pixel = |k: usize| {
            let error = if (k % WIDTH + k / WIDTH).is_multiple_of(2) { 1.0 } else { -1.0 };
            [half(k, error), half(k, error)]
        };
        let pixels: Vec<[DVec3; 2]> = (0..WIDTH * HEIGHT).map(pixel).collect();
        ErrorBlocks::new(pixels.into_iter(), WIDTH)
    }

    #[test]
    fn without_noise_the_error_is_that_of_single_pixels() {
        let blocks = alternating(|_| 0.0, 1);
        let told = blocks.within(0.0);
        assert!((told.value - 1.0).abs() < 1e-12 && told.deviation == 0.0, "{told:?}");
        let sizes: Vec<f64> = blocks.of_sizes().map(|s| s.value).collect();
        assert_eq!(sizes.len(), LEVELS);
        assert!((sizes[0] - 1.0).abs() < 1e-12);
        // What changes sign cancels in larger blocks, but for those cut off by the border, odd in width and height.
        assert!(sizes[1..].iter().all(|&s| s < 0.06), "{sizes:?}");
    }

    #[test]
    fn one_noisy_pixel_does_not_hide_the_others() {
        let noisy = |k: usize| if k == 5 * WIDTH + 9 { 1e4 } else { 0.01 };
        let blocks = alternating(noisy, 2);
        let wanted = 0.1;
        let sizes: Vec<SquaredError> = blocks.of_sizes().collect();
        assert!(sizes[0].deviation > 10.0 * wanted, "{sizes:?}");
        // One size of blocks would be the largest, in which the error cancels.
        let told = blocks.within(wanted);
        assert!(told.deviation <= wanted && (told.value - 1.0).abs() < 3.0 * wanted, "{told:?}");
    }

    #[test]
    fn expectations_hold_no_noise() {
        // Noise as large as the error, of which every fourth pixel has ten times as much.
        let draws = 400;
        let values = (0..draws).map(|k| {
            let blocks = alternating(|k| if k.is_multiple_of(4) { 10.0 } else { 1.0 }, 10 + k);
            blocks.of_sizes().map(|s| s.value).collect::<Vec<f64>>()
        });
        let values: Vec<Vec<f64>> = values.collect();
        let truths: Vec<f64> = alternating(|_| 0.0, 1).of_sizes().map(|s| s.value).collect();
        for (k, truth) in truths.into_iter().enumerate() {
            let mean = values.iter().map(|v| v[k]).sum::<f64>() / f64::from(draws);
            let variance = values.iter().map(|v| (v[k] - mean).powi(2)).sum::<f64>() / f64::from(draws - 1);
            let error = (variance / f64::from(draws)).sqrt();
            assert!((mean - truth).abs() < 4.0 * error, "level {k}: {mean} beside {truth} ± {error}");
        }
    }

    #[test]
    fn where_noise_allows_nothing_the_best_is_told() {
        let blocks = alternating(|_| 1e6, 3);
        let least = blocks.of_sizes().map(|s| s.deviation).fold(f64::INFINITY, f64::min);
        assert!(blocks.within(1e-9).deviation <= least);
    }
}
