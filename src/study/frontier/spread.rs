//! How the path tracer's error shrinks with the number of paths: measured over independent repeats.
//!
//! Where the variance is finite both the spread of the means and the standard error that the tracer reports fall as
//! N^-1/2. Between the frontiers a path's weight has a tail of index p < 2 ([`Survey::tail_index`](crate::study::map::Survey::tail_index)): the spread
//! falls as N^-(1 - 1/p) only. Spread is taken from quartiles, which exist where the variance does not.

use rayon::prelude::*;

use crate::rays::Rays;
use crate::reference::{NextEvent, TraceSettings, Tracer};
use crate::scene::Scene;

/// Pixels each way of the pictures whose mean is looked at.
const SIDE: usize = 4;

/// Errors at one number of paths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Paths of each repeat.
    pub paths: u64,
    /// Half the distance of the quartiles of the repeats' means over 0.6745 (so that it is sigma for normal errors), as a share of
    /// their median.
    pub spread: f64,
    /// Median over the repeats of the standard error that the tracer reports, as the same share.
    pub reported: f64,
}

/// Measures at paths = 16 · 2^k, k = 4 ..= `doublings`; the scene's materials have their own (alpha, tau).
pub fn spreads(scene: &Scene, repeats: u32, doublings: u32, seed: u32) -> Vec<Spread> {
    let rays = Rays::new(scene);
    let transports = scene.transports(Default::default());
    let repeat = |number: u32| -> Vec<(f64, f64)> {
        let settings = TraceSettings {
            next_event: NextEvent::On,
            max_bounces: 100_000,
            seed: seed.wrapping_add(number),
        };
        let mut tracer = Tracer::new(scene, &rays, &transports, (SIDE, SIDE), &settings);
        let looks = (4..=doublings).map(|k| {
            let samples = 1u64 << k;
            tracer.pass((samples - tracer.samples()) as u32);
            let mean = tracer.mean();
            (mean.value[0], mean.error[0])
        });
        looks.collect()
    };
    let found: Vec<_> = (0..repeats).into_par_iter().map(repeat).collect();
    let at = |k: u32| {
        let of = |pick: fn(&(f64, f64)) -> f64| {
            let values = found.iter().map(|looks| pick(&looks[k as usize - 4]));
            sorted(values)
        };
        let (means, errors) = (of(|l| l.0), of(|l| l.1));
        let middle = quantile(&means, 0.5);
        Spread {
            paths: (SIDE * SIDE) as u64 * (1 << k),
            spread: 0.5 * (quantile(&means, 0.75) - quantile(&means, 0.25)) / 0.6745 / middle,
            reported: quantile(&errors, 0.5) / middle,
        }
    };
    (4..=doublings).map(at).collect()
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

/// The slope of log error over log paths by least squares, and its standard error from the scatter about the line.
pub fn slope(points: &[(f64, f64)]) -> (f64, f64) {
    let logs: Vec<_> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let (x0, y0) = (
        logs.iter().map(|p| p.0).sum::<f64>() / n,
        logs.iter().map(|p| p.1).sum::<f64>() / n,
    );
    let xx: f64 = logs.iter().map(|p| (p.0 - x0).powi(2)).sum();
    let xy: f64 = logs.iter().map(|p| (p.0 - x0) * (p.1 - y0)).sum();
    let slope = xy / xx;
    let left = logs.iter().map(|p| (p.1 - y0 - slope * (p.0 - x0)).powi(2));
    let error = (left.sum::<f64>() / (n - 2.0) / xx).sqrt();
    (slope, error)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_of_powers_are_their_exponents() {
        let points = [1.0, 2.0, 4.0, 8.0].map(|x: f64| (x, 3.0 * x.powf(-0.4)));
        let (found, error) = slope(&points);
        assert!((found + 0.4).abs() < 1e-12 && error < 1e-12);
    }

    #[test]
    fn quantiles_by_hand() {
        assert_eq!(quantile(&[1.0, 2.0, 4.0], 0.5), 2.0);
        assert_eq!(quantile(&[1.0, 2.0, 4.0], 0.25), 1.5);
        assert!(quantile(&[], 0.5).is_nan());
    }
}
