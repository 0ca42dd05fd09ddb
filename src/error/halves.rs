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
