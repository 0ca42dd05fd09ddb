//! One irradiance record: the surface that one pixel sees, and the hemisphere rays cast from there (G. Ward, F.
//! Rubinstein, R. Clear, *A ray tracing solution for diffuse interreflection*, 1988).
//!
//! Rays come in two halves with independent scramblings, and each half starts from its own points of the pixel: what
//! the halves differ by is then the noise of both, so light that bends within a pixel is in the estimate. Where the
//! points seen lie far apart beside their surroundings (surfaces seen at a grazing angle, creases) more camera rays
//! look for more of them, in proportion to the hemisphere rays.
//!
//! Not handled: surfaces of which less than a quarter of the pixel's camera rays meet anything more than once.

use glam::DVec3;

use crate::gather::camera_rays::CameraRays;
use crate::gather::final_gather::{FinalGather, HemisphereRays};
use crate::gather::guiding::Guiding;
use crate::gather::interpolation::Place;
use crate::gather::pixel_layer::Layer;
use crate::gather::reflection::Memory;
use crate::rays::purpose::Purpose;
use crate::surfaces::SurfacePoint;

/// Rays of a half that tell how near the surroundings are.
const FIRST: u32 = 8;
/// Points seen further from their middle than this share of the distance to the surroundings are too few.
const APART: f64 = 0.05;
/// Hemisphere rays for each point that they start from, where those are too few.
const EACH: u32 = 4;
/// Camera rays to look for one more point to start from.
const LOOKS: u32 = 4;

/// Where a record belongs, and what it is named by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Site {
    /// The pixel that sees its surface.
    pub pixel: usize,
    /// Camera rays of each half of the pixel so far.
    pub looked: u32,
    /// Spacing of its lattice, pixels.
    pub spacing: usize,
    /// Chooses the scrambling of its rays.
    pub seed: u32,
    /// The number of its guiding density.
    pub density: u32,
}

/// What a record's rays are cast with.
pub(crate) struct Casting<'a> {
    pub camera_rays: &'a CameraRays<'a>,
    pub final_gather: &'a FinalGather<'a>,
    pub guiding: Guiding<'a>,
}

/// One irradiance record.
pub(crate) struct Record {
    /// Where it belongs; `looked` counts the camera rays that looked for its surface.
    pub site: Site,
    /// The surface; rays start where its camera rays met it.
    layer: Layer,
    /// Factor on its valid radius, where the fit was biased.
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

impl Record {
    /// A record of a surface that no ray has left yet; `camera` is the camera's position.
    pub fn new(layer: &Layer, site: Site, camera: DVec3, fields: usize) -> Record {
        let none = || vec![DVec3::ZERO; fields];
        Record {
            site,
            layer: layer.clone(),
            shortened: 1.0,
            seen: f64::from(layer.count[0] + layer.count[1]) / f64::from(2 * site.looked),
            distance: layer.first.position.as_dvec3().distance(camera),
            rays: 0,
            nearness: 0.0,
            sums: [none(), none()],
        }
    }

    /// Casts rays until each half has `count`; returns the number of rays cast.
    pub fn extend(&mut self, with: &Casting, count: u32, memory: &mut Memory) -> u64 {
        let mut cast = 0;
        if self.rays == 0 {
            cast += self.gather(with, count.min(FIRST), memory);
        }
        if count > self.rays {
            cast += self.look(with.camera_rays, count / EACH);
            cast += self.gather(with, count, memory);
        }
        cast
    }

    /// Casts hemisphere rays until each half has `count`.
    fn gather(&mut self, with: &Casting, count: u32, memory: &mut Memory) -> u64 {
        let range = self.rays..count.max(self.rays);
        for (half, sums) in self.sums.iter_mut().enumerate() {
            let rays = HemisphereRays {
                from: self.layer.origins(half),
                indices: range.clone(),
                seed: Purpose::HemisphereRays(half).seed(self.site.seed),
                guiding: with.guiding,
            };
            self.nearness += with.final_gather.read(&rays, memory, sums);
        }
        self.rays = range.end;
        2 * range.len() as u64
    }

    /// Looks for more points to start from, `count` for each half, where those there are lie far apart.
    fn look(&mut self, camera_rays: &CameraRays, count: u32) -> u64 {
        if self.spread() < APART * self.surroundings() {
            return 0;
        }
        let mut cast = 0;
        let most = self.site.looked + LOOKS * count;
        let few = |layer: &Layer| (0..2).any(|half| (layer.origins(half).len() as u32) < count);
        while self.site.looked < most && few(&self.layer) {
            for half in 0..2 {
                let mut looked = camera_rays.look(self.site.pixel, half, self.site.looked);
                if let Some((_, seen)) = looked.find(|(key, seen)| self.layer.holds(*key, seen)) {
                    self.layer.start(half, seen);
                }
            }
            self.site.looked += 1;
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

    /// What irradiance over pi counts in the pixel: reflectance, the largest channel, times the share of camera rays
    /// that met the surface.
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
