//! Direct light smoothed over the pixels of one surface, as far as the other half of the rays agrees.
//!
//! Each half of a pixel's camera rays measures the light D that arrives on each surface that the pixel shows, with
//! noise. D is averaged over surfaces of the same material, side and normal by level after level of a 3×3 binomial
//! kernel with holes (à trous: M. Holschneider et al., *A real-time algorithm for signal analysis with the help of the
//! wavelet transform*, 1989; over surfaces: H. Dammertz et al., *Edge-avoiding à-trous wavelet transform for fast
//! global illumination filtering*, 2010), and reflected by the pixel's own reflectance and share again. Shadows stay as
//! sharp as the rays know them: how far a half A is smoothed at a pixel k is the level s that comes nearest to what
//! half B shows around it,
//!
//! ```text
//! s_A(k) = argmin over s of   sum over pixels j around k, j /= k, of   |D_A^s(j) - B(j)|²
//! ```
//!
//! where the noise of A itself counts by half if nothing is smoothed, as it halves in the picture, the mean of D_A and
//! D_B. B(k) has no part in that choice and none in D_A(k), so that both are independent, and what smoothing leaves is
//! known without bias whatever it does to the light ([`Halves::crossed`]).
//!
//! The squared error stated is the sum of that over all pixels and its own standard error; where that leaves more than
//! three quarters of the variance nothing is smoothed, and no more tried.
//!
//! Worth: at 640×360 in a room with a dozen luminaires four camera rays a pixel leave 11.1 % of noise, and 4.5 % when
//! smoothed (4.4 stated), and a picture takes half the time at 5 and at 2 %; 0.8 of it at 5 % in one with thin things
//! before windows (docs/validation.md, Rooms that other people modelled).
//!
//! Not handled: pixels that show luminaires or highlights, which keep their own light; emitters that are kept apart.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::error::halves::Halves;
use crate::gather::pixels::camera_rays::CameraRays;
use crate::gather::pixels::pixel::Pixel;
use crate::gather::pixels::pixel_layer::Layer;
use crate::gather::pixels::pixel_light::SmoothLight;
use crate::gather::pixels::window::{spans, window};
use crate::light::over;
use crate::rays::Side;

/// Levels, of which each doubles the width: the widest kernel reaches 31 pixels to each side.
const LEVELS: usize = 5;
/// Pixels to each side by which a level is chosen: 121 of them tell squared errors apart that differ by a tenth.
const AROUND: usize = 5;
/// Pixels to each side over which what is left is spread.
const POOL: usize = 2;
/// Share of the variance of all pixels that smoothing may leave: at 640×360 it takes 0.2 s a round where the first four
/// camera rays a pixel take 1 to 2 s, so less would not make up for it.
const PAYS: f64 = 0.75;
/// Cosine of normals from which on light is shared.
const ALIKE: f32 = 0.8;
/// Surfaces of one material share light where they lie off each other's plane by at most this share of their distance.
const FLAT: f32 = 0.1;

/// Smooths the direct light of all pixels, in place of what was smoothed before, and returns whether that pays; leaves
/// them as they are where it does not.
pub(crate) fn smooth(camera_rays: &CameraRays, pixels: &mut [Pixel]) -> bool {
    pixels.par_iter_mut().for_each(|pixel| pixel.light.smooth = None);
    if camera_rays.view.lights.emitters().are_apart() {
        return false;
    }
    let picture = Surfaces::new(camera_rays, pixels);
    let smoothed = picture.smoothed();
    let Some(variances) = picture.variances(&smoothed) else { return false };
    for (pixel, (light, variance)) in pixels.iter_mut().zip(smoothed.into_iter().zip(variances)) {
        pixel.light.smooth = light.map(|direct| Box::new(SmoothLight { direct, variance }));
    }
    true
}

/// A surface that a pixel shows.
#[derive(Clone, Copy)]
struct Surface {
    pixel: u32,
    position: Vec3,
    normal: Vec3,
    /// Material and side.
    material: (u32, Side),
    /// What half of the pixel's rays reflect of light 1, mean over them.
    reflects: Vec3,
}

impl Surface {
    fn new(k: usize, pixel: &Pixel, layer: &Layer) -> Surface {
        let [a, b] = layer.reflected();
        Surface {
            pixel: k as u32,
            position: layer.position().as_vec3(),
            normal: layer.first.normal,
            material: (layer.key.material, layer.key.side),
            reflects: ((a + b) / pixel.camera()).as_vec3(),
        }
    }

    /// How much the light of another surface counts on this one.
    fn shares(&self, other: &Surface) -> f32 {
        let cosine = self.normal.dot(other.normal);
        let apart = other.position - self.position;
        let off = apart.dot(self.normal).abs();
        if self.material != other.material || cosine <= ALIKE || off > FLAT * apart.length() {
            return 0.0;
        }
        ((cosine - ALIKE) / (1.0 - ALIKE)).powi(2)
    }
}

/// Light D on a surface by the rays of each half, as many times as there are.
#[derive(Clone, Copy, Default)]
struct Arriving {
    sums: [Vec3; 2],
    rays: [f32; 2],
}

impl Arriving {
    /// What the rays of a pixel found on one of its surfaces.
    fn new(layer: &Layer) -> Arriving {
        let reflected = layer.reflected();
        let light = [0, 1].map(|half| over(layer.lit[half], reflected[half]) * f64::from(layer.count[half]));
        Arriving { sums: light.map(|sum| sum.as_vec3()), rays: layer.count.map(|count| count as f32) }
    }

    /// Adds another's as much as it counts.
    fn add(&mut self, share: f32, other: &Arriving) {
        for half in 0..2 {
            self.sums[half] += share * other.sums[half];
            self.rays[half] += share * other.rays[half];
        }
    }

    /// The light by the rays of one half; none where it has none.
    fn mean(&self, half: usize) -> Option<Vec3> {
        (self.rays[half] > 0.0).then(|| self.sums[half] / self.rays[half])
    }
}

/// The surfaces of all pixels whose light may be smoothed, pixel by pixel.
struct Surfaces<'a> {
    pixels: &'a [Pixel],
    width: usize,
    /// Number of the first surface of every pixel.
    starts: Vec<u32>,
    list: Vec<Surface>,
}

impl<'a> Surfaces<'a> {
    fn new(camera_rays: &CameraRays, pixels: &'a [Pixel]) -> Surfaces<'a> {
        let is_plain = |layer: &Layer| !camera_rays.shows_highlights(layer.key.material);
        let (mut starts, mut list) = (vec![0], Vec::new());
        for (k, pixel) in pixels.iter().enumerate() {
            if pixel.met.emitting == 0 && pixel.layers.iter().all(is_plain) {
                list.extend(pixel.layers.iter().map(|layer| Surface::new(k, pixel, layer)));
            }
            starts.push(list.len() as u32);
        }
        Surfaces { pixels, width: camera_rays.view.width, starts, list }
    }

    fn of_pixel(&self, k: usize) -> std::ops::Range<usize> {
        self.starts[k] as usize..self.starts[k + 1] as usize
    }

    /// Direct light of each half at the level chosen, sums over its rays; none where that is the pixel's own.
    fn smoothed(&self) -> Vec<Option<[DVec3; 2]>> {
        let layer = |i: usize, surface: &Surface| {
            let k = surface.pixel as usize;
            &self.pixels[k].layers[i - self.starts[k] as usize]
        };
        let own: Vec<Arriving> = self.list.par_iter().enumerate().map(|(i, s)| Arriving::new(layer(i, s))).collect();
        let mut best = self.own_misfits(&own);
        let mut light = own.clone();
        let mut shown: Vec<Option<[DVec3; 2]>> = vec![None; self.pixels.len()];
        for level in 0..LEVELS {
            light = self.smoother(&light, 1 << level);
            let misfits = self.around(&self.misfits(&light, &own));
            let choose = |(k, (shown, best)): (usize, (&mut Option<[DVec3; 2]>, &mut [f64; 2]))| {
                for half in (0..2).filter(|_| !self.of_pixel(k).is_empty()) {
                    if misfits[k][half] < best[half] {
                        let raw = || self.pixels[k].light.direct();
                        shown.get_or_insert_with(raw)[half] = self.reflected(k, half, &light);
                        best[half] = misfits[k][half];
                    }
                }
            };
            shown.par_iter_mut().zip(&mut best).enumerate().for_each(choose);
        }
        shown
    }

    /// What a half of pixel k reflects of some light, the sum over its rays.
    fn reflected(&self, k: usize, half: usize, light: &[Arriving]) -> DVec3 {
        let of = |(layer, light): (&Layer, &Arriving)| {
            let light = light.mean(half).unwrap_or_default();
            layer.reflected()[half] * light.as_dvec3()
        };
        self.pixels[k].layers.iter().zip(&light[self.of_pixel(k)]).map(of).sum()
    }

    /// One level more, whose kernel has holes of `step`.
    fn smoother(&self, light: &[Arriving], step: usize) -> Vec<Arriving> {
        let (width, height) = (self.width as isize, (self.pixels.len() / self.width) as isize);
        let one = |own: &Surface| {
            let (x, y) = (own.pixel as isize % width, own.pixel as isize / width);
            let mut sum = Arriving::default();
            for (dx, dy) in (0..9).map(|i| (i % 3 - 1, i / 3 - 1)) {
                let (column, row) = (x + dx * step as isize, y + dy * step as isize);
                if !(0..width).contains(&column) || !(0..height).contains(&row) {
                    continue;
                }
                let kernel = 0.25 / (1 << (dx * dx + dy * dy)) as f32;
                for j in self.of_pixel((row * width + column) as usize) {
                    let share = own.shares(&self.list[j]);
                    if share > 0.0 {
                        sum.add(kernel * share, &light[j]);
                    }
                }
            }
            sum
        };
        self.list.par_iter().map(one).collect()
    }

    /// Squared differences of the light of each half of a pixel to what its other half found; 0 without surfaces.
    fn misfits(&self, light: &[Arriving], own: &[Arriving]) -> Vec<[f64; 2]> {
        let of_surface = |i: usize, half: usize| {
            let apart = light[i].mean(half).zip(own[i].mean(1 - half)).map(|(light, other)| light - other);
            self.list[i].reflects * apart.unwrap_or_default()
        };
        let of_half = |k: usize, half: usize| self.of_pixel(k).map(|i| of_surface(i, half)).sum::<Vec3>();
        let of_pixel = |k: usize| [0, 1].map(|half| f64::from(of_half(k, half).length_squared()));
        (0..self.pixels.len()).into_par_iter().map(of_pixel).collect()
    }

    /// The same where nothing is smoothed, over the pixels around each, less what the mean of both halves loses of it.
    ///
    /// Of `|A - B|²` half is the variance of B, as at every level, and half that of A, which goes as the inverse of the
    /// rays of pixel k and not of those around. Noise of A halves in the mean of both halves, where what smoothing
    /// does to the light stays, so it counts by half.
    fn own_misfits(&self, own: &[Arriving]) -> Vec<[f64; 2]> {
        let misfits = self.misfits(own, own);
        let rays = |k: usize| f64::from(self.pixels[k].count);
        let weighted: Vec<[f64; 2]> = (0..misfits.len()).map(|k| misfits[k].map(|one| rays(k) * one)).collect();
        let [plain, weighted] = [misfits, weighted].map(|all| self.around(&all));
        let sum = |k: usize| [0, 1].map(|half| 0.5 * plain[k][half] + 0.25 * weighted[k][half] / rays(k));
        (0..plain.len()).map(sum).collect()
    }

    /// Sums over the pixels around each but not its own.
    fn around(&self, own: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let add = |a: [f64; 2], b: [f64; 2]| [a[0] + b[0], a[1] + b[1]];
        let across = |k: usize| {
            let row = k - k % self.width;
            let [columns, _] = spans(k, AROUND, self.width, self.pixels.len());
            columns.map(|x| row + x).filter(|j| *j != k).map(|j| own[j]).fold([0.0; 2], add)
        };
        let rows: Vec<[f64; 2]> = (0..own.len()).into_par_iter().map(across).collect();
        let sum = |k: usize| {
            let (x, y) = (k % self.width, k / self.width);
            let [_, others] = spans(k, AROUND, self.width, self.pixels.len());
            let whole = |row: usize| add(rows[row * self.width + x], own[row * self.width + x]);
            others.filter(|row| *row != y).map(whole).fold(rows[k], add)
        };
        (0..own.len()).into_par_iter().map(sum).collect()
    }

    /// Squared errors of the pixels that are smoothed, spread over those around, whose sum is that of all and its
    /// standard error; none where that does not pay.
    fn variances(&self, smoothed: &[Option<[DVec3; 2]>]) -> Option<Vec<DVec3>> {
        let judged = |k: usize| {
            let pixel = &self.pixels[k];
            let (light, raw, direct) = (smoothed[k]?, pixel.halves(), pixel.light.direct());
            let smooth = [0, 1].map(|half| raw[half] - direct[half] + light[half]);
            let of = |halves: [DVec3; 2]| Halves::of(halves.map(|half| half / f64::from(pixel.count)));
            Some([of(smooth).crossed(of(raw)), of(raw).variance()])
        };
        let judged: Vec<Option<[DVec3; 2]>> = (0..self.pixels.len()).into_par_iter().map(judged).collect();
        let sum = |of: &dyn Fn(&[DVec3; 2]) -> f64| judged.iter().flatten().map(of).sum::<f64>();
        let [left, before] = [0, 1].map(|i| sum(&|own| own[i].element_sum()));
        let unsure = sum(&|own| own[0].element_sum().powi(2)).sqrt();
        let stated = left.max(0.0) + unsure;
        let own = |(k, pixel): (usize, &Pixel)| match smoothed[k] {
            Some(_) => 0.0,
            None => pixel.weight() * pixel.variance(pixel.halves_below(0.0)).element_sum(),
        };
        let others: f64 = self.pixels.iter().enumerate().map(own).sum();
        if stated + others >= PAYS * (before + others) {
            return None;
        }
        let left = |k: usize| judged[k].map(|own| own[0]);
        let spread: Vec<DVec3> = (0..judged.len()).into_par_iter().map(|k| self.spread(k, &left)).collect();
        let total: f64 = spread.iter().map(|one| one.element_sum()).sum();
        // Where it lies is not known.
        if total == 0.0 {
            return None;
        }
        Some(spread.into_iter().map(|one| one * (stated / total)).collect())
    }

    /// The mean of what is known of the pixels around one that show as many surfaces, one or several; no less than
    /// nothing.
    fn spread(&self, k: usize, own: &impl Fn(usize) -> Option<DVec3>) -> DVec3 {
        if own(k).is_none() {
            return DVec3::ZERO;
        }
        let is_edge = |k: usize| self.of_pixel(k).len() > 1;
        let around = window(k, POOL, self.width, self.pixels.len());
        let alike = around.filter(|&j| is_edge(j) == is_edge(k)).filter_map(own);
        let (sum, count) = alike.fold((DVec3::ZERO, 0.0), |(sum, count), one| (sum + one, count + 1.0));
        (sum / count).max(DVec3::ZERO)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gather::nearness::NOBODY;
    use crate::gather::pixels::adaptive_sampling::{Plan, sample_pixels};
    use crate::gather::pixels::camera_rays::CameraSampling;
    use crate::gather::sampling::Limit;
    use crate::light::{Mode, Rgb};
    use crate::rays::sobol::Stream;
    use crate::reading::patch_light::Fields;
    use crate::reading::view::{View, lights_of};

    const SIDE: usize = 192;

    /// Calls `test` with the pixels of the Cornell box, what they show, shadows and all, and what smooths it.
    fn with_pixels(test: impl FnOnce(&CameraRays, Vec<Pixel>, Vec<DVec3>)) {
        let lights = lights_of("cornell-box", Mode::OneBounce.transport(), 200);
        let view = View::new(&lights, (SIDE, SIDE).into());
        let fields = Fields::new(&[vec![Rgb::ZERO; view.patches.len()]]);
        let rays = CameraRays::new(&view, &fields, &CameraSampling { tabled: 64, visibility: 1, seed: 0 });
        let pixels = sample_pixels(&rays, &Plan { first: 4, noise: None, limit: Limit::NONE, nearing: NOBODY });
        let shown = |pixel: &Pixel| pixel.light.direct().into_iter().sum::<DVec3>() / pixel.camera();
        let truth = pixels.iter().map(shown).collect();
        test(&rays, pixels, truth);
    }

    /// Gives pixels their true light times 1 and noise of each half, uniform up to `noise`.
    fn set_light(pixels: &mut [Pixel], truth: &[DVec3], noise: f64, random: &mut Stream) {
        for (pixel, truth) in pixels.iter_mut().zip(truth) {
            for half in 0..2 {
                let noise = noise * (2.0 * f64::from(random.uniform()) - 1.0);
                pixel.light.lit[half] = (1.0 + noise) * *truth * f64::from(pixel.count);
                if let [layer] = &mut pixel.layers[..] {
                    layer.lit[half] = pixel.light.lit[half];
                }
            }
        }
    }

    /// Squared errors of pixels that are smoothed: without, with smoothing, and as stated.
    fn squared_errors(pixels: &[Pixel], truth: &[DVec3]) -> [f64; 3] {
        let mut sums = [0.0; 3];
        for (pixel, truth) in pixels.iter().zip(truth).filter(|(pixel, _)| pixel.light.smooth.is_some()) {
            let off = |[a, b]: [DVec3; 2]| ((a + b) / pixel.camera() - truth).length_squared();
            sums[0] += off(pixel.light.direct());
            sums[1] += off(pixel.light.shown_direct());
            sums[2] += pixel.shown_variance().element_sum();
        }
        sums
    }

    /// What is left is stated, its own standard error added, of noise and of shadows that were smoothed too far: in the
    /// mean of several pictures no less than is true.
    #[test]
    fn what_smoothing_leaves_is_stated() {
        with_pixels(|rays, mut pixels, truth| {
            for noise in [0.2, 0.5] {
                let (mut random, mut sums) = (Stream::new(3), [0.0; 3]);
                for _ in 0..4 {
                    set_light(&mut pixels, &truth, noise, &mut random);
                    assert!(smooth(rays, &mut pixels));
                    let own = squared_errors(&pixels, &truth);
                    (0..3).for_each(|i| sums[i] += own[i]);
                }
                let [raw, smoothed, stated] = sums;
                assert!(smoothed < 0.5 * raw, "{noise}: {smoothed} of {raw}");
                assert!((1.0..1.5).contains(&(stated / smoothed)), "{noise}: {stated} stated, {smoothed}");
            }
        });
    }

    /// Light without noise needs no smoothing.
    #[test]
    fn light_without_noise_stays_as_it_is() {
        with_pixels(|rays, mut pixels, truth| {
            set_light(&mut pixels, &truth, 0.0, &mut Stream::new(0));
            assert!(!smooth(rays, &mut pixels));
            assert!(pixels.iter().all(|pixel| pixel.light.smooth.is_none()));
        });
    }
}
