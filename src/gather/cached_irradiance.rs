//! What the irradiance cache says of a layer: the fit through the records around it, or the nearest record.
//!
//! Not handled: how far that may be off; that is [`crate::gather::fit_error`].

use glam::DVec3;

use crate::gather::interpolation::{Fit, Place};
use crate::gather::irradiance_cache::{IrradianceCache, NONE};
use crate::gather::pixel_layer::Layer;

/// A fit that leaves more than this share of a record's variance reaches out of its records.
const LOOSE: f64 = 0.5;

/// A fit and what it gives; memory that one thread uses again.
#[derive(Default)]
pub(crate) struct Fitted {
    pub fit: Fit,
    /// Irradiance over pi of every field in both halves.
    pub values: Vec<[DVec3; 2]>,
}

impl IrradianceCache<'_> {
    /// Irradiance over pi at layer l of pixel k, every field in both halves, as the `values` of `fitted`.
    ///
    /// Returns by how much that of the fields that make the picture differs between where each half of the camera rays
    /// met the layer and the middle.
    pub fn at(&self, fitted: &mut Fitted, k: usize, l: usize, layer: &Layer) -> [DVec3; 2] {
        self.fit_layer(&mut fitted.fit, k, l, layer);
        self.evaluate(fitted);
        [0, 1].map(|half| {
            let change = fitted.fit.change(layer.off(half));
            change.map(|(i, coefficient)| coefficient * self.mean(i)).sum()
        })
    }

    /// The fit of the records around record i at its own place, itself among them; false where none speaks for it.
    pub(crate) fn at_record(&self, fitted: &mut Fitted, i: u32) -> bool {
        let found = self.fit(&mut fitted.fit, self.lattice.pixel_of(i), &self.supports[i as usize].place);
        if found {
            fitted.fit.settle(LOOSE);
            self.evaluate(fitted);
        }
        found
    }

    /// Fits layer l of pixel k; takes a mean where the fit reaches out of its records, and a single record where none
    /// speaks for the layer.
    pub(crate) fn fit_layer(&self, fit: &mut Fit, k: usize, l: usize, layer: &Layer) {
        let own = self.own_record(k, l);
        let reach = own.map_or(f64::INFINITY, |record| self.supports[record as usize].place.reach);
        let place = Place { reach, ..layer.place() };
        // A record near a contact speaks for less than its pixel.
        if !self.fit(fit, k, &place) {
            match own.or_else(|| self.nearest(k, &place)) {
                Some(record) => fit.take(record),
                None => fit.clear(),
            }
        }
        fit.settle(LOOSE);
    }

    /// Finds the values that a fit gives.
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
        // Layers that later camera rays found come after those that records were placed for.
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

    /// Irradiance over pi that a record found: every field in both halves.
    pub(crate) fn means(&self, i: usize) -> &[[DVec3; 2]] {
        &self.values[i * self.fields..(i + 1) * self.fields]
    }

    /// The mean of both halves that a record found of the fields that make the picture together.
    fn mean(&self, i: u32) -> DVec3 {
        let means = &self.means(i as usize)[..self.leading];
        means.iter().map(|[a, b]| 0.5 * (*a + *b)).sum()
    }

    /// Of values of every field in both halves the light of the fields that make the picture together.
    pub(crate) fn total(&self, values: &[[DVec3; 2]]) -> [DVec3; 2] {
        [0, 1].map(|half| values[..self.leading].iter().map(|m| m[half]).sum())
    }
}
