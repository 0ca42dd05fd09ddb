//! Sums over the camera rays of one pixel, surface by surface, in two halves whose difference is the standard error.
//!
//! A pixel on an edge sees several surfaces: each has its own irradiance, weighted by the share of the camera rays that
//! met it. Facets of one smooth body that continue each other count as one surface.
//!
//! Not handled: indirect light that is gathered; until then the light that patches receive stands for it. Gathered
//! light that varies with the texture within a pixel: its mean is multiplied by the mean of rho.

use glam::DVec3;

use crate::error::halves::Halves;
use crate::gather::pixels::pixel_layer::{Layer, SurfaceKey};
use crate::gather::pixels::pixel_light::PixelLight;
use crate::gather::pixels::pixel_noise::PixelNoise;
use crate::gather::pixels::pixel_texture::PixelTexture;
use crate::surfaces::SurfacePoint;

/// Sums over the camera rays of one pixel.
#[derive(Default)]
pub(crate) struct Pixel {
    /// Camera rays of each half.
    pub count: u32,
    pub light: PixelLight,
    pub met: Met,
    /// The surfaces that reflect indirect light to it.
    pub layers: Vec<Layer>,
    /// The texture, where all of it is one surface.
    pub texture: PixelTexture,
    /// The faces smaller than it that it shows.
    pub small_faces: Vec<SmallFace>,
    pub noise: PixelNoise,
    /// Whether the pixel counts in the error whatever it emits, as where the picture shows nothing but luminaires.
    pub counts_emission: bool,
}

/// What the camera rays of a pixel met.
#[derive(Default)]
pub(crate) struct Met {
    /// Camera rays that met light as emitted.
    pub emitting: u32,
    /// Camera rays that met a side that reflects.
    pub reflecting: u32,
    /// Camera rays that met the black back of a one-sided face.
    pub backs: u32,
    /// Rays cast, to luminaires and punctual lights as well.
    pub rays: u64,
    /// Distances from the camera of the nearest and of the farthest point met, infinite where one met nothing; none
    /// before the first.
    pub reach: Option<[f32; 2]>,
}

/// The sums of a pixel at some moment.
pub(crate) struct HalfSums {
    halves: [DVec3; 2],
    count: u32,
}

/// Share of its distance that a surface seen head on may be nearer or farther within a pixel.
const LEVEL: f32 = 1e-3;

impl Met {
    /// Extends the reach to a distance at which a ray met a point.
    pub(crate) fn extend_reach(&mut self, distance: f32) {
        let [near, far] = self.reach.unwrap_or([distance; 2]);
        self.reach = Some([near.min(distance), far.max(distance)]);
    }

    /// Whether a point is behind all that was met: farther by as much as that differs by.
    pub(crate) fn hides(&self, distance: f32) -> bool {
        self.reach.is_some_and(|[near, far]| distance > far + (far - near) + LEVEL * far)
    }
}

/// The rays of all pixels, and those to luminaires.
pub(crate) fn rays(pixels: &[Pixel]) -> u64 {
    pixels.iter().map(|pixel| pixel.met.rays).sum()
}

impl Pixel {
    /// The layer of a surface seen; a new one if no camera ray has seen it before.
    pub(crate) fn layer(&mut self, key: SurfaceKey, seen: SurfacePoint) -> &mut Layer {
        let known = self.layers.iter().position(|l| l.holds(key, &seen));
        let k = known.unwrap_or_else(|| {
            self.layers.push(Layer::new(key, seen));
            self.layers.len() - 1
        });
        &mut self.layers[k]
    }

    /// Camera rays of both halves.
    pub(crate) fn camera(&self) -> f64 {
        f64::from(2 * self.count)
    }

    /// Whether some camera rays met light as emitted, but not all.
    pub(crate) fn shows_outline(&self) -> bool {
        0 < self.met.emitting && self.met.emitting < 2 * self.count
    }

    /// The mean of what it shows as emitted.
    pub(crate) fn mean_emission(&self) -> DVec3 {
        let [a, b] = self.light.emission(self.count);
        (a + b) / self.camera().max(1.0)
    }

    /// Squared standard error of that.
    pub(crate) fn emission_variance(&self) -> DVec3 {
        self.light.outline.as_ref().map_or_else(|| self.variance(self.light.emitted), |outline| outline.variance)
    }

    /// The squared standard error of what its outline of an emitter shows, which its halves do not have; 0 without one.
    pub(crate) fn outline_variance(&self) -> DVec3 {
        self.light.outline.as_ref().map_or(DVec3::ZERO, |outline| outline.variance)
    }

    /// Whether camera rays disagree about what is emitted: some met any, or the halves different light.
    pub(crate) fn emission_differs(&self) -> bool {
        self.shows_outline() || self.light.emitted[0] != self.light.emitted[1]
    }

    /// All light of each half, sums over its camera rays.
    pub(crate) fn halves(&self) -> [DVec3; 2] {
        self.halves_below(f64::INFINITY)
    }

    /// The light of each half, of which what is emitted counts no more than `bright`, sums over its camera rays.
    pub(crate) fn halves_below(&self, bright: f64) -> [DVec3; 2] {
        self.light.halves(self.count, if self.counts_emission { f64::INFINITY } else { bright })
    }

    /// Standard error squared of the mean of two halves of the camera rays, all channels.
    pub(crate) fn variance(&self, halves: [DVec3; 2]) -> DVec3 {
        Halves::of(halves.map(|half| half * (2.0 / self.camera()))).variance()
    }

    /// Squared standard error of all light that it shows.
    pub(crate) fn shown_variance(&self) -> DVec3 {
        let own = || self.variance(self.halves());
        self.light.smooth.as_ref().map_or_else(own, |smooth| smooth.variance) + self.outline_variance()
    }

    /// The variance, emission counting up to `bright`: that of the halves, or of the last resampling if there is one,
    /// and no less than that of small faces.
    pub(crate) fn variance_below(&self, bright: f64) -> DVec3 {
        self.sampled_variance_below(bright).max(self.small_face_variance())
    }

    /// The variance estimated from rays.
    fn sampled_variance_below(&self, bright: f64) -> DVec3 {
        if let Some(smooth) = &self.light.smooth {
            return smooth.variance;
        }
        self.noise.resampled().unwrap_or_else(|| self.variance(self.halves_below(bright)))
    }

    /// The variance that small faces make which its rays may have missed.
    pub(crate) fn small_face_variance(&self) -> DVec3 {
        let mean = self.reflected();
        self.small_faces.iter().map(|face| face.variance(mean, self.camera())).sum()
    }

    /// Mean reflected light of its rays.
    pub(crate) fn reflected(&self) -> DVec3 {
        self.halves_below(0.0).into_iter().sum::<DVec3>() / self.camera()
    }

    /// Its sums so far.
    pub(crate) fn sums_below(&self, bright: f64) -> HalfSums {
        HalfSums { halves: self.halves_below(bright), count: self.count }
    }

    /// Estimates the variance from the rays since `before`, scaled to all rays.
    pub(crate) fn take_resampled(&mut self, before: HalfSums, bright: f64) {
        let now = self.sums_below(bright);
        let more = f64::from(now.count - before.count);
        let own = Halves::of([0, 1].map(|half| (now.halves[half] - before.halves[half]) / more));
        self.noise.resample(own.variance() * (more / f64::from(now.count)), self.count);
    }

    /// Notes the variance by the difference of the halves, their emission up to `bright`, and predicts it from the one
    /// noted before times the share `remaining` that the rays since are expected to leave.
    pub(crate) fn note_difference(&mut self, bright: f64, remaining: f64) {
        let now = self.sampled_variance_below(bright).element_sum();
        let mean = self.reflected();
        self.noise.is_explained = self.small_faces.iter().any(|face| face.explains(now, mean, self.camera()));
        self.noise.note(now, self.count, remaining);
    }

    /// How much the pixel counts in the error of what surfaces reflect: the share of it that no luminaire covers.
    pub(crate) fn weight(&self) -> f64 {
        if self.counts_emission {
            return 1.0;
        }
        let share = f64::from(self.met.emitting) / self.camera().max(1.0);
        1.0 - share
    }
}

/// Standard deviations of the number of rays that meet a face which count as chance.
const CHANCE: f64 = 4.0;

/// A face within a pixel, or the part of one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SmallFace {
    /// Share of the pixel that it covers.
    pub share: f64,
    /// The light of its middle, as camera rays count it.
    pub light: DVec3,
}

impl SmallFace {
    /// Variance of the mean of so many rays of a pixel with this mean.
    pub(crate) fn variance(&self, mean: DVec3, rays: f64) -> DVec3 {
        let c = self.light - mean;
        let spread = (self.share * rays).sqrt().recip().min(1.0);
        self.share * (1.0 - self.share) / rays * spread * c * c
    }

    /// Whether the number of rays that met it by chance may explain a variance.
    pub(crate) fn explains(&self, variance: f64, mean: DVec3, rays: f64) -> bool {
        let met = 1.0 + self.share * rays;
        CHANCE * CHANCE * met * (self.light - mean).length_squared() >= variance * rays * rays
    }
}
