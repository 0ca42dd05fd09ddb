//! What the irradiance points say of a pixel, and how far that may be off.
//!
//! The halves' difference, fitted like the values, is the noise. Fitting each point from the others,
//! in either half, and multiplying the two misfits, leaves the squared bias of the fit: the halves' noises do not
//! correlate.
//!
//! Not handled: places that no point speaks for.

use glam::DVec3;
use rayon::prelude::*;

use super::irradiance::Fit;
use super::layer::Layer;
use super::points::{COVERED, NONE, Points, place};

/// A fit that leaves more than this share reaches out of its points.
const LOOSE: f64 = 0.5;

impl Points<'_> {
    /// Irradiance over pi at layer l of pixel k, every field in both halves, into `found`.
    pub fn at(
        &self,
        fit: &mut Fit,
        k: usize,
        (l, layer): (usize, &Layer),
        found: &mut Vec<[DVec3; 2]>,
    ) {
        let own = self.hosts[self.starts[k] + l];
        // A point near a contact speaks for less than its pixel.
        if !self.fit(fit, k, &place(layer)) && own != NONE {
            fit.take(own);
        }
        fit.settle(LOOSE);
        self.combine(fit, found);
    }

    /// The fitted value of every field in both halves.
    fn combine(&self, fit: &Fit, found: &mut Vec<[DVec3; 2]>) {
        found.clear();
        found.resize(self.fields, [DVec3::ZERO; 2]);
        for &(i, share) in &fit.shares {
            for ([a, b], [u, v]) in found.iter_mut().zip(self.means(i as usize)) {
                *a += share * *u;
                *b += share * *v;
            }
        }
    }

    /// Irradiance over pi that a point found: every field in both halves.
    fn means(&self, i: usize) -> &[[DVec3; 2]] {
        &self.values[i * self.fields..(i + 1) * self.fields]
    }

    /// Mean squared bias of the fit relative to the mean squared irradiance, of the light of all `leading` fields
    /// together: each point fitted from the others, weighted by the pixels it stands for.
    pub fn bias(&self, leading: usize) -> f64 {
        let total = |means: &[[DVec3; 2]]| {
            let sum = |half: usize| means[..leading].iter().map(|m| m[half]).sum::<DVec3>();
            [sum(0), sum(1)]
        };
        let one = |(fit, found): &mut (Fit, Vec<[DVec3; 2]>), i: usize| -> (f64, f64) {
            let (own, known) = (&self.points[i], &self.known[i]);
            let k = self.lattice.pixel_of(i as u32);
            if !self.fit_without(fit, k, &known.place, i as u32) || fit.variance() > COVERED {
                return (0.0, 0.0);
            }
            self.combine(fit, found);
            let ([u, v], [p, q]) = (total(found), total(self.means(i)));
            let pixels = (own.spacing * own.spacing) as f64;
            (pixels * (p - u).dot(q - v), pixels * p.dot(q))
        };
        let sums: Vec<(f64, f64)> = (0..self.points.len())
            .into_par_iter()
            .map_init(Default::default, one)
            .collect();
        let (bias, signal) = sums.iter().fold((0.0, 0.0), |s, t| (s.0 + t.0, s.1 + t.1));
        if signal > 0.0 {
            (bias / signal).max(0.0)
        } else {
            0.0
        }
    }
}
