//! The irradiance cache: few records where irradiance varies slowly, many where surroundings are near.
//!
//! A coarse lattice of pixels comes first. At each finer lattice those pixels get records that the records so far do
//! not cover (G. Ward, F. Rubinstein, R. Clear, *A ray tracing solution for diffuse interreflection*, 1988; here by the
//! variance of a local linear fit, where G. Ward, P. Heckbert, *Irradiance gradients*, 1992, extrapolate each record).
//! A record of a coarse lattice stands for more pixels and gets more rays, in proportion to the spacing: that minimises
//! the noise of the picture for the rays cast. Every record's rays come in two halves with independent scramblings.
//!
//! Not handled: places seen only by camera rays that came after the records were placed; the nearest record speaks for
//! them.

use glam::DVec3;
use rayon::prelude::*;

use crate::gather::camera_rays::CameraRays;
use crate::gather::final_gather::FinalGather;
use crate::gather::guiding::{Guiding, GuidingField};
use crate::gather::interpolation::{Fit, Place, Support};
use crate::gather::irradiance_record::{Casting, Record, Site};
use crate::gather::pixel::Pixel;
use crate::gather::pixel_lattice::Lattice;
use crate::gather::pixel_layer::Layer;
use crate::gather::reflection::Memory;
use crate::rays::sobol::hash;

/// No record.
pub(crate) const NONE: u32 = u32::MAX;
/// A place is covered where the fit leaves at most this share of a record's variance: some four records around it.
pub(crate) const COVERED: f64 = 0.34;
/// Spacings of the coarsest lattice to a side of the squares whose records share a guiding density.
const TILE: usize = 2;
/// Such squares across the picture at most.
const TILES: usize = 24;
/// Where light bends, a record borrows from others up to so many times its own valid radius away: those whose own, if
/// theirs is as short, would touch it.
const APART: f64 = 2.0;
/// Rays of a half at least.
const LEAST: u32 = 8;

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
    /// Where each record lies and how far it speaks.
    pub(crate) supports: Vec<Support>,
    /// Irradiance over pi of each record, field by field in both halves.
    pub(crate) values: Vec<[DVec3; 2]>,
    pub(crate) fields: usize,
    /// Number of fields that make the picture.
    pub(crate) leading: usize,
    pub(crate) lattice: Lattice,
    /// The record of each layer that has one, by the layer's number; else NONE.
    pub(crate) record_of: Vec<u32>,
    /// Number of the first layer of every pixel.
    pub(crate) starts: Vec<usize>,
    /// What guides the rays, where records of one place are cast one after the other.
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
            leading: final_gather.leading(),
            lattice: Lattice::new(density.spacing, width, pixels.len() / width.max(1)),
            record_of: vec![NONE; starts[pixels.len()]],
            starts,
            guiding: (density.spacing > 1).then(|| GuidingField::new(tile, width, final_gather.brightest())),
            cast: 0,
        }
    }

    /// Pixels across.
    pub fn width(&self) -> usize {
        self.lattice.width()
    }

    /// Number of layers without a record.
    pub fn bare(&self) -> usize {
        self.record_of.iter().filter(|&&record| record == NONE).count()
    }

    /// Adds records until every layer of every pixel is covered.
    pub fn place(&mut self, pixels: &[Pixel]) {
        self.place_where(pixels, &vec![true; pixels.len()]);
    }

    /// Adds records until every layer of the pixels marked is covered.
    pub(super) fn place_where(&mut self, pixels: &[Pixel], marked: &[bool]) {
        let mut spacing = self.density.spacing;
        loop {
            let own = self.lattice.pixels(spacing).filter(|&k| marked[k]);
            let own: Vec<usize> = own.collect();
            let found: Vec<(usize, usize)> = own
                .par_iter()
                .map_init(Fit::default, |fit, &k| self.uncovered(fit, k, &pixels[k]))
                .flatten_iter()
                .collect();
            let first = self.records.len();
            for &(k, l) in &found {
                self.add(k, l, &pixels[k], spacing);
            }
            let rays = self.rays_at(spacing);
            self.cast_from(first, |_| rays);
            for (i, &(k, _)) in found.iter().enumerate() {
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

    /// Fits the records around pixel k at a place; false where none speaks for it.
    pub(crate) fn fit(&self, fit: &mut Fit, k: usize, at: &Place) -> bool {
        fit.begin(at);
        self.lattice.visit(k, |i| fit.consider(at, i, &self.supports[i as usize]));
        fit.solve()
    }

    /// Adds a record without rays for layer l of pixel k.
    pub(crate) fn add(&mut self, k: usize, l: usize, pixel: &Pixel, spacing: usize) {
        self.record_of[self.starts[k] + l] = self.records.len() as u32;
        let seed = hash(k as u32, hash(l as u32, self.density.seed));
        let site = Site { pixel: k, looked: pixel.count, spacing, seed, density: 0 };
        let record = self.record(&pixel.layers[l], site);
        self.records.push(record);
    }

    /// A record of a layer, without rays and not of the cache, with the density of its place.
    pub(super) fn record(&mut self, layer: &Layer, site: Site) -> Record {
        let density = self.guiding.as_mut().map_or(0, |g| g.number(site.pixel, layer.first.normal));
        Record::new(layer, Site { density, ..site }, self.camera, self.fields)
    }

    /// Rays of a half that the records of one lattice get.
    fn rays_at(&self, spacing: usize) -> u32 {
        let rays = self.density.rays as usize * spacing / self.density.spacing;
        (rays as u32).max(LEAST.min(self.density.rays))
    }

    /// Casts rays from the records after `first` until each half has as many as `wanted` says of each of them.
    pub(crate) fn cast_from(&mut self, first: usize, wanted: impl Fn(usize) -> u32 + Sync) {
        let mut records = std::mem::take(&mut self.records);
        self.extend(&mut records[first..], wanted);
        self.records = records;
        self.settle(first);
    }

    /// Casts rays from records, of the cache or not, until each half has as many as `wanted` says of each of them.
    pub(super) fn extend(&mut self, records: &mut [Record], wanted: impl Fn(usize) -> u32 + Sync) {
        if let Some(guiding) = &mut self.guiding {
            guiding.update();
        }
        let (camera_rays, final_gather, guiding) = (self.camera_rays, self.final_gather, self.guiding.as_ref());
        let added: u64 = records
            .par_iter_mut()
            .enumerate()
            .map_init(Memory::default, |memory, (i, record)| {
                let guiding = guiding.map_or(Guiding::NONE, |g| g.of(record.site.density));
                record.extend(&Casting { camera_rays, final_gather, guiding }, wanted(i), memory)
            })
            .sum();
        self.cast += added;
    }

    /// Sets value, valid radius and weight of the records after `first`.
    pub(super) fn settle(&mut self, first: usize) {
        self.supports.truncate(first);
        self.values.truncate(first * self.fields);
        let density = self.density;
        for p in &self.records[first..] {
            self.values.extend(p.means());
            let least = density.least * density.pixel * p.distance;
            let radius = p.shortened * (density.radius * p.surroundings()).min(1.0).max(least);
            let reach = if p.shortened < 1.0 { APART * radius } else { f64::INFINITY };
            self.supports.push(Support {
                place: Place { reach, ..p.place() },
                radius,
                // Not by their own rays or variance: a record that met bright light by chance would count less.
                weight: p.site.spacing as f64,
            });
        }
    }
}
