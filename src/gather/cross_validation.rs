//! What the fit between irradiance records leaves where there is no record, measured at places drawn by chance.
//!
//! Records lie where those before them could not speak, so their own misfits say nothing of places that others only
//! seem to speak for, as a strip of a pixel's width whose neighbours lie on another board. Layers of pixels are drawn,
//! their light is gathered by rays of their own, and the product of both halves' misfits is the squared error without
//! noise. They become records then, so no ray is lost.
//!
//! Not handled: errors in fewer layers than are likely to be drawn, of which a standard error from few places tells too
//! little.

use glam::DVec3;
use rayon::prelude::*;

use crate::gather::cached_irradiance::Fitted;
use crate::gather::irradiance_cache::{IrradianceCache, NONE};
use crate::gather::pixel::Pixel;
use crate::rays::sobol::hash;

/// Places drawn over records so far.
const SHARE: f64 = 0.125;

/// A layer without a record, and what the records around say of it.
struct Probe {
    pixel: usize,
    layer: usize,
    /// Irradiance over pi of both halves, the fields that make the picture together.
    fitted: [DVec3; 2],
}

/// What places drawn by chance tell.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Validation {
    /// Squared error of the fit, (W/(m² sr))².
    misfit: f64,
    /// Its standard error.
    deviation: f64,
}

impl Validation {
    /// The sum over places, each of which is the estimate of an independent share of the whole.
    fn of(places: impl Iterator<Item = f64>) -> Validation {
        let (sum, squares) = places.fold((0.0, 0.0), |(sum, squares), one| (sum + one, squares + one * one));
        Validation { misfit: sum, deviation: f64::sqrt(squares) }
    }

    /// What is foreseen, if the places allow it within their standard error; else the bound that they set.
    pub fn corrected(self, foreseen: f64) -> f64 {
        let least = (self.misfit - self.deviation).max(0.0);
        foreseen.clamp(least, (self.misfit + self.deviation).max(least))
    }
}

impl IrradianceCache<'_> {
    /// The sum over the pixels of the squared error of the fit where there is no record, as places drawn in one `round`
    /// tell it, channels added.
    pub fn validate(&mut self, pixels: &[Pixel], round: u32) -> Validation {
        let bare = self.bare() as f64;
        let every = bare / (SHARE * self.records.len() as f64).max(1.0);
        let probes = self.probes(pixels, every.max(1.0) as u32, round);
        let every = bare / probes.len().max(1) as f64;
        let first = self.records.len();
        for probe in &probes {
            self.add(probe.pixel, probe.layer, &pixels[probe.pixel], 1);
        }
        let rays = self.records[..first].iter().map(|p| u64::from(p.rays)).sum::<u64>() / first.max(1) as u64;
        self.cast_from(first, |_| (rays as u32).max(1));
        for (i, probe) in probes.iter().enumerate() {
            self.lattice.insert(1, probe.pixel, (first + i) as u32);
        }
        Validation::of(probes.iter().enumerate().map(|(i, probe)| {
            let missed = squared_misfit(probe.fitted, self.total(self.means(first + i)));
            every * pixels[probe.pixel].weight() * (self.records[first + i].counts().powi(2) * missed)
        }))
    }

    /// One in `every` layers without a record.
    fn probes(&self, pixels: &[Pixel], every: u32, round: u32) -> Vec<Probe> {
        let one = |fitted: &mut Fitted, k: usize| -> Vec<Probe> {
            let mut probes = Vec::new();
            for (l, layer) in pixels[k].layers.iter().enumerate() {
                let number = self.starts[k] + l;
                let taken = hash(number as u32, round ^ 0x7a11_da7e).is_multiple_of(every);
                if taken && self.record_of[number] == NONE {
                    self.at(fitted, k, l, layer);
                    probes.push(Probe { pixel: k, layer: l, fitted: self.total(&fitted.values) });
                }
            }
            probes
        };
        let all = (0..pixels.len()).into_par_iter();
        all.map_init(Default::default, one).flatten_iter().collect()
    }
}

/// The product of both halves' misfits, channels added: the squared error in the mean, as the halves' noises are
/// independent.
fn squared_misfit(fitted: [DVec3; 2], own: [DVec3; 2]) -> f64 {
    let [a, b] = [0, 1].map(|half| fitted[half] - own[half]);
    a.dot(b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::sobol::Stream;

    /// The squared error told by so many places whose fit is off by `off`, from halves with noise of standard deviation
    /// 1 / sqrt(12) in every channel.
    fn told(off: DVec3, places: u32) -> Validation {
        let mut random = Stream::new(places);
        let mut half = || DVec3::from_array([0; 3].map(|_| f64::from(random.uniform()) - 0.5));
        Validation::of((0..places).map(|_| squared_misfit([off; 2], [half(), half()]) / f64::from(places)))
    }

    #[test]
    fn noise_of_the_halves_adds_nothing_to_the_squared_error() {
        const PLACES: u32 = 10_000;
        for off in [DVec3::ZERO, DVec3::new(0.3, -0.2, 0.1)] {
            let found = told(off, PLACES);
            // A product has the variance 2 |off|² / 12 + 3 / 144; squares of products have the mean of the product
            // beside.
            let squared = off.length_squared();
            let second = squared / 6.0 + 3.0 / 144.0 + squared * squared;
            let expected = (second / f64::from(PLACES)).sqrt();
            assert!((found.deviation / expected - 1.0).abs() < 0.1, "{} {expected}", found.deviation);
            assert!((found.misfit - squared).abs() < 4.0 * expected, "{} {squared}", found.misfit);
        }
    }

    #[test]
    fn what_is_foreseen_is_kept_within_a_standard_error_of_what_places_tell() {
        let told = Validation { misfit: 4.0, deviation: 1.0 };
        assert_eq!([2.0, 3.5, 9.0].map(|foreseen| told.corrected(foreseen)), [3.0, 3.5, 5.0]);
        let noise = Validation { misfit: -4.0, deviation: 1.0 };
        assert_eq!(noise.corrected(2.0), 0.0);
    }
}
