//! The squared error of light on patches from a few pixels, each by many paths.
//!
//! A pixel k is drawn with probability p_k, and n paths that start from it sample errors x whose mean is that of the
//! pixel ([`crate::error::residual`]). Of N pixels the squared error is
//!
//! ```text
//! mean over all pixels of |e_k|² / 3 = E[ U_k / (3 N p_k) ],    U_k = (|sum x|² - sum |x|²) / (n (n - 1))
//! ```
//!
//! (M. Hansen, W. Hurwitz, *On the theory of sampling from finite populations*, 1943; W. Hoeffding, *A class of
//! statistics with asymptotically normal distribution*, 1948). Its mean has no noise of paths in it, and errors that
//! change sign from pixel to pixel do not cancel. The variance of U_k from paths falls as n^-2 and, over m pixels, as
//! m^-1; that between pixels falls as m^-1 alone. So the larger of the two is halved, by twice the paths or by twice
//! the pixels.
//!
//! Not handled: places that few pixels show, none of which was drawn.

use std::time::Instant;

use glam::DVec3;
use halflight_team::would_be_over;

use crate::error::importance_paths::ImportancePaths;
use crate::error::residual::error;
use crate::light::shares::Shares;
use crate::patches::Patches;
use crate::pictures::Size;
use crate::rays::sobol::{Stream, hash};
use crate::reading::patch_light::Fields;
use crate::reading::view::View;

/// Pixels drawn at first: the mean of so many squares has a standard error of a tenth.
const DRAWS: usize = 256;
/// Paths of each at first.
const EACH: u32 = 32;
/// The golden ratio's multiples lie well spread between whole numbers, however many there are.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// A squared error and its standard error.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SquaredError {
    /// The mean over pixels and channels, (W/(m² sr))²; may be negative by chance.
    pub value: f64,
    /// Its standard error.
    pub deviation: f64,
}

impl SquaredError {
    /// One standard error above the value.
    pub(crate) fn upper(self) -> f64 {
        self.value.max(0.0) + self.deviation
    }

    /// One standard error below the value, at least 0.
    pub(crate) fn lower(self) -> f64 {
        (self.value - self.deviation).max(0.0)
    }

    /// Value and standard error as shares of a square.
    pub(crate) fn over(self, square: f64) -> SquaredError {
        SquaredError { value: self.value / square, deviation: self.deviation / square }
    }
}

/// How bright a picture is, by pixels of a smaller one.
#[derive(Clone, Copy)]
pub(crate) struct Brightness<'a> {
    /// Above 0, row by row.
    pub values: &'a [f32],
    /// Of the smaller picture.
    pub size: Size,
}

/// How precisely an error is to be estimated.
#[derive(Clone, Copy)]
pub(crate) struct SamplingGoal {
    /// Standard error of the squared error, (W/(m² sr))².
    pub wanted: f64,
    /// Paths at most, whatever that is by then. All are kept, some 2 KB each.
    pub most: usize,
    /// When to stop, whatever that is by then.
    pub deadline: Option<Instant>,
}

/// A few pixels of a picture, and paths that start from them; they serve every set of patches.
pub(crate) struct SampledPixels {
    chances: Shares,
    batches: Vec<Batch>,
    /// Paths of each pixel.
    each: u32,
    seed: u32,
}

impl SampledPixels {
    /// None yet, of a view; brighter ones are drawn more often.
    pub(crate) fn new(view: &View, bright: Brightness, seed: u32) -> SampledPixels {
        SampledPixels { chances: chances(view, bright), batches: Vec::new(), each: EACH, seed }
    }

    /// The squared error from more pixels and paths until it has the standard error requested, or twice as many would
    /// be more than there may be.
    pub(crate) fn measure(&mut self, view: &View, fields: &Fields, goal: SamplingGoal) -> SquaredError {
        if self.batches.is_empty() {
            self.widen(view, DRAWS);
        }
        self.batches.iter_mut().for_each(Batch::forget);
        let mut began = Instant::now();
        loop {
            self.batches.iter_mut().for_each(|batch| batch.measure(view.patches, fields));
            let Estimate { error, is_noise } = self.estimate();
            let is_most = 2 * self.draws() * self.each as usize > goal.most;
            let is_last = is_most || would_be_over(goal.deadline, began, 2.0);
            began = Instant::now();
            if error.deviation <= goal.wanted || is_last {
                return error;
            }
            if is_noise {
                self.each *= 2;
                self.batches.iter_mut().for_each(|batch| batch.paths.extend(view, self.each / 2));
            } else {
                self.widen(view, self.draws());
            }
        }
    }

    /// What a gather ray takes until it has read, in rays ([`ImportancePaths::price`]).
    pub(crate) fn price(&self, patches: &Patches, fields: &Fields) -> f64 {
        let count = |batch: &Batch| batch.paths.count as f64;
        let own = |batch: &Batch| count(batch) * batch.paths.price(patches, fields);
        self.batches.iter().map(own).sum::<f64>() / self.batches.iter().map(count).sum::<f64>()
    }

    /// Rays cast so far.
    pub(crate) fn rays(&self) -> u64 {
        self.batches.iter().map(|batch| batch.paths.rays).sum()
    }

    fn draws(&self) -> usize {
        self.batches.iter().map(|batch| batch.draws.len()).sum()
    }

    /// Draws more pixels.
    fn widen(&mut self, view: &View, more: usize) {
        let offset = f64::from(Stream::new(self.seed).uniform());
        let before = self.draws();
        let drawn = (before..before + more).map(|j| draw(&self.chances, (offset + j as f64 * GOLDEN).fract()));
        let drawn: Vec<(u32, f64)> = drawn.collect();
        let mut pixels: Vec<u32> = drawn.iter().map(|(pixel, _)| *pixel).collect();
        pixels.sort_unstable();
        pixels.dedup();
        let start = |pixel: u32| pixels.partition_point(|p| *p < pixel);
        let draws = drawn.iter().map(|&(pixel, counts)| Draw { start: start(pixel), counts }).collect();
        let sums = vec![ErrorSums::default(); pixels.len()];
        let seed = hash(self.batches.len() as u32, self.seed);
        let mut paths = ImportancePaths::from_pixels(pixels.into_iter(), seed);
        paths.extend(view, self.each);
        self.batches.push(Batch { draws, paths, measured: 0, sums });
    }

    fn estimate(&self) -> Estimate {
        let pixels: Vec<PixelEstimate> = self.batches.iter().flat_map(|batch| batch.estimates()).collect();
        let [mean, noise, variance] = moments(&pixels);
        // Where rare paths carry most of the light, what two of them would add is in the variance of paths alone.
        let error = SquaredError { value: mean, deviation: (variance.max(noise) / pixels.len() as f64).sqrt() };
        Estimate { error, is_noise: noise > 0.5 * variance }
    }
}

/// The mean of the values, the mean of their variances by paths, and the variance of the values.
fn moments(pixels: &[PixelEstimate]) -> [f64; 3] {
    let count = pixels.len() as f64;
    let mean = pixels.iter().map(|p| p.value).sum::<f64>() / count;
    let noise = pixels.iter().map(|p| p.variance).sum::<f64>() / count;
    [mean, noise, pixels.iter().map(|p| (p.value - mean).powi(2)).sum::<f64>() / (count - 1.0)]
}

/// How often pixels are drawn: in proportion to how bright they are.
fn chances(view: &View, Brightness { values, size }: Brightness) -> Shares {
    let bright = |k: usize| {
        let (x, y) = (k % view.width * size.width / view.width, k / view.width * size.height / view.height);
        f64::from(values[y * size.width + x])
    };
    Shares::of((0..view.width * view.height).map(bright))
}

/// The pixel at a point of the unit interval, and 1/(N p).
fn draw(chances: &Shares, at: f64) -> (u32, f64) {
    let drawn = chances.draw(at);
    (drawn.index as u32, chances.total() / (drawn.weight * chances.count() as f64))
}

/// A pixel that was drawn.
struct Draw {
    /// Its number among those that paths start from.
    start: usize,
    /// 1/(N p).
    counts: f64,
}

/// Sums over the paths of a pixel of their errors x.
#[derive(Clone, Copy, Default)]
struct ErrorSums {
    errors: DVec3,
    squares: f64,
}

/// The squared error estimated at a pixel, and its variance from the noise of paths.
#[derive(Clone, Copy)]
struct PixelEstimate {
    value: f64,
    variance: f64,
}

/// The estimate from all pixels.
struct Estimate {
    error: SquaredError,
    /// Paths make more of the variance than differences between pixels.
    is_noise: bool,
}

/// Pixels drawn together.
struct Batch {
    draws: Vec<Draw>,
    paths: ImportancePaths,
    /// Additions of paths measured so far.
    measured: usize,
    /// By pixel that paths start from.
    sums: Vec<ErrorSums>,
}

impl Batch {
    /// Discards what was measured, as patches or their light have changed.
    fn forget(&mut self) {
        self.measured = 0;
        self.sums.fill(ErrorSums::default());
    }

    /// Measures the paths that were not measured yet.
    fn measure(&mut self, patches: &Patches, fields: &Fields) {
        // In order: the sums are the same for any number of threads.
        for (start, error) in
            self.paths.each_of(self.measured, |path| (path.start, error(&path.vertices, patches, fields)))
        {
            let sums = &mut self.sums[start as usize];
            sums.errors += error;
            sums.squares += error.length_squared();
        }
        self.measured = self.paths.additions();
    }

    /// The estimates at each pixel drawn, as if it were the whole picture.
    fn estimates(&self) -> impl Iterator<Item = PixelEstimate> {
        let paths = (self.paths.count / self.sums.len()) as f64;
        self.draws.iter().map(move |Draw { start, counts }| {
            let PixelEstimate { value, variance } = self.sums[*start].estimate(paths);
            PixelEstimate { value: counts * value, variance: counts * counts * variance }
        })
    }
}

impl ErrorSums {
    /// The estimate from n paths, mean of the channels.
    fn estimate(&self, n: f64) -> PixelEstimate {
        let pairs = n * (n - 1.0);
        let value = (self.errors.length_squared() - self.squares) / pairs;
        // Of one path, as if all channels were fully correlated, which is an upper bound.
        let path = (self.squares - self.errors.length_squared() / n) / (n - 1.0);
        let variance = 2.0 * path * path / pairs + 4.0 * value.max(0.0) * path / n;
        PixelEstimate { value: value / 3.0, variance: variance / 9.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::{Mode, Rgb};
    use crate::reading::view::lights_of;

    #[test]
    fn noise_of_paths_is_not_in_the_mean() {
        const PATHS: usize = 16;
        const PIXELS: u32 = 4000;
        let mut random = Stream::new(7);
        // Errors of 1 with uniform noise of the variance 3, alike in all channels.
        let mut pixel = || {
            let mut sums = ErrorSums::default();
            for _ in 0..PATHS {
                let error = DVec3::splat(1.0 + 6.0 * (f64::from(random.uniform()) - 0.5));
                sums.errors += error;
                sums.squares += error.length_squared();
            }
            sums.estimate(PATHS as f64)
        };
        let [mean, noise, variance] = moments(&(0..PIXELS).map(|_| pixel()).collect::<Vec<_>>());
        let count = f64::from(PIXELS);
        assert!((mean - 1.0).abs() < 4.0 * (variance / count).sqrt(), "{mean}");
        // The variance of a variance over so many, of values whose kurtosis is below 9, and as much again.
        assert!((noise / variance - 1.0).abs() < 8.0 * (8.0 / count).sqrt(), "{noise} {variance}");
    }

    #[test]
    fn pixels_are_drawn_as_often_as_they_are_bright() {
        let lights = lights_of("furnace", Mode::Global.transport(), 24);
        let view = View::new(&lights, (6, 2).into());
        let bright = Brightness { values: &[1.0, 3.0], size: (2, 1).into() };
        let chances = chances(&view, bright);
        const DRAWS: usize = 1024;
        let drawn: Vec<(u32, f64)> = (0..DRAWS).map(|j| draw(&chances, (j as f64 * GOLDEN).fract())).collect();
        // Multiples of the golden ratio miss the length of an interval by less than 3 of so many.
        let right = drawn.iter().filter(|(pixel, _)| pixel % 6 >= 3).count();
        assert!(right.abs_diff(3 * DRAWS / 4) < 3, "{right}");
        // Of pixels that are all 1 the mean is 1.
        let mean = drawn.iter().map(|(_, counts)| counts).sum::<f64>() / DRAWS as f64;
        assert!((mean - 1.0).abs() < 0.01, "{mean}");
        assert_eq!([draw(&chances, 0.0).0, draw(&chances, 1.0).0], [0, 11]);
    }

    /// In a furnace all light is E / (1 - rho): that leaves nothing, and light a tenth too bright leaves a tenth of it
    /// in every pixel, reflected once.
    #[test]
    fn exact_light_leaves_nothing_and_wrong_light_its_error() {
        let lights = lights_of("furnace", Mode::Global.transport(), 24);
        let view = View::new(&lights, (8, 8).into());
        let material = &view.scene.materials[0];
        let (rho, e) = (material.rho.x, material.emission.x);
        let exact = e / (1.0 - rho);
        let bright = Brightness { values: &[1.0], size: (1, 1).into() };
        let mut pixels = SampledPixels::new(&view, bright, 5);
        let mut off = |factor: f32| {
            let fields = Fields::new(&[vec![Rgb::splat(factor * exact); view.patches.len()]]);
            let once = SamplingGoal { wanted: f64::INFINITY, most: 0, deadline: None };
            pixels.measure(&view, &fields, once)
        };
        assert!(off(1.0).value.abs() < 1e-9, "{:?}", off(1.0));
        // Light of a surface is E + rho L: what is read wrong by 0.1 L shows as rho 0.1 L.
        let squared = f64::from(0.1 * exact * rho).powi(2);
        let error = off(1.1);
        assert!(error.deviation < 0.1 * squared, "{error:?}");
        assert!((error.value - squared).abs() < 4.0 * error.deviation, "{error:?} {squared}");
        // What is measured again is not counted twice.
        let again = off(1.1);
        assert_eq!((again.value, again.deviation), (error.value, error.deviation));
    }
}
