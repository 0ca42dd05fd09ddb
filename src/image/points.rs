//! Irradiance points: few where irradiance varies slowly, many where surroundings are near.
//!
//! A coarse lattice of pixels comes first. At each finer lattice those pixels become points whose place the points so far
//! cannot speak for (Ward, Rubinstein and Clear 1988, here by the variance of a local linear fit). A point of a
//! coarse lattice stands for more pixels and gets more rays, in proportion to the spacing: that minimises the noise of the
//! picture for the rays cast. Every point's rays come in two halves with independent scramblings.
//!
//! Not handled: a point's irradiance varying within one pixel.

use glam::DVec3;
use rayon::prelude::*;

use super::hemisphere::Reader;
use super::irradiance::{Fit, Known, Place};
use super::lattice::Lattice;
use super::layer::Layer;
use super::pixel::Pixel;
use crate::form_factors::Receiver;
use crate::rays::Side;
use crate::rays::sequence::hash;

/// No point.
pub(super) const NONE: u32 = u32::MAX;
/// A place is spoken for when the fit leaves at most this share of a point's variance: some four points around it.
pub(super) const COVERED: f64 = 0.34;
/// Rays of a half at least.
const LEAST: u32 = 8;

/// How many points and rays.
#[derive(Clone, Copy, Debug)]
pub(super) struct Density {
    /// Pixels between the points of the coarsest lattice, a power of two; 1 makes every pixel a point.
    pub spacing: usize,
    /// Rays of each half of a point of the coarsest lattice.
    pub rays: u32,
    /// A point speaks for places within this share of the harmonic mean distance to its surroundings...
    pub reach: f64,
    /// ... and within this distance a unit distance from the camera, whatever surrounds it: about a pixel.
    pub least: f64,
    /// Chooses the scrambling of the rays.
    pub seed: u32,
}

/// One irradiance point.
pub(super) struct Point {
    /// Where the rays of each half start.
    from: [Vec<Receiver>; 2],
    material: u32,
    seed: u32,
    /// Spacing of the lattice it belongs to.
    pub(super) spacing: usize,
    /// Factor on its reach, where the fit was biased.
    shortened: f64,
    /// Distance from the camera.
    distance: f64,
    /// Rays of each half cast so far.
    rays: u32,
    /// Sum over the rays of their inverse lengths.
    nearness: f64,
    /// Sums over the rays of each half, field by field.
    sums: [Vec<DVec3>; 2],
}

/// All points of a picture.
pub(super) struct Points<'a> {
    reader: &'a Reader<'a>,
    density: Density,
    camera: DVec3,
    pub(super) points: Vec<Point>,
    pub(super) known: Vec<Known>,
    /// Irradiance over pi of each point, field by field in both halves.
    pub(super) values: Vec<[DVec3; 2]>,
    pub(super) fields: usize,
    pub(super) lattice: Lattice,
    /// The point of each layer that is one, by the layer's number; else NONE.
    pub(super) hosts: Vec<u32>,
    /// Number of the first layer of every pixel.
    pub(super) starts: Vec<usize>,
    /// Rays cast.
    pub cast: u64,
}

impl<'a> Points<'a> {
    /// No points yet.
    pub fn new(
        reader: &'a Reader<'a>,
        density: Density,
        camera: DVec3,
        pixels: &[Pixel],
        width: usize,
    ) -> Points<'a> {
        let mut starts = vec![0];
        for pixel in pixels {
            starts.push(starts[starts.len() - 1] + pixel.layers.len());
        }
        Points {
            reader,
            density,
            camera,
            points: Vec::new(),
            known: Vec::new(),
            values: Vec::new(),
            fields: reader.fields(),
            lattice: Lattice::new(density.spacing, width, pixels.len() / width.max(1)),
            hosts: vec![NONE; starts[pixels.len()]],
            starts,
            cast: 0,
        }
    }

    /// Pixels across.
    pub fn width(&self) -> usize {
        self.lattice.width()
    }

    /// Adds points until every layer of every pixel is spoken for.
    pub fn place(&mut self, pixels: &[Pixel]) {
        let mut spacing = self.density.spacing;
        loop {
            let own: Vec<usize> = self.lattice.pixels(spacing).collect();
            let found: Vec<(usize, usize)> = own
                .par_iter()
                .map_init(Fit::default, |fit, &k| self.wanting(fit, k, &pixels[k]))
                .flatten_iter()
                .collect();
            let first = self.points.len();
            for &(k, l) in &found {
                self.add(k, l, &pixels[k].layers[l], spacing);
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

    /// Layers of pixel k that no points speak for.
    fn wanting(&self, fit: &mut Fit, k: usize, pixel: &Pixel) -> Vec<(usize, usize)> {
        let all = self.density.spacing == 1;
        (0..pixel.layers.len())
            .filter(|l| self.hosts[self.starts[k] + l] == NONE)
            .filter(|&l| all || !self.covers(fit, k, &pixel.layers[l]))
            .map(|l| (k, l))
            .collect()
    }

    fn covers(&self, fit: &mut Fit, k: usize, layer: &Layer) -> bool {
        self.fit(fit, k, &place(layer)) && fit.variance() <= COVERED
    }

    /// Fits the points around pixel k at a place.
    pub(super) fn fit(&self, fit: &mut Fit, k: usize, at: &Place) -> bool {
        self.fit_without(fit, k, at, NONE)
    }

    /// The same, one point left out.
    pub(super) fn fit_without(&self, fit: &mut Fit, k: usize, at: &Place, out: u32) -> bool {
        fit.begin(at);
        self.lattice.visit(k, |i| {
            if i != out {
                fit.consider(at, i, &self.known[i as usize]);
            }
        });
        fit.solve()
    }

    fn add(&mut self, k: usize, l: usize, layer: &Layer, spacing: usize) {
        self.hosts[self.starts[k] + l] = self.points.len() as u32;
        let none = || vec![DVec3::ZERO; self.fields];
        self.points.push(Point {
            from: [0, 1].map(|half| layer.origins(half).to_vec()),
            material: place(layer).material,
            seed: hash(k as u32, hash(l as u32, self.density.seed)),
            spacing,
            shortened: 1.0,
            distance: layer.first.position.as_dvec3().distance(self.camera),
            rays: 0,
            nearness: 0.0,
            sums: [none(), none()],
        });
    }

    /// Rays of a half that the points of one lattice get.
    fn rays_at(&self, spacing: usize) -> u32 {
        let rays = self.density.rays as usize * spacing / self.density.spacing;
        (rays as u32).max(LEAST.min(self.density.rays))
    }

    /// Casts rays from the points after `first` until each half has as many as `wanted` says.
    fn cast_from(&mut self, first: usize, wanted: impl Fn(&Point) -> u32 + Sync) {
        let reader = self.reader;
        let cast = |hits: &mut Vec<_>, point: &mut Point| {
            let range = point.rays..wanted(point).max(point.rays);
            let added = 2 * range.len() as u64;
            for (half, sums) in point.sums.iter_mut().enumerate() {
                let seed = point.seed ^ HALVES[half];
                point.nearness += reader.read(&point.from[half], range.clone(), seed, hits, sums);
            }
            point.rays = range.end;
            added
        };
        let added: u64 = self.points[first..]
            .par_iter_mut()
            .map_init(Vec::new, cast)
            .sum();
        self.cast += added;
        self.settle(first);
    }

    /// Sets value, reach and weight of the points after `first`.
    fn settle(&mut self, first: usize) {
        self.known.truncate(first);
        self.values.truncate(first * self.fields);
        for p in &self.points[first..] {
            let share = 1.0 / f64::from(p.rays);
            let [a, b] = &p.sums;
            self.values
                .extend(a.iter().zip(b).map(|(a, b)| [*a * share, *b * share]));
        }
        let density = self.density;
        self.known.extend(self.points[first..].iter().map(|p| {
            let surroundings = f64::from(2 * p.rays) / p.nearness;
            Known {
                place: Place {
                    position: p.middle(),
                    normal: p.from[0][0].normal,
                    material: p.material,
                },
                reach: p.shortened
                    * (density.reach * surroundings)
                        .min(1.0)
                        .max(density.least * p.distance),
                weight: f64::from(p.rays),
            }
        }));
    }

    /// Multiplies the rays of every point.
    pub fn refine(&mut self, factor: f64) {
        let more = |rays: u32| (f64::from(rays) * factor).ceil() as u32;
        self.density.rays = more(self.density.rays);
        self.cast_from(0, |p| more(p.rays));
    }

    /// Shortens the reach of some points; places may want more points then.
    pub fn shorten(&mut self, some: &[u32], factor: f64) {
        for &i in some {
            self.points[i as usize].shortened *= factor;
        }
        self.settle(0);
    }
}

/// Tells the two halves' scramblings apart.
const HALVES: [u32; 2] = [0x51ed_270b, 0xa3b1_95c7];

impl Point {
    /// Mean of where its rays start.
    fn middle(&self) -> DVec3 {
        let mean = |from: &Vec<Receiver>| {
            let sum: DVec3 = from.iter().map(|r| r.position.as_dvec3()).sum();
            sum / from.len() as f64
        };
        0.5 * (mean(&self.from[0]) + mean(&self.from[1]))
    }
}

/// Where a layer's irradiance is wanted, and what may speak for it.
pub(super) fn place(layer: &Layer) -> Place {
    Place {
        position: layer.position(),
        normal: layer.first.normal,
        material: 2 * layer.key.2 + u32::from(layer.key.1 == Side::Back),
    }
}
