//! Indirect light of the pixels from the irradiance points, and the pictures with their errors.
//!
//! Not handled: where to put points and how many rays they get ([`crate::gather::budget`]).

use glam::DVec3;
use rayon::prelude::*;

use crate::gather::adaptive_sampling::{choose, double, measure};
use crate::gather::camera_rays::Pass;
use crate::gather::fields::Fields;
use crate::gather::gathered::{GatherError, Gathered};
use crate::gather::interpolation::Fit;
use crate::gather::irradiance_cache::Points;
use crate::gather::pixel::Pixel;
use crate::light::Rgb;
use crate::pictures::Picture;

/// Places of one row's chosen pixels before those of the next: creases lie along rows and columns, none may be missed.
const SKEW: usize = 4;
/// Rounds of more camera rays.
const ROUNDS: usize = 12;

/// Indirect light of every pixel, and the variance of its sum over the leading fields.
#[derive(Default)]
pub(crate) struct Found {
    pixels: Vec<Indirect>,
    /// Squared error of the fit, summed over the pixels that see no luminaire.
    misfit: f64,
}

#[derive(Default)]
struct Indirect {
    fields: Vec<Rgb>,
    variance: DVec3,
    /// Product of the two halves of every field that rides along, channels added: free of noise in the mean.
    riders: Vec<f64>,
    /// What each half of the camera rays reflects, sums over them.
    ambient: [DVec3; 2],
}

/// Sums over the pixels, weighted as they count.
#[derive(Default)]
pub(crate) struct Sums {
    pub variance: f64,
    pub signal: f64,
    pub count: f64,
}

impl Found {
    /// One pixel in `step`, in every row and column; the others stay dark.
    pub fn new(pixels: &[Pixel], points: &Points, fields: &Fields, step: usize) -> Found {
        let width = points.width();
        let reflected = |memory: &mut (Fit, Vec<[DVec3; 2]>), (k, pixel): (usize, &Pixel)| {
            if (k % width + SKEW * (k / width)) % step != step / 2 {
                return Indirect::default();
            }
            indirect(k, pixel, points, fields, memory)
        };
        let indexed = pixels.par_iter().enumerate();
        Found { pixels: indexed.map_init(Default::default, reflected).collect(), misfit: 0.0 }
    }

    /// States the squared error of the fit, summed over the pixels that see no luminaire.
    pub fn biased_by(mut self, misfit: f64) -> Found {
        self.misfit = misfit.max(0.0);
        self
    }

    pub fn measure(&self, pixels: &[Pixel]) -> Sums {
        let mut sums = Sums::default();
        let seen = self.pixels.iter().zip(pixels);
        for (found, pixel) in seen.filter(|(f, _)| !f.fields.is_empty()) {
            let total: Rgb = found.fields.iter().sum();
            sums.variance += pixel.weight() * found.variance.element_sum();
            sums.signal += pixel.weight() * total.as_dvec3().length_squared();
            sums.count += pixel.weight();
        }
        sums
    }

    /// Gives pixels more camera rays where the light now gathered varies within them.
    pub fn sharpen(&mut self, pass: &Pass, pixels: &mut [Pixel], points: &Points, noise: Option<f64>) {
        let width = points.width();
        for (pixel, found) in pixels.iter_mut().zip(&self.pixels) {
            pixel.ambient = found.ambient;
        }
        let Some(noise) = noise else { return };
        for _ in 0..ROUNDS {
            let chosen = choose(pixels, width, noise);
            if chosen.is_empty() {
                return;
            }
            double(pass, pixels, &chosen);
            let again =
                |memory: &mut _, &k: &u32| indirect(k as usize, &pixels[k as usize], points, pass.fields, memory);
            let found: Vec<Indirect> = chosen.par_iter().map_init(Default::default, again).collect();
            for (&k, found) in chosen.iter().zip(found) {
                pixels[k as usize].ambient = found.ambient;
                self.pixels[k as usize] = found;
            }
        }
    }

    /// The pictures of all parts, with their errors.
    pub fn assemble(&self, pixels: &[Pixel], fields: &Fields, (width, height): (usize, usize)) -> Gathered {
        let picture = |value: &dyn Fn(usize) -> DVec3| Picture {
            width,
            height,
            pixels: (0..pixels.len()).map(|k| value(k).as_vec3()).collect(),
        };
        let own = |k: usize| self.pixels.get(k);
        let variance = |k: usize| own(k).map_or(DVec3::ZERO, |p| p.variance);
        let field = |f: usize| picture(&|k| own(k).map_or(DVec3::ZERO, |p| p.fields[f].as_dvec3()));
        let deviation = |k: usize| (pixels[k].variance() + variance(k)).map(f64::sqrt);
        let cast: f64 = pixels.iter().map(Pixel::camera).sum();
        let reflecting: u64 = pixels.iter().map(|p| u64::from(p.reflecting)).sum();
        let backs: u64 = pixels.iter().map(|p| u64::from(p.backs)).sum();
        Gathered {
            emission: picture(&|k| pixels[k].emission / pixels[k].camera()),
            direct: picture(&|k| pixels[k].direct / pixels[k].camera()),
            indirect: (0..fields.count()).map(field).collect(),
            standard_error: picture(&deviation),
            error: self.error(pixels),
            riders: self.riders(pixels, fields),
            backs: backs as f64 / cast,
            sees: reflecting as f64 / cast,
            rays: pixels.iter().map(|p| p.rays).sum(),
            leading: fields.leading(),
        }
    }

    /// RMS of the picture of every field that rides along.
    fn riders(&self, pixels: &[Pixel], fields: &Fields) -> Vec<f64> {
        let mut sums = vec![0.0; fields.count() - fields.leading()];
        let seen = self.pixels.iter().zip(pixels);
        for (found, pixel) in seen {
            for (sum, product) in sums.iter_mut().zip(&found.riders) {
                *sum += pixel.weight() * product;
            }
        }
        let count = measure(pixels).count.max(1.0);
        let rms = |sum: f64| (sum.max(0.0) / (3.0 * count)).sqrt();
        sums.into_iter().map(rms).collect()
    }

    fn error(&self, pixels: &[Pixel]) -> GatherError {
        let camera = measure(pixels);
        let indirect = self.measure(pixels);
        let rms = |sum: f64| (sum / (3.0 * camera.count.max(1.0))).sqrt();
        GatherError {
            camera: rms(camera.variance),
            hemisphere: rms(indirect.variance),
            fit: rms(self.misfit),
            signal: rms(camera.signal),
        }
    }
}

/// What one pixel reflects of every field, and the variance of the leading ones together.
fn indirect(
    k: usize,
    pixel: &Pixel,
    points: &Points,
    fields: &Fields,
    (fit, found): &mut (Fit, Vec<[DVec3; 2]>),
) -> Indirect {
    let leading = fields.leading();
    let mut halves = [DVec3::ZERO; 2];
    let mut sums = vec![DVec3::ZERO; fields.count()];
    let mut riders = vec![[DVec3::ZERO; 2]; fields.count() - leading];
    let mut ambient = [DVec3::ZERO; 2];
    for layer in pixel.layers.iter().enumerate() {
        let counts = layer.1.count.map(f64::from);
        let rho = layer.1.rho.as_dvec3() * ((counts[0] + counts[1]) / pixel.camera());
        let change = points.at(fit, k, layer, leading, found);
        let mut total = DVec3::ZERO;
        for (f, [a, b]) in found.iter().enumerate() {
            let mean = 0.5 * (*a + *b);
            // A plane through noise may dip below the dark; light does not. Differences of fields may.
            let mean = if f < leading { mean.max(DVec3::ZERO) } else { mean };
            sums[f] += rho * mean;
            let own = match f.checked_sub(leading) {
                Some(rider) => &mut riders[rider],
                None => {
                    total += mean;
                    &mut halves
                }
            };
            own[0] += rho * *a;
            own[1] += rho * *b;
        }
        for half in 0..2 {
            ambient[half] += layer.1.rho.as_dvec3() * (counts[half] * (total + change[half]));
        }
    }
    let d = 0.5 * (halves[0] - halves[1]);
    Indirect {
        fields: sums.iter().map(|s| s.as_vec3()).collect(),
        variance: d * d,
        riders: riders.iter().map(|[a, b]| a.dot(*b)).collect(),
        ambient,
    }
}
