//! The path tracer: gathers passes of samples into pictures, with the standard error of every pixel.
//!
//! Samples of a pixel are independent: uniform over its box, without stratification, so the standard error of their
//! mean holds. A pass of given size gives the same bits for any number of threads. A pixel takes 284 bytes.
//!
//! Not handled: filters other than the box; adaptive sampling; proof that a series converges.
//!
//! Source of the moments: T. Chan, G. Golub, R. LeVeque, *Algorithms for computing the sample variance*, The American
//! Statistician 37, 1983.

use std::time::Instant;

use glam::{DVec3, Vec3};

use crate::lights::Emitters;
use crate::path::{KEPT, NextEvent, Space};
use crate::random::Random;
use crate::surfaces::Surfaces;
use halflight::light::team;
use halflight::light::{Rgb, Transport};
use halflight::pictures::{Picture, Size};
use halflight::rays::{Hit, Ray, Rays};
use halflight::scene::{Camera, Scene};

/// How paths are traced.
#[derive(Clone, Copy, Debug)]
pub struct TraceSettings {
    /// Whether emitters are sampled at every vertex.
    pub next_event: NextEvent,
    /// Reflections after which a path ends in any case; what comes later is missing from the picture.
    pub max_bounces: u32,
    /// Chooses the random numbers.
    pub seed: u32,
}

impl Default for TraceSettings {
    fn default() -> Self {
        TraceSettings { next_event: NextEvent::On, max_bounces: 128, seed: 0 }
    }
}

/// What was done so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Counts {
    /// Paths, one for each sample of each pixel.
    pub paths: u64,
    /// Rays cast: from the camera, from surface to surface, and to emitters.
    pub rays: u64,
    /// Paths that `max_bounces` ended with light still to gather.
    pub cut: u64,
    /// Paths that met the black back of a one-sided face first.
    pub backs: u64,
}

/// A mean over the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Mean {
    /// Radiance per channel, W/(m² sr); `mean` in reports.
    #[serde(rename = "mean")]
    pub value: [f64; 3],
    /// Its standard error per channel; `standard_error` in reports.
    #[serde(rename = "standard_error")]
    pub error: [f64; 3],
}

/// Light grew beyond single precision: a series that diverges, followed too far.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the light overflows within {max_bounces} bounces: the series diverges")]
pub struct Overflow {
    /// Reflections after which paths ended.
    pub max_bounces: u32,
}

impl Counts {
    fn add(&mut self, other: &Counts) {
        self.paths += other.paths;
        self.rays += other.rays;
        self.cut += other.cut;
        self.backs += other.backs;
    }
}

/// Mean and sum of squared deviations of samples of one pixel, which come in passes and are not kept:
///
/// ```text
/// merging (mean, M, n) with (m, Q, k), d = m - mean:   mean += d k/(n+k),   M += Q + d² n k/(n+k)
/// standard error of the mean = sqrt(M / (n (n - 1)))
/// ```
///
/// Sums run in f64 within a pass; between passes nothing cancels, so f32 holds them.
#[derive(Clone, Copy, Default, serde::Serialize, serde::Deserialize)]
struct Moments {
    mean: Vec3,
    deviation: Vec3,
}

/// Sums over one pass.
#[derive(Clone, Copy, Default)]
struct Sums {
    sum: DVec3,
    squares: DVec3,
}

impl Sums {
    #[inline]
    fn add(&mut self, sample: Vec3) {
        let x = sample.as_dvec3();
        self.sum += x;
        self.squares += x * x;
    }
}

impl Moments {
    /// Takes in a pass of `new` samples after `old` ones.
    fn merge(&mut self, old: u64, pass: &Sums, new: u64) {
        let (n, k) = (old as f64, new as f64);
        let mean = pass.sum / k;
        let within = (pass.squares - pass.sum * mean).max(DVec3::ZERO);
        let apart = mean - self.mean.as_dvec3();
        self.mean = (self.mean.as_dvec3() + apart * (k / (n + k))).as_vec3();
        let between = apart * apart * (n * k / (n + k));
        self.deviation = (self.deviation.as_dvec3() + within + between).as_vec3();
    }

    /// Square of the standard error of the mean of `count` samples, at least two.
    fn squared_error(&self, count: u64) -> DVec3 {
        let n = count as f64;
        self.deviation.as_dvec3() / (n * (n - 1.0))
    }
}

/// A picture that grows more exact with every pass.
pub struct Tracer<'a> {
    space: Space<'a>,
    camera: Camera,
    width: usize,
    height: usize,
    seed: u32,
    pixels: Vec<Pixel>,
    samples: u64,
    counts: Counts,
}

/// What the samples of one pixel add up to.
#[derive(Clone, Copy, Default, serde::Serialize, serde::Deserialize)]
struct Pixel {
    total: Moments,
    orders: [Moments; KEPT + 1],
    largest: Rgb,
    lit: u32,
    luminaire: bool,
}

impl<'a> Tracer<'a> {
    /// No samples yet. `transports` holds (alpha, tau) of every material, `size` the picture's width and height.
    pub fn new(
        scene: &Scene,
        rays: &'a Rays,
        transports: &[Transport],
        size: impl Into<Size>,
        settings: &TraceSettings,
    ) -> Tracer<'a> {
        let Size { width, height } = size.into();
        let surfaces = Surfaces::new(scene, transports);
        let space = Space {
            rays,
            emitters: Emitters::new(&surfaces),
            surfaces,
            lights: scene.lights.iter().filter(|light| light.shines()).cloned().collect(),
            next_event: settings.next_event,
            max_bounces: settings.max_bounces,
        };
        Tracer {
            space,
            camera: scene.camera,
            width,
            height,
            seed: settings.seed,
            pixels: vec![Pixel::default(); width * height],
            samples: 0,
            counts: Counts::default(),
        }
    }

    /// Adds so many samples to every pixel.
    pub fn pass(&mut self, samples: u32) {
        if samples == 0 || self.pixels.is_empty() {
            return;
        }
        let mut rows: Vec<Vec<Pixel>> = self.pixels.chunks(self.width).map(<[_]>::to_vec).collect();
        let this = &*self;
        let sample = |hits: &mut Vec<Hit>, y: usize, row: &mut Vec<Pixel>| {
            let mut counts = Counts::default();
            for (x, pixel) in row.iter_mut().enumerate() {
                this.sample(y * this.width + x, samples, pixel, &mut counts, hits);
            }
            counts
        };
        let counts = team::share(this.height, |_| 1.0).change(&mut rows, |y| y, Vec::new, sample);
        self.pixels = rows.concat();
        self.samples += u64::from(samples);
        counts.iter().for_each(|own| self.counts.add(own));
    }

    /// Adds passes of `pass` samples, one at least, until there are `most` more samples, `goes_on` says no after a pass
    /// at so many seconds, or the next one, as long as the longest so far, would end after `seconds`. Returns the
    /// seconds.
    pub fn sample_within(
        &mut self,
        pass: u32,
        most: u32,
        seconds: f64,
        mut goes_on: impl FnMut(&Self, f64) -> bool,
    ) -> f64 {
        let (clock, mut remaining) = (Instant::now(), most);
        let (mut longest, mut now) = (0.0_f64, 0.0);
        while remaining > 0 {
            self.pass(remaining.min(pass));
            remaining -= remaining.min(pass);
            let then = team::agree(|| clock.elapsed().as_secs_f64());
            longest = longest.max(then - now);
            now = then;
            if !goes_on(self, now) || now + longest > seconds {
                break;
            }
        }
        now
    }

    /// Adds samples to pixel k.
    fn sample(&self, k: usize, samples: u32, pixel: &mut Pixel, counts: &mut Counts, hits: &mut Vec<Hit>) {
        let mut total = Sums::default();
        let mut orders = [Sums::default(); KEPT + 1];
        for sample in self.samples..self.samples + u64::from(samples) {
            let mut random = Random::new(self.seed, k as u64, sample);
            let ray = self.camera_ray(k, &mut random);
            let found = self.space.follow(&ray, &mut random, hits);
            let used = &found.orders[..found.used];
            let light: Rgb = used.iter().copied().sum();
            total.add(light);
            pixel.largest = pixel.largest.max(light);
            pixel.lit = pixel.lit.saturating_add(u32::from(light != Rgb::ZERO));
            for (sums, &light) in orders.iter_mut().zip(used) {
                sums.add(light);
            }
            pixel.luminaire |= found.luminaire;
            counts.add(&Counts { paths: 1, rays: found.rays, cut: found.cut.into(), backs: found.back.into() });
        }
        let new = u64::from(samples);
        pixel.total.merge(self.samples, &total, new);
        for (moments, sums) in pixel.orders.iter_mut().zip(&orders) {
            moments.merge(self.samples, sums, new);
        }
    }

    /// A ray through a uniform point of the box of pixel k.
    fn camera_ray(&self, k: usize, random: &mut Random) -> Ray {
        let (x, y) = (k % self.width, k / self.width);
        let px = (x as f32 + random.uniform()) / self.width as f32;
        let py = (y as f32 + random.uniform()) / self.height as f32;
        let aspect = self.width as f32 / self.height as f32;
        let (origin, direction) = self.camera.ray(px, py, aspect);
        Ray { origin, direction, source: None }
    }

    /// Samples a pixel so far.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// What was done so far.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Checks that every mean and standard error is finite.
    ///
    /// # Errors
    /// [`Overflow`] where one is not.
    pub fn check(&self) -> Result<(), Overflow> {
        let mean = self.mean();
        let finite = mean.value.iter().chain(&mean.error).all(|x| x.is_finite());
        let max_bounces = self.space.max_bounces;
        finite.then_some(()).ok_or(Overflow { max_bounces })
    }

    /// Visible radiance, all bounces together.
    pub fn picture(&self) -> Picture {
        self.picture_of(|pixel| pixel.total.mean)
    }

    /// Standard error of every pixel of [`Tracer::picture`]; none before the second sample.
    pub fn standard_error(&self) -> Option<Picture> {
        self.error_of(|pixel| pixel.total)
    }

    /// The largest sample of every pixel, channel by channel.
    pub fn largest(&self) -> Picture {
        self.picture_of(|pixel| pixel.largest)
    }

    /// How many samples of every pixel found any light.
    pub fn lit(&self) -> Vec<u32> {
        self.pixels.iter().map(|pixel| pixel.lit).collect()
    }

    /// Visible radiance after exactly n reflections, n < [`KEPT`]; n = `KEPT` gives all later ones together.
    pub fn bounce(&self, n: usize) -> Option<Picture> {
        (n <= KEPT).then(|| self.picture_of(|pixel| pixel.orders[n].mean))
    }

    /// Standard error of every pixel of [`Tracer::bounce`]; none before the second sample.
    pub fn bounce_error(&self, n: usize) -> Option<Picture> {
        (n <= KEPT).then(|| self.error_of(|pixel| pixel.orders[n]))?
    }

    /// Mean radiance over the picture; its error is 0 before the second sample.
    pub fn mean(&self) -> Mean {
        self.mean_of(|pixel| pixel.total)
    }

    /// Mean radiance over the picture of [`Tracer::bounce`] for n = 0..=[`KEPT`].
    pub fn means(&self) -> Vec<Mean> {
        (0..=KEPT).map(|n| self.mean_of(|pixel| pixel.orders[n])).collect()
    }

    /// 1 in pixels none of whose samples saw a luminaire, 0 elsewhere.
    pub fn mask(&self) -> Picture {
        self.picture_of(|pixel| Rgb::splat(f32::from(u8::from(!pixel.luminaire))))
    }

    /// `sqrt(mean(se²) / (mean(L²) - mean(se²)))` over channels and the pixels that see no luminaire, or all where
    /// every pixel sees one: the noise over the RMS of the picture without its noise.
    ///
    /// None before the second sample, and where noise leaves no picture to relate it to.
    pub fn relative_error(&self) -> Option<f64> {
        let everywhere = self.pixels.iter().all(|pixel| pixel.luminaire);
        let counted = self.pixels.iter().filter(|pixel| everywhere || !pixel.luminaire);
        let (mut noise, mut power) = (0.0, 0.0);
        for pixel in counted {
            noise += pixel.total.squared_error(self.samples).element_sum();
            power += pixel.total.mean.as_dvec3().length_squared();
        }
        (self.samples > 1 && power > noise).then(|| (noise / (power - noise)).sqrt())
    }

    fn picture_of(&self, colour: impl Fn(&Pixel) -> Rgb) -> Picture {
        Picture { width: self.width, height: self.height, pixels: self.pixels.iter().map(colour).collect() }
    }

    fn error_of(&self, moments: impl Fn(&Pixel) -> Moments) -> Option<Picture> {
        let error = |pixel: &Pixel| moments(pixel).squared_error(self.samples).map(f64::sqrt).as_vec3();
        (self.samples > 1).then(|| self.picture_of(error))
    }

    fn mean_of(&self, moments: impl Fn(&Pixel) -> Moments) -> Mean {
        let count = self.pixels.len().max(1) as f64;
        let (mut value, mut noise) = (DVec3::ZERO, DVec3::ZERO);
        for pixel in &self.pixels {
            let moments = moments(pixel);
            value += moments.mean.as_dvec3();
            if self.samples > 1 {
                noise += moments.squared_error(self.samples);
            }
        }
        Mean { value: (value / count).to_array(), error: (noise.map(f64::sqrt) / count).to_array() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_of_any_size_give_the_textbook_mean_and_error() {
        let samples = [3.0, 1.0, 4.0, 1.0, 5.0, 9.0, 2.0, 6.0].map(Vec3::splat);
        let mut moments = Moments::default();
        let mut old = 0;
        for pass in [&samples[..3], &samples[3..4], &samples[4..]] {
            let mut sums = Sums::default();
            pass.iter().for_each(|&x| sums.add(x));
            moments.merge(old, &sums, pass.len() as u64);
            old += pass.len() as u64;
        }
        // Mean 31/8; sum of squares 173; deviations 173 - 31²/8 = 52.875.
        assert!((moments.mean.x - 3.875).abs() < 1e-6);
        let error = moments.squared_error(8).x;
        assert!((error - 52.875 / 56.0).abs() < 1e-6, "{error}");
    }
}
