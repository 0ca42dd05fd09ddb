//! Means and standard errors of samples that come in passes, without keeping the samples.
//!
//! ```text
//! merging (mean, M, n) with (m, Q, k), d = m - mean:   mean += d k/(n+k),   M += Q + d² n k/(n+k)
//! standard error of the mean = sqrt(M / (n (n - 1)))
//! ```
//!
//! M is the sum of squared deviations. Sums run in f64 within a pass; between passes nothing cancels, so f32 holds
//! them. Not handled: samples that depend on each other.
//!
//! Source: T. Chan, G. Golub, R. LeVeque, *Algorithms for computing the sample variance*, The American Statistician 37,
//! 1983.

use glam::{DVec3, Vec3};

/// Mean and sum of squared deviations of samples of one pixel.
#[derive(Clone, Copy, Default)]
pub(crate) struct Moments {
    pub mean: Vec3,
    deviation: Vec3,
}

/// Sums over one pass.
#[derive(Clone, Copy, Default)]
pub(crate) struct Sums {
    sum: DVec3,
    squares: DVec3,
}

impl Sums {
    #[inline]
    pub(crate) fn add(&mut self, sample: Vec3) {
        let x = sample.as_dvec3();
        self.sum += x;
        self.squares += x * x;
    }
}

impl Moments {
    /// Takes in a pass of `new` samples after `old` ones.
    pub(crate) fn merge(&mut self, old: u64, pass: &Sums, new: u64) {
        let (n, k) = (old as f64, new as f64);
        let mean = pass.sum / k;
        let within = (pass.squares - pass.sum * mean).max(DVec3::ZERO);
        let apart = mean - self.mean.as_dvec3();
        self.mean = (self.mean.as_dvec3() + apart * (k / (n + k))).as_vec3();
        let between = apart * apart * (n * k / (n + k));
        self.deviation = (self.deviation.as_dvec3() + within + between).as_vec3();
    }

    /// Square of the standard error of the mean of `count` samples, at least two.
    pub(crate) fn squared_error(&self, count: u64) -> DVec3 {
        let n = count as f64;
        self.deviation.as_dvec3() / (n * (n - 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_of_any_size_give_the_textbook_mean_and_error() {
        let samples = [3.0, 1.0, 4.0, 1.0, 5.0, 9.0, 2.0, 6.0].map(Vec3::splat);
        let mut moments = Moments::default();
        let mut old = 0;
        for pass in [&samples[..3], &samples[3..4], &samples[4..]] {
            let mut sums = Sums::default();
            pass.iter().for_each(|&x| sums.add(x));
            moments.merge(old, &sums, pass.len() as u64);
            old += pass.len() as u64;
        }
        // Mean 31/8; sum of squares 173; deviations 173 - 31²/8 = 52.875.
        assert!((moments.mean.x - 3.875).abs() < 1e-6);
        let error = moments.squared_error(8).x;
        assert!((error - 52.875 / 56.0).abs() < 1e-6, "{error}");
    }
}
