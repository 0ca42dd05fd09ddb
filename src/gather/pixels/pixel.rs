//! What the camera rays of one pixel found, surface by surface, in two halves whose difference is the standard error.
//!
//! A pixel on an edge sees several surfaces: each has its own irradiance, and the share of the camera rays that saw it
//! weighs it in the pixel. Facets of one smooth body that continue each other count as one surface.
//!
//! Not handled: indirect light that is gathered; until then the light that patches receive stands for it. Light that
//! differs within a surface in step with its texture: of the light gathered, the mean over the pixel is multiplied by
//! the mean of rho.

use glam::DVec3;

use crate::error::halves::Halves;
use crate::gather::pixels::pixel_layer::{Layer, SurfaceKey};
use crate::gather::pixels::pixel_texture::PixelTexture;
use crate::light::Rgb;
use crate::surfaces::SurfacePoint;

/// What one pixel found, sums over its camera rays.
#[derive(Default)]
pub(crate) struct Pixel {
    /// Light as emitted, of each half.
    pub emitted: [DVec3; 2],
    pub direct: DVec3,
    /// Direct light of each half.
    pub lit: [DVec3; 2],
    /// Indirect light of each half: what the patches themselves receive, until it is gathered.
    pub ambient: [DVec3; 2],
    /// Camera rays of each half.
    pub count: u32,
    pub layers: Vec<Layer>,
    /// The texture, where it is the same surface everywhere.
    pub texture: PixelTexture,
    pub backs: u32,
    /// Camera rays that met light as emitted.
    pub emitting: u32,
    /// Whether the pixel counts in the error whatever it emits, as where the picture shows nothing but luminaires.
    pub counts_emission: bool,
    /// Camera rays that met a side that reflects.
    pub reflecting: u32,
    pub rays: u64,
    /// The variance by the difference of the halves, when that was last noted.
    pub differed: f64,
    /// The variance as it was predicted before the last rays were cast, which knows nothing of what they found.
    pub predicted: f64,
    /// Camera rays of each half when the difference was last noted.
    pub noted: u32,
    /// The variance by the rays of the last look alone; none where the pixel was chosen since, or all its rays are one
    /// look.
    resampled: Option<DVec3>,
    /// Whether it was chosen since the last look.
    chosen: bool,
    /// The variance for which it was chosen since the last look, and which others stand for that have missed it.
    pub unseen: f64,
    /// Distances from the camera of the nearest and of the farthest point that its rays met, infinite where one met
    /// nothing; none before the first.
    pub reach: Option<[f32; 2]>,
    /// The faces smaller than it that it shows.
    pub small_faces: Vec<SmallFace>,
    /// Whether one of those may have made what the halves differed by when that was last noted.
    pub is_explained: bool,
}

/// What a pixel found until some moment.
pub(crate) struct HalfSums {
    halves: [DVec3; 2],
    count: u32,
}

/// Share of its distance that a surface seen head on may be nearer or farther within a pixel.
const LEVEL: f32 = 1e-3;
/// Rays that tell whether a pixel sees a luminaire.
const LUMINAIRE_RAYS: i32 = 16;

impl Pixel {
    /// The layer of a surface seen; a new one if no camera ray has seen it before.
    pub fn layer(&mut self, key: SurfaceKey, seen: SurfacePoint, rho: Rgb) -> &mut Layer {
        let found = self.layers.iter().position(|l| l.holds(key, &seen));
        let k = found.unwrap_or_else(|| {
            self.layers.push(Layer::new(key, seen, rho));
            self.layers.len() - 1
        });
        &mut self.layers[k]
    }

    /// Camera rays of both halves.
    pub fn camera(&self) -> f64 {
        f64::from(2 * self.count)
    }

    /// Whether some camera rays met light as emitted, but not all.
    pub fn shows_outline(&self) -> bool {
        0 < self.emitting && self.emitting < 2 * self.count
    }

    /// Light as emitted, sum over the camera rays.
    pub fn emission(&self) -> DVec3 {
        self.emitted[0] + self.emitted[1]
    }

    /// All light of each half, sums over its camera rays.
    pub fn halves(&self) -> [DVec3; 2] {
        self.halves_below(f64::INFINITY)
    }

    /// The light of each half, of which what is emitted counts no more than `bright`, sums over its camera rays.
    pub fn halves_below(&self, bright: f64) -> [DVec3; 2] {
        let most = if self.counts_emission { f64::INFINITY } else { bright * f64::from(self.count) };
        [0, 1].map(|half| self.emitted[half].min(DVec3::splat(most)) + self.lit[half] + self.ambient[half])
    }

    /// Standard error squared of the mean of two halves of the camera rays, all channels.
    pub fn variance(&self, halves: [DVec3; 2]) -> DVec3 {
        Halves::of(halves.map(|half| half * (2.0 / self.camera()))).variance()
    }

    /// What the variance is taken to be, emission counting up to `bright`: what rays tell that were cast whatever the
    /// others told, if there are any; no less than small faces make it.
    pub fn variance_below(&self, bright: f64) -> DVec3 {
        self.sampled_variance_below(bright).max(self.small_face_variance())
    }

    /// The variance that rays tell.
    fn sampled_variance_below(&self, bright: f64) -> DVec3 {
        self.resampled.unwrap_or_else(|| self.variance(self.halves_below(bright)))
    }

    /// Takes in a point that a ray met at a distance, or that one met none.
    pub fn extend_reach(&mut self, distance: f32) {
        let [near, far] = self.reach.unwrap_or([distance; 2]);
        self.reach = Some([near.min(distance), far.max(distance)]);
    }

    /// Whether a point is surely behind what its rays met: farther by as much as those differ by.
    pub fn hides(&self, distance: f32) -> bool {
        self.reach.is_some_and(|[near, far]| distance > far + (far - near) + LEVEL * far)
    }

    /// The variance that small faces make which its rays may have missed.
    pub fn small_face_variance(&self) -> DVec3 {
        let mean = self.reflected();
        self.small_faces.iter().map(|face| face.variance(mean, self.camera())).sum()
    }

    /// What its rays saw reflected, their mean.
    pub fn reflected(&self) -> DVec3 {
        self.halves_below(0.0).into_iter().sum::<DVec3>() / self.camera()
    }

    /// What it found so far.
    pub fn sums_below(&self, bright: f64) -> HalfSums {
        HalfSums { halves: self.halves_below(bright), count: self.count }
    }

    /// Takes the variance from what was found since `before`; of all rays it is as much less as they are more.
    pub fn take_resampled(&mut self, before: HalfSums, bright: f64) {
        let now = self.sums_below(bright);
        let more = f64::from(now.count - before.count);
        let own = Halves::of([0, 1].map(|half| (now.halves[half] - before.halves[half]) / more));
        let own = own.variance() * (more / f64::from(now.count));
        (self.resampled, self.chosen) = (Some(own), false);
        self.predicted = own.element_sum();
        (self.differed, self.noted) = (self.predicted, self.count);
    }

    /// Is chosen to get more rays, because of what its own or its neighbours' have told; what is seen around it as
    /// well, or made by a face that is known of, stands for nothing that others have missed.
    pub fn choose(&mut self, is_seen_around: bool) {
        if !self.chosen && !self.is_explained && !is_seen_around {
            self.unseen = self.differed;
        }
        (self.resampled, self.chosen) = (None, true);
    }

    /// Takes note of what the halves differ by, their emission up to `bright`; what they differed by before the last
    /// rays counts by the share `left` that those rays are expected to leave.
    pub fn note_difference(&mut self, bright: f64, left: f64) {
        let now = self.sampled_variance_below(bright).element_sum();
        let mean = self.reflected();
        self.is_explained = self.small_faces.iter().any(|face| face.explains(now, mean, self.camera()));
        if self.noted == 0 {
            self.predicted = now;
        } else if self.noted < self.count {
            self.predicted = left * self.differed;
        }
        (self.differed, self.noted) = (now, self.count);
    }

    /// How much the pixel counts in the error: the chance that none of [`LUMINAIRE_RAYS`] rays through it meets light as
    /// emitted. Pixels that see a luminaire count nothing, those that a sliver of one lies in count a little less than
    /// others.
    pub fn weight(&self) -> f64 {
        if self.counts_emission {
            return 1.0;
        }
        let share = f64::from(self.emitting) / self.camera().max(1.0);
        (1.0 - share).powi(LUMINAIRE_RAYS)
    }
}

/// Standard deviations of the number of rays that meet a face, and one ray more, which chance may make it differ by.
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
    pub fn variance(&self, mean: DVec3, rays: f64) -> DVec3 {
        let c = self.light - mean;
        let spread = (self.share * rays).sqrt().recip().min(1.0);
        self.share * (1.0 - self.share) / rays * spread * c * c
    }

    /// Whether chance may have made a variance by how many of so many rays met it.
    pub fn explains(&self, variance: f64, mean: DVec3, rays: f64) -> bool {
        let met = 1.0 + self.share * rays;
        CHANCE * CHANCE * met * (self.light - mean).length_squared() >= variance * rays * rays
    }
}

#[cfg(test)]
impl Pixel {
    /// A pixel that so many camera rays of each half found some light in.
    pub fn of_halves(count: u32, light: [f64; 2]) -> Pixel {
        let lit = light.map(|l| DVec3::splat(l * f64::from(count)));
        Pixel { count, lit, ..Pixel::default() }
    }
}
