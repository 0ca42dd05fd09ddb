//! Crossed squared errors: how far any picture D is off, by estimates that share nothing with it.
//!
//! Of independent estimates B_1, ..., B_G of a pixel without bias and independent of D, with mean T,
//!
//! ```text
//! E[(D - B_i) · (D - B_j)] = |D - T|²,    E[B_i · B_j] = |T|²          i ≠ j, over the three channels
//! q = mean over pairs of (D - B_i) · (D - B_j),     s = mean over pairs of B_i · B_j
//! squared relative error = sum q / sum s            over the pixels that count
//! ```
//!
//! whatever made D. All pairs of G estimates are a U-statistic (W. Hoeffding, *A class of statistics with
//! asymptotically normal distribution*, 1948): with noise s² of the mean of all of them it has the variance `2 s⁴ G /
//! (G - 1) + 4 |D - T|² s²` and not the `4 s⁴` of two halves.
//!
//! **Its own standard error.** Pairs without a common estimate are independent, so `h_ij h_kl` of four different ones
//! has the mean (E h)² for every kernel h, and
//!
//! ```text
//! v = (mean over pairs of h_ij)² - mean over disjoint pairs of h_ij h_kl          E v = variance of the first mean
//! ```
//!
//! exactly, whatever the distribution: what pixels differ in is no part of it. With `h = q_ij - r s_ij`, r the squared
//! relative error, `sqrt(sum v) / sum s` is the standard error of the ratio (delta method).
//!
//! **The effective number of pixels**, `n = (sum v)² / sum v²`: where few pixels carry the sum it is small, and the
//! variance itself known to `sqrt(2/n)` of itself and no better. So what is stated is `v (1 + sqrt(2/n))`.
//!
//! Not handled: light that no sample of any pixel has found; it is in neither the error nor its standard error.

use glam::DVec3;

/// A mean over all pairs of independent estimates of a pixel, and its variance, both without bias.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PairMean {
    /// `mean over i ≠ j of h(B_i, B_j)`.
    pub value: f64,
    /// Its variance; of one pixel it may be estimated below 0.
    pub variance: f64,
}

impl PairMean {
    /// Of a symmetric kernel h.
    ///
    /// # Panics
    /// If there are fewer than four estimates: no two pairs would be disjoint.
    pub fn of(estimates: &[DVec3], h: impl Fn(DVec3, DVec3) -> f64) -> PairMean {
        assert!(estimates.len() >= 4, "{} estimates", estimates.len());
        let g = estimates.len() as f64;
        let (mut total, mut rows, mut squares) = (0.0, 0.0, 0.0);
        for (i, a) in estimates.iter().enumerate() {
            let mut row = 0.0;
            for (j, b) in estimates.iter().enumerate() {
                if i != j {
                    let own = h(*a, *b);
                    row += own;
                    squares += own * own;
                }
            }
            total += row;
            rows += row * row;
        }
        let value = total / (g * (g - 1.0));
        // All products of two pairs, less those that share one estimate, or both.
        let disjoint = (total * total - 4.0 * rows + 2.0 * squares) / (g * (g - 1.0) * (g - 2.0) * (g - 3.0));
        PairMean { value, variance: value * value - disjoint }
    }
}

/// A number with its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Estimated {
    /// The estimate.
    pub value: f64,
    /// Its standard error.
    pub standard_error: f64,
}

/// Sums of variances over pixels, and how many pixels carry them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Variances {
    sum: f64,
    squares: f64,
}

impl Variances {
    /// Adds the variance of a pixel, which may have been estimated below 0.
    pub fn add(&mut self, variance: f64) {
        self.sum += variance;
        self.squares += variance * variance;
    }

    /// `(sum v)² / sum v²`, the number of pixels that carry the sum; 0 where there is none.
    pub fn effective(&self) -> f64 {
        if self.squares > 0.0 { self.sum.max(0.0).powi(2) / self.squares } else { 0.0 }
    }

    /// What is stated of the variance of the sum: `v (1 + sqrt(2/n))`, and the largest that single pixels say where the
    /// sum is not above 0.
    pub fn stated(&self) -> f64 {
        let n = self.effective();
        if n > 0.0 { self.sum * (1.0 + (2.0 / n).sqrt()) } else { self.squares.sqrt() }
    }

    /// The variances of two sets of pixels.
    pub fn plus(self, other: Variances) -> Variances {
        Variances { sum: self.sum + other.sum, squares: self.squares + other.squares }
    }
}

/// The squared relative error of a picture.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct SquaredError {
    /// `sum |D - T|² / sum |T|²`, without bias; below 0 where chance is more than the error.
    pub squared: Estimated,
    /// Pixels that carry the standard error.
    pub effective_pixels: f64,
    /// Root of the mean of T² over pixels and channels, W/(m² sr).
    pub rms: f64,
    /// Pixels that count.
    pub pixels: usize,
}

impl SquaredError {
    /// Of a picture, pixel by pixel, with at least four independent estimates of each. None without pixels or light.
    ///
    /// # Panics
    /// If a pixel has fewer than four estimates.
    pub fn of<'a>(pixels: impl Iterator<Item = (DVec3, &'a [DVec3])> + Clone) -> Option<SquaredError> {
        let (mut error, mut signal, mut count) = (0.0, 0.0, 0);
        for (d, estimates) in pixels.clone() {
            error += PairMean::of(estimates, |a, b| (d - a).dot(d - b)).value;
            signal += PairMean::of(estimates, DVec3::dot).value;
            count += 1;
        }
        let ratio = error / signal;
        let mut variances = Variances::default();
        for (d, estimates) in pixels {
            variances.add(PairMean::of(estimates, |a, b| (d - a).dot(d - b) - ratio * a.dot(b)).variance);
        }
        let standard_error = variances.stated().sqrt() / signal;
        (signal > 0.0 && ratio.is_finite()).then(|| SquaredError {
            squared: Estimated { value: ratio, standard_error },
            effective_pixels: variances.effective(),
            rms: (signal / (3 * count) as f64).sqrt(),
            pixels: count,
        })
    }

    /// The relative RMS error so many standard errors of its square above the estimate, or below; 0 where the square is
    /// below 0.
    pub fn at(&self, standard_errors: f64) -> f64 {
        let Estimated { value, standard_error } = self.squared;
        (value + standard_errors * standard_error).max(0.0).sqrt()
    }

    /// The relative RMS error and its standard error, which is half the width from one standard error of the square
    /// below to one above.
    pub fn relative(&self) -> Estimated {
        Estimated { value: self.at(0.0), standard_error: 0.5 * (self.at(1.0) - self.at(-1.0)) }
    }
}

/// The mean of a pixel's estimates and the variance of that, of the channels' sum and channel by channel.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PixelMean {
    pub mean: DVec3,
    /// Of each channel of the mean.
    pub variance: DVec3,
    /// Of the sum of the channels of the mean.
    pub variance_of_sum: f64,
}

impl PixelMean {
    pub(crate) fn of(estimates: &[DVec3]) -> PixelMean {
        let g = estimates.len() as f64;
        let mean = estimates.iter().sum::<DVec3>() / g;
        let (mut channels, mut sum) = (DVec3::ZERO, 0.0);
        for estimate in estimates {
            let apart = *estimate - mean;
            channels += apart * apart;
            sum += apart.element_sum().powi(2);
        }
        let share = 1.0 / (g * (g - 1.0));
        PixelMean { mean, variance: share * channels, variance_of_sum: share * sum }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of two values that are equally likely all is known: the mean of the kernel, and of the variance over all draws.
    #[test]
    fn mean_and_variance_have_no_bias() {
        let value = |bit: u32| DVec3::new(1.0, 2.0, 0.5) * f64::from(1 + 3 * bit);
        let d = DVec3::new(3.0, 5.0, 1.0);
        let draws = 5;
        let all: Vec<PairMean> = (0..1_u32 << draws)
            .map(|bits| {
                let estimates: Vec<DVec3> = (0..draws).map(|k| value(bits >> k & 1)).collect();
                PairMean::of(&estimates, |a, b| (d - a).dot(d - b))
            })
            .collect();
        let mean = |of: &dyn Fn(&PairMean) -> f64| all.iter().map(of).sum::<f64>() / all.len() as f64;
        let truth = (d - 0.5 * (value(0) + value(1))).length_squared();
        let found = mean(&|own| own.value);
        assert!((found - truth).abs() < 1e-12 * truth, "{found} {truth}");
        let spread = mean(&|own| (own.value - truth).powi(2));
        let stated = mean(&|own| own.variance);
        assert!((stated - spread).abs() < 1e-12 * spread, "{stated} {spread}");
    }

    #[test]
    fn few_pixels_that_carry_the_sum_are_counted() {
        let of = |variances: &[f64]| {
            let mut sum = Variances::default();
            variances.iter().for_each(|v| sum.add(*v));
            sum
        };
        assert_eq!(of(&[2.0; 8]).effective(), 8.0);
        assert_eq!(of(&[2.0; 8]).stated(), 24.0);
        assert!((of(&[1.0, 1e-9, 1e-9]).effective() - 1.0).abs() < 1e-8);
        assert_eq!((of(&[]).stated(), of(&[-3.0, 0.0]).stated()), (0.0, 3.0));
    }

    /// Where estimates agree the error is that of the picture, and known.
    #[test]
    fn without_noise_the_error_is_exact() {
        let truth = [DVec3::new(1.0, 2.0, 3.0); 4];
        let shown = [truth[0] * 1.1, truth[0] * 0.9];
        let error = SquaredError::of(shown.iter().map(|d| (*d, &truth[..]))).expect("light");
        assert!((error.relative().value - 0.1).abs() < 1e-9 && error.squared.standard_error < 1e-9);
        assert!((error.rms - (14.0_f64 / 3.0).sqrt()).abs() < 1e-12 && error.pixels == 2);
        assert!(SquaredError::of([(DVec3::ONE, &[DVec3::ZERO; 4][..])].into_iter()).is_none());
    }
}
