//! Independent estimates of every pixel, more and more of them where they are needed.
//!
//! A pixel has [`GROUPS`] estimates, each the mean of samples of its own scrambling: a net of Sobol points spreads
//! camera rays over the pixel and first directions over the hemisphere, within a group and not between groups. How many
//! samples a pixel gets is chosen by the noise of the pixels around it and never by its own, so that its estimates stay
//! without bias (M. Kirk, J. Arvo, *Unbiased sampling techniques for image synthesis*, 1991, show what else happens).
//! For the variance of crossed errors, sum of `s⁴ / n²`, the best numbers are in proportion to `s^(4/3)`.
//!
//! Pixels that see emission are looked for by rays of their own: a mask by the samples themselves would keep
//! just those pixels whose samples missed it.
//!
//! Not handled: when there are enough samples.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::{DVec3, Vec2};
use halflight_team::Loop;

use crate::crossed::PixelMean;
use crate::paths::{Memory, Paths, Start};
use halflight::pictures::Size;
use halflight::rays::sobol::{Sobol, Stream, hash};

/// Independent estimates of a pixel: all pairs of 8 leave 8/7 of the least variance of a crossed square, two halves 2.
pub(crate) const GROUPS: usize = 8;
/// Rays of every pixel that look for emission, and of pixels beside those that see some.
const LOOKS: u32 = 16;
const LOOKS_BESIDE: u32 = 256;
/// Samples of a group that are tabled.
const TABLED: usize = 256;
/// Samples of a pixel are at least this share of the mean number, and at most so many times as many.
const LEAST: f64 = 0.25;
const MOST: f64 = 16.0;
/// Pixels to either side whose noise counts.
const AROUND: usize = 2;
/// Paths that were too long, after which sampling ends: the series diverges, or nearly.
const TOO_MANY: u64 = 256;

/// The estimates of one pixel.
#[derive(Clone, Copy, Default, serde::Serialize, serde::Deserialize)]
struct Groups {
    sums: [DVec3; GROUPS],
    /// Samples of each.
    count: u32,
}

/// The estimates of all pixels that count.
pub(crate) struct Estimates<'a> {
    paths: Paths<'a>,
    size: Size,
    seed: u32,
    sobol: Sobol,
    pixels: Vec<Groups>,
    /// Pixels that see no emission, or all where every pixel sees some.
    pub counts: Vec<bool>,
    /// Rays cast.
    pub rays: u64,
    /// Paths that were ended.
    pub cut: u64,
}

impl<'a> Estimates<'a> {
    /// None yet; finds the pixels that count.
    pub(crate) fn new(paths: Paths<'a>, size: Size, seed: u32) -> Estimates<'a> {
        let sobol = Sobol::new(TABLED, 4);
        let pixels = vec![Groups::default(); size.width * size.height];
        let (counts, rays) = unlit(&paths, &sobol, size, hash(GROUPS as u32, seed));
        Estimates { paths, size, seed, sobol, pixels, counts, rays, cut: 0 }
    }

    /// Samples of a pixel that counts, in the mean.
    pub(crate) fn mean_samples(&self) -> f64 {
        let sampled = self.pixels.iter().map(|own| f64::from(own.count)).sum::<f64>();
        GROUPS as f64 * sampled / self.counted().count().max(1) as f64
    }

    /// The pixels that count.
    pub(crate) fn counted(&self) -> impl Iterator<Item = usize> + Clone + '_ {
        (0..self.pixels.len()).filter(|&k| self.counts[k])
    }

    /// The estimates of a pixel that was sampled.
    pub(crate) fn of(&self, k: usize) -> [DVec3; GROUPS] {
        let own = &self.pixels[k];
        own.sums.map(|sum| sum / f64::from(own.count))
    }

    /// Samples until a pixel has so many in the mean, a number that is rounded up; `tick` counts rows.
    pub(crate) fn extend(&mut self, mean: f64, tick: impl Fn(u64) + Sync + Send) {
        let wanted = self.wanted(mean / GROUPS as f64);
        let mut rows: Vec<Vec<Groups>> = self.pixels.chunks(self.size.width).map(<[_]>::to_vec).collect();
        let (this, ended) = (&*self, AtomicU64::new(0));
        let row = |memory: &mut Memory, y: usize, row: &mut Vec<Groups>| {
            let before = (memory.rays(), memory.cut);
            for (x, own) in row.iter_mut().enumerate() {
                let k = y * this.size.width + x;
                if ended.load(Ordering::Relaxed) < TOO_MANY {
                    let cut = memory.cut;
                    this.sample(k, wanted[k], own, memory);
                    ended.fetch_add(memory.cut - cut, Ordering::Relaxed);
                }
            }
            tick(1);
            (memory.rays() - before.0, memory.cut - before.1)
        };
        let done = Loop::each(self.size.height).change(&mut rows, Memory::default, row);
        self.pixels = rows.concat();
        done.iter().for_each(|(rays, cut)| {
            self.rays += rays;
            self.cut += cut;
        });
    }

    /// Samples of each group of pixel k until there are so many.
    fn sample(&self, k: usize, wanted: u32, own: &mut Groups, memory: &mut Memory) {
        for (g, sum) in own.sums.iter_mut().enumerate() {
            let seed = hash(k as u32, hash(g as u32, self.seed));
            for i in own.count..wanted {
                let [x, y, u, v] = [0, 1, 2, 3].map(|d| self.sobol.point(i, d, seed));
                let start = Start { point: Vec2::new(x, y), direction: Vec2::new(u, v) };
                *sum += self.paths.sample(k, start, &mut Stream::new(hash(i, !seed)), memory);
            }
        }
        own.count = own.count.max(wanted);
    }

    /// Samples of a group of every pixel, so many in the mean or somewhat more.
    fn wanted(&self, mean: f64) -> Vec<u32> {
        let noise: Vec<f64> = (0..self.pixels.len()).map(|k| self.noise_around(k).powf(2.0 / 3.0)).collect();
        let count = self.counted().count().max(1) as f64;
        let typical = self.counted().map(|k| noise[k]).sum::<f64>() / count;
        let share = |k: usize| if typical > 0.0 { (noise[k] / typical).clamp(LEAST, MOST) } else { 1.0 };
        let all = self.counted().map(share).sum::<f64>() / count;
        let of = |k: usize| ((mean * share(k) / all).ceil().max(1.0) as u32).max(self.pixels[k].count);
        (0..self.pixels.len()).map(|k| if self.counts[k] { of(k) } else { 0 }).collect()
    }

    /// Variance of one sample, channels added, in the mean over the pixels around pixel k, without it.
    fn noise_around(&self, k: usize) -> f64 {
        let Size { width, height } = self.size;
        let near = |at: usize, of: usize| at.saturating_sub(AROUND)..(at + AROUND + 1).min(of);
        let (mut sum, mut count) = (0.0, 0.0);
        for other in near(k / width, height).flat_map(|y| near(k % width, width).map(move |x| y * width + x)) {
            let own = self.pixels[other].count;
            if other != k && own > 0 {
                sum += f64::from(own) * PixelMean::of(&self.of(other)).variance.element_sum();
                count += 1.0;
            }
        }
        if count > 0.0 { sum / count } else { 0.0 }
    }
}

/// Pixels in which no ray meets emission, or all where every pixel shows some; and how many rays looked.
fn unlit(paths: &Paths, sobol: &Sobol, size: Size, seed: u32) -> (Vec<bool>, u64) {
    let sees = |k: usize, looks: u32| {
        let point = |i: u32| Vec2::from([0, 1].map(|d| sobol.point(i, d, hash(k as u32, seed))));
        (0..looks).any(|i| paths.sees_emission(k, point(i)))
    };
    let all = Loop::each(size.width * size.height);
    let first: Vec<bool> = all.map(|k| sees(k, LOOKS));
    let Size { width, height } = size;
    let beside = |k: usize| {
        let near = |at: usize, of: usize| at.saturating_sub(1)..(at + 2).min(of);
        near(k / width, height).any(|y| near(k % width, width).any(|x| first[y * width + x]))
    };
    let lit: Vec<bool> = all.map(|k| first[k] || beside(k) && sees(k, LOOKS_BESIDE));
    let beside = (0..first.len()).filter(|&k| !first[k] && beside(k)).count() as u64;
    let rays = u64::from(LOOKS) * first.len() as u64 + u64::from(LOOKS_BESIDE) * beside;
    let everywhere = lit.iter().all(|own| *own);
    (lit.into_iter().map(|own| everywhere || !own).collect(), rays)
}
