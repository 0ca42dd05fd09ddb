//! The irradiance cache: few records where irradiance varies slowly, many where surroundings are near.
//!
//! A coarse lattice of pixels comes first. At each finer lattice those pixels get records that the records so far do
//! not cover (G. Ward, F. Rubinstein, R. Clear, *A ray tracing solution for diffuse interreflection*, 1988; here by the
//! variance of a local linear fit, where G. Ward, P. Heckbert, *Irradiance gradients*, 1992, extrapolate each record).
//! A record of a coarse lattice counts in more pixels and gets more rays, in proportion to the spacing: that minimises
//! the noise of the picture for the rays cast. Every record's rays come in two halves with independent scramblings.
//!
//! Not handled: surfaces first seen after the records were placed; they take the nearest record.

use glam::DVec3;

use crate::gather::pixels::camera_rays::CameraRays;
use crate::gather::pixels::pixel::Pixel;
use crate::gather::pixels::pixel_layer::{Layer, Place};
use crate::gather::records::final_gather::{FinalGather, HemisphereRays};
use crate::gather::records::guiding::{Guiding, GuidingField};
use crate::gather::records::interpolation::{Fit, Support};
use crate::gather::records::pixel_lattice::Lattice;
use crate::light::team;
use crate::rays::purpose::Purpose;
use crate::rays::sobol::hash;
use crate::reading::patch_light::FieldLayers;
use crate::reading::reflection::Memory;
use crate::surfaces::SurfacePoint;

/// No record.
pub(crate) const NONE: u32 = u32::MAX;
/// A place is covered where the fit leaves at most this share of a record's variance: some four records around it.
pub(crate) const COVERED: f64 = 0.34;
/// Spacings of the coarsest lattice to a side of the squares whose records share a guiding density.
const TILE: usize = 2;
/// Such squares across the picture at most.
const TILES: usize = 24;
/// Rays of a half at least.
const LEAST_RAYS: u32 = 8;

/// How many records and rays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Density {
    /// Pixels between the records of the coarsest lattice, a power of two; 1 gives every pixel a record.
    pub spacing: usize,
    /// Rays of each half of a record of the coarsest lattice.
    pub rays: u32,
    /// The valid radius of a record over the harmonic mean distance to its surroundings.
    pub radius: f64,
    /// The least valid radius in pixels, whatever surrounds a record.
    pub least: f64,
    /// Width of a pixel a unit distance from the camera.
    pub pixel: f64,
    /// Chooses the scrambling of the rays.
    pub seed: u32,
}

/// All records of a picture.
pub(crate) struct IrradianceCache<'a> {
    camera_rays: &'a CameraRays<'a>,
    final_gather: &'a FinalGather<'a>,
    pub(crate) density: Density,
    /// The camera's position.
    camera: DVec3,
    pub(crate) records: Vec<Record>,
    /// Place, valid radius and weight of each record.
    pub(crate) supports: Vec<Support>,
    /// Irradiance over pi of each record, field by field in both halves.
    pub(crate) values: Vec<[DVec3; 2]>,
    pub(crate) fields: usize,
    /// Number of fields that make the picture.
    pub(crate) picture_fields: usize,
    pub(crate) lattice: Lattice,
    /// The record of each layer that has one, by the layer's number; else NONE.
    pub(crate) record_of: Vec<u32>,
    /// Layers for which no other record speaks: their own is all they take.
    pub(crate) alone: Vec<bool>,
    /// Number of the first layer of every pixel.
    pub(crate) starts: Vec<usize>,
    /// Guiding densities of the rays; none where every pixel has a record.
    guiding: Option<GuidingField>,
    /// Rays cast.
    pub cast: u64,
}

impl<'a> IrradianceCache<'a> {
    /// A cache without records, for the layers that pixels see.
    pub fn new(
        camera_rays: &'a CameraRays<'a>,
        final_gather: &'a FinalGather<'a>,
        density: Density,
        pixels: &[Pixel],
    ) -> IrradianceCache<'a> {
        let view = camera_rays.view;
        let width = view.width;
        let tile = (TILE * density.spacing).max(width / TILES);
        let mut starts = vec![0];
        for pixel in pixels {
            starts.push(starts[starts.len() - 1] + pixel.layers.len());
        }
        IrradianceCache {
            camera_rays,
            final_gather,
            density,
            camera: view.scene.camera.position.as_dvec3(),
            records: Vec::new(),
            supports: Vec::new(),
            values: Vec::new(),
            fields: final_gather.fields(),
            picture_fields: final_gather.picture_fields(),
            lattice: Lattice::new(density.spacing, width, pixels.len() / width.max(1)),
            record_of: vec![NONE; starts[pixels.len()]],
            alone: vec![false; starts[pixels.len()]],
            starts,
            guiding: (density.spacing > 1).then(|| GuidingField::new(tile, width, final_gather.brightest())),
            cast: 0,
        }
    }

    /// Which of the last fields are the picture's taken apart.
    pub(crate) fn layers(&self) -> FieldLayers {
        self.final_gather.layers()
    }

    /// Pixels across.
    pub fn width(&self) -> usize {
        self.lattice.width()
    }

    /// Adds records until every layer of every pixel is covered.
    pub fn place(&mut self, pixels: &[Pixel]) {
        let mut spacing = self.density.spacing;
        loop {
            let own: Vec<usize> = self.lattice.pixels(spacing).collect();
            let of_pixel = |fit: &mut Fit, i: usize| self.uncovered(fit, own[i], &pixels[own[i]]);
            let uncovered: Vec<Vec<(usize, usize)>> = team::share(own.len(), |_| 1.0).map(Fit::default, of_pixel);
            let uncovered: Vec<(usize, usize)> = uncovered.into_iter().flatten().collect();
            let first = self.records.len();
            for &(k, l) in &uncovered {
                self.add(k, l, &pixels[k], spacing);
            }
            let rays = self.rays_at(spacing);
            self.cast_from(first, |_| rays);
            for (i, &(k, _)) in uncovered.iter().enumerate() {
                self.lattice.insert(spacing, k, (first + i) as u32);
            }
            if spacing == 1 {
                return;
            }
            spacing /= 2;
        }
    }

    /// Layers of pixel k without a record that no records cover.
    fn uncovered(&self, fit: &mut Fit, k: usize, pixel: &Pixel) -> Vec<(usize, usize)> {
        let all = self.density.spacing == 1;
        (0..pixel.layers.len())
            .filter(|l| self.record_of[self.starts[k] + l] == NONE)
            .filter(|&l| all || !self.covers(fit, k, &pixel.layers[l]))
            .map(|l| (k, l))
            .collect()
    }

    /// Whether the records around pixel k cover a layer.
    fn covers(&self, fit: &mut Fit, k: usize, layer: &Layer) -> bool {
        self.fit(fit, k, &layer.place()) && fit.variance() <= COVERED
    }

    /// Fits the records around pixel k at a place; false where none is valid there.
    pub(crate) fn fit(&self, fit: &mut Fit, k: usize, at: &Place) -> bool {
        fit.begin(at);
        self.lattice.visit(k, |i| fit.consider(at, i, &self.supports[i as usize]));
        fit.solve()
    }

    /// Adds a record without rays for layer l of pixel k.
    pub(crate) fn add(&mut self, k: usize, l: usize, pixel: &Pixel, spacing: usize) {
        self.record_of[self.starts[k] + l] = self.records.len() as u32;
        let seed = hash(k as u32, hash(l as u32, self.density.seed));
        let site = Site { pixel: k, camera_count: pixel.count, spacing, seed, density: 0 };
        let record = self.record(&pixel.layers[l], site);
        self.records.push(record);
    }

    /// A record of a layer, without rays and not of the cache, with the density of its place.
    pub(crate) fn record(&mut self, layer: &Layer, site: Site) -> Record {
        let density = self.guiding.as_mut().map_or(0, |g| g.number(site.pixel, layer.first.normal));
        Record::new(layer, Site { density, ..site }, self.camera, self.fields)
    }

    /// Rays of a half that the records of one lattice get.
    fn rays_at(&self, spacing: usize) -> u32 {
        let rays = self.density.rays as usize * spacing / self.density.spacing;
        (rays as u32).max(LEAST_RAYS.min(self.density.rays))
    }

    /// Casts rays from the records after `first` until each half has as many as `wanted` says of each of them.
    pub(crate) fn cast_from(&mut self, first: usize, wanted: impl Fn(usize) -> u32 + Sync) {
        let mut records = std::mem::take(&mut self.records);
        self.extend(&mut records[first..], wanted);
        self.records = records;
        self.settle(first);
    }

    /// Casts rays from records, of the cache or not, until each half has as many as `wanted` says of each of them.
    pub(crate) fn extend(&mut self, records: &mut [Record], wanted: impl Fn(usize) -> u32 + Sync) {
        if let Some(guiding) = &mut self.guiding {
            guiding.update();
        }
        let (camera_rays, final_gather, guiding) = (self.camera_rays, self.final_gather, self.guiding.as_ref());
        let share = team::share(records.len(), |i| f64::from(wanted(i).saturating_sub(records[i].rays)));
        let cast = |memory: &mut Memory, i: usize, record: &mut Record| {
            let guiding = guiding.map_or(Guiding::NONE, |g| g.of(record.site.density));
            record.extend(&Casting { camera_rays, final_gather, guiding }, wanted(i), memory)
        };
        let added = share.change(records, |i| i, Memory::default, cast);
        if let Some(guiding) = &mut self.guiding {
            guiding.gather();
        }
        self.cast += added.into_iter().sum::<u64>();
    }

    /// Sets value, valid radius and weight of the records after `first`.
    pub(crate) fn settle(&mut self, first: usize) {
        self.supports.truncate(first);
        self.values.truncate(first * self.fields);
        let density = self.density;
        for p in &self.records[first..] {
            self.values.extend(p.means());
            let least = density.least * density.pixel * p.distance;
            self.supports.push(Support {
                place: p.place(),
                radius: (density.radius * p.surroundings()).min(1.0).max(least),
                // Not the inverse variance: a record that met bright light by chance would count less.
                weight: p.site.spacing as f64,
            });
        }
    }
}

/// Rays of a half from which the distance to the surroundings is estimated.
const FIRST: u32 = 8;
/// Origins whose RMS distance to their mean is above this share of the distance to the surroundings are too few.
const FAR_APART: f64 = 0.05;
/// Hemisphere rays for each origin, where those are too few.
const EACH: u32 = 4;
/// Camera rays for one more origin at most.
const CAMERA_RAYS: u32 = 4;

/// The pixel, lattice and random numbers of a record.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct Site {
    /// The pixel that sees its surface.
    pub pixel: usize,
    /// Camera rays of each half of the pixel so far.
    pub camera_count: u32,
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
#[derive(serde::Serialize, serde::Deserialize)]
pub(crate) struct Record {
    /// Its `camera_count` includes camera rays cast for more origins.
    pub site: Site,
    /// The surface; rays start where its camera rays met it.
    layer: Layer,
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
    /// A record without rays; `camera` is the camera's position.
    pub fn new(layer: &Layer, site: Site, camera: DVec3, fields: usize) -> Record {
        let none = || vec![DVec3::ZERO; fields];
        Record {
            site,
            layer: layer.clone(),
            distance: layer.first.position.as_dvec3().distance(camera),
            rays: 0,
            nearness: 0.0,
            sums: [none(), none()],
        }
    }

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
    pub fn surroundings(&self) -> f64 {
        f64::from(2 * self.rays) / self.nearness
    }

    /// Irradiance over pi of both halves, field by field.
    pub fn means(&self) -> impl Iterator<Item = [DVec3; 2]> {
        let share = 1.0 / f64::from(self.rays);
        let [a, b] = &self.sums;
        a.iter().zip(b).map(move |(a, b)| [*a * share, *b * share])
    }

    /// Where it is.
    pub fn place(&self) -> Place {
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

/// A fit that leaves more than this share of a record's variance extrapolates.
const LOOSE: f64 = 0.5;

/// A fit and its values; memory that one thread uses again.
#[derive(Default)]
pub(crate) struct Fitted {
    pub fit: Fit,
    /// Irradiance over pi of every field in both halves.
    pub values: Vec<[DVec3; 2]>,
}

impl IrradianceCache<'_> {
    /// Irradiance over pi at layer l of pixel k, every field in both halves, as the `values` of `fitted`.
    ///
    /// Returns the changes of that of the picture from the middle to the mean point of each half of the camera rays.
    pub fn at(&self, fitted: &mut Fitted, k: usize, l: usize, layer: &Layer) -> [DVec3; 2] {
        self.fit_layer(&mut fitted.fit, k, l, layer);
        self.evaluate(fitted);
        [0, 1].map(|half| {
            let change = fitted.fit.change(layer.off(half));
            change.map(|(i, coefficient)| coefficient * self.mean(i)).sum()
        })
    }

    /// Fits layer l of pixel k; takes a mean where the fit extrapolates, and a single record where none is valid or the
    /// layer is alone.
    pub(crate) fn fit_layer(&self, fit: &mut Fit, k: usize, l: usize, layer: &Layer) {
        let own = self.own_record(k, l);
        if let Some(record) = own.filter(|_| self.alone[self.starts[k] + l]) {
            return fit.take(record);
        }
        let place = layer.place();
        // The valid radius of a record near a contact may be less than a pixel.
        if !self.fit(fit, k, &place) {
            match own.or_else(|| self.nearest(k, &place)) {
                Some(record) => fit.take(record),
                None => fit.clear(),
            }
        }
        fit.settle(LOOSE);
    }

    /// Evaluates a fit.
    fn evaluate(&self, Fitted { fit, values }: &mut Fitted) {
        values.clear();
        values.resize(self.fields, [DVec3::ZERO; 2]);
        for &(i, coefficient) in &fit.coefficients {
            for ([a, b], [u, v]) in values.iter_mut().zip(self.means(i as usize)) {
                *a += coefficient * *u;
                *b += coefficient * *v;
            }
        }
    }

    /// The record of a layer, if it has one.
    fn own_record(&self, k: usize, l: usize) -> Option<u32> {
        let own = &self.record_of[self.starts[k]..self.starts[k + 1]];
        // Layers that later camera rays met follow those that records were placed for.
        own.get(l).copied().filter(|&record| record != NONE)
    }

    /// The nearest record on a layer's side and material that looks the same way.
    fn nearest(&self, k: usize, at: &Place) -> Option<u32> {
        let mut best: Option<(f64, u32)> = None;
        self.lattice.visit(k, |i| {
            let other = &self.supports[i as usize].place;
            let apart = other.position.distance_squared(at.position);
            let alike = other.material == at.material && other.normal.dot(at.normal) > 0.9;
            if alike && best.is_none_or(|b| (apart, i) < b) {
                best = Some((apart, i));
            }
        });
        best.map(|b| b.1)
    }

    /// Irradiance over pi of a record: every field in both halves.
    pub(crate) fn means(&self, i: usize) -> &[[DVec3; 2]] {
        &self.values[i * self.fields..(i + 1) * self.fields]
    }

    /// The mean of both halves of a record, the sum of the fields that make the picture.
    fn mean(&self, i: u32) -> DVec3 {
        let means = &self.means(i as usize)[..self.picture_fields];
        means.iter().map(|[a, b]| 0.5 * (*a + *b)).sum()
    }

    /// The sum of the fields that make the picture in both halves, of values of every field.
    pub(crate) fn total(&self, values: &[[DVec3; 2]]) -> [DVec3; 2] {
        [0, 1].map(|half| values[..self.picture_fields].iter().map(|m| m[half]).sum())
    }
}
