//! How the path tracer's error shrinks with the number of paths: measured over independent repeats.
//!
//! Where the variance is finite both the spread of the means and the standard error that the tracer reports fall as
//! N^-1/2. Between the frontiers a path's weight has a tail of index p < 2
//! ([`Survey::tail_index`](halflight_study::map::Survey::tail_index)): the spread falls as N^-(1 - 1/p) only.
//! Spread is taken from quartiles, which exist where the variance does not.

use std::fmt::{Display, Formatter};

use rayon::prelude::*;

use halflight::form_factors::Estimate;
use halflight::rays::Rays;
use halflight::scene::Scene;
use halflight_reference::{NextEvent, TraceSettings, Tracer};
use halflight_study::log_slope;

/// Pixels each way of the pictures whose mean is looked at.
const SIDE: usize = 4;

/// Errors at one number of paths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Paths of each repeat.
    pub paths: u64,
    /// Half the distance of the quartiles of the repeats' means over 0.6745 (so that it is sigma for normal errors), as
    /// a share of their median.
    pub spread: f64,
    /// Median over the repeats of the standard error that the tracer reports, as the same share.
    pub reported: f64,
}

/// How the error scales with the number of paths.
#[derive(Clone, Debug)]
pub struct Scaling {
    /// By paths, each step twice as many.
    pub spreads: Vec<Spread>,
    /// The slope of log spread over log paths, and its standard error from independent groups of repeats.
    pub slope: (f64, f64),
}

/// Measured and predicted errors at one alpha.
#[derive(Clone, Debug)]
pub struct Traced {
    /// Factor on every alpha.
    pub alpha: f64,
    /// x of the predicted error ~ N^x.
    pub predicted: f64,
    /// Errors as measured.
    pub measured: Scaling,
}

impl Display for Traced {
    fn fmt(&self, f: &mut Formatter) -> std::fmt::Result {
        let Traced { alpha, predicted, measured: Scaling { slope: (slope, error), spreads } } = self;
        writeln!(
            f,
            "path tracing at alpha {alpha:.4}: error falls as N^{slope:.3} ± {error:.3}, predicted N^{predicted:.3}\n\
             {:>9} {:>9} {:>15}",
            "paths", "error", "as it reports"
        )?;
        spreads.iter().try_for_each(|s| writeln!(f, "{:>9} {:>9.2e} {:>15.2e}", s.paths, s.spread, s.reported))
    }
}

/// Groups of repeats, each with a slope of its own.
const GROUPS: usize = 8;
/// Samples a pixel at the first look, as a power of two.
const FIRST: u32 = 5;

/// Measures at 2^5 to 2^`doublings` samples a pixel; the scene's materials have their own (alpha, tau).
pub fn scaling(scene: &Scene, repeats: usize, doublings: u32, seed: u32) -> Scaling {
    let rays = Rays::new(scene);
    let transports = scene.transports(Default::default());
    let repeat = |number: u32| -> Vec<(f64, f64)> {
        let settings = TraceSettings {
            next_event: NextEvent::On,
            max_bounces: 100_000,
            seed: seed.wrapping_mul(65_537).wrapping_add(number),
        };
        let mut tracer = Tracer::new(scene, &rays, &transports, (SIDE, SIDE), &settings);
        let looks = (FIRST..=doublings).map(|k| {
            let samples = 1u64 << k;
            tracer.pass((samples - tracer.samples()) as u32);
            let mean = tracer.mean();
            (mean.value[0], mean.error[0])
        });
        looks.collect()
    };
    let size = repeats.div_ceil(GROUPS).max(2);
    let found: Vec<_> = (0..(GROUPS * size) as u32).into_par_iter().map(repeat).collect();
    let slopes: Vec<f64> = found.chunks(size).map(|g| slope(&spreads(g))).collect();
    let slope = Estimate::of_mean(slopes.iter().copied());
    Scaling { spreads: spreads(&found), slope: (slope.value, slope.error) }
}

/// Errors at every look, from the repeats' (mean, reported error).
fn spreads(repeats: &[Vec<(f64, f64)>]) -> Vec<Spread> {
    let at = |look: usize| {
        let of = |pick: fn(&(f64, f64)) -> f64| sorted(repeats.iter().map(|r| pick(&r[look])));
        let (means, errors) = (of(|l| l.0), of(|l| l.1));
        let middle = quantile(&means, 0.5);
        Spread {
            paths: (SIDE * SIDE) as u64 * (1 << (FIRST as usize + look)),
            spread: 0.5 * (quantile(&means, 0.75) - quantile(&means, 0.25)) / 0.6745 / middle,
            reported: quantile(&errors, 0.5) / middle,
        }
    };
    let looks = repeats.first().map_or(0, Vec::len);
    (0..looks).map(at).collect()
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

/// The quantile of sorted values, linear between them; NaN of none.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else {
        return f64::NAN;
    };
    let at = share * last as f64;
    let (low, high) = (at.floor() as usize, at.ceil() as usize);
    sorted[low] + (sorted[high] - sorted[low]) * at.fract()
}

/// The slope of log spread over log paths.
fn slope(spreads: &[Spread]) -> f64 {
    let line: Vec<_> = spreads.iter().map(|s| (s.paths as f64, s.spread)).collect();
    log_slope(&line).unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::slice::Slice;
    use halflight::form_factors::Sampling;

    #[test]
    fn quantiles_by_hand() {
        assert_eq!(quantile(&[1.0, 2.0, 4.0], 0.5), 2.0);
        assert_eq!(quantile(&[1.0, 2.0, 4.0], 0.25), 1.5);
        assert!(quantile(&[], 0.5).is_nan());
    }

    /// Between the frontiers the weight of a path has a tail of index p < 2: the error of the mean falls as
    /// N^-(1 - 1/p), not N^-1/2. Both exponents are measured over independent repeats and held to the prediction by
    /// their standard errors.
    #[test]
    fn the_error_falls_as_predicted_on_both_sides_of_its_variance_frontier() {
        let sampling = Sampling { rays: 1024, ..Sampling::default() };
        let slice = Slice::new(Scene::open("furnished-room").unwrap(), 1.0, 300, sampling).unwrap();
        let Slice { alpha_c, alpha_variance, .. } = slice;
        assert!(alpha_variance < 0.9 * alpha_c, "little room between {alpha_variance} and {alpha_c}");
        for (alpha, finite) in [(0.5 * alpha_variance, true), ((alpha_variance * alpha_c).sqrt(), false)] {
            let (slope, error) = scaling(&slice.at(alpha), 64, 9, 0).slope;
            let predicted = slice.exponent(alpha);
            assert_eq!(predicted == -0.5, finite, "{alpha}");
            assert!((slope - predicted).abs() < 4.0 * error, "{alpha}: {slope} ± {error}, predicted {predicted}");
            // The two are told apart.
            assert!(finite || slope - 3.0 * error > -0.5, "{slope} ± {error}");
        }
    }
}
