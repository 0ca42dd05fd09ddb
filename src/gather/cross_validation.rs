//! How far the light between irradiance records is off, measured at places drawn by chance with rays of their own.
//!
//! Records lie where those before them could not speak, and get rays and neighbours where they seem to be off. What
//! they say of themselves was therefore chosen by what it says: a record that misses bright light with both halves of
//! its rays looks right, and stays. So places are drawn anew, whether they have a record or not, and their light is
//! gathered by as many rays as stand behind the fit there. The product of what both halves of the fit and of those rays
//! differ by is, in the mean, what the fit is off by beyond the noise that its own halves tell. The rays are not used
//! again, or the next choice would know them.
//!
//! A place i is drawn with the chance p_i; of N places the squared error is the sum of product_i / (N p_i) (M. Hansen,
//! W. Hurwitz, *On the theory of sampling from finite populations*, 1943). A third of the chance is the same
//! everywhere, one goes by the squared light, one by what its records would leave if they were drawn by chance
//! ([`crate::gather::layer_fits`]), as errors lie where those differ.
//!
//! Not handled: errors in fewer layers than are likely to be drawn, of which a standard error from few places tells too
//! little.

use glam::DVec3;

use crate::gather::irradiance_cache::IrradianceCache;
use crate::gather::irradiance_record::{Record, Site};
use crate::gather::layer_fits::LayerFit;
use crate::gather::pixel::Pixel;
use crate::rays::sobol::{Stream, hash};

/// Rays cast from the places over those of all records.
const SHARE: f64 = 0.125;
/// Places at least.
const LEAST: f64 = 16.0;
/// Keeps the rays of places apart from those of records.
const ROUND: u32 = 0x7a11_da7e;

/// A place that was drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Draw {
    place: usize,
    /// What it stands for: how often it was drawn over N p.
    counts: f64,
}

impl IrradianceCache<'_> {
    /// The sum over the pixels of the squared error of the fit beyond what the halves of the rays differ by, as places
    /// drawn in one `round` tell it, channels added.
    pub fn validate(&mut self, pixels: &[Pixel], round: u32) -> f64 {
        let places = self.layer_fits(pixels);
        let draws = self.draws(&places, round);
        let mut fresh: Vec<Record> = draws.iter().map(|draw| self.fresh(&places[draw.place], pixels, round)).collect();
        self.extend(&mut fresh, |j| (places[draws[j].place].rays as u32).max(1));
        let told = draws.iter().zip(&fresh).map(|(draw, record)| {
            let place = &places[draw.place];
            let own = self.total(&record.means().collect::<Vec<_>>());
            draw.counts * place.weight * squared_misfit(place.fitted, own, place.rho)
        });
        told.sum()
    }

    /// A record of a place that knows nothing of those in the cache.
    fn fresh(&mut self, &LayerFit { pixel, layer, .. }: &LayerFit, pixels: &[Pixel], round: u32) -> Record {
        let seed = hash(pixel as u32, hash(layer as u32, hash(round, self.density.seed ^ ROUND)));
        let site = Site { pixel, looked: pixels[pixel].count, spacing: 1, seed, density: 0 };
        self.record(&pixels[pixel].layers[layer], site)
    }

    /// The places drawn in a round, as many as the rays allow.
    fn draws(&self, places: &[LayerFit], round: u32) -> Vec<Draw> {
        let chances = chances(places);
        let all: f64 = self.records.iter().map(|record| f64::from(record.rays)).sum();
        let price: f64 = chances.iter().zip(places).map(|(chance, place)| chance * place.rays.max(1.0)).sum();
        let count = (SHARE * all / price).max(LEAST).round();
        drawn(&chances, count, Stream::new(hash(round, self.density.seed ^ ROUND)).uniform().into())
    }
}

/// The chance that each place is drawn.
fn chances(places: &[LayerFit]) -> Vec<f64> {
    let even = 1.0 / places.len().max(1) as f64;
    let sum = |part: fn(&LayerFit) -> f64| places.iter().map(part).sum::<f64>();
    let (light, uncertainty) = (sum(|p| p.light), sum(|p| p.uncertainty));
    let of = |part: f64, all: f64| if all > 0.0 { part / all } else { even };
    places.iter().map(|p| (even + of(p.light, light) + of(p.uncertainty, uncertainty)) / 3.0).collect()
}

/// `count` draws, evenly spread over the places one after the other; neighbours are not drawn together by chance.
fn drawn(chances: &[f64], count: f64, offset: f64) -> Vec<Draw> {
    let (mut sum, mut before) = (offset, 0.0);
    let times = chances.iter().map(|chance| {
        sum += count * chance;
        let times = f64::floor(sum) - before;
        before += times;
        times
    });
    let all = times.zip(chances).enumerate();
    all.filter(|(_, (times, _))| *times > 0.0)
        .map(|(place, (times, chance))| Draw { place, counts: times / (count * chance) })
        .collect()
}

/// The product of what both halves reflect too little, channels added: the squared error in the mean, as the halves'
/// noises are independent.
fn squared_misfit(fitted: [DVec3; 2], own: [DVec3; 2], rho: DVec3) -> f64 {
    let [a, b] = [0, 1].map(|half| rho * (fitted[half] - own[half]));
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
        Validation::of((0..places).map(|_| squared_misfit([off; 2], [half(), half()], DVec3::ONE) / f64::from(places)))
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
    fn what_is_foreseen_is_no_less_than_places_tell_and_no_more_than_they_allow() {
        let told = Validation { misfit: 4.0, deviation: 1.0 };
        assert_eq!([2.0, 4.5, 9.0].map(|foreseen| told.corrected(foreseen)), [4.0, 4.5, 5.0]);
        let noise = Validation { misfit: -4.0, deviation: 1.0 };
        assert_eq!(noise.corrected(2.0), 0.0);
    }
}
