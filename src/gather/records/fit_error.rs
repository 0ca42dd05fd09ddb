//! The bias of the fit between irradiance records: by cross-validation of the records, and by validation at randomly
//! sampled places with rays of their own.
//!
//! Cross-validation fits each record from the others in either half; the product of the two misfits is the squared bias
//! of the fit in the mean, as the noise of the halves is independent.
//!
//! But records were placed and refined by that very estimate: a record whose rays miss bright light in both halves
//! looks right, and stays. So places are sampled at random, with a record or not, and their light is gathered by as
//! many rays as the fit there has. The product of the differences of both halves is, in the mean, the squared error of
//! the fit beyond the noise of its own halves. These rays are not used again, so that no later choice depends on them.
//!
//! A place i is drawn with probability p_i; of N places the squared error is the sum of product_i / (N p_i) (M. Hansen,
//! W. Hurwitz, *On the theory of sampling from finite populations*, 1943). A third of p is uniform, one goes by the
//! squared light, one by the variance that its records would leave if they were samples of light that varies about the
//! fit as they do,
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
use rayon::prelude::*;

use crate::error::halves::Halves;
use crate::gather::pixels::pixel::Pixel;
use crate::gather::records::irradiance_cache::{COVERED, Fitted, IrradianceCache, Record, Site};
use crate::gather::records::pixel_lattice::skewed;
use crate::rays::purpose::Purpose;
use crate::rays::sobol::{Stream, hash};

/// Coefficient of a record in the fit at its own place beyond which the others leave more than [`COVERED`] of the
/// variance there, so that it would have a record anyway. (A coefficient h leaves the others h / (1 - h).)
const NEEDED: f64 = COVERED / (1.0 + COVERED);

/// Squared bias of the fit at a record.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Bias {
    /// In the pixel that the record lies in, (W/(m² sr))², channels added.
    pub here: f64,
    /// There and in its share of the layers that have no record, where others predict light as they do here.
    pub around: f64,
    /// That of the irradiance over pi which others predict there, times the pixels that the record was placed for.
    pub predicted: f64,
    /// Squared irradiance over pi, times the pixels that the record was placed for.
    pub light: f64,
}

impl IrradianceCache<'_> {
    /// The bias of the fit at each record, for the sum of the fields that make the picture. Single products are noisy,
    /// their sums are not.
    ///
    /// The fit is linear in the records' values, so where a record itself has the coefficient s in it, the misfit of
    /// the others alone is the misfit over 1 - s.
    pub fn biases(&self) -> Vec<Bias> {
        let bare = self.bare() as f64 / self.records.len().max(1) as f64;
        let one = |fitted: &mut Fitted, i: usize| -> Bias {
            if !self.at_record(fitted, i as u32) {
                return Bias::default();
            }
            let own = &self.records[i];
            let (fit, own_light) = (Halves::of(self.total(&fitted.values)), Halves::of(self.total(self.means(i))));
            let misfit = own_light.less(fit).squared();
            let coefficient = fitted.fit.coefficient_of(i as u32);
            let others = if coefficient < NEEDED { 1.0 - coefficient } else { 1.0 };
            let predicted = misfit / (others * others);
            let pixels = (own.site.spacing * own.site.spacing) as f64;
            Bias {
                here: own.counts().powi(2) * misfit,
                around: own.counts().powi(2) * (misfit + bare * predicted),
                predicted: pixels * predicted,
                light: pixels * own_light.squared(),
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

/// Mean squared bias predicted where there is no record, as a share of the mean squared irradiance.
pub(crate) fn relative(biases: &[Bias]) -> f64 {
    let predicted: f64 = biases.iter().map(|b| b.predicted).sum();
    let light: f64 = biases.iter().map(|b| b.light).sum();
    if light > 0.0 { (predicted / light).max(0.0) } else { 0.0 }
}

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

impl IrradianceCache<'_> {
    /// The sum over the pixels of the squared error of the fit beyond the noise of its halves, channels added,
    /// estimated at places sampled in one `round`.
    pub fn validate(&mut self, pixels: &[Pixel], round: u32) -> f64 {
        let places = self.layer_fits(pixels, round);
        let draws = self.draws(&places, round);
        let mut fresh: Vec<Record> = draws.iter().map(|draw| self.fresh(&places[draw.place], pixels, round)).collect();
        self.extend(&mut fresh, |j| (places[draws[j].place].rays as u32).max(1));
        let errors = draws.iter().zip(&fresh).map(|(draw, record)| {
            let place = &places[draw.place];
            let own = self.total(&record.means().collect::<Vec<_>>());
            draw.counts * place.weight * Halves::of(place.fitted).less(Halves::of(own)).times(place.rho).squared()
        });
        self.pixel_stride() as f64 * errors.sum::<f64>()
    }

    /// A record of a place, independent of those in the cache.
    fn fresh(&mut self, &LayerFit { pixel, layer, .. }: &LayerFit, pixels: &[Pixel], round: u32) -> Record {
        let seed =
            hash(pixel as u32, hash(layer as u32, hash(round, Purpose::CrossValidation.seed(self.density.seed))));
        let site = Site { pixel, camera_count: pixels[pixel].count, spacing: 1, seed, density: 0 };
        self.record(&pixels[pixel].layers[layer], site)
    }

    /// The places drawn in a round, as many as the rays allow.
    fn draws(&self, places: &[LayerFit], round: u32) -> Vec<Draw> {
        let chances = chances(places);
        let all: f64 = self.records.iter().map(|record| f64::from(record.rays)).sum();
        let price: f64 = chances.iter().zip(places).map(|(chance, place)| chance * place.rays.max(1.0)).sum();
        let count = (SHARE * all / price).max(LEAST_PLACES).round();
        let mut random = Stream::new(hash(round, Purpose::CrossValidation.seed(self.density.seed)));
        drawn(&chances, count, random.uniform().into())
    }
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

/// A layer of a pixel, as one of [`IrradianceCache::layer_fits`].
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

impl IrradianceCache<'_> {
    /// Every layer of some pixels, in order: one in [`IrradianceCache::pixel_stride`] pixels in each row and column,
    /// others from turn to turn.
    pub fn layer_fits(&self, pixels: &[Pixel], turn: u32) -> Vec<LayerFit> {
        let (width, stride) = (self.width(), self.pixel_stride());
        let of_pixel = |fitted: &mut Fitted, k: usize| -> Vec<LayerFit> {
            if !(skewed(k, width) + turn as usize).is_multiple_of(stride) {
                return Vec::new();
            }
            (0..pixels[k].layers.len()).map(|l| self.layer_fit(fitted, &pixels[k], [k, l])).collect()
        };
        let all = (0..pixels.len()).into_par_iter();
        all.map_init(Default::default, of_pixel).flatten_iter().collect()
    }

    /// One in so many pixels is evaluated: errors larger than a few pixels show in some of them.
    pub fn pixel_stride(&self) -> usize {
        (self.record_of.len() / LAYERS).max(1)
    }

    /// Layer l of pixel k.
    fn layer_fit(&self, fitted: &mut Fitted, pixel: &Pixel, [k, l]: [usize; 2]) -> LayerFit {
        let layer = &pixel.layers[l];
        self.at(fitted, k, l, layer);
        let fit @ [a, b] = self.total(&fitted.values);
        let (rho, weight) = (layer.mean_reflectance(pixel.camera()), pixel.weight());
        let mean = 0.5 * (a + b);
        let (mut spread, mut variance) = (0.0, 0.0);
        for &(i, coefficient) in &fitted.fit.coefficients {
            let [u, v] = self.total(self.means(i as usize));
            spread += coefficient.abs() * (rho * (0.5 * (u + v) - mean)).length_squared();
            variance += coefficient * coefficient / f64::from(self.records[i as usize].rays.max(1));
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
}

/// The fewest that leave no more uncertainty than `rest` to the others, the least certain first.
pub(crate) fn least_certain(mut fits: Vec<LayerFit>, rest: f64) -> Vec<LayerFit> {
    let mut remaining: f64 = fits.iter().map(|fit| fit.uncertainty).sum();
    let place = |fit: &LayerFit| (fit.pixel, fit.layer);
    fits.sort_unstable_by(|a, b| b.uncertainty.total_cmp(&a.uncertainty).then(place(a).cmp(&place(b))));
    fits.into_iter()
        .take_while(|fit| {
            let before = remaining;
            remaining -= fit.uncertainty;
            fit.uncertainty > 0.0 && before > rest
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
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
                let record = all.record_of[all.starts[fit.pixel] + fit.layer] as usize;
                let error = Halves::of(fit.fitted).less(Halves::of(all.total(all.means(record))));
                fit.weight * error.times(fit.rho).squared()
            };
            let expected: f64 = own.layer_fits(pixels, 0).iter().map(exact).sum();
            const ROUNDS: u32 = 64;
            let estimates: Vec<f64> = (0..ROUNDS).map(|round| own.validate(pixels, round)).collect();
            let count = f64::from(ROUNDS);
            let mean = estimates.iter().sum::<f64>() / count;
            let variance = estimates.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (count - 1.0);
            // The fits are the same throughout; the exact ones have less noise by the ratio of all rays.
            assert!((mean - expected).abs() < 4.0 * (variance / count).sqrt(), "{mean} {expected} {variance}");
            assert!(expected > 4.0 * (variance / count).sqrt(), "no error: {expected} {variance}");
        });
    }

    #[test]
    fn turns_evaluate_every_layer_once() {
        with_records(
            ("cornell-box", 100, 224),
            |_| Rgb::ONE,
            |pixels, cache| {
                let cache = cache(|density| density);
                let stride = cache.pixel_stride() as u32;
                assert!(stride > 1, "one turn evaluates all");
                let mut times = vec![0; cache.record_of.len()];
                for fit in (0..stride).flat_map(|turn| cache.layer_fits(pixels, turn)) {
                    times[cache.starts[fit.pixel] + fit.layer] += 1;
                }
                assert!(times.iter().all(|&n| n == 1));
            },
        );
    }

    #[test]
    fn the_fewest_layers_are_chosen_that_leave_little_uncertain() {
        let fits = |uncertainties: &[f64]| -> Vec<LayerFit> {
            let fit = |(pixel, &uncertainty): (usize, &f64)| LayerFit {
                pixel,
                layer: 0,
                fitted: [DVec3::ZERO; 2],
                rho: DVec3::ONE,
                weight: 1.0,
                light: 1.0,
                uncertainty,
                rays: 1.0,
            };
            uncertainties.iter().enumerate().map(fit).collect()
        };
        let chosen = |of: &[f64], rest: f64| -> Vec<usize> {
            least_certain(fits(of), rest).iter().map(|fit| fit.pixel).collect()
        };
        let of = [1.0, 0.0, 6.0, 1.0, 2.0];
        assert_eq!(chosen(&of, 10.0), [0; 0]);
        assert_eq!(chosen(&of, 9.9), [2]);
        assert_eq!(chosen(&of, 3.0), [2, 4]);
        // Never those without uncertainty.
        assert_eq!(chosen(&of, -1.0), [2, 4, 0, 3]);
    }
}
