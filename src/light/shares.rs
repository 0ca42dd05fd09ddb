//! One of several things drawn in proportion to its weight: a piecewise constant density over the unit interval.
//!
//! With `S_k` the sum of the weights up to and including k, a number u of the unit interval chooses the first k with
//! `u S_n < S_k`, and `(u S_n - S_(k-1)) / w_k` is uniform again: one well spread number serves twice.
//!
//! Source: M. Pharr, W. Jakob, G. Humphreys, *Physically Based Rendering*, 4th edition, 2023, A.1 and A.4. Not handled:
//! weights below 0; constant time, as of alias tables, which would use the number up. Drawing of nothing panics.

use std::ops::{Div, Range, Sub};

/// Weights added up.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Shares {
    until: Vec<f64>,
}

/// What was drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drawn<T> {
    /// Which.
    pub index: usize,
    /// Its weight; over the sum of all its probability.
    pub weight: T,
    /// Where the number lies within its part of the interval, in 0..=1 but for rounding.
    pub rest: T,
}

impl<T: Into<f64>> Drawn<T> {
    /// The rest as a number to draw with again, in [0, 1) also where it is rounded.
    #[inline]
    pub fn again(self) -> f32 {
        (self.rest.into() as f32).clamp(0.0, 1.0 - 0.5 * f32::EPSILON)
    }
}

impl Shares {
    /// Of weights, in order.
    pub fn of(weights: impl IntoIterator<Item = f64>) -> Shares {
        let add = |sum: &mut f64, weight: f64| {
            *sum += weight;
            Some(*sum)
        };
        Shares { until: weights.into_iter().scan(0.0, add).collect() }
    }

    /// Over the sum of all.
    pub fn normalised(mut self) -> Shares {
        let total = self.total();
        self.until.iter_mut().for_each(|until| *until /= total);
        self
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.until.len()
    }

    /// The sum of all weights.
    pub fn total(&self) -> f64 {
        self.before(self.count())
    }

    /// The sum of the weights of a range.
    pub fn weight(&self, range: &Range<usize>) -> f64 {
        self.before(range.end) - self.before(range.start)
    }

    fn before(&self, k: usize) -> f64 {
        if k == 0 { 0.0 } else { self.until[k - 1] }
    }

    /// The one at u in the unit interval.
    pub fn draw(&self, u: f64) -> Drawn<f64> {
        self.draw_of(&(0..self.count()), u)
    }

    /// The one of a range at u in the unit interval.
    pub fn draw_of(&self, range: &Range<usize>, u: f64) -> Drawn<f64> {
        let low = self.before(range.start);
        let drawn = draw_after(low, &self.until[range.clone()], |&until| until, low + u * self.weight(range));
        Drawn { index: range.start + drawn.index, ..drawn }
    }
}

/// The first of some things whose weight, with that of all before it, is above a number; the last if none is.
#[inline]
pub fn draw<S, T>(things: &[S], until: impl Fn(&S) -> T, at: T) -> Drawn<T>
where
    T: Copy + Default + PartialOrd + Sub<Output = T> + Div<Output = T>,
{
    draw_after(T::default(), things, until, at)
}

#[inline]
fn draw_after<S, T>(low: T, things: &[S], until: impl Fn(&S) -> T, at: T) -> Drawn<T>
where
    T: Copy + PartialOrd + Sub<Output = T> + Div<Output = T>,
{
    let index = things.partition_point(|thing| until(thing) <= at).min(things.len() - 1);
    let before = if index == 0 { low } else { until(&things[index - 1]) };
    let weight = until(&things[index]) - before;
    Drawn { index, weight, rest: (at - before) / weight }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_chooses_by_the_sums_and_leaves_its_rest() {
        let shares = Shares::of([1.0, 0.0, 2.0, 5.0]);
        for (u, index, weight, rest) in [(0.0, 0, 1.0, 0.0), (0.125, 2, 2.0, 0.0), (0.6875, 3, 5.0, 0.5)] {
            assert_eq!(shares.draw(u), Drawn { index, weight, rest });
            assert_eq!(shares.clone().normalised().draw(u), Drawn { index, weight: weight / 8.0, rest });
        }
        assert_eq!(shares.draw_of(&(1..3), 0.75), Drawn { index: 2, weight: 2.0, rest: 0.75 });
        assert_eq!((shares.draw(1.0).index, shares.draw(1.0).again()), (3, 0.999_999_94));
        assert_eq!(draw(&[0.25_f32, 0.75], |&until| until, 0.99).again(), 0.999_999_94);
    }

    /// Evenly spread numbers choose each as often as it weighs, but for one at either end of its part, and leave
    /// numbers that are as evenly spread.
    #[test]
    fn each_is_drawn_as_often_as_it_weighs() {
        const DRAWS: usize = 10_000;
        let shares = Shares::of([0.5, 3.0, 0.0, 1.0, 7.0, 0.25]);
        let mut found = [(0.0, 0.0); 6];
        for k in 0..DRAWS {
            let drawn = shares.draw((k as f64 + 0.5) / DRAWS as f64);
            found[drawn.index].0 += 1.0;
            found[drawn.index].1 += f64::from(drawn.again());
        }
        for (k, (count, rests)) in found.into_iter().enumerate() {
            let expected = shares.weight(&(k..k + 1)) / shares.total() * DRAWS as f64;
            assert!((count - expected).abs() <= 2.0 && (rests - 0.5 * expected).abs() <= 2.0, "{k}: {count} {rests}");
        }
    }
}
