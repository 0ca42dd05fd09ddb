//! Whether two answers agree: every pixel, the mean, and the mean of every bounce order.
//!
//! Two numbers agree where their difference is within what chance allows with probability 1 - LEVEL, plus the error
//! that patches make. LEVEL is shared between all numbers tested (Bonferroni): half of it between the pixels and their
//! channels, half between the means.
//!
//! A pixel of a path tracer may have few samples with light, or none: its samples' own spread is then no standard error
//! and its mean is not normal. What chance allows is therefore Bennett's bound for the largest sample near the pixel,
//! with the largest variance that the samples around it leave possible ([`crate::statistics`]); for many samples
//! this is the normal bound `sqrt(2 ln(3/p))` standard errors. Of repeated pictures the noise counts as normal.
//! Variances are pooled: the largest of a pixel and its eight neighbours counts (a few repetitions often make one pixel
//! of an edge seem free of noise, seldom three), or the mean over a wider window if that is larger. This makes the test
//! conservative.
//!
//! Means are tested by Student's distribution with Welch's degrees of freedom, and by the same bounds where light is
//! rare. Errors of the size of patches cancel between methods on the same patches.
//!
//! Not handled: spatial patterns too weak for any pixel and too balanced for the mean.

use serde::{Serialize, Serializer};

use crate::compare::arithmetic::{counted, map, smoothed, window};
use crate::compare::truth::{Made, Truth};
use crate::statistics::{bennett, student_quantile, variance_limit};
use halflight::light::Rgb;
use halflight::pictures::{Picture, Size};

/// Probability of calling two equal pictures different.
const LEVEL: f64 = 0.01;

/// Half the window over which variances are pooled, in pixels.
const POOL: usize = 3;

/// What the end of a series leaves out, relative: counts as none.
const NEGLIGIBLE: f64 = 1e-4;

/// A method's best picture, its bounce orders and means, with all that is known of their errors: what verdicts rest on,
/// and what methods of the other kind are held against.
#[derive(Clone, Debug, Default)]
pub struct Answer {
    /// The method.
    pub name: &'static str,
    /// How fine: patches and rays, or samples a pixel.
    pub effort: String,
    /// All bounces.
    pub picture: Picture,
    /// Standard error of each pixel and channel.
    pub noise: Picture,
    /// Estimated size of the error that more samples do not reduce, per pixel and channel; none for a path tracer.
    pub systematic: Option<Picture>,
    /// Bounces n = 0 to [`ORDERS`](crate::compare::ORDERS).
    pub orders: Vec<Picture>,
    /// Standard errors of the orders.
    pub order_noise: Vec<Picture>,
    /// Means over the mask: of the picture, then of the orders.
    pub means: Vec<Mean>,
    /// Degrees of freedom behind the standard errors of the means.
    pub freedom: f64,
    /// The most that one sample adds to each pixel; none where noise counts as normal.
    pub sample: Option<Picture>,
}

/// A mean over the mask, per channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mean {
    /// Radiance, W/(m² sr).
    pub value: [f64; 3],
    /// Its standard error.
    pub noise: [f64; 3],
    /// Bound on the error that the size of patches makes.
    pub systematic: [f64; 3],
}

impl Answer {
    /// The references it gives: of the picture, then of each order.
    pub(crate) fn truths(&self, mask: &Picture) -> Vec<Truth> {
        let pictures = std::iter::once((&self.picture, &self.noise)).chain(self.orders.iter().zip(&self.order_noise));
        let made = Made { by: self.name.into(), effort: String::new(), seconds: 0.0, error: None };
        let truth = |(picture, noise): (&Picture, &Picture)| {
            Truth::new(picture.clone(), noise.clone(), mask.clone(), made.clone())
        };
        pictures.map(truth).collect()
    }
}

/// Two methods, compared.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Pair {
    /// One.
    pub a: &'static str,
    /// The other.
    pub b: &'static str,
    /// The means of the pictures, and whether no pixel fails and all means agree.
    #[serde(flatten)]
    pub whole: Difference,
    /// Whether the means of the pictures agree.
    #[serde(skip)]
    pub means_agree: bool,
    /// Pixels that fail.
    pub failing_pixels: usize,
    /// The means of bounce orders n = 0, 1, ….
    pub orders: Vec<OrderDifference>,
    /// Pixels tested.
    #[serde(skip)]
    pub pixels: usize,
}

/// Two means, compared.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Relative difference, of the channel that differs most in parts of its error; 0 where both are black.
    #[serde(rename = "mean_difference")]
    pub relative: f64,
    /// Half the width of its 95 % confidence interval, the error of the patches included.
    #[serde(rename = "mean_difference_error")]
    pub error: f64,
    /// Whether all channels agree.
    #[serde(rename = "verdict", serialize_with = "in_a_word")]
    pub agree: bool,
}

/// The means of one bounce order, compared.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct OrderDifference {
    /// The order.
    pub n: usize,
    /// Its means.
    #[serde(flatten)]
    pub means: Difference,
}

impl Difference {
    /// `agree` or `differ`.
    pub fn verdict(&self) -> &'static str {
        if self.agree { "agree" } else { "differ" }
    }
}

fn in_a_word<S: Serializer>(agree: &bool, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(if *agree { "agree" } else { "differ" })
}

/// Compares two answers over the mask.
pub fn judge(a: &Answer, b: &Answer, mask: &Picture) -> Pair {
    let chosen = counted(mask);
    let failing_pixels = failing(a, b, mask, &chosen);
    let numbers = a.means.len().min(b.means.len()).max(1);
    let pairs = a.means.iter().zip(&b.means);
    let mut means = pairs.map(|(x, y)| difference([x, y], [a, b], chosen.len(), numbers));
    let mean = means.next().unwrap_or(Difference { relative: 0.0, error: 0.0, agree: true });
    let orders: Vec<_> = means.enumerate().map(|(n, means)| OrderDifference { n, means }).collect();
    let agree = failing_pixels == 0 && mean.agree && orders.iter().all(|o| o.means.agree);
    Pair {
        a: a.name,
        b: b.name,
        whole: Difference { agree, ..mean },
        means_agree: mean.agree,
        failing_pixels,
        orders,
        pixels: chosen.len(),
    }
}

/// Number of pixels with a channel that chance and patches do not explain.
fn failing(a: &Answer, b: &Answer, mask: &Picture, chosen: &[usize]) -> usize {
    // Either way, and the variance beyond its limit: three ways to be wrong, for each channel.
    let l = (3.0 * 3.0 * chosen.len().max(1) as f64 / (0.5 * LEVEL)).ln();
    let variances = [a, b].map(|e| variance(e, mask, l));
    let weight = |k: usize, c: usize| {
        let of = |e: &Answer| e.sample.as_ref().map_or(0.0, |s| s.pixels[k][c]);
        f64::from(of(a).max(of(b)))
    };
    let patches = |k: usize, c: usize| match (&a.systematic, &b.systematic) {
        (Some(s), None) | (None, Some(s)) => f64::from(s.pixels[k][c]),
        _ => 0.0,
    };
    let fails = |k: usize, c: usize| {
        let (x, y) = (a.picture.pixels[k][c], b.picture.pixels[k][c]);
        let noise = f64::from(variances[0].pixels[k][c] + variances[1].pixels[k][c]);
        let chance = deviation(noise, weight(k, c), l);
        let negligible = NEGLIGIBLE * f64::from(x.max(y));
        f64::from((x - y).abs()) > chance + patches(k, c) + negligible
    };
    let any = |k: &&usize| (0..3).any(|c| fails(**k, c));
    chosen.iter().filter(any).count()
}

/// How far a mean of this variance may be off with probability exp(-l), if one sample adds at most `weight` to it.
fn deviation(variance: f64, weight: f64, l: f64) -> f64 {
    if weight > 0.0 { weight * bennett(variance / (weight * weight), l) } else { (2.0 * l * variance).sqrt() }
}

/// The largest variance of each pixel's mean that what is seen near it leaves possible.
fn variance(e: &Answer, mask: &Picture, l: f64) -> Picture {
    let own = map(&e.noise, |v| v * v);
    let pooled = smoothed(&own, POOL, mask);
    let largest = largest_near(&own, mask);
    let limit = |k: usize| match &e.sample {
        None => pooled.pixels[k],
        Some(sample) => {
            let n = window(mask, k, POOL).count().max(1) as f64;
            let (seen, weight) = (pooled.pixels[k], sample.pixels[k]);
            Rgb::from_array([0, 1, 2].map(|c| limit(f64::from(seen[c]), weight[c].into(), n, l) as f32))
        }
    };
    let at = |k: usize| largest.pixels[k].max(limit(k));
    Picture { pixels: (0..own.pixels.len()).map(at).collect(), ..own }
}

/// Largest mean variance of n means whose mean variance `seen` was estimated from samples that weigh `weight` at most.
fn limit(seen: f64, weight: f64, n: f64, l: f64) -> f64 {
    if weight == 0.0 {
        return seen;
    }
    let unit = weight * weight;
    variance_limit(n * seen / unit, l) * unit / n
}

/// Largest of each pixel and its eight neighbours, channel by channel, within the mask.
fn largest_near(picture: &Picture, mask: &Picture) -> Picture {
    let Size { width, height } = picture.size();
    Picture::from_fn(width, height, |x, y| {
        let near = window(mask, y * width + x, 1);
        near.fold(Rgb::ZERO, |m, k| m.max(picture.pixels[k]))
    })
}

/// Compares one of `numbers` means of `pixels` pixels, in the channel that differs most.
fn difference([x, y]: [&Mean; 2], [a, b]: [&Answer; 2], pixels: usize, numbers: usize) -> Difference {
    let same_patches = a.systematic.is_some() == b.systematic.is_some();
    let weights =
        [a, b].map(|e| e.sample.as_ref().map_or(Rgb::ZERO, |s| s.pixels.iter().copied().fold(Rgb::ZERO, Rgb::max)));
    let mut worst = Difference { relative: 0.0, error: 0.0, agree: true };
    let (mut rank, mut agree) = (-1.0, true);
    for c in 0..3 {
        let size = 0.5 * (x.value[c] + y.value[c]);
        if size <= 0.0 {
            continue;
        }
        let chance = Chance {
            variances: [x.noise[c].powi(2), y.noise[c].powi(2)],
            freedoms: [a.freedom, b.freedom],
            weights: weights.map(|w| f64::from(w[c]) / pixels.max(1) as f64),
        };
        let patches = if same_patches { 0.0 } else { x.systematic[c] + y.systematic[c] };
        let apart = x.value[c] - y.value[c];
        // Three channels, two sides.
        let allowed = chance.allows(0.5 * LEVEL / (6 * numbers) as f64) + patches;
        agree &= apart.abs() <= allowed + NEGLIGIBLE * size;
        let error = chance.interval() + patches;
        if apart.abs() / error.max(1e-12 * size) > rank {
            rank = apart.abs() / error.max(1e-12 * size);
            worst.relative = apart / size;
            worst.error = error / size;
        }
    }
    Difference { agree, ..worst }
}

/// What is known of the noise of two means.
struct Chance {
    variances: [f64; 2],
    freedoms: [f64; 2],
    /// The most one sample adds.
    weights: [f64; 2],
}

impl Chance {
    /// Half the 95 % confidence interval.
    fn interval(&self) -> f64 {
        let [a, b] = self.variances;
        (a + b).sqrt() * student_quantile(0.975, self.freedom())
    }

    /// The difference that is exceeded one way with probability `p`.
    fn allows(&self, p: f64) -> f64 {
        let l = (1.0 / p).ln();
        let limits = [0, 1].map(|k| limit(self.variances[k], self.weights[k], 1.0, l));
        let (total, weight) = (limits[0] + limits[1], self.weights[0].max(self.weights[1]));
        if total == 0.0 {
            return 0.0;
        }
        // Student's quantile, widened as rare light widens the normal bound.
        let widened = deviation(total, weight, l) / (2.0 * l * total).sqrt();
        total.sqrt() * student_quantile(1.0 - p, self.freedom()) * widened
    }

    /// Welch's degrees of freedom of the sum.
    fn freedom(&self) -> f64 {
        let [a, b] = self.variances;
        let share = |k: usize| self.variances[k].powi(2) / self.freedoms[k];
        let parts = share(0) + share(1);
        if parts > 0.0 { (a + b).powi(2) / parts } else { f64::INFINITY }
    }
}
