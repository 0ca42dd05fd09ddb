//! The bias of the fit between irradiance records, by rays of their own from places drawn at random.
//!
//! The light of a place that is drawn is gathered by as many rays as the fit there has. The product of the differences
//! of both halves is, in the mean, the squared error of the fit beyond the noise of its own halves. These rays are not
//! used again, so that no later choice depends on them.
//!
//! A place i is drawn with probability p_i; of N places the squared error is the sum of product_i / (N p_i) (M. Hansen,
//! W. Hurwitz, *On the theory of sampling from finite populations*, 1943). A third of p is uniform, one goes by the
//! squared light, one by the *uncertainty*: the variance that the records of a fit would leave if they were samples of
//! light that varies about the fit as they do,
//!
//! ```text
//! sum c_j² * spread,    spread = sum |c_j| (v_j - fit)²       for a fit of sum c_j v_j
//! ```
//!
//! with the noise of their rays in it. It shows where errors may lie, not how large they are, as light that is linear
//! over the records has a spread too.
//!
//! Not handled: errors in fewer layers than are likely to be drawn.

use glam::DVec3;
use halflight_team::Loop;

use crate::error::SquaredError;
use crate::error::halves::Halves;
use crate::gather::pixels::pixel::Pixel;
use crate::gather::records::irradiance_cache::{Fitted, IrradianceCache, OwnRecord};
use crate::gather::records::pixel_lattice::skewed;
use crate::gather::records::record::{Record, Site};
use crate::rays::purpose::Purpose;
use crate::rays::sobol::{Stream, hash};

/// Rays cast from the places over those of all records.
const SHARE: f64 = 0.125;
/// Places at least.
const LEAST_PLACES: f64 = 16.0;

/// A sampled place.
#[derive(Clone, Copy, Debug)]
struct Draw {
    place: usize,
    /// Its weight: how often it was drawn over N p.
    counts: f64,
}

/// What one draw adds to the squared error, and how uncertain the fit is there.
#[derive(Clone, Copy, Debug)]
struct DrawnError {
    uncertainty: f64,
    squared: f64,
}

/// The squared error of the fit beyond the noise of its halves, channels added, summed over the pixels as they count.
#[derive(Debug, Default)]
pub(crate) struct FitError {
    /// In order of uncertainty.
    drawn: Vec<DrawnError>,
}

impl FitError {
    fn new(mut drawn: Vec<DrawnError>) -> FitError {
        drawn.sort_by(|a, b| a.uncertainty.total_cmp(&b.uncertainty));
        FitError { drawn }
    }

    /// The sum, with the standard error of N independent draws.
    pub(crate) fn sum(&self) -> SquaredError {
        let sum: f64 = self.drawn.iter().map(|own| own.squared).sum();
        let mean = sum / self.drawn.len().max(1) as f64;
        let variance: f64 = self.drawn.iter().map(|own| (own.squared - mean).powi(2)).sum();
        SquaredError { value: sum, deviation: variance.sqrt() }
    }

    /// The uncertainty up to which fits are together off by no more than `most`.
    pub(crate) fn most_certain(&self, most: f64) -> f64 {
        let mut sum = 0.0;
        let within = self.drawn.iter().filter(|own| {
            sum += own.squared;
            sum <= most
        });
        within.last().map_or(0.0, |own| own.uncertainty)
    }
}

/// The error of the fit, estimated at places sampled in one `round`.
pub(crate) fn validate(cache: &mut IrradianceCache, pixels: &[Pixel], round: u32) -> FitError {
    let stride = pixel_stride(cache);
    let places = layer_fits(cache, pixels, round, stride);
    let draws = draws(cache, &places, round);
    let mut fresh: Vec<Record> = draws.iter().map(|draw| fresh(cache, &places[draw.place], pixels, round)).collect();
    cache.caster.extend(&mut fresh, |j| (places[draws[j].place].rays as u32).max(1));
    let error = |(draw, record): (&Draw, &Record)| {
        let place = &places[draw.place];
        let own = cache.light.total(&record.means().collect::<Vec<_>>());
        let squared = Halves::of(place.fitted).less(Halves::of(own)).times(place.rho).squared();
        DrawnError { uncertainty: place.uncertainty, squared: stride as f64 * draw.counts * place.weight * squared }
    };
    FitError::new(draws.iter().zip(&fresh).map(error).collect())
}

/// A record of a place, independent of those in the cache.
fn fresh(cache: &mut IrradianceCache, place: &LayerFit, pixels: &[Pixel], round: u32) -> Record {
    let &LayerFit { pixel, layer, .. } = place;
    let seed = hash(pixel as u32, hash(layer as u32, hash(round, Purpose::Validation.seed(cache.density.seed))));
    let site = Site { pixel, camera_count: pixels[pixel].count, spacing: 1, seed };
    cache.caster.record(&pixels[pixel].layers[layer], site)
}

/// The places drawn in a round, as many as the rays allow.
fn draws(cache: &IrradianceCache, places: &[LayerFit], round: u32) -> Vec<Draw> {
    let chances = chances(places);
    let all: f64 = cache.records.iter().map(|record| f64::from(record.rays)).sum();
    let price: f64 = chances.iter().zip(places).map(|(chance, place)| chance * place.rays.max(1.0)).sum();
    let count = (SHARE * all / price).max(LEAST_PLACES).round();
    let mut random = Stream::new(hash(round, Purpose::Validation.seed(cache.density.seed)));
    drawn(&chances, count, random.uniform().into())
}

/// The probability that each place is drawn.
fn chances(places: &[LayerFit]) -> Vec<f64> {
    let even = 1.0 / places.len().max(1) as f64;
    let sum = |part: fn(&LayerFit) -> f64| places.iter().map(part).sum::<f64>();
    let (light, uncertainty) = (sum(|p| p.light), sum(|p| p.uncertainty));
    let of = |part: f64, all: f64| if all > 0.0 { part / all } else { even };
    places.iter().map(|p| (even + of(p.light, light) + of(p.uncertainty, uncertainty)) / 3.0).collect()
}

/// `count` draws by systematic sampling.
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

/// Layers to draw from, to a factor of two: many times as many as are drawn.
const LAYERS: usize = 16_384;

/// A layer of a pixel, as one of [`layer_fits`].
pub(crate) struct LayerFit {
    pub pixel: usize,
    pub layer: usize,
    /// Irradiance over pi of both halves, the fields that make the picture together.
    pub fitted: [DVec3; 2],
    /// Reflectance in the mean over the pixel's camera rays.
    pub rho: DVec3,
    /// How much the pixel counts.
    pub weight: f64,
    /// Squared light that it reflects, weighted as the pixel counts, channels added.
    pub light: f64,
    /// Variance that the spread of its records would leave, weighted as the pixel counts.
    pub uncertainty: f64,
    /// Rays of a half that would have the variance of the fit.
    pub rays: f64,
}

/// Every layer of some pixels that takes more than its own record's light, in order: one in `stride` pixels in each
/// row and column, others from turn to turn.
fn layer_fits(cache: &IrradianceCache, pixels: &[Pixel], turn: u32, stride: usize) -> Vec<LayerFit> {
    let width = cache.light.lattice.width();
    let of_pixel = |fitted: &mut Fitted, k: usize| -> Vec<LayerFit> {
        if !(skewed(k, width) + turn as usize).is_multiple_of(stride) {
            return Vec::new();
        }
        let fits = (0..pixels[k].layers.len()).filter(|&l| !matches!(cache.layers.of(k, l), OwnRecord::Alone(_)));
        fits.map(|l| layer_fit(cache, fitted, &pixels[k], [k, l])).collect()
    };
    Loop::each(pixels.len()).map_init(Fitted::default, of_pixel).into_iter().flatten().collect()
}

/// One in so many pixels is evaluated: errors larger than a few pixels show in some of them.
fn pixel_stride(cache: &IrradianceCache) -> usize {
    (cache.layers.count() / LAYERS).max(1)
}

/// Layer l of pixel k.
fn layer_fit(cache: &IrradianceCache, fitted: &mut Fitted, pixel: &Pixel, [k, l]: [usize; 2]) -> LayerFit {
    let layer = &pixel.layers[l];
    cache.at(fitted, k, l, layer);
    let fit @ [a, b] = cache.light.total(&fitted.values);
    let (rho, weight) = (layer.mean_reflectance(pixel.camera()), pixel.weight());
    let mean = 0.5 * (a + b);
    let (mut spread, mut variance) = (0.0, 0.0);
    for &(i, coefficient) in &fitted.fit.coefficients {
        let [u, v] = cache.light.total(cache.light.means(i as usize));
        spread += coefficient.abs() * (rho * (0.5 * (u + v) - mean)).length_squared();
        variance += coefficient * coefficient / f64::from(cache.records[i as usize].rays.max(1));
    }
    LayerFit {
        pixel: k,
        layer: l,
        fitted: fit,
        rho,
        weight,
        light: weight * (rho * mean).length_squared(),
        uncertainty: weight * fitted.fit.variance() * spread,
        rays: if variance > 0.0 { variance.recip() } else { 1.0 },
    }
}

/// Has every layer whose fit is less certain than `most` gather for itself; each gets as many rays as records have
/// in the mean.
pub(crate) fn part(cache: &mut IrradianceCache, most: f64, pixels: &[Pixel]) {
    let first = cache.records.len();
    let rays = cache.records.iter().map(|p| u64::from(p.rays)).sum::<u64>() / first.max(1) as u64;
    for LayerFit { pixel, layer, .. } in layer_fits(cache, pixels, 0, 1).into_iter().filter(|f| f.uncertainty > most) {
        let record = cache.layers.of(pixel, layer).number().unwrap_or_else(|| {
            cache.light.lattice.insert(1, pixel, cache.records.len() as u32);
            cache.add(pixel, layer, &pixels[pixel], 1)
        });
        cache.layers.set(pixel, layer, OwnRecord::Alone(record));
    }
    cache.cast_from(first, |_| (rays as u32).max(1));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factors::Estimate;
    use crate::gather::pass::with_records;
    use crate::gather::records::irradiance_cache::Density;
    use crate::light::Rgb;

    #[test]
    fn a_place_counts_one_in_the_mean_however_often_it_is_drawn() {
        let mut random = Stream::new(4);
        let parts: Vec<f64> = (0..50).map(|_| f64::from(random.uniform()).powi(4) + 0.01).collect();
        let sum: f64 = parts.iter().sum();
        let chances: Vec<f64> = parts.iter().map(|part| part / sum).collect();
        const OFFSETS: u32 = 1000;
        let mut counts = [0.0; 50];
        for k in 0..OFFSETS {
            let offset = (f64::from(k) + 0.5) / f64::from(OFFSETS);
            drawn(&chances, 20.0, offset).iter().for_each(|draw| counts[draw.place] += draw.counts);
        }
        // An interval of length l holds l of evenly spread offsets, to one at each end.
        for (count, chance) in counts.iter().zip(&chances) {
            let off = (count / f64::from(OFFSETS) - 1.0).abs();
            assert!(off <= 2.0 / (20.0 * chance * f64::from(OFFSETS)), "{count} {chance}");
        }
    }

    /// Validation at sampled places has the mean of validation by a record at every layer.
    #[test]
    fn sampled_places_estimate_the_error_of_every_layer() {
        // Few bright patches, so that records miss some of them.
        let light = |i: usize| if i.is_multiple_of(7) { Rgb::splat(8.0) } else { Rgb::splat(0.1) };
        with_records(("furnished-room", 300, 24), light, |pixels, cache| {
            let mut own = cache(|density| density);
            let all = cache(|density| Density { spacing: 1, rays: 2048, seed: 77, ..density });
            let exact = |fit: &LayerFit| {
                let record = all.layers.of(fit.pixel, fit.layer).number().unwrap() as usize;
                let error = Halves::of(fit.fitted).less(Halves::of(all.light.total(all.light.means(record))));
                fit.weight * error.times(fit.rho).squared()
            };
            let expected: f64 = layer_fits(&own, pixels, 0, 1).iter().map(exact).sum();
            const ROUNDS: u32 = 64;
            let estimates: Vec<f64> = (0..ROUNDS).map(|round| validate(&mut own, pixels, round).sum().value).collect();
            let found = Estimate::of_mean(estimates.into_iter());
            // The fits are the same throughout; the exact ones have less noise by the ratio of all rays.
            assert!((found.value - expected).abs() < 4.0 * found.error, "{found:?} {expected}");
            assert!(expected > 4.0 * found.error, "no error: {expected} {found:?}");
        });
    }

    #[test]
    fn turns_evaluate_every_layer_once() {
        with_records(
            ("cornell-box", 100, 224),
            |_| Rgb::ONE,
            |pixels, cache| {
                let cache = cache(|density| density);
                let stride = pixel_stride(&cache) as u32;
                assert!(stride > 1, "one turn evaluates all");
                let mut times = vec![0; cache.layers.count()];
                for fit in (0..stride).flat_map(|turn| layer_fits(&cache, pixels, turn, stride as usize)) {
                    times[cache.layers.number(fit.pixel, fit.layer)] += 1;
                }
                assert!(times.iter().all(|&n| n == 1));
            },
        );
    }

    /// Those that gather for themselves have no bias, and rays of their own; the others keep their fits.
    #[test]
    fn the_least_certain_places_take_their_own_light() {
        with_records(
            ("furnished-room", 300, 64),
            |i| Rgb::splat((i % 5) as f32),
            |pixels, cache| {
                let mut cache = cache(|density| density);
                let before = layer_fits(&cache, pixels, 0, 1);
                let mut order: Vec<f64> = before.iter().map(|fit| fit.uncertainty).collect();
                order.sort_by(f64::total_cmp);
                let most = order[3 * order.len() / 4];
                part(&mut cache, most, pixels);
                let mut fitted = Fitted::default();
                for fit in &before {
                    let own = cache.layers.of(fit.pixel, fit.layer);
                    assert_eq!(matches!(own, OwnRecord::Alone(_)), fit.uncertainty > most);
                    if let OwnRecord::Alone(record) = own {
                        cache.at(&mut fitted, fit.pixel, fit.layer, &pixels[fit.pixel].layers[fit.layer]);
                        assert_eq!(fitted.values, cache.light.means(record as usize));
                        assert!(cache.records[record as usize].rays > 0);
                    }
                }
                assert_eq!(layer_fits(&cache, pixels, 0, 1).len(), 3 * order.len() / 4 + 1);
                part(&mut cache, -1.0, pixels);
                assert_eq!(validate(&mut cache, pixels, 0).sum().value, 0.0);
            },
        );
    }

    #[test]
    fn the_most_certain_fits_are_those_that_leave_what_may_be_left() {
        let drawn = |of: &[(f64, f64)]| {
            FitError::new(of.iter().map(|&(uncertainty, squared)| DrawnError { uncertainty, squared }).collect())
        };
        // Noise may make single products negative.
        let error = drawn(&[(3.0, 4.0), (1.0, 1.0), (2.0, -0.5), (5.0, 8.0)]);
        assert_eq!(error.sum().value, 12.5);
        assert_eq!([0.1, 0.6, 4.4, 4.6, 13.0].map(|most| error.most_certain(most)), [0.0, 2.0, 2.0, 3.0, 5.0]);
        assert_eq!(drawn(&[]).most_certain(1.0), 0.0);
        // Of N equal draws the sum has no standard error, of two that differ by d it is that of their difference.
        assert_eq!(drawn(&[(1.0, 2.0); 8]).sum().deviation, 0.0);
        assert!((drawn(&[(1.0, 0.0), (1.0, 3.0)]).sum().deviation - 3.0 / 2.0_f64.sqrt()).abs() < 1e-12);
    }
}
