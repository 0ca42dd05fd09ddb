//! How many rays each record gets, by the variance of the picture.
//!
//! Not handled: bias, which shorter valid radii lessen ([`crate::gather::records::record_rounds`]).

use halflight_team::Loop;
use rayon::prelude::*;

use crate::error::halves::Halves;
use crate::gather::pixels::pixel::Pixel;
use crate::gather::records::interpolation::Fit;
use crate::gather::records::irradiance_cache::IrradianceCache;
use crate::gather::sampling::RATE;

/// Rays of a half at most.
const MOST_RAYS: f64 = 16_384.0;
/// Spacings within which records are alike in noise.
const NEAR: f64 = 2.5;
/// How many times as many rays one round casts, at least and at most.
const GROWTH: [f64; 2] = [1.1, 8.0];
/// Halvings of the levels to choose from.
const HALVINGS: usize = 24;

/// The rays of a record, and what they leave of the variance of the picture.
#[derive(Clone, Copy, Debug)]
struct Share {
    /// Of each half.
    rays: f64,
    /// The part of the picture's variance that comes from them.
    variance: f64,
}

impl Share {
    /// Optimal allocation: of shares `w s² / n` the sum is least for `n` in proportion to `s sqrt(w)` (J. Neyman, *On
    /// the two different aspects of the representative method*, 1934).
    fn worth(self) -> f64 {
        (self.variance * self.rays).sqrt()
    }

    /// Rays at a level: no fewer than before, and no more than [`MOST_RAYS`].
    fn at(self, level: f64) -> f64 {
        self.rays.max((level * self.worth()).min(MOST_RAYS))
    }

    /// The variance predicted of rays at a level.
    fn remaining(self, level: f64) -> f64 {
        self.variance * (self.rays / self.at(level)).powf(RATE)
    }
}

/// Casts more rays from the records, where they lessen the noise of the picture most, until they are predicted to
/// leave the share `remaining` of its variance.
pub(crate) fn refine(cache: &mut IrradianceCache, remaining: f64, pixels: &[Pixel]) {
    let shares = shares(cache, pixels);
    let level = level(&shares, remaining);
    cache.cast_from(0, |i| shares[i].at(level) as u32);
}

/// The part of the picture's variance due to each record's rays: the variance of its rays, pooled over the records
/// nearby, times its [use](uses).
fn shares(cache: &IrradianceCache, pixels: &[Pixel]) -> Vec<Share> {
    let one = |i: usize| {
        let own = Halves::of(cache.light.total(cache.light.means(i)));
        own.variance().element_sum() * f64::from(cache.records[i].rays)
    };
    let count = 0..cache.records.len();
    let variances: Vec<f64> = count.clone().into_par_iter().map(one).collect();
    let uses = uses(cache, pixels);
    let variance = |i: usize| {
        let own = &cache.records[i];
        let at = &cache.light.supports[i].place;
        let near = NEAR * own.site.spacing as f64 * own.pixel;
        let (mut sum, mut number) = (0.0, 0.0);
        cache.light.lattice.visit(cache.light.lattice.pixel_of(i as u32), |j| {
            let other = &cache.light.supports[j as usize].place;
            let apart = other.position.distance(at.position);
            if apart <= near && other.normal.dot(at.normal) > 0.9 {
                sum += variances[j as usize];
                number += 1.0;
            }
        });
        uses[i] * sum / (number * f64::from(own.rays))
    };
    let parts = Loop::each(count.len()).map(variance).into_iter().zip(&cache.records);
    parts.map(|(variance, own)| Share { rays: f64::from(own.rays), variance }).collect()
}

/// The derivative of the picture's variance by that of each record: the sum over the pixels of its squared
/// coefficients there, times their squared reflectance.
fn uses(cache: &IrradianceCache, pixels: &[Pixel]) -> Vec<f64> {
    let of_pixel = |fit: &mut Fit, k: usize| coefficients(cache, fit, k, &pixels[k]);
    let each: Vec<Vec<(u32, f64)>> = Loop::each(pixels.len()).map_init(Fit::default, of_pixel);
    let mut uses = vec![0.0; cache.records.len()];
    // In order: the sum is the same for any number of threads.
    for (pixel, coefficients) in pixels.iter().zip(each) {
        for (record, coefficient) in coefficients {
            uses[record as usize] += pixel.weight() * coefficient * coefficient;
        }
    }
    uses
}

/// Derivatives of the light of a pixel by that of each record, RMS over the channels.
fn coefficients(cache: &IrradianceCache, fit: &mut Fit, k: usize, pixel: &Pixel) -> Vec<(u32, f64)> {
    let mut all: Vec<(u32, f64)> = Vec::new();
    for (l, layer) in pixel.layers.iter().enumerate() {
        let rho = layer.mean_reflectance(pixel.camera()).length() / 3.0_f64.sqrt();
        cache.fit_layer(fit, k, l, layer);
        all.extend(fit.coefficients.iter().map(|(record, coefficient)| (*record, rho * coefficient)));
    }
    // Layers of one pixel may share a record.
    all.sort_by_key(|(record, _)| *record);
    let merged = all.chunk_by(|a, b| a.0 == b.0).map(|same| (same[0].0, same.iter().map(|c| c.1).sum()));
    merged.collect()
}

/// The least level that is predicted to leave so small a share of the variance, within the growth of one round.
fn level(shares: &[Share], remaining: f64) -> f64 {
    let sum = |of: &dyn Fn(&Share) -> f64| shares.iter().map(of).sum::<f64>();
    let (rays, worth) = (sum(&|s| s.rays), sum(&|s| s.worth()));
    let goal = remaining * sum(&|s| s.variance);
    let enough = |level: f64| {
        let growth = sum(&|s| s.at(level)) / rays;
        growth >= GROWTH[1] || (growth >= GROWTH[0] && sum(&|s| s.remaining(level)) <= goal)
    };
    if worth <= 0.0 {
        return 0.0;
    }
    let [mut low, mut high] = [0.0, GROWTH[1] * rays / worth];
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if enough(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::gather::pass::with_records;
    use crate::gather::records::irradiance_cache::Fitted;
    use crate::light::Rgb;

    /// What every pixel reflects of the light in the cache.
    fn reflected(cache: &IrradianceCache, pixels: &[Pixel]) -> Vec<DVec3> {
        let mut fitted = Fitted::default();
        let mut pixel = |(k, pixel): (usize, &Pixel)| {
            let layers = pixel.layers.iter().enumerate();
            let one = layers.map(|(l, layer)| {
                cache.at(&mut fitted, k, l, layer);
                layer.mean_reflectance(pixel.camera()) * fitted.values[0][0]
            });
            one.sum()
        };
        pixels.iter().enumerate().map(&mut pixel).collect()
    }

    #[test]
    fn the_use_of_a_record_is_the_change_of_pixels_with_it() {
        with_records(
            ("furnished-room", 300, 48),
            |_| Rgb::ONE,
            |pixels, cache| {
                let mut cache = cache(|density| density);
                let (uses, before) = (uses(&cache, pixels), reflected(&cache, pixels));
                let count = cache.records.len();
                for i in (0..count).step_by(count.div_ceil(20)) {
                    cache.light.values[i] = cache.light.values[i].map(|half| half + DVec3::ONE);
                    let after = reflected(&cache, pixels);
                    cache.light.values[i] = cache.light.values[i].map(|half| half - DVec3::ONE);
                    // Reflectance counts by the mean of squares over the channels.
                    let squares = pixels.iter().zip(before.iter().zip(&after));
                    let change: f64 = squares.map(|(p, (b, a))| p.weight() * (a - b).length_squared() / 3.0).sum();
                    // Layers that share a record are of one material, so their channels are proportional.
                    assert!((change / uses[i] - 1.0).abs() < 1e-6, "record {i} of {count}: {change} {}", uses[i]);
                }
            },
        );
    }

    /// The variance that rays leave which are predicted to leave so much.
    fn predicted(shares: &[Share], remaining: f64) -> (f64, Vec<f64>) {
        let level = level(shares, remaining);
        let before: f64 = shares.iter().map(|s| s.variance).sum();
        let after: f64 = shares.iter().map(|s| s.remaining(level)).sum();
        (after / before, shares.iter().map(|s| s.at(level)).collect())
    }

    #[test]
    fn rays_go_where_the_picture_has_its_noise_until_so_much_is_left() {
        // Worth 1, 2, 4 and 0 times ten rays.
        let shares = [0.1, 0.4, 1.6, 0.0].map(|variance| Share { rays: 10.0, variance });
        // One record, two, three get more rays.
        for remaining in [0.6, 0.3, 0.1] {
            let (share, rays) = predicted(&shares, remaining);
            assert!((share / remaining - 1.0).abs() < 1e-5, "{share} of {remaining}");
            assert_eq!(rays[3], 10.0);
            // Those that get any get them in proportion to what they are worth.
            assert!((rays[2] / 2.0 - rays[1]).abs() < 1e-9 || rays[1] == 10.0, "{rays:?}");
        }
    }

    #[test]
    fn a_record_with_the_most_rays_is_predicted_to_stay_as_it_is() {
        let mut shares = vec![Share { rays: 64.0, variance: 0.0025 }; 400];
        shares.insert(0, Share { rays: MOST_RAYS, variance: 1.0 });
        let (share, rays) = predicted(&shares, 0.6);
        assert_eq!(rays[0], MOST_RAYS);
        assert!((share - 0.6).abs() < 1e-5 && shares[0].remaining(1e9) == 1.0, "{share}");
    }

    #[test]
    fn a_round_casts_a_tenth_more_rays_at_least_and_eight_times_as_many_at_most() {
        let shares = [0.1, 0.4, 1.6].map(|variance| Share { rays: 10.0, variance });
        let sum = |remaining: f64| predicted(&shares, remaining).1.into_iter().sum::<f64>();
        assert!((sum(0.999) / 33.0 - 1.0).abs() < 1e-5, "{}", sum(0.999));
        assert!((sum(1e-9) / 240.0 - 1.0).abs() < 1e-5, "{}", sum(1e-9));
        let dark = [Share { rays: 10.0, variance: 0.0 }; 2];
        assert_eq!(level(&dark, 0.5), 0.0);
    }
}
