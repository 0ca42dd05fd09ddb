//! What the irradiance points say of a pixel, and how far that may be off.
//!
//! The halves' difference, fitted like the values, is the noise. Fitting each point from the others,
//! in either half, and multiplying the two misfits, leaves the squared bias of the fit: the halves' noises do not
//! correlate.
//!
//! Not handled: places that no point speaks for.

use glam::DVec3;
use rayon::prelude::*;

use super::irradiance::{Fit, Place};
use super::layer::Layer;
use super::points::{COVERED, NONE, Points};

/// A fit that leaves more than this share reaches out of its points.
const LOOSE: f64 = 0.5;

/// Spacings within which points are alike in noise.
const NEAR: f64 = 2.5;

impl Points<'_> {
    /// Irradiance over pi at layer l of pixel k, every field in both halves, into `found`.
    ///
    /// Returns by how much that of the `leading` fields together differs between where each half of the camera rays met the
    /// layer and the middle.
    pub fn at(
        &self,
        fit: &mut Fit,
        k: usize,
        (l, layer): (usize, &Layer),
        leading: usize,
        found: &mut Vec<[DVec3; 2]>,
    ) -> [DVec3; 2] {
        let own = self.host(k, l);
        // A point near a contact speaks for less than its pixel.
        if !self.fit(fit, k, &layer.place()) {
            match own.or_else(|| self.nearest(k, &layer.place())) {
                Some(point) => fit.take(point),
                None => fit.clear(),
            }
        }
        fit.settle(LOOSE);
        self.combine(fit, found);
        [0, 1].map(|half| {
            let change = fit.change(layer.off(half));
            change
                .map(|(i, share)| share * self.total(i, leading))
                .sum()
        })
    }

    /// The point of a layer, if it is one.
    fn host(&self, k: usize, l: usize) -> Option<u32> {
        let own = &self.hosts[self.starts[k]..self.starts[k + 1]];
        // Layers that later camera rays found come after those that points were chosen for.
        own.get(l).copied().filter(|&point| point != NONE)
    }

    /// The nearest point on the same side and material that looks the same way.
    fn nearest(&self, k: usize, at: &Place) -> Option<u32> {
        let mut best: Option<(f64, u32)> = None;
        self.lattice.visit(k, |i| {
            let other = &self.known[i as usize].place;
            let apart = other.position.distance_squared(at.position);
            let alike = other.material == at.material && other.normal.dot(at.normal) > 0.9;
            if alike && best.is_none_or(|b| (apart, i) < b) {
                best = Some((apart, i));
            }
        });
        best.map(|b| b.1)
    }

    /// The mean of both halves that a point found of the leading fields together.
    fn total(&self, i: u32, leading: usize) -> DVec3 {
        let means = &self.means(i as usize)[..leading];
        means.iter().map(|[a, b]| 0.5 * (*a + *b)).sum()
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

    /// Squared bias of the fit at each point, the others fitted there, of the light of all `leading` fields together; and the
    /// squared irradiance; both times the pixels that the point stands for. Single products are noisy, their sums are not.
    pub fn biases(&self, leading: usize) -> Vec<(f64, f64)> {
        let total = |means: &[[DVec3; 2]]| {
            let sum = |half: usize| means[..leading].iter().map(|m| m[half]).sum::<DVec3>();
            [sum(0), sum(1)]
        };
        let one = |(fit, found): &mut (Fit, Vec<[DVec3; 2]>), i: usize| -> (f64, f64) {
            let (own, known) = (&self.points[i], &self.known[i]);
            let k = self.lattice.pixel_of(i as u32);
            let inside =
                self.fit_without(fit, k, &known.place, i as u32) && fit.variance() <= COVERED;
            // Places that others cannot speak for, as along a crease, are points: their own share is part of the fit there.
            if !inside && !self.fit(fit, k, &known.place) {
                return (0.0, 0.0);
            }
            fit.settle(LOOSE);
            self.combine(fit, found);
            let ([u, v], [p, q]) = (total(found), total(self.means(i)));
            let pixels = (own.spacing * own.spacing) as f64;
            (pixels * (p - u).dot(q - v), pixels * p.dot(q))
        };
        let all = (0..self.points.len()).into_par_iter();
        all.map_init(Default::default, one).collect()
    }

    /// The points whose surroundings have the largest bias, up to the `share` of the whole bias that is too much.
    pub fn worst(&self, biases: &[(f64, f64)], share: f64) -> Vec<u32> {
        let pooled: Vec<f64> = (0..self.points.len())
            .into_par_iter()
            .map(|i| self.pooled(i, biases))
            .collect();
        let total: f64 = pooled.iter().map(|b| b.max(0.0)).sum();
        let mut order: Vec<u32> = (0..pooled.len() as u32).collect();
        let bias = |i: u32| pooled[i as usize];
        order.sort_unstable_by(|&a, &b| bias(b).total_cmp(&bias(a)).then(a.cmp(&b)));
        let mut sum = 0.0;
        order.retain(|&i| {
            sum += bias(i);
            sum - bias(i) < share * total && bias(i) > 0.0
        });
        order
    }

    /// What each point's rays are worth: the standard deviation of one, times the reflectance, times the pixels to a side
    /// that the point stands for.
    ///
    /// Two halves say little about one point, so points nearby speak as well.
    pub(super) fn wants(&self) -> Vec<f64> {
        let leading = self.reader.leading();
        let one = |i: usize| {
            let sum = |half: usize| {
                self.means(i)[..leading]
                    .iter()
                    .map(|m| m[half])
                    .sum::<DVec3>()
            };
            let own = &self.points[i];
            0.25 * (sum(0) - sum(1)).length_squared() * f64::from(own.rays)
        };
        let count = 0..self.points.len();
        let variances: Vec<f64> = count.clone().into_par_iter().map(one).collect();
        let want = |i: usize| {
            let own = &self.points[i];
            let at = &self.known[i].place;
            let near = NEAR * own.spacing as f64 * self.density.pixel * own.distance;
            let (mut sum, mut number) = (0.0, 0.0);
            self.lattice.visit(self.lattice.pixel_of(i as u32), |j| {
                let other = &self.known[j as usize].place;
                let apart = other.position.distance(at.position);
                if apart <= near && other.normal.dot(at.normal) > 0.9 {
                    sum += variances[j as usize];
                    number += 1.0;
                }
            });
            own.rho() * own.spacing as f64 * (sum / number).sqrt()
        };
        count.into_par_iter().map(want).collect()
    }

    /// Mean bias of the points that one point is fitted with, for the pixels that it stands for.
    fn pooled(&self, i: usize, biases: &[(f64, f64)]) -> f64 {
        let known = &self.known[i];
        let (mut sum, mut pixels) = (0.0, 0.0);
        self.lattice.visit(self.lattice.pixel_of(i as u32), |j| {
            let other = &self.known[j as usize].place;
            let near = other.position.distance(known.place.position) < 2.0 * known.reach;
            if near && other.normal.dot(known.place.normal) > 0.9 {
                sum += biases[j as usize].0;
                pixels += (self.points[j as usize].spacing as f64).powi(2);
            }
        });
        sum / pixels.max(1.0) * (self.points[i].spacing as f64).powi(2)
    }
}
