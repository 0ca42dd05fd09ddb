//! The norm of K: how much a single bounce can enlarge light, which may exceed the spectral radius, since K is not
//! normal.
//!
//! ```text
//! norm(K) = max ‖Kx‖ / ‖x‖,   ‖x‖² = sum A_i |x_i|²,   by the power iteration of A^-1 K^T A K
//! ```
//!
//! B = alpha rho F is self-adjoint under the weights A/(alpha rho) where F is reciprocal, not under A: light on dark
//! patches weighs little there. Not handled: an upper bound; the iteration's quotient is a lower bound that rises to
//! the norm.

use crate::light::Light;
use crate::operator::linear::LinearOperator;

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
