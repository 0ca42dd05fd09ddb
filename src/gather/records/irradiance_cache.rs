//! The irradiance cache: few records where irradiance varies slowly, many where surroundings are near.
//!
//! A coarse lattice of pixels comes first. At each finer lattice those pixels get records that the records so far do
//! not cover (G. Ward, F. Rubinstein, R. Clear, *A ray tracing solution for diffuse interreflection*, 1988; here by the
//! variance of a local linear fit, where G. Ward, P. Heckbert, *Irradiance gradients*, 1992, extrapolate each record).
//! A record of a coarse lattice counts in more pixels and gets more rays, in proportion to the spacing: that minimises
//! the noise of the picture for the rays cast.
//!
//! Not handled: surfaces first seen after the records were placed; they take the nearest record.

use glam::DVec3;
use halflight_team::Loop;

use crate::gather::pixels::camera_rays::CameraRays;
use crate::gather::pixels::pixel::Pixel;
use crate::gather::pixels::pixel_layer::{Layer, Place};
use crate::gather::records::final_gather::FinalGather;
use crate::gather::records::interpolation::{Fit, Support};
use crate::gather::records::pixel_lattice::Lattice;
use crate::gather::records::record::{Record, RecordCaster, Site};
use crate::rays::sobol::hash;

/// A place is covered where the fit leaves at most this share of a record's variance: some four records around it.
const COVERED: f64 = 0.34;
/// Spacings of the coarsest lattice to a side of the squares whose records share a guiding density.
const TILE: usize = 2;
/// Such squares across the picture at most.
const TILES: usize = 24;
/// Rays of a half at least.
const LEAST_RAYS: u32 = 8;
/// A fit that leaves more than this share of a record's variance extrapolates.
const LOOSE: f64 = 0.5;

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
    /// Chooses the scrambling of the rays.
    pub seed: u32,
}

/// All records of a picture, and the light between them.
pub(crate) struct IrradianceCache<'a> {
    pub density: Density,
    pub caster: RecordCaster<'a>,
    pub records: Vec<Record>,
    pub light: RecordedLight,
    pub layers: LayerRecords,
}

impl<'a> IrradianceCache<'a> {
    /// A cache without records, for the layers that pixels see.
    pub(crate) fn new(
        camera_rays: &'a CameraRays<'a>,
        final_gather: &'a FinalGather<'a>,
        density: Density,
        pixels: &[Pixel],
    ) -> IrradianceCache<'a> {
        let width = camera_rays.view.width;
        let tile = (density.spacing > 1).then(|| (TILE * density.spacing).max(width / TILES));
        IrradianceCache {
            density,
            caster: RecordCaster::new(camera_rays, final_gather, tile),
            records: Vec::new(),
            light: RecordedLight {
                lattice: Lattice::new(density.spacing, width, pixels.len() / width.max(1)),
                supports: Vec::new(),
                values: Vec::new(),
                fields: final_gather.count(),
                picture_fields: final_gather.fields.picture_fields(),
            },
            layers: LayerRecords::none(pixels),
        }
    }

    /// Adds records until every layer of every pixel is covered.
    pub(crate) fn place(&mut self, pixels: &[Pixel]) {
        let mut spacing = self.density.spacing;
        loop {
            let own: Vec<usize> = self.light.lattice.pixels(spacing).collect();
            let of_pixel = |fit: &mut Fit, i: usize| self.uncovered(fit, own[i], &pixels[own[i]]);
            let uncovered: Vec<Vec<(usize, usize)>> = Loop::each(own.len()).map_init(Fit::default, of_pixel);
            let uncovered: Vec<(usize, usize)> = uncovered.into_iter().flatten().collect();
            let first = self.records.len();
            for &(k, l) in &uncovered {
                self.add(k, l, &pixels[k], spacing);
            }
            let rays = self.rays_at(spacing);
            self.cast_from(first, |_| rays);
            for (i, &(k, _)) in uncovered.iter().enumerate() {
                self.light.lattice.insert(spacing, k, (first + i) as u32);
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
            .filter(|l| self.layers.of(k, *l) == OwnRecord::None)
            .filter(|&l| all || !self.covers(fit, k, &pixel.layers[l]))
            .map(|l| (k, l))
            .collect()
    }

    /// Whether the records around pixel k cover a layer.
    fn covers(&self, fit: &mut Fit, k: usize, layer: &Layer) -> bool {
        self.light.fit(fit, k, &layer.place()) && fit.variance() <= COVERED
    }

    /// Adds a record without rays for layer l of pixel k, and returns its number.
    pub(crate) fn add(&mut self, k: usize, l: usize, pixel: &Pixel, spacing: usize) -> u32 {
        let number = self.records.len() as u32;
        let seed = hash(k as u32, hash(l as u32, self.density.seed));
        let site = Site { pixel: k, camera_count: pixel.count, spacing, seed };
        self.records.push(self.caster.record(&pixel.layers[l], site));
        self.layers.set(k, l, OwnRecord::Shared(number));
        number
    }

    /// Rays of a half that the records of one lattice get.
    fn rays_at(&self, spacing: usize) -> u32 {
        let rays = self.density.rays as usize * spacing / self.density.spacing;
        (rays as u32).max(LEAST_RAYS.min(self.density.rays))
    }

    /// Casts rays from the records after `first` until each half has as many as `wanted` says of each of them.
    pub(crate) fn cast_from(&mut self, first: usize, wanted: impl Fn(usize) -> u32 + Sync) {
        self.caster.extend(&mut self.records[first..], wanted);
        self.light.settle(&self.records, first, &self.density);
    }

    /// Irradiance over pi at layer l of pixel k, every field in both halves, as the `values` of `fitted`.
    ///
    /// Returns the changes of that of the picture from the middle to the mean point of each half of the camera rays.
    pub(crate) fn at(&self, fitted: &mut Fitted, k: usize, l: usize, layer: &Layer) -> [DVec3; 2] {
        self.fit_layer(&mut fitted.fit, k, l, layer);
        self.light.evaluate(fitted);
        [0, 1].map(|half| {
            let change = fitted.fit.change(layer.off(half));
            change.map(|(i, coefficient)| coefficient * self.light.mean(i)).sum()
        })
    }

    /// Fits layer l of pixel k; takes a mean where the fit extrapolates, and a single record where none is valid or the
    /// layer is alone.
    pub(crate) fn fit_layer(&self, fit: &mut Fit, k: usize, l: usize, layer: &Layer) {
        let own = self.layers.of(k, l);
        if let OwnRecord::Alone(record) = own {
            return fit.take(record);
        }
        let place = layer.place();
        // The valid radius of a record near a contact may be less than a pixel.
        if !self.light.fit(fit, k, &place) {
            match own.number().or_else(|| self.light.nearest(k, &place)) {
                Some(record) => fit.take(record),
                None => fit.clear(),
            }
        }
        fit.settle(LOOSE);
    }
}

/// A fit and its values; memory that one thread uses again.
#[derive(Default)]
pub(crate) struct Fitted {
    pub fit: Fit,
    /// Irradiance over pi of every field in both halves.
    pub values: Vec<[DVec3; 2]>,
}

/// What the records tell of the light at them and between them.
pub(crate) struct RecordedLight {
    pub lattice: Lattice,
    /// Place, valid radius and weight of each record.
    pub supports: Vec<Support>,
    /// Irradiance over pi of each record, field by field in both halves.
    pub values: Vec<[DVec3; 2]>,
    /// Number of fields, of which the first make the picture.
    pub fields: usize,
    pub picture_fields: usize,
}

impl RecordedLight {
    /// Fits the records around pixel k at a place; false where none is valid there.
    pub(crate) fn fit(&self, fit: &mut Fit, k: usize, at: &Place) -> bool {
        fit.begin(at);
        self.lattice.visit(k, |i| fit.consider(at, i, &self.supports[i as usize]));
        fit.solve()
    }

    /// Sets value, valid radius and weight of the records after `first`.
    fn settle(&mut self, records: &[Record], first: usize, density: &Density) {
        self.supports.truncate(first);
        self.values.truncate(first * self.fields);
        for p in &records[first..] {
            self.values.extend(p.means());
            let least = density.least * p.pixel;
            self.supports.push(Support {
                place: p.place(),
                radius: (density.radius * p.surroundings()).min(1.0).max(least),
                // Not the inverse variance: a record that met bright light by chance would count less.
                weight: p.site.spacing as f64,
            });
        }
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

/// The record that each layer of each pixel has of its own.
pub(crate) struct LayerRecords {
    /// Number of the first layer of every pixel.
    starts: Vec<usize>,
    own: Vec<OwnRecord>,
}

/// The record that a layer has of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum OwnRecord {
    /// Those around it are all it takes.
    None,
    /// The layer takes those around it as well.
    Shared(u32),
    /// It is all that the layer takes.
    Alone(u32),
}

impl OwnRecord {
    /// Its number.
    pub(crate) fn number(self) -> Option<u32> {
        match self {
            OwnRecord::None => None,
            OwnRecord::Shared(record) | OwnRecord::Alone(record) => Some(record),
        }
    }
}

impl LayerRecords {
    fn none(pixels: &[Pixel]) -> LayerRecords {
        let mut starts = vec![0];
        for pixel in pixels {
            starts.push(starts[starts.len() - 1] + pixel.layers.len());
        }
        LayerRecords { own: vec![OwnRecord::None; starts[pixels.len()]], starts }
    }

    /// Layers of all pixels.
    pub(crate) fn count(&self) -> usize {
        self.own.len()
    }

    /// The number of layer l of pixel k, of all.
    pub(crate) fn number(&self, k: usize, l: usize) -> usize {
        self.starts[k] + l
    }

    /// The record of layer l of pixel k.
    pub(crate) fn of(&self, k: usize, l: usize) -> OwnRecord {
        let own = &self.own[self.starts[k]..self.starts[k + 1]];
        // Layers that later camera rays met follow those that records were placed for.
        own.get(l).copied().unwrap_or(OwnRecord::None)
    }

    /// Sets the record of layer l of pixel k.
    pub(crate) fn set(&mut self, k: usize, l: usize, own: OwnRecord) {
        let number = self.number(k, l);
        self.own[number] = own;
    }
}
