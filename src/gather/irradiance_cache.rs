//! Irradiance points: few where irradiance varies slowly, many where surroundings are near.
//!
//! A coarse lattice of pixels comes first. At each finer lattice those pixels become points whose place the points so far
//! cannot speak for (Ward, Rubinstein and Clear 1988, here by the variance of a local linear fit). A point of a
//! coarse lattice stands for more pixels and gets more rays, in proportion to the spacing: that minimises the noise of the
//! picture for the rays cast. Every point's rays come in two halves with independent scramblings.
//!
//! Not handled: places seen only by camera rays that came after the points were chosen; the nearest point speaks for them.

use glam::DVec3;
use rayon::prelude::*;

use crate::gather::camera_rays::Pass;
use crate::gather::final_gather::Reader;
use crate::gather::guiding::{Guided, Guides};
use crate::gather::interpolation::{Fit, Known, Place};
use crate::gather::irradiance_record::Point;
use crate::gather::pixel::Pixel;
use crate::gather::pixel_lattice::Lattice;
use crate::gather::pixel_layer::Layer;
use crate::gather::reflection::Memory;
use crate::rays::sobol::hash;

/// No point.
pub(crate) const NONE: u32 = u32::MAX;
/// A place is spoken for when the fit leaves at most this share of a point's variance: some four points around it.
pub(crate) const COVERED: f64 = 0.34;
/// Spacings of the coarsest lattice to a side of the squares whose points share guides, and such squares across the picture at most.
const TILE: usize = 2;
const TILES: usize = 24;
/// Rays of a half at most.
const MOST: u32 = 1 << 14;
/// Rays of a half at least.
const LEAST: u32 = 8;

/// How many points and rays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Density {
    /// Pixels between the points of the coarsest lattice, a power of two; 1 makes every pixel a point.
    pub spacing: usize,
    /// Rays of each half of a point of the coarsest lattice.
    pub rays: u32,
    /// A point speaks for places within this share of the harmonic mean distance to its surroundings...
    pub reach: f64,
    /// ... and within so many pixels, whatever surrounds it.
    pub least: f64,
    /// Width of a pixel a unit distance from the camera.
    pub pixel: f64,
    /// Chooses the scrambling of the rays.
    pub seed: u32,
}

/// All points of a picture.
pub(crate) struct Points<'a> {
    pass: &'a Pass<'a>,
    pub(crate) reader: &'a Reader<'a>,
    pub(crate) density: Density,
    camera: DVec3,
    pub(crate) points: Vec<Point>,
    pub(crate) known: Vec<Known>,
    /// Irradiance over pi of each point, field by field in both halves.
    pub(crate) values: Vec<[DVec3; 2]>,
    pub(crate) fields: usize,
    pub(crate) lattice: Lattice,
    /// The point of each layer that is one, by the layer's number; else NONE.
    pub(crate) hosts: Vec<u32>,
    /// Number of the first layer of every pixel.
    pub(crate) starts: Vec<usize>,
    /// Guides of the rays, where points of one place are cast one after the other.
    guides: Option<Guides>,
    /// Rays cast.
    pub cast: u64,
}

impl<'a> Points<'a> {
    /// No points yet.
    pub fn new((pass, reader): (&'a Pass<'a>, &'a Reader<'a>), density: Density, pixels: &[Pixel]) -> Points<'a> {
        let view = pass.view;
        let width = view.width;
        let tile = (TILE * density.spacing).max(width / TILES);
        let mut starts = vec![0];
        for pixel in pixels {
            starts.push(starts[starts.len() - 1] + pixel.layers.len());
        }
        Points {
            pass,
            reader,
            density,
            camera: view.scene.camera.position.as_dvec3(),
            points: Vec::new(),
            known: Vec::new(),
            values: Vec::new(),
            fields: reader.fields(),
            lattice: Lattice::new(density.spacing, width, pixels.len() / width.max(1)),
            hosts: vec![NONE; starts[pixels.len()]],
            starts,
            guides: (density.spacing > 1).then(|| Guides::new(tile, width, reader.brightest())),
            cast: 0,
        }
    }

    /// Pixels across.
    pub fn width(&self) -> usize {
        self.lattice.width()
    }

    /// Adds points until every layer of every pixel is spoken for.
    pub fn place(&mut self, pixels: &[Pixel]) {
        self.place_where(pixels, &vec![true; pixels.len()]);
    }

    /// The same where only the layers of the pixels marked may want points.
    fn place_where(&mut self, pixels: &[Pixel], marked: &[bool]) {
        let mut spacing = self.density.spacing;
        loop {
            let own = self.lattice.pixels(spacing).filter(|&k| marked[k]);
            let own: Vec<usize> = own.collect();
            let found: Vec<(usize, usize)> = own
                .par_iter()
                .map_init(Fit::default, |fit, &k| self.wanting(fit, k, &pixels[k]))
                .flatten_iter()
                .collect();
            let first = self.points.len();
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
        self.fit(fit, k, &layer.place()) && fit.variance() <= COVERED
    }

    /// Fits the points around pixel k at a place.
    pub(crate) fn fit(&self, fit: &mut Fit, k: usize, at: &Place) -> bool {
        self.fit_without(fit, k, at, NONE)
    }

    /// The same, one point left out.
    pub(crate) fn fit_without(&self, fit: &mut Fit, k: usize, at: &Place, out: u32) -> bool {
        fit.begin(at);
        self.lattice.visit(k, |i| {
            if i != out {
                fit.consider(at, i, &self.known[i as usize]);
            }
        });
        fit.solve()
    }

    pub(crate) fn add(&mut self, k: usize, l: usize, pixel: &Pixel, spacing: usize) {
        self.hosts[self.starts[k] + l] = self.points.len() as u32;
        let seed = hash(k as u32, hash(l as u32, self.density.seed));
        let (seen, camera) = ((k, pixel.count), self.camera);
        let layer = &pixel.layers[l];
        let guides = self.guides.as_mut();
        let guide = guides.map_or(0, |g| g.number(k, layer.first.normal));
        let point = Point::new(layer, seen, spacing, camera, (self.fields, seed, guide));
        self.points.push(point);
    }

    /// Rays of a half that the points of one lattice get.
    fn rays_at(&self, spacing: usize) -> u32 {
        let rays = self.density.rays as usize * spacing / self.density.spacing;
        (rays as u32).max(LEAST.min(self.density.rays))
    }

    /// Casts rays from the points after `first` until each half has as many as `wanted` says of each of them.
    pub(crate) fn cast_from(&mut self, first: usize, wanted: impl Fn(usize) -> u32 + Sync) {
        if let Some(guides) = &mut self.guides {
            guides.learn();
        }
        let (pass, reader, guides) = (self.pass, self.reader, self.guides.as_ref());
        let points = self.points[first..].par_iter_mut().enumerate();
        let added: u64 = points
            .map_init(Memory::default, |memory, (i, point)| {
                let guided = guides.map_or(Guided::ALONE, |g| g.of(point.guide));
                point.extend((pass, reader, guided), wanted(i), memory)
            })
            .sum();
        self.cast += added;
        self.settle(first);
    }

    /// Sets value, reach and weight of the points after `first`.
    fn settle(&mut self, first: usize) {
        self.known.truncate(first);
        self.values.truncate(first * self.fields);
        let density = self.density;
        for p in &self.points[first..] {
            self.values.extend(p.means());
            let least = density.least * density.pixel * p.distance;
            let reach = (density.reach * p.surroundings()).min(1.0).max(least);
            self.known.push(Known {
                place: p.place(),
                reach: p.shortened * reach,
                // Not by their own rays or variance: a point that met bright light by chance would count less.
                weight: p.spacing as f64,
            });
        }
    }

    /// Casts as many more rays as multiply their number by a factor, where they lessen the noise of the picture most: rays
    /// that leave `s² / n` at each of the w pixels that a point stands for go as `s sqrt(w)`.
    pub fn refine(&mut self, factor: f64) {
        let more = (f64::from(self.density.rays) * factor).ceil() as u32;
        self.density.rays = more.min(MOST.max(self.density.rays));
        let wants = self.wants();
        let rays: Vec<f64> = self.points.iter().map(|p| f64::from(p.rays)).collect();
        let level = level(&wants, &rays, factor * rays.iter().sum::<f64>());
        self.cast_from(0, |i| (level * wants[i]).min(f64::from(MOST)) as u32);
    }

    /// Shortens the reach of some points, and adds points for the places that they spoke for.
    pub fn shorten(&mut self, some: &[u32], factor: f64, pixels: &[Pixel]) {
        let mut marked = vec![false; pixels.len()];
        for &i in some {
            let point = &mut self.points[i as usize];
            point.shortened *= factor;
            self.lattice.mark(point.spacing, i, &mut marked);
        }
        self.settle(0);
        self.place_where(pixels, &marked);
    }
}

/// The level at which `max(rays, level * want)`, summed over the points, is `total`.
fn level(wants: &[f64], rays: &[f64], total: f64) -> f64 {
    // Points join in the order in which a rising level meets their rays.
    let mut order: Vec<usize> = (0..wants.len()).filter(|&i| wants[i] > 0.0).collect();
    let meets = |i: usize| rays[i] / wants[i];
    order.sort_unstable_by(|&a, &b| meets(a).total_cmp(&meets(b)).then(a.cmp(&b)));
    let mut rest: f64 = rays.iter().sum();
    let (mut want, mut level) = (0.0, 0.0);
    for (k, &i) in order.iter().enumerate() {
        rest -= rays[i];
        want += wants[i];
        level = (total - rest).max(0.0) / want;
        if order.get(k + 1).is_none_or(|&next| level <= meets(next)) {
            break;
        }
    }
    level
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_level_shares_out_the_rays_by_what_they_are_worth() {
        let wants = [1.0, 2.0, 4.0, 0.0];
        let rays = [10.0_f64; 4];
        let spent = |level: f64| -> f64 {
            let each = wants.iter().zip(rays).map(|(w, n)| n.max(level * w));
            each.sum()
        };
        // Nothing more, some for the third, for the last two, for all that want any.
        for total in [40.0, 45.0, 60.0, 200.0] {
            let found = spent(level(&wants, &rays, total));
            assert!((found - total).abs() < 1e-9, "{found} of {total}");
        }
        assert_eq!(level(&[0.0; 4], &rays, 100.0), 0.0);
    }
}
