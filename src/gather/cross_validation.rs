//! What the fit between irradiance points leaves where there is no point, measured at places drawn by chance.
//!
//! Points lie where those before them could not speak, so their own misfits say nothing of places that others only seem to speak for, as
//! a strip of a pixel's width whose neighbours lie on another board. Layers of pixels are drawn, their light gathered by
//! rays of their own, and the product of both halves' misfits is the squared error without noise. They become points then, so no ray is lost.

use glam::DVec3;
use rayon::prelude::*;

use crate::gather::fit_error::total;
use crate::gather::interpolation::Fit;
use crate::gather::irradiance_cache::{NONE, Points};
use crate::gather::pixel::Pixel;
use crate::gather::pixel_layer::Layer;
use crate::rays::sobol::hash;

/// Places drawn over points so far.
const SHARE: f64 = 0.125;

/// A layer without a point, and what the points say of it.
struct Place {
    pixel: usize,
    layer: usize,
    /// Irradiance over pi of both halves, the fields that make the picture together.
    fitted: [DVec3; 2],
}

/// What places drawn by chance tell.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Validated {
    /// Squared error of the fit, (W/(m² sr))².
    misfit: f64,
    /// Its standard error.
    deviation: f64,
}

impl Validated {
    /// What is foreseen, if the places allow it within their standard error; else the bound that they set.
    pub fn corrected(self, foreseen: f64) -> f64 {
        let least = (self.misfit - self.deviation).max(0.0);
        foreseen.clamp(least, (self.misfit + self.deviation).max(least))
    }
}

impl Points<'_> {
    /// The sum over the pixels of the squared error of the fit where there is no point, as places drawn in one `round` tell it, channels
    /// added.
    pub fn validate(&mut self, pixels: &[Pixel], leading: usize, round: u32) -> Validated {
        let none = self.bare();
        let every = none as f64 / (SHARE * self.points.len() as f64).max(1.0);
        let places = self.drawn(pixels, leading, every.max(1.0) as u32, round);
        let every = none as f64 / places.len().max(1) as f64;
        let first = self.points.len();
        for place in &places {
            self.add(place.pixel, place.layer, &pixels[place.pixel], 1);
        }
        let rays = (self.points[..first].iter().map(|p| u64::from(p.rays)).sum::<u64>() / first.max(1) as u64) as u32;
        self.cast_from(first, |_| rays.max(1));
        let (mut sum, mut squares) = (0.0, 0.0);
        for (i, place) in places.iter().enumerate() {
            self.lattice.insert(1, place.pixel, (first + i) as u32);
            let weight = pixels[place.pixel].weight();
            let missed = every * weight * self.missed(first + i, place, leading);
            sum += missed;
            squares += missed * missed;
        }
        Validated { misfit: sum, deviation: squares.sqrt() }
    }

    /// Layers without a point.
    pub fn bare(&self) -> usize {
        self.hosts.iter().filter(|&&host| host == NONE).count()
    }

    /// One in `every` layers without a point.
    fn drawn(&self, pixels: &[Pixel], leading: usize, every: u32, round: u32) -> Vec<Place> {
        let one = |memory: &mut (Fit, Vec<[DVec3; 2]>), k: usize| -> Vec<Place> {
            let layers = pixels[k].layers.iter().enumerate();
            let place = |(l, layer): (usize, &Layer)| {
                let number = self.starts[k] + l;
                let taken = hash(number as u32, round ^ 0x7a11_da7e).is_multiple_of(every);
                (taken && self.hosts[number] == NONE).then(|| {
                    self.at(&mut memory.0, k, (l, layer), leading, &mut memory.1);
                    Place { pixel: k, layer: l, fitted: total(&memory.1, leading) }
                })
            };
            layers.filter_map(place).collect()
        };
        let all = (0..pixels.len()).into_par_iter();
        all.map_init(Default::default, one).flatten_iter().collect()
    }

    /// The squared error at a place that has become point i.
    fn missed(&self, i: usize, place: &Place, leading: usize) -> f64 {
        let own = total(self.means(i), leading);
        let [a, b] = [0, 1].map(|half| place.fitted[half] - own[half]);
        self.points[i].counts().powi(2) * a.dot(b)
    }
}
