//! Adaptive integration: cells whose error is large are cut in two until the sum of errors is small enough.
//!
//! Goes by rounds, each of which cuts every cell above a fifth of the largest error, so that the result depends on
//! neither the number of threads nor the order of work.

use halflight_team::heed_interrupt;
use rayon::prelude::*;

/// A number and how far it may be off.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Estimate of its error, not negative.
    pub error: f64,
}

impl Estimate {
    /// The mean of independent numbers and its standard error, from their spread; not a number for fewer than two.
    pub fn of_mean(values: impl ExactSizeIterator<Item = f64> + Clone) -> Estimate {
        let mean = values.clone().sum::<f64>() / values.len() as f64;
        Estimate::about(mean, values)
    }

    /// A known mean and its standard error, `sqrt(sum of squared differences from it / (n (n - 1)))`.
    pub fn about(mean: f64, values: impl ExactSizeIterator<Item = f64>) -> Estimate {
        let n = values.len() as f64;
        let squares: f64 = values.map(|value| (value - mean).powi(2)).sum();
        Estimate { value: mean, error: (squares / (n * (n - 1.0))).sqrt() }
    }
}

/// How accurate a form factor must be.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance {
    /// Share of the form factor.
    pub relative: f64,
    /// Where this is more.
    pub absolute: f64,
}

impl Tolerance {
    /// The error allowed in a form factor of this value.
    pub fn of(&self, value: f64) -> f64 {
        self.absolute.max(self.relative * value)
    }
}

/// A part of the domain with the integral over it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cell<P> {
    /// The part.
    pub place: P,
    /// Integral over it and its error.
    pub integral: Estimate,
}

/// Share of the largest error above which a cell is cut in a round.
const WORST: f64 = 0.2;

/// Rounds at most: an interval halved so often has no more numbers inside.
const ROUNDS: usize = 200;

/// Cuts `cells` with `split` until the errors sum to at most `goal(sum of values)` or there are `most` cells.
pub(crate) fn refine<P: Copy + Send + Sync>(
    mut cells: Vec<Cell<P>>,
    goal: impl Fn(f64) -> f64,
    most: usize,
    split: impl Fn(&Cell<P>) -> [Cell<P>; 2] + Sync,
) -> Estimate {
    let mut sum = total(&cells);
    for _ in 0..ROUNDS {
        heed_interrupt();
        if sum.error <= goal(sum.value) || cells.len() >= most {
            break;
        }
        let largest = cells.iter().map(|c| c.integral.error).fold(0.0, f64::max);
        let (cut, mut kept): (Vec<_>, Vec<_>) = cells.into_iter().partition(|c| c.integral.error >= WORST * largest);
        let halves: Vec<[Cell<P>; 2]> = cut.par_iter().map(&split).collect();
        kept.extend(halves.into_iter().flatten());
        cells = kept;
        sum = total(&cells);
    }
    sum
}

/// Sums of values and errors, compensated (Neumaier): cells differ by many orders of magnitude.
fn total<P>(cells: &[Cell<P>]) -> Estimate {
    let (mut sum, mut carry, mut error) = (0.0_f64, 0.0, 0.0);
    for Estimate { value, error: own } in cells.iter().map(|c| c.integral) {
        let next = sum + value;
        carry += if sum.abs() >= value.abs() { (sum - next) + value } else { (value - next) + sum };
        sum = next;
        error += own;
    }
    let value = sum + carry;
    Estimate { value, error }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Midpoint rule for 1/sqrt(x) with the difference to its halves as the error.
    fn cell(a: f64, b: f64) -> Cell<(f64, f64)> {
        let rule = |a: f64, b: f64| (b - a) / (0.5 * (a + b)).sqrt();
        let (middle, value) = (0.5 * (a + b), rule(a, b));
        let halves = rule(a, middle) + rule(middle, b);
        Cell { place: (a, b), integral: Estimate { value: halves, error: (halves - value).abs() } }
    }

    #[test]
    fn an_integrable_singularity_is_approached() {
        let split = |c: &Cell<(f64, f64)>| {
            let (a, b) = c.place;
            [cell(a, 0.5 * (a + b)), cell(0.5 * (a + b), b)]
        };
        let found = refine(vec![cell(0.0, 1.0)], |_| 1e-5, 100_000, split);
        assert!(found.error <= 1e-5);
        // Next to 0 each halving takes a factor of sqrt 2 off the error: the remainder is 1/(sqrt 2 - 1) of it.
        assert!((found.value - 2.0).abs() < 3.5e-5, "{}", found.value);
    }
}
