//! Two-sided bounds on the spectral radius of K, proved, not estimated.
//!
//! The eigenvalues of K are those of `B = alpha rho F`, B >= 0, channel by channel. For any x > 0
//! (Collatz 1942, Wielandt 1950)
//!
//! ```text
//! min (Bx)_i / x_i  <=  spectral radius  <=  max (Bx)_i / x_i.
//! ```
//!
//! Patches that receive or pass on nothing make the minimum 0; taken over a subset S with x = 0 outside S it is a
//! proof still, since the radius of B is at least that of its part on S. x comes from a shifted power iteration.
//! The bounds hold for K as assembled (with the noise of its F) and are widened by the rounding of the products.

use glam::Vec4;

use crate::form_factors::Rows;
use crate::light::Light;
use crate::operator::linear::LinearOperator;

/// A product `F x` with relative error at most [`Rows::ROUNDING`] where x >= 0.
pub type Product<'a> = &'a dyn Fn(&[Vec4]) -> Vec<Vec4>;

/// `lower <= spectral radius <= upper`; both are 0 where nothing travels on.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Bounds {
    /// Proved lower bound.
    pub lower: f64,
    /// Proved upper bound.
    pub upper: f64,
}

impl Bounds {
    /// The number half way between the bounds.
    pub fn middle(&self) -> f64 {
        0.5 * (self.lower + self.upper)
    }
}

/// Bounds of each channel, with the vectors that prove the upper ones.
#[derive(Clone, Debug)]
pub struct Spectrum {
    /// Red, green, blue.
    pub channels: [Bounds; 3],
    /// x > 0 where `alpha rho > 0`, and 0 elsewhere, with `B x <= upper x`; fourth component unused.
    pub x: Vec<Vec4>,
    /// `F x`: what the visible half of the tail is proportional to.
    pub fx: Vec<Vec4>,
}

impl Spectrum {
    /// Bound on the relative error of `B x` as computed: that of the product, and of the scaling by alpha rho.
    pub const ROUNDING: f64 = Rows::ROUNDING + 4.0 * f32::EPSILON as f64;

    /// Bounds of the worst channel.
    pub fn worst(&self) -> Bounds {
        let worst = |a: Bounds, b: &Bounds| Bounds { lower: a.lower.max(b.lower), upper: a.upper.max(b.upper) };
        let [r, rest @ ..] = &self.channels;
        rest.iter().fold(*r, worst)
    }
}

/// When the power iteration stops.
#[derive(Clone, Copy, Debug)]
pub struct SpectrumEffort {
    /// The bounds of every channel are within this share of each other.
    pub gap: f64,
    /// Products to spend on that at most.
    pub products: usize,
    /// Products to spend at most as long as it is undecided whether the radius lies below or above 1, or, below, how
    /// far; 0 where 1 means nothing.
    pub undecided: usize,
}

impl Default for SpectrumEffort {
    fn default() -> Self {
        SpectrumEffort { gap: 0.005, products: 64, undecided: 1024 }
    }
}

/// The gap that bounds below 1 may have, as a share of what remains to 1.
const VAGUE: f64 = 0.25;
/// Shift of the power iteration as a share of the radius: bipartite scenes (two facing walls) would oscillate.
const SHIFT: f32 = 0.2;

/// Bounds the spectral radius of K.
pub fn spectrum(k: &dyn LinearOperator) -> Spectrum {
    let b: Vec<Vec4> = (0..k.areas().len()).map(|i| k.passed_on(i).extend(0.0)).collect();
    let start: Vec<Vec4> = b.iter().map(|b| positive(*b)).collect();
    spectrum_of(&|x| k.incident(x), &b, &start, &SpectrumEffort::default())
}

/// Bounds the spectral radius of `b F`, b >= 0 one number a row and channel (the fourth component unused).
///
/// The iteration starts from the components of `start` where b is above 0; those of an eigenvector of a matrix near by
/// save most of it.
///
/// # Panics
/// If `b` and `start` differ in length.
pub fn spectrum_of(f: Product, b: &[Vec4], start: &[Vec4], effort: &SpectrumEffort) -> Spectrum {
    assert_eq!(b.len(), start.len());
    let pairs = b.iter().zip(start);
    let mut x: Vec<Vec4> = pairs.map(|(b, x)| kept_positive(*x, *b)).collect();
    let mut lower = [0.0f64; 3];
    for step in 1.. {
        let fx = f(&x);
        let bx: Vec<Vec4> = b.iter().zip(&fx).map(|(b, fx)| b * fx).collect();
        let upper = largest_ratio(&bx, &x);
        raise(&mut lower, smallest_ratio(&bx, &x));
        // Bounds from subsets cost products of their own: compute them every few steps only.
        if step % 4 == 0 && !settled(lower, upper, step, effort) {
            raise(&mut lower, best_subset(f, b, &x, &bx, upper));
        }
        if settled(lower, upper, step, effort) {
            let channels = [0, 1, 2].map(|c| widened(lower[c], upper[c]));
            return Spectrum { channels, x, fx };
        }
        x = shifted_step(&x, &bx, upper);
    }
    unreachable!("the number of products is bounded")
}

fn raise(lower: &mut [f64; 3], found: [f64; 3]) {
    for c in 0..3 {
        lower[c] = lower[c].max(found[c]);
    }
}

/// x where b is above 0 and 0 elsewhere; components of the support stay above 0, or x would prove nothing about them.
fn kept_positive(x: Vec4, b: Vec4) -> Vec4 {
    positive(b) * x.max(Vec4::splat(1e-30))
}

/// 1 in the components that are above 0.
pub(crate) fn positive(b: Vec4) -> Vec4 {
    Vec4::select(b.cmpgt(Vec4::ZERO), Vec4::ONE, Vec4::ZERO)
}

/// `(Bx)_i / x_i` over the support of x: the extremes of each channel, `begin` for an empty support.
fn extreme_ratio(bx: &[Vec4], x: &[Vec4], begin: f64, extreme: fn(f64, f64) -> f64) -> [f64; 3] {
    let mut found = [begin; 3];
    for (y, x) in bx.iter().zip(x) {
        for c in (0..3).filter(|&c| x[c] > 0.0) {
            found[c] = extreme(found[c], y[c] as f64 / x[c] as f64);
        }
    }
    found
}

/// max over i of `(Bx)_i / x_i`; `(Bx)_i` is 0 wherever x_i is.
fn largest_ratio(bx: &[Vec4], x: &[Vec4]) -> [f64; 3] {
    extreme_ratio(bx, x, 0.0, f64::max)
}

/// min over the support of x of `(Bx)_i / x_i`; 0 for an empty support.
fn smallest_ratio(bx: &[Vec4], x: &[Vec4]) -> [f64; 3] {
    extreme_ratio(bx, x, f64::INFINITY, f64::min).map(|s| if s.is_finite() { s } else { 0.0 })
}

/// Lower bounds from subsets on which the ratio is nearly the largest, each with its own product.
fn best_subset(f: Product, b: &[Vec4], x: &[Vec4], bx: &[Vec4], upper: [f64; 3]) -> [f64; 3] {
    let mut best = [0.0f64; 3];
    let mut restricted = x.to_vec();
    let mut image = bx.to_vec();
    for share in [0.5, 0.9, 0.97] {
        for (x, y) in restricted.iter_mut().zip(&image) {
            for c in 0..3 {
                if (y[c] as f64) < share * upper[c] * x[c] as f64 {
                    x[c] = 0.0;
                }
            }
        }
        image = f(&restricted);
        for (y, b) in image.iter_mut().zip(b) {
            *y *= *b;
        }
        raise(&mut best, smallest_ratio(&image, &restricted));
    }
    best
}

fn settled(lower: [f64; 3], upper: [f64; 3], step: usize, effort: &SpectrumEffort) -> bool {
    let radius = |v: [f64; 3]| v.into_iter().fold(0.0, f64::max);
    let undecided = radius(lower) < 1.0 && radius(upper) >= 1.0;
    // Just below 1 the sum of the series is as uncertain as 1 - radius, and so is the number of its terms.
    let vague = |c: usize| upper[c] < 1.0 && upper[c] - lower[c] > VAGUE * (1.0 - upper[c]);
    let near = step < effort.undecided && (undecided || (0..3).any(vague));
    let close = (0..3).all(|c| upper[c] - lower[c] <= effort.gap * upper[c]);
    !near && (close || step >= effort.products)
}

/// `x + (Bx)/(shift)`, scaled to a largest component of 1 in every channel.
fn shifted_step(x: &[Vec4], bx: &[Vec4], upper: [f64; 3]) -> Vec<Vec4> {
    let shift = Vec4::new(upper[0] as f32, upper[1] as f32, upper[2] as f32, 0.0) * SHIFT;
    let next: Vec<Vec4> = x.iter().zip(bx).map(|(x, y)| *y + shift * *x).collect();
    let largest = next.iter().fold(Vec4::splat(f32::MIN_POSITIVE), |m, v| m.max(*v));
    next.iter().zip(x).map(|(v, x)| kept_positive(v / largest, *x)).collect()
}

/// Widens the bounds by the rounding of F x and of the scaling by alpha rho.
fn widened(lower: f64, upper: f64) -> Bounds {
    Bounds { lower: lower * (1.0 - Spectrum::ROUNDING), upper: upper * (1.0 + Spectrum::ROUNDING) }
}

/// A lower bound on the area-weighted norm of K, from so many products with K and as many with its transpose.
pub fn operator_norm(k: &dyn LinearOperator, products: usize) -> f64 {
    let one = Light { invisible: crate::light::Rgb::ONE, visible: crate::light::Rgb::ZERO };
    let mut x = vec![one; k.areas().len()];
    let mut norm = 0.0f64;
    for _ in 0..products {
        let y = k.apply(&x);
        let (before, after) = (size(k, &x), size(k, &y));
        // Nothing travels, or it grew beyond the numbers.
        if !(before > 0.0 && after > 0.0 && after.is_finite()) {
            break;
        }
        norm = norm.max(after / before);
        let weighted = weigh(&y, |i| k.areas()[i] / after);
        x = weigh(&k.apply_transposed(&weighted), |i| 1.0 / k.areas()[i]);
    }
    norm
}

fn size(k: &dyn LinearOperator, x: &[Light]) -> f64 {
    let squares = x.iter().zip(k.areas()).map(|(l, a)| {
        let halves = [l.invisible, l.visible].map(|h| h.as_dvec3().length_squared());
        a * (halves[0] + halves[1])
    });
    squares.sum::<f64>().sqrt()
}

fn weigh(x: &[Light], weight: impl Fn(usize) -> f64) -> Vec<Light> {
    let scaled = x.iter().enumerate().map(|(i, l)| {
        let w = weight(i) as f32;
        Light { invisible: w * l.invisible, visible: w * l.visible }
    });
    scaled.collect()
}
