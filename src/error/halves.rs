//! Two independent estimates of one quantity: the variance of their mean, and its square without bias by noise.
//!
//! Where estimates a and b have independent errors of mean 0,
//!
//! ```text
//! E[((a - b) / 2)²] = variance of (a + b) / 2,        E[a · b] = square of what both estimate.
//! ```
//!
//! This is the only place where halves are multiplied.

use glam::DVec3;

/// Two independent estimates.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Halves(pub DVec3, pub DVec3);

impl Halves {
    /// Of two arrays' entries.
    pub(crate) fn of([a, b]: [DVec3; 2]) -> Self {
        Halves(a, b)
    }

    /// Variance of the mean, channel by channel.
    pub(crate) fn variance(self) -> DVec3 {
        let d = 0.5 * (self.0 - self.1);
        d * d
    }

    /// Squared error of the mean of two estimates that each were made of one of two `raw` ones, whatever was done to
    /// them:
    ///
    /// ```text
    /// ((a - B)² + (b - A)²) / 2 - (A - B)² / 2 - (a - b)² / 4        raw A and B of one variance, a made of A, b of B
    /// ```
    ///
    /// The mean of this is exact: with errors a, b and A, B of these letters the first three terms are
    /// `(a² + b²) / 2 - a B - b A + A B`, of which only the squares have a mean, and the square of the mean of a and b
    /// is less by the last. It is the variance where nothing was done, and noise may make it negative.
    pub(crate) fn crossed(self, raw: Self) -> DVec3 {
        let square = |v: DVec3| v * v;
        let apart = 0.5 * (square(self.0 - raw.1) + square(self.1 - raw.0) - square(raw.0 - raw.1));
        apart - 0.25 * square(self.0 - self.1)
    }

    /// The square of the estimated quantity, channels added; noise may make it negative.
    pub(crate) fn squared(self) -> f64 {
        self.0.dot(self.1)
    }

    /// The differences to two other estimates.
    pub(crate) fn less(self, other: Self) -> Self {
        Halves(self.0 - other.0, self.1 - other.1)
    }

    /// Both times a factor a channel.
    pub(crate) fn times(self, factor: DVec3) -> Self {
        Halves(factor * self.0, factor * self.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::sobol::Stream;

    /// Estimates drawn towards a wrong value: the crossed squares are the squared error of their mean all the same.
    #[test]
    fn crossed_squares_know_what_was_done_to_estimates() {
        let mut random = Stream::new(7);
        let truth = DVec3::new(2.0, -1.0, 0.5);
        let (mut crossed, mut squared, count) = (DVec3::ZERO, DVec3::ZERO, 20_000);
        for _ in 0..count {
            let raw = Halves::of([0, 1].map(|_| truth + (f64::from(random.uniform()) - 0.5)));
            let drawn = Halves(0.5 * raw.0 + 0.6, 0.3 * raw.1 + 0.9);
            let off = 0.5 * (drawn.0 + drawn.1) - truth;
            crossed += drawn.crossed(raw) / f64::from(count);
            squared += off * off / f64::from(count);
            assert!((raw.crossed(raw) - raw.variance()).abs().max_element() < 1e-12);
        }
        // Each term has a standard deviation below the product of the largest error, 2, and of noise, 0.3.
        assert!((crossed - squared).abs().max_element() < 4.0 * 0.6 / 20_000_f64.sqrt(), "{crossed} {squared}");
    }

    #[test]
    fn means_of_products_know_no_noise() {
        let mut random = Stream::new(5);
        let mut estimate = || DVec3::new(2.0, -1.0, 0.5) + (f64::from(random.uniform()) - 0.5);
        let (mut squared, mut variance, count) = (0.0, 0.0, 20_000);
        for _ in 0..count {
            let halves = Halves(estimate(), estimate());
            squared += halves.squared() / f64::from(count);
            variance += halves.variance().x / f64::from(count);
        }
        // Of a uniform number the variance is 1/12, of the mean of two half of it; their standard errors are below 1 %.
        assert!((squared - 5.25).abs() < 0.03, "{squared}");
        assert!((variance * 24.0 - 1.0).abs() < 0.03, "{variance}");
    }
}
