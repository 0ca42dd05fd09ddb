//! More of an irradiance cache where the error of the picture asks for it: rays where noise is, records where the fit
//! is biased.
//!
//! Not handled: how large the errors may be; that is [`crate::gather::budget`].

use rayon::prelude::*;

use crate::gather::irradiance_cache::IrradianceCache;
use crate::gather::pixel::Pixel;

/// Rays of a half at most.
const MOST: u32 = 1 << 14;
/// Spacings within which records are alike in noise.
const NEAR: f64 = 2.5;

impl IrradianceCache<'_> {
    /// Casts as many more rays as multiply their number by a factor, where they lessen the noise of the picture most:
    /// rays that leave `s² / n` at each of the w pixels that a record stands for go as `s sqrt(w)`.
    pub fn refine(&mut self, factor: f64) {
        let more = (f64::from(self.density.rays) * factor).ceil() as u32;
        self.density.rays = more.min(MOST.max(self.density.rays));
        let wants = self.wants();
        let rays: Vec<f64> = self.records.iter().map(|p| f64::from(p.rays)).collect();
        let level = level(&wants, &rays, factor * rays.iter().sum::<f64>());
        self.cast_from(0, |i| (level * wants[i]).min(f64::from(MOST)) as u32);
    }

    /// Shortens the valid radius of some records, and adds records for the places that they spoke for.
    pub fn shorten(&mut self, some: &[u32], factor: f64, pixels: &[Pixel]) {
        let mut marked = vec![false; pixels.len()];
        for &i in some {
            let record = &mut self.records[i as usize];
            record.shortened *= factor;
            self.lattice.mark(record.site.spacing, i, &mut marked);
        }
        self.settle(0);
        self.place_where(pixels, &marked);
    }

    /// What each record's rays are worth: the standard deviation of one, times the reflectance, times the pixels to a
    /// side that the record stands for.
    ///
    /// Two halves say little about one record, so records nearby speak as well.
    fn wants(&self) -> Vec<f64> {
        let one = |i: usize| {
            let [a, b] = self.total(self.means(i));
            let own = &self.records[i];
            0.25 * (a - b).length_squared() * f64::from(own.rays)
        };
        let count = 0..self.records.len();
        let variances: Vec<f64> = count.clone().into_par_iter().map(one).collect();
        let want = |i: usize| {
            let own = &self.records[i];
            let at = &self.supports[i].place;
            let near = NEAR * own.site.spacing as f64 * self.density.pixel * own.distance;
            let (mut sum, mut number) = (0.0, 0.0);
            self.lattice.visit(self.lattice.pixel_of(i as u32), |j| {
                let other = &self.supports[j as usize].place;
                let apart = other.position.distance(at.position);
                if apart <= near && other.normal.dot(at.normal) > 0.9 {
                    sum += variances[j as usize];
                    number += 1.0;
                }
            });
            own.rho() * own.site.spacing as f64 * (sum / number).sqrt()
        };
        count.into_par_iter().map(want).collect()
    }
}

/// The level at which `max(rays, level * want)`, summed over the records, is `total`.
fn level(wants: &[f64], rays: &[f64], total: f64) -> f64 {
    // Records join in the order in which a rising level meets their rays.
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
