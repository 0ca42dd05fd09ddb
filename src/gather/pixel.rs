//! What the camera rays of one pixel found, surface by surface, in two halves whose difference is the standard error.
//!
//! A pixel on an edge sees several surfaces: each has its own irradiance, and the share of the camera rays that saw it
//! weighs it in the pixel. Facets of one smooth body that continue each other count as one surface.
//!
//! Not handled: indirect light that is gathered; until then the light that patches receive stands for it. Light that
//! differs within a surface in step with its texture: of the light gathered, the mean over the pixel is multiplied by
//! the mean of rho.

use crate::error::halves::Halves;
use glam::DVec3;

use crate::gather::interpolation::Place;
use crate::gather::pixel_texture::PixelTexture;
use crate::gather::small_faces::SmallFace;
use crate::light::Rgb;
use crate::rays::Side;
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
    /// The variance as it was foreseen before the last rays were cast, which knows nothing of what they found.
    pub foreseen: f64,
    /// Camera rays of each half when the difference was last noted.
    pub noted: u32,
    /// The variance by the rays of the last look alone; none where the pixel was chosen since, or all its rays are one
    /// look.
    looked: Option<DVec3>,
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
pub(crate) struct Found {
    halves: [DVec3; 2],
    count: u32,
}

/// Share of its distance that a surface seen head on may be nearer or farther within a pixel.
const LEVEL: f32 = 1e-3;
/// Rays that tell whether a pixel sees a luminaire.
const LOOKS: i32 = 16;

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
        self.found_below(bright).max(self.foretold())
    }

    /// The variance that rays tell.
    fn found_below(&self, bright: f64) -> DVec3 {
        self.looked.unwrap_or_else(|| self.variance(self.halves_below(bright)))
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
    pub fn foretold(&self) -> DVec3 {
        let mean = self.reflected();
        self.small_faces.iter().map(|face| face.variance(mean, self.camera())).sum()
    }

    /// What its rays saw reflected, their mean.
    pub fn reflected(&self) -> DVec3 {
        self.halves_below(0.0).into_iter().sum::<DVec3>() / self.camera()
    }

    /// What it found so far.
    pub fn sums_below(&self, bright: f64) -> Found {
        Found { halves: self.halves_below(bright), count: self.count }
    }

    /// Takes the variance from what was found since `before`; of all rays it is as much less as they are more.
    pub fn look_back(&mut self, before: Found, bright: f64) {
        let now = self.sums_below(bright);
        let more = f64::from(now.count - before.count);
        let own = Halves::of([0, 1].map(|half| (now.halves[half] - before.halves[half]) / more));
        let own = own.variance() * (more / f64::from(now.count));
        (self.looked, self.chosen) = (Some(own), false);
        self.foreseen = own.element_sum();
        (self.differed, self.noted) = (self.foreseen, self.count);
    }

    /// Is chosen to get more rays, because of what its own or its neighbours' have told; what is seen around it as
    /// well, or made by a face that is known of, stands for nothing that others have missed.
    pub fn choose(&mut self, is_seen_around: bool) {
        if !self.chosen && !self.is_explained && !is_seen_around {
            self.unseen = self.differed;
        }
        (self.looked, self.chosen) = (None, true);
    }

    /// Takes note of what the halves differ by, their emission up to `bright`; what they differed by before the last
    /// rays counts by the share `left` that those rays are expected to leave.
    pub fn note_difference(&mut self, bright: f64, left: f64) {
        let now = self.found_below(bright).element_sum();
        let mean = self.reflected();
        self.is_explained = self.small_faces.iter().any(|face| face.explains(now, mean, self.camera()));
        if self.noted == 0 {
            self.foreseen = now;
        } else if self.noted < self.count {
            self.foreseen = left * self.differed;
        }
        (self.differed, self.noted) = (now, self.count);
    }

    /// How much the pixel counts in the error: the chance that none of [`LOOKS`] rays through it meets light as
    /// emitted. Pixels that see a luminaire count nothing, those that a sliver of one lies in count a little less than
    /// others.
    pub fn weight(&self) -> f64 {
        if self.counts_emission {
            return 1.0;
        }
        let share = f64::from(self.emitting) / self.camera().max(1.0);
        (1.0 - share).powi(LOOKS)
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

/// Normals of facets of one surface agree to this cosine.
const ALIGNED: f32 = 0.99;
/// Facets of one surface lie off each other's plane by at most this share of their distance.
const FLAT: f32 = 0.1;

/// Points of a half that camera rays leave for hemisphere rays to start from.
const ORIGINS: usize = 16;

/// What camera rays of one surface agree in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SurfaceKey {
    /// The plane of the face.
    pub plane: u32,
    pub side: Side,
    pub material: u32,
}

/// A surface as one pixel sees it.
#[derive(Clone, Debug)]
pub(crate) struct Layer {
    /// Plane, side and material.
    key: SurfaceKey,
    /// The first point seen, with the normal of the side seen.
    pub first: SurfacePoint,
    /// Reflectance about there: the patch's mean.
    pub rho: Rgb,
    /// Number of camera rays of each half.
    pub count: [u32; 2],
    /// Sums of the points seen.
    sum: [DVec3; 2],
    /// Sums of the reflectance of the points seen.
    reflected: [DVec3; 2],
    /// The first points seen by each half.
    origins: [Vec<SurfacePoint>; 2],
}

impl Layer {
    /// A layer that no ray has seen yet.
    pub fn new(key: SurfaceKey, first: SurfacePoint, rho: Rgb) -> Layer {
        let (sum, reflected) = ([DVec3::ZERO; 2], [DVec3::ZERO; 2]);
        Layer { key, first, rho, count: [0; 2], sum, reflected, origins: [Vec::new(), Vec::new()] }
    }

    /// Adds one camera ray of a half, and the reflectance where it ended.
    pub fn add(&mut self, half: usize, seen: &SurfacePoint, rho: DVec3) {
        if self.origins[half].len() < ORIGINS {
            self.start(half, *seen);
        }
        self.count[half] += 1;
        self.sum[half] += seen.position.as_dvec3();
        self.reflected[half] += rho;
    }

    /// Sums of the reflectance of the points that each half saw; of one reflectance they are exact, as f64 holds them.
    pub fn reflected(&self) -> [DVec3; 2] {
        self.reflected
    }

    /// Reflectance, in the mean over so many camera rays of which some met the surface.
    pub fn mean_reflectance(&self, camera: f64) -> DVec3 {
        let all = f64::from(self.count[0]) + f64::from(self.count[1]);
        // Division by their number gives one reflectance back exactly.
        (self.reflected[0] + self.reflected[1]) / all * (all / camera)
    }

    /// Points that rays of a half may start from: those that it saw first, or the other half's where it saw none.
    pub fn origins(&self, half: usize) -> &[SurfacePoint] {
        match &self.origins[half][..] {
            [] => &self.origins[1 - half],
            own => own,
        }
    }

    /// Adds a point that rays of a half may start from.
    pub fn start(&mut self, half: usize, seen: SurfacePoint) {
        self.origins[half].push(seen);
    }

    /// Where its irradiance is wanted, and what may speak for it.
    pub fn place(&self) -> Place {
        Place {
            position: self.position(),
            normal: self.first.normal,
            material: 2 * self.key.material + u32::from(self.key.side == Side::Back),
            reach: f64::INFINITY,
        }
    }

    /// Mean of the points seen.
    pub fn position(&self) -> DVec3 {
        (self.sum[0] + self.sum[1]) / f64::from(self.count[0] + self.count[1])
    }

    /// How far a half's mean of the points seen lies from that of both.
    pub fn off(&self, half: usize) -> DVec3 {
        let n = self.count[half];
        if n == 0 { DVec3::ZERO } else { self.sum[half] / f64::from(n) - self.position() }
    }

    /// Whether a point belongs to this surface: in its plane, or on a facet that continues it around a bend.
    pub fn holds(&self, key: SurfaceKey, seen: &SurfacePoint) -> bool {
        if self.key == key {
            return true;
        }
        let (n, m) = (self.first.normal, seen.normal);
        let d = seen.position - self.first.position;
        (self.key.side, self.key.material) == (key.side, key.material)
            && (ALIGNED..1.0 - 1e-6).contains(&n.dot(m))
            && d.dot(n).abs() <= FLAT * d.length()
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    fn receiver(position: Vec3, normal: Vec3) -> SurfacePoint {
        SurfacePoint { position, normal: normal.normalize(), face: 0 }
    }

    #[test]
    fn parallel_planes_stay_apart_and_facets_join() {
        let key = |plane: u32, material: u32| SurfaceKey { plane, side: Side::Front, material };
        let layer = Layer::new(key(0, 0), receiver(Vec3::ZERO, Vec3::Z), Rgb::ONE);
        let beside = Vec3::new(0.1, 0.0, 0.001);
        let other = key(1, 0);
        assert!(layer.holds(key(0, 0), &receiver(beside, Vec3::Z)));
        assert!(!layer.holds(other, &receiver(beside, Vec3::Z)));
        assert!(layer.holds(other, &receiver(beside, Vec3::new(0.05, 0.0, 1.0))));
        assert!(!layer.holds(other, &receiver(beside, Vec3::new(0.5, 0.0, 1.0))));
        let glass = key(1, 7);
        assert!(!layer.holds(glass, &receiver(beside, Vec3::new(0.05, 0.0, 1.0))));
    }
}
