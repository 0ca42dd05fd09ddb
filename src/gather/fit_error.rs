//! How far the fit between irradiance records is off where there is a record.
//!
//! Fitting each record from the others, in either half, and multiplying the two misfits, leaves the squared bias of the
//! fit: the halves' noises do not correlate.
//!
//! Not handled: places that no record speaks for, and places without a record; [`crate::gather::cross_validation`]
//! looks there.

use rayon::prelude::*;

use crate::gather::cached_irradiance::Fitted;
use crate::gather::irradiance_cache::{COVERED, IrradianceCache};
use crate::gather::pixel::Pixel;

/// Coefficient of a record in the fit at its own place beyond which the others leave more than [`COVERED`] of the
/// variance there: they would not speak for it, it would be a record. (A coefficient h leaves the others h / (1 - h).)
const NEEDED: f64 = COVERED / (1.0 + COVERED);

/// Squared bias of the fit at a record.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Bias {
    /// In the pixel that the record lies in, (W/(m² sr))², channels added.
    pub here: f64,
    /// There and in its share of the layers that have no record, where others foresee light as they do here.
    pub around: f64,
    /// That of the irradiance over pi which others foresee there, times the pixels that the record stood for.
    pub foreseen: f64,
    /// Squared irradiance over pi, times the pixels that the record stood for.
    pub light: f64,
}

impl IrradianceCache<'_> {
    /// The bias of the fit at each record, of the light of all fields that make the picture together. Single products
    /// are noisy, their sums are not.
    ///
    /// The fit is linear in the records' values, so where a record itself has the coefficient s in it, what the others
    /// alone would miss is the misfit over 1 - s.
    pub fn biases(&self) -> Vec<Bias> {
        let bare = self.bare() as f64 / self.records.len().max(1) as f64;
        let one = |fitted: &mut Fitted, i: usize| -> Bias {
            if !self.at_record(fitted, i as u32) {
                return Bias::default();
            }
            let own = &self.records[i];
            let ([u, v], [p, q]) = (self.total(&fitted.values), self.total(self.means(i)));
            let misfit = (p - u).dot(q - v);
            let coefficient = fitted.fit.coefficient_of(i as u32);
            let others = if coefficient < NEEDED { 1.0 - coefficient } else { 1.0 };
            let foreseen = misfit / (others * others);
            let pixels = (own.site.spacing * own.site.spacing) as f64;
            Bias {
                here: own.counts().powi(2) * misfit,
                around: own.counts().powi(2) * (misfit + bare * foreseen),
                foreseen: pixels * foreseen,
                light: pixels * p.dot(q),
            }
        };
        let all = (0..self.records.len()).into_par_iter();
        all.map_init(Default::default, one).collect()
    }

    /// The squared error of the fit at the records themselves, summed over the pixels that see no luminaire.
    pub fn misfit(&self, pixels: &[Pixel], biases: &[Bias]) -> f64 {
        let weight = |i: u32| pixels[self.lattice.pixel_of(i)].weight();
        let own = biases.iter().zip(0_u32..);
        own.map(|(bias, i)| weight(i) * bias.here).sum()
    }

    /// The records whose surroundings have the largest bias, up to the `share` of the whole bias that is too much.
    pub fn worst(&self, biases: &[Bias], share: f64) -> Vec<u32> {
        let pooled: Vec<f64> = (0..self.records.len()).into_par_iter().map(|i| self.pooled(i, biases)).collect();
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

    /// Mean bias of the records that one record is fitted with.
    fn pooled(&self, i: usize, biases: &[Bias]) -> f64 {
        let own = &self.supports[i];
        let (mut sum, mut count) = (0.0, 0.0);
        self.lattice.visit(self.lattice.pixel_of(i as u32), |j| {
            let other = &self.supports[j as usize].place;
            let near = other.position.distance(own.place.position) < 2.0 * own.radius;
            if near && other.normal.dot(own.place.normal) > 0.9 {
                sum += biases[j as usize].around;
                count += 1.0;
            }
        });
        sum / f64::max(count, 1.0)
    }
}

/// Mean squared bias that records foresee where there is none, as a share of the mean squared irradiance.
pub(crate) fn relative(biases: &[Bias]) -> f64 {
    let foreseen: f64 = biases.iter().map(|b| b.foreseen).sum();
    let light: f64 = biases.iter().map(|b| b.light).sum();
    if light > 0.0 { (foreseen / light).max(0.0) } else { 0.0 }
}
