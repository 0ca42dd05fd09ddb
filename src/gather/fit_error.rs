//! What the irradiance points say of a pixel, and how far that may be off.
//!
//! The halves' difference, fitted like the values, is the noise. Fitting each point from the others,
//! in either half, and multiplying the two misfits, leaves the squared bias of the fit: the halves' noises do not
//! correlate.
//!
//! Not handled: places that no point speaks for.

use glam::DVec3;
use rayon::prelude::*;

use crate::gather::interpolation::{Fit, Place};
use crate::gather::irradiance_cache::{COVERED, NONE, Points};
use crate::gather::pixel::Pixel;
use crate::gather::pixel_layer::Layer;

/// A fit that leaves more than this share reaches out of its points.
const LOOSE: f64 = 0.5;

/// Spacings within which points are alike in noise.
const NEAR: f64 = 2.5;

/// Share of a point in the fit at its own place beyond which the others leave more than [`COVERED`] of the variance there: they would not
/// speak for it, it would be a point. (A share h leaves the others h / (1 - h).)
const NEEDED: f64 = COVERED / (1.0 + COVERED);

/// Squared bias of the fit at a point.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Bias {
    /// In the pixel that the point lies in, (W/(m² sr))², channels added.
    pub here: f64,
    /// There and in its share of the layers that have no point, where others foresee light as they do here.
    pub around: f64,
    /// That of the irradiance over pi which others foresee there, times the pixels that the point stood for.
    pub foreseen: f64,
    /// Squared irradiance over pi, times the same.
    pub light: f64,
}

/// The light of the first `leading` fields together in both halves.
pub(crate) fn total(means: &[[DVec3; 2]], leading: usize) -> [DVec3; 2] {
    [0, 1].map(|half| means[..leading].iter().map(|m| m[half]).sum())
}

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
            change.map(|(i, share)| share * self.total(i, leading)).sum()
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
    pub(crate) fn means(&self, i: usize) -> &[[DVec3; 2]] {
        &self.values[i * self.fields..(i + 1) * self.fields]
    }

    /// The bias of the fit at each point, of the light of all `leading` fields together. Single products are noisy, their sums are not.
    ///
    /// The fit is linear in the points' values, so where a point itself has the share s in it, what the others alone would miss
    /// is the misfit over 1 - s.
    pub fn biases(&self, leading: usize) -> Vec<Bias> {
        let bare = self.bare() as f64 / self.points.len().max(1) as f64;
        let one = |(fit, found): &mut (Fit, Vec<[DVec3; 2]>), i: usize| -> Bias {
            let (own, known) = (&self.points[i], &self.known[i]);
            let k = self.lattice.pixel_of(i as u32);
            if !self.fit(fit, k, &known.place) {
                return Bias::default();
            }
            fit.settle(LOOSE);
            self.combine(fit, found);
            let ([u, v], [p, q]) = (total(found, leading), total(self.means(i), leading));
            let misfit = (p - u).dot(q - v);
            let share = fit.share_of(i as u32);
            let others = if share < NEEDED { 1.0 - share } else { 1.0 };
            let foreseen = misfit / (others * others);
            let pixels = (own.spacing * own.spacing) as f64;
            Bias {
                here: own.counts().powi(2) * misfit,
                around: own.counts().powi(2) * (misfit + bare * foreseen),
                foreseen: pixels * foreseen,
                light: pixels * p.dot(q),
            }
        };
        let all = (0..self.points.len()).into_par_iter();
        all.map_init(Default::default, one).collect()
    }

    /// The squared error of the fit at the points themselves, summed over the pixels that see no luminaire.
    pub fn misfit(&self, pixels: &[Pixel], biases: &[Bias]) -> f64 {
        let weight = |i: u32| pixels[self.lattice.pixel_of(i)].weight();
        let own = biases.iter().zip(0_u32..);
        own.map(|(bias, i)| weight(i) * bias.here).sum()
    }

    /// The points whose surroundings have the largest bias, up to the `share` of the whole bias that is too much.
    pub fn worst(&self, biases: &[Bias], share: f64) -> Vec<u32> {
        let pooled: Vec<f64> = (0..self.points.len()).into_par_iter().map(|i| self.pooled(i, biases)).collect();
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
    pub(crate) fn wants(&self) -> Vec<f64> {
        let leading = self.reader.leading();
        let one = |i: usize| {
            let [a, b] = total(self.means(i), leading);
            let own = &self.points[i];
            0.25 * (a - b).length_squared() * f64::from(own.rays)
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

    /// Mean bias of the points that one point is fitted with.
    fn pooled(&self, i: usize, biases: &[Bias]) -> f64 {
        let known = &self.known[i];
        let (mut sum, mut points) = (0.0, 0.0);
        self.lattice.visit(self.lattice.pixel_of(i as u32), |j| {
            let other = &self.known[j as usize].place;
            let near = other.position.distance(known.place.position) < 2.0 * known.reach;
            if near && other.normal.dot(known.place.normal) > 0.9 {
                sum += biases[j as usize].around;
                points += 1.0;
            }
        });
        sum / f64::max(points, 1.0)
    }
}

/// Mean squared bias that points foresee where there is none, as a share of the mean squared irradiance.
pub(crate) fn relative(biases: &[Bias]) -> f64 {
    let foreseen: f64 = biases.iter().map(|b| b.foreseen).sum();
    let light: f64 = biases.iter().map(|b| b.light).sum();
    if light > 0.0 { (foreseen / light).max(0.0) } else { 0.0 }
}
