//! One irradiance record: where its hemisphere rays start and what they found; and how rays of many are cast.
//!
//! Every record's rays come in two halves with independent scramblings. Where the points that its camera rays met lie
//! far apart next to the distance to the surroundings, more camera rays find more points to start from.
//!
//! Not handled: where records are, and the light between them ([`crate::gather::records::irradiance_cache`]).

use glam::DVec3;
use halflight_team::Loop;

use crate::gather::pixels::camera_rays::CameraRays;
use crate::gather::pixels::pixel_layer::{Layer, Place};
use crate::gather::records::final_gather::{FinalGather, HemisphereRays};
use crate::gather::records::guiding::{Guiding, GuidingField};
use crate::rays::purpose::Purpose;
use crate::reading::reflection::Memory;
use crate::surfaces::SurfacePoint;

/// Rays of a half from which the distance to the surroundings is estimated.
const FIRST: u32 = 8;
/// Origins whose RMS distance to their mean is above this share of the distance to the surroundings are too few.
const FAR_APART: f64 = 0.05;
/// Hemisphere rays for each origin, where those are too few.
const EACH: u32 = 4;
/// Camera rays for one more origin at most.
const CAMERA_RAYS: u32 = 4;

/// The pixel, lattice and random numbers of a record.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Site {
    /// The pixel that sees its surface.
    pub pixel: usize,
    /// Camera rays of each half of the pixel so far.
    pub camera_count: u32,
    /// Spacing of its lattice, pixels.
    pub spacing: usize,
    /// Chooses the scrambling of its rays.
    pub seed: u32,
}

/// What a record's rays are cast with.
struct Casting<'a> {
    camera_rays: &'a CameraRays<'a>,
    final_gather: &'a FinalGather<'a>,
    guiding: Guiding<'a>,
}

/// One irradiance record.
pub(crate) struct Record {
    /// Its `camera_count` includes camera rays cast for more origins.
    pub site: Site,
    /// The surface; rays start where its camera rays met it.
    pub layer: Layer,
    /// The number of its guiding density.
    pub density: u32,
    /// Width of the pixel there.
    pub pixel: f64,
    /// Rays of each half cast so far.
    pub rays: u32,
    /// Sum over the rays of their inverse lengths.
    pub nearness: f64,
    /// Sums over the rays of each half, field by field.
    pub sums: [Vec<DVec3>; 2],
}

impl Record {
    /// Casts rays until each half has `count`; returns the number of rays cast.
    fn extend(&mut self, with: &Casting, count: u32, memory: &mut Memory) -> u64 {
        let mut cast = 0;
        if self.rays == 0 {
            cast += self.gather(with, count.min(FIRST), memory);
        }
        if count > self.rays {
            cast += self.find_origins(with.camera_rays, count / EACH);
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

    /// Adds origins by camera rays, up to `count` for each half, where those there are lie far apart.
    fn find_origins(&mut self, camera_rays: &CameraRays, count: u32) -> u64 {
        if self.spread() < FAR_APART * self.surroundings() {
            return 0;
        }
        let mut cast = 0;
        let most = self.site.camera_count + CAMERA_RAYS * count;
        let few = |layer: &Layer| (0..2).any(|half| (layer.origins(half).len() as u32) < count);
        while self.site.camera_count < most && few(&self.layer) {
            for half in 0..2 {
                let mut seen = camera_rays.surfaces_seen(self.site.pixel, half, self.site.camera_count);
                if let Some((_, seen)) = seen.find(|(key, seen)| self.layer.holds(*key, seen)) {
                    self.layer.start(half, seen);
                }
            }
            self.site.camera_count += 1;
            cast += 2;
        }
        cast
    }

    /// RMS distance of the origins to their mean.
    fn spread(&self) -> f64 {
        let middle = self.middle();
        let all = (0..2).flat_map(|half| self.layer.origins(half));
        let apart = |r: &SurfacePoint| r.position.as_dvec3().distance_squared(middle);
        let (sum, count) = all.fold((0.0, 0.0), |(s, n), r| (s + apart(r), n + 1.0));
        (sum / count).sqrt()
    }

    /// Harmonic mean distance to its surroundings; infinite where its rays meet nothing.
    pub(crate) fn surroundings(&self) -> f64 {
        f64::from(2 * self.rays) / self.nearness
    }

    /// Irradiance over pi of both halves, field by field.
    pub(crate) fn means(&self) -> impl Iterator<Item = [DVec3; 2]> {
        let share = 1.0 / f64::from(self.rays);
        let [a, b] = &self.sums;
        a.iter().zip(b).map(move |(a, b)| [*a * share, *b * share])
    }

    /// Where it is.
    pub(crate) fn place(&self) -> Place {
        Place { position: self.middle(), ..self.layer.place() }
    }

    /// Mean of the origins of its rays, each half counting the same.
    fn middle(&self) -> DVec3 {
        let mean = |half: usize| {
            let from = self.layer.origins(half);
            let sum: DVec3 = from.iter().map(|r| r.position.as_dvec3()).sum();
            sum / from.len() as f64
        };
        0.5 * (mean(0) + mean(1))
    }
}

/// Makes records, and casts their rays.
pub(crate) struct RecordCaster<'a> {
    camera_rays: &'a CameraRays<'a>,
    pub final_gather: &'a FinalGather<'a>,
    /// Guiding densities of the rays; none where every pixel has a record.
    guiding: Option<GuidingField>,
    /// Rays cast.
    pub cast: u64,
}

impl<'a> RecordCaster<'a> {
    /// Casts rays of records; those within so many pixels share a guiding density, if there are any to share.
    pub(crate) fn new(
        camera_rays: &'a CameraRays<'a>,
        final_gather: &'a FinalGather<'a>,
        tile: Option<usize>,
    ) -> RecordCaster<'a> {
        let width = camera_rays.view.width;
        let guiding = tile.map(|tile| GuidingField::new(tile, width, final_gather.brightest()));
        RecordCaster { camera_rays, final_gather, guiding, cast: 0 }
    }

    /// A record of a layer, without rays.
    pub(crate) fn record(&mut self, layer: &Layer, site: Site) -> Record {
        let none = || vec![DVec3::ZERO; self.final_gather.count()];
        Record {
            site,
            layer: layer.clone(),
            pixel: self.camera_rays.view.pixel_at(site.pixel, layer.first.position),
            rays: 0,
            nearness: 0.0,
            sums: [none(), none()],
            density: self.guiding.as_mut().map_or(0, |g| g.number(site.pixel, layer.first.normal)),
        }
    }

    /// Casts rays from records until each half has as many as `wanted` says of each of them.
    pub(crate) fn extend(&mut self, records: &mut [Record], wanted: impl Fn(usize) -> u32 + Sync) {
        let shared = Loop::weighed(records.len(), |i| f64::from(wanted(i).saturating_sub(records[i].rays)));
        if let Some(guiding) = &mut self.guiding {
            guiding.update(&shared);
        }
        let (camera_rays, final_gather, guiding) = (self.camera_rays, self.final_gather, self.guiding.as_ref());
        let cast = |memory: &mut Memory, i: usize, record: &mut Record| {
            let guiding = guiding.map_or(Guiding::NONE, |g| g.of(record.density));
            record.extend(&Casting { camera_rays, final_gather, guiding }, wanted(i), memory)
        };
        let added = shared.change(records, Memory::default, cast);
        if let Some(guiding) = &mut self.guiding {
            guiding.gather(&shared);
        }
        self.cast += added.into_iter().sum::<u64>();
    }
}
