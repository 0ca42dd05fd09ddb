//! One irradiance point: the surface that one pixel sees, and the hemisphere rays cast from there.
//!
//! Rays come in two halves with independent scramblings, and each half starts from its own points of the pixel: what
//! the halves differ by is then the noise of both, so light that bends within a pixel is in the estimate. Where the points seen lie
//! far apart beside their surroundings (surfaces seen at a grazing angle, creases) more camera rays look for more of them,
//! in proportion to the hemisphere rays.
//!
//! Not handled: surfaces of which less than a quarter of the pixel's camera rays meet anything more than once.

use glam::DVec3;

use crate::gather::camera_rays::Pass;
use crate::gather::final_gather::Reader;
use crate::gather::guiding::Guided;
use crate::gather::interpolation::Place;
use crate::gather::pixel_layer::Layer;
use crate::gather::reflection::Memory;
use crate::surfaces::SurfacePoint;

/// Rays of a half that tell how near the surroundings are.
const FIRST: u32 = 8;
/// Points seen further from their middle than this share of the distance to the surroundings are too few.
const APART: f64 = 0.05;
/// Hemisphere rays for each point that they start from, where those are too few.
const EACH: u32 = 4;
/// Camera rays to look for one more point to start from.
const LOOKS: u32 = 4;
/// Tells the two halves' scramblings apart.
const HALVES: [u32; 2] = [0x51ed_270b, 0xa3b1_95c7];

/// One irradiance point.
pub(crate) struct Point {
    /// The number of its guide.
    pub guide: u32,
    /// The surface; rays start where its camera rays met it.
    layer: Layer,
    pixel: usize,
    /// Camera rays of each half that have looked for it.
    looked: u32,
    seed: u32,
    /// Spacing of the lattice it belongs to.
    pub spacing: usize,
    /// Factor on its reach, where the fit was biased.
    pub shortened: f64,
    /// Share of the camera rays of its pixel that met the surface.
    seen: f64,
    /// Distance from the camera.
    pub distance: f64,
    /// Rays of each half cast so far.
    pub rays: u32,
    /// Sum over the rays of their inverse lengths.
    nearness: f64,
    /// Sums over the rays of each half, field by field.
    sums: [Vec<DVec3>; 2],
}

impl Point {
    /// A point of pixel k that no ray has left yet; `looked` camera rays of each half have met `layer` among others.
    pub fn new(
        layer: &Layer,
        (pixel, looked): (usize, u32),
        spacing: usize,
        camera: DVec3,
        (fields, seed, guide): (usize, u32, u32),
    ) -> Point {
        let none = || vec![DVec3::ZERO; fields];
        Point {
            guide,
            layer: layer.clone(),
            pixel,
            looked,
            seed,
            spacing,
            shortened: 1.0,
            seen: f64::from(layer.count[0] + layer.count[1]) / f64::from(2 * looked),
            distance: layer.first.position.as_dvec3().distance(camera),
            rays: 0,
            nearness: 0.0,
            sums: [none(), none()],
        }
    }

    /// Casts rays until each half has `count`; returns the number of rays cast.
    pub fn extend(&mut self, (pass, reader, guided): (&Pass, &Reader, Guided), count: u32, memory: &mut Memory) -> u64 {
        let mut cast = 0;
        if self.rays == 0 {
            cast += self.read((reader, guided), count.min(FIRST), memory);
        }
        if count > self.rays {
            cast += self.look(pass, count / EACH);
            cast += self.read((reader, guided), count, memory);
        }
        cast
    }

    fn read(&mut self, (reader, guided): (&Reader, Guided), count: u32, memory: &mut Memory) -> u64 {
        let range = self.rays..count.max(self.rays);
        let cast = 2 * range.len() as u64;
        for (half, sums) in self.sums.iter_mut().enumerate() {
            let seed = self.seed ^ HALVES[half];
            let from = self.layer.origins(half);
            self.nearness += reader.read(from, range.clone(), (seed, guided), memory, sums);
        }
        self.rays = range.end;
        cast
    }

    /// Looks for more points to start from, `count` for each half, where those there are lie far apart.
    fn look(&mut self, pass: &Pass, count: u32) -> u64 {
        if self.spread() < APART * self.surroundings() {
            return 0;
        }
        let mut cast = 0;
        let most = self.looked + LOOKS * count;
        let few = |layer: &Layer| (0..2).any(|half| (layer.origins(half).len() as u32) < count);
        while self.looked < most && few(&self.layer) {
            for half in 0..2 {
                if let Some((key, seen)) = pass.look(self.pixel, half, self.looked)
                    && self.layer.holds(key, &seen)
                {
                    self.layer.start(half, seen);
                }
            }
            self.looked += 1;
            cast += 2;
        }
        cast
    }

    /// RMS distance of the points that rays start from to their middle.
    fn spread(&self) -> f64 {
        let middle = self.middle();
        let all = (0..2).flat_map(|half| self.layer.origins(half));
        let apart = |r: &SurfacePoint| r.position.as_dvec3().distance_squared(middle);
        let (sum, count) = all.fold((0.0, 0.0), |(s, n), r| (s + apart(r), n + 1.0));
        (sum / count).sqrt()
    }

    /// Harmonic mean distance to its surroundings; infinite where its rays meet nothing.
    pub fn surroundings(&self) -> f64 {
        f64::from(2 * self.rays) / self.nearness
    }

    /// Irradiance over pi of both halves, field by field.
    pub fn means(&self) -> impl Iterator<Item = [DVec3; 2]> {
        let share = 1.0 / f64::from(self.rays);
        let [a, b] = &self.sums;
        a.iter().zip(b).map(move |(a, b)| [*a * share, *b * share])
    }

    /// What irradiance over pi counts in the pixel: reflectance, the largest channel, times the share of camera rays that met the surface.
    pub fn counts(&self) -> f64 {
        self.rho() * self.seen
    }

    /// Where it is.
    pub fn place(&self) -> Place {
        Place { position: self.middle(), ..self.layer.place() }
    }

    /// Reflectance of the surface, the largest channel.
    pub fn rho(&self) -> f64 {
        f64::from(self.layer.rho.max_element())
    }

    /// Mean of where its rays start, each half counting the same.
    fn middle(&self) -> DVec3 {
        let mean = |half: usize| {
            let from = self.layer.origins(half);
            let sum: DVec3 = from.iter().map(|r| r.position.as_dvec3()).sum();
            sum / from.len() as f64
        };
        0.5 * (mean(0) + mean(1))
    }
}
