//! Indirect light of the pixels from the irradiance cache, and the pictures with their errors.
//!
//! Not handled: where to place records and how many rays they get ([`crate::gather::records::record_rounds`]).

use glam::DVec3;
use halflight_team::Loop;

use crate::error::halves::Halves;
use crate::gather::gathered::{GatherError, Gathered, GatheredLayer};
use crate::gather::pixels::adaptive_sampling::{Measured, Plan, measure, outlines, refine};
use crate::gather::pixels::camera_rays::CameraRays;
use crate::gather::pixels::pixel::Pixel;
use crate::gather::records::irradiance_cache::{Fitted, IrradianceCache, RecordedLight};
use crate::gather::records::pixel_lattice::skewed;
use crate::light::Rgb;
use crate::pictures::Picture;
use crate::reading::patch_light::{FieldLayers, Fields, to_whole};
use crate::reading::view::View;

/// Indirect light of every pixel, and the variance of its sum over the picture fields.
#[derive(Default)]
pub(crate) struct IndirectLight {
    pixels: Vec<PixelIndirect>,
    /// Number of fields that make the picture.
    picture_fields: usize,
    /// Squared error of the fit, summed over the pixels that see no luminaire.
    misfit: f64,
}

/// Indirect light of one pixel.
#[derive(Default)]
pub(crate) struct PixelIndirect {
    /// Every field's light.
    pub fields: Vec<Rgb>,
    /// Of the sum of the picture fields.
    pub variance: DVec3,
    /// Product of the two halves of every auxiliary field, channels added: no bias by noise.
    pub auxiliary: Vec<f64>,
    /// Both halves of the layers of the picture, each set of which adds up to it.
    pub layers: Vec<[DVec3; 2]>,
    /// What each half of the camera rays reflects, sums over them.
    pub ambient: [DVec3; 2],
}

impl IndirectLight {
    /// One pixel in `step`, in every row and column; the others stay dark.
    pub(crate) fn new(pixels: &[Pixel], cache: &IrradianceCache, step: usize) -> IndirectLight {
        let width = cache.light.lattice.width();
        let reflected = |fitted: &mut Fitted, k: usize| {
            let chosen = skewed(k, width) % step == step / 2;
            if chosen { indirect(k, &pixels[k], cache, fitted) } else { PixelIndirect::default() }
        };
        let pixels = Loop::each(pixels.len()).map_init(Fitted::default, reflected);
        IndirectLight { pixels, picture_fields: cache.light.picture_fields, misfit: 0.0 }
    }

    /// States the squared error of the fit, summed over the pixels that see no luminaire.
    pub(crate) fn biased_by(mut self, misfit: f64) -> IndirectLight {
        self.misfit = positive(misfit);
        self
    }

    /// The noise of the indirect light and the light itself, over the pixels that were gathered.
    pub(crate) fn measure(&self, pixels: &[Pixel]) -> Measured {
        let mut sums = Measured::default();
        let seen = self.pixels.iter().zip(pixels);
        for (light, pixel) in seen.filter(|(f, _)| !f.fields.is_empty()) {
            let total: Rgb = light.fields[..self.picture_fields].iter().sum();
            sums.add(pixel, light.variance, total.as_dvec3());
        }
        sums
    }

    /// Gives pixels more camera rays where the light now gathered varies within them.
    pub(crate) fn sharpen(
        &mut self,
        camera_rays: &CameraRays,
        pixels: &mut [Pixel],
        cache: &IrradianceCache,
        plan: &Plan,
    ) {
        for (pixel, light) in pixels.iter_mut().zip(&self.pixels) {
            pixel.light.ambient = light.ambient;
        }
        refine(camera_rays, pixels, plan, |pixels, extended| {
            let again = |fitted: &mut Fitted, i: usize| {
                let k = extended[i] as usize;
                indirect(k, &pixels[k], cache, fitted)
            };
            let light = Loop::each(extended.len()).map_init(Fitted::default, again);
            for (&k, light) in extended.iter().zip(light) {
                pixels[k as usize].light.ambient = light.ambient;
                self.pixels[k as usize] = light;
            }
        });
    }

    /// The pictures of all parts, with their errors.
    pub(crate) fn assemble(&self, pixels: &[Pixel], fields: &Fields, view: &View) -> Gathered {
        let own = |k: usize| self.pixels.get(k);
        let variance = |k: usize| own(k).map_or(DVec3::ZERO, |p| p.variance);
        let picture = |value: &dyn Fn(usize) -> DVec3| drawn(view, value);
        let field = |f: usize| picture(&|k| own(k).map_or(DVec3::ZERO, |p| p.fields[f].as_dvec3()));
        let deviation = |k: usize| (pixels[k].shown_variance() + variance(k)).map(f64::sqrt);
        let cast: f64 = pixels.iter().map(Pixel::camera).sum();
        let rays: u64 = pixels.iter().map(|p| p.met.rays).sum();
        let reflecting: u64 = pixels.iter().map(|p| u64::from(p.met.reflecting)).sum();
        let backs: u64 = pixels.iter().map(|p| u64::from(p.met.backs)).sum();
        Gathered {
            emission: picture(&|k| pixels[k].mean_emission()),
            direct: picture(&|k| whole(pixels[k].light.shown_direct()) / pixels[k].camera()),
            indirect: (0..fields.count()).map(field).collect(),
            standard_error: picture(&deviation),
            error: self.error(pixels),
            layers: self.layers(pixels, fields.layers(), view),
            auxiliary_rms: self.auxiliary_rms(pixels, fields),
            backs: backs as f64 / cast,
            sees: reflecting as f64 / cast,
            luminaire_rays: rays as f64 / cast - 1.0,
            rays,
            picture_fields: fields.picture_fields(),
        }
    }

    /// The layers of the picture: those of the emitters, then those of the bounces, E first.
    fn layers(&self, pixels: &[Pixel], fields: FieldLayers, view: &View) -> Vec<GatheredLayer> {
        // Both halves of field f of a pixel, sums over the camera rays of each; those of its mean over them.
        let indirect = |k: usize, f: usize| -> [DVec3; 2] {
            let own = self.pixels.get(k).and_then(|light| light.layers.get(f));
            own.map_or([DVec3::ZERO; 2], |halves| halves.map(|half| half * f64::from(pixels[k].count)))
        };
        let fit = self.misfit_share(pixels);
        let added = |a: [DVec3; 2], b: [DVec3; 2]| [a[0] + b[0], a[1] + b[1]];
        // What pixels show as emitted, as reflected from emitters, and as field f.
        let layer = |glow: &Sums, direct: &Sums, field: Option<usize>| {
            let of_field = |k: usize| field.map_or([DVec3::ZERO; 2], |f| indirect(k, f));
            let reflected = |k: usize| added(direct(k), of_field(k));
            let all = |k: usize| added(glow(k), reflected(k));
            // Halves that were smoothed alike may be off alike.
            let smoothed = |k: usize| pixels[k].light.smooth.as_ref().filter(|smooth| smooth.direct == direct(k));
            let variance = |k: usize, halves: [DVec3; 2]| {
                pixels[k].variance(halves).max(smoothed(k).map_or(DVec3::ZERO, |smooth| smooth.variance))
            };
            let (mut squares, mut noise, mut count) = (0.0, 0.0, 0.0);
            for (k, pixel) in pixels.iter().enumerate() {
                let light = |halves: [DVec3; 2]| (whole(halves) / pixel.camera()).length_squared();
                count += pixel.weight();
                squares += pixel.weight() * light(reflected(k));
                let own = variance(k, reflected(k)).element_sum();
                noise += pixel.weight() * (own + fit * light(of_field(k)));
            }
            let rms = |sum: f64| (sum / (3.0 * f64::max(count, 1.0))).sqrt();
            GatheredLayer {
                picture: drawn(view, |k| whole(all(k)) / pixels[k].camera()),
                half: drawn(view, |k| difference(all(k)) / pixels[k].camera()),
                standard_error: drawn(view, |k| variance(k, all(k)).map(f64::sqrt)),
                rms: rms(squares),
                noise: rms(noise),
            }
        };
        let nothing = |_: usize| [DVec3::ZERO; 2];
        let emitter = |e: usize| {
            let glow = |k: usize| pixels[k].light.glow_of(e, pixels[k].count);
            layer(&glow, &|k| pixels[k].light.direct_of(e), Some(e))
        };
        let bounce = |n: usize| match n {
            0 => layer(&|k| pixels[k].light.emission(pixels[k].count), &nothing, None),
            1 => layer(&nothing, &|k| pixels[k].light.shown_direct(), Some(fields.emitters)),
            _ => layer(&nothing, &nothing, Some(fields.emitters + n - 1)),
        };
        let bounces = if fields.bounces > 0 { fields.bounces + 1 } else { 0 };
        (0..fields.emitters).map(emitter).chain((0..bounces).map(bounce)).collect()
    }

    /// The squared error of fits as a share of the squared light that they interpolate, summed over the pixels.
    fn misfit_share(&self, pixels: &[Pixel]) -> f64 {
        let squared = |(light, pixel): (&PixelIndirect, &Pixel)| {
            let all: DVec3 = light.fields[..self.picture_fields].iter().map(|field| field.as_dvec3()).sum();
            pixel.weight() * all.length_squared()
        };
        let squares: f64 = self.pixels.iter().zip(pixels).map(squared).sum();
        if squares > 0.0 { self.misfit / squares } else { 0.0 }
    }

    /// RMS of the picture of every auxiliary field.
    fn auxiliary_rms(&self, pixels: &[Pixel], fields: &Fields) -> Vec<f64> {
        let mut sums = vec![0.0; fields.first_layer() - fields.picture_fields()];
        let seen = self.pixels.iter().zip(pixels);
        for (light, pixel) in seen {
            for (sum, product) in sums.iter_mut().zip(&light.auxiliary) {
                *sum += pixel.weight() * product;
            }
        }
        let count = pixels.iter().map(Pixel::weight).sum::<f64>().max(1.0);
        let rms = |sum: f64| (positive(sum) / (3.0 * count)).sqrt();
        sums.into_iter().map(rms).collect()
    }

    /// The parts of the error, RMS over the pixels that see no luminaire.
    fn error(&self, pixels: &[Pixel]) -> GatherError {
        let camera = measure(pixels);
        let indirect = self.measure(pixels);
        let rms = |sum: f64| (sum / (3.0 * camera.count.max(1.0))).sqrt();
        let shown: f64 = pixels.iter().map(|pixel| pixel.mean_emission().length_squared()).sum();
        let noise: f64 = pixels.iter().map(|pixel| pixel.emission_variance().element_sum()).sum();
        GatherError {
            emission: [noise, shown].map(|sum| (sum / (3 * pixels.len().max(1)) as f64).sqrt()),
            camera: rms(camera.variance + outlines(pixels)),
            hemisphere: rms(indirect.variance),
            fit: rms(self.misfit),
            signal: rms(camera.signal),
        }
    }
}

/// Both halves of some light of a pixel, sums over the camera rays of each.
type Sums<'a> = dyn Fn(usize) -> [DVec3; 2] + 'a;

/// The picture of a value for each pixel.
fn drawn(view: &View, value: impl Fn(usize) -> DVec3) -> Picture {
    let &View { width, height, .. } = view;
    Picture { width, height, pixels: (0..width * height).map(|k| value(k).as_vec3()).collect() }
}

/// The sum of two halves.
fn whole([a, b]: [DVec3; 2]) -> DVec3 {
    a + b
}

/// The difference of two halves.
fn difference([a, b]: [DVec3; 2]) -> DVec3 {
    a - b
}

/// A squared error by products of halves, which noise may make negative; NaN stays, where [`f64::max`] makes it 0.
fn positive(squared: f64) -> f64 {
    if squared < 0.0 { 0.0 } else { squared }
}

/// What one pixel reflects of every field, and the variance of the picture fields together.
fn indirect(k: usize, pixel: &Pixel, cache: &IrradianceCache, fitted: &mut Fitted) -> PixelIndirect {
    let &RecordedLight { fields, picture_fields, .. } = &cache.light;
    let field_layers = cache.caster.final_gather.fields.layers();
    let mut halves = [DVec3::ZERO; 2];
    let mut sums = vec![DVec3::ZERO; fields];
    let mut auxiliary = vec![[DVec3::ZERO; 2]; fields - picture_fields];
    let mut ambient = [DVec3::ZERO; 2];
    for (l, layer) in pixel.layers.iter().enumerate() {
        let counts = layer.count.map(f64::from);
        let reflected = layer.reflected();
        let rho = layer.mean_reflectance(pixel.camera());
        let change = cache.at(fitted, k, l, layer);
        let mut total = DVec3::ZERO;
        for (f, [a, b]) in fitted.values.iter().enumerate() {
            let mean = 0.5 * (*a + *b);
            // A plane through noise may dip below the dark; light does not. Differences of fields may.
            let mean = if f < picture_fields { mean.max(DVec3::ZERO) } else { mean };
            sums[f] += rho * mean;
            let own = match f.checked_sub(picture_fields) {
                Some(number) => &mut auxiliary[number],
                None => {
                    total += mean;
                    &mut halves
                }
            };
            own[0] += rho * *a;
            own[1] += rho * *b;
        }
        for half in 0..2 {
            let mean = if counts[half] > 0.0 { reflected[half] / counts[half] } else { DVec3::ZERO };
            ambient[half] += mean * (counts[half] * (total + change[half]));
        }
    }
    let (others, layers) = auxiliary.split_at(auxiliary.len() - field_layers.count());
    PixelIndirect {
        fields: sums.iter().map(|s| s.as_vec3()).collect(),
        variance: Halves::of(halves).variance(),
        auxiliary: others.iter().map(|own| Halves::of(*own).squared()).collect(),
        layers: apart(layers, sums[..picture_fields].iter().sum(), field_layers),
        ambient,
    }
}

/// Halves of the layers, each set of which is scaled to the light of the picture: slopes of its patches differ from the
/// sum of theirs.
fn apart(fields: &[[DVec3; 2]], total: DVec3, layers: FieldLayers) -> Vec<[DVec3; 2]> {
    if fields.is_empty() {
        return Vec::new();
    }
    let (emitters, bounces) = fields.split_at(layers.emitters);
    let mut all = Vec::with_capacity(layers.count());
    for set in [emitters, bounces] {
        let light = |[a, b]: &[DVec3; 2]| (0.5 * (*a + *b)).max(DVec3::ZERO);
        let (scale, rest) = to_whole(set.iter().map(light), total);
        all.extend(set.iter().map(|halves| {
            let half = 0.5 * (halves[0] - halves[1]);
            let mean = light(halves);
            [mean + half, mean - half].map(|value| scale * value + rest)
        }));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_is_not_taken_for_no_error() {
        assert_eq!([-1.0, 0.0, 2.0].map(positive), [0.0, 0.0, 2.0]);
        assert!(positive(f64::NAN).is_nan());
    }
}
