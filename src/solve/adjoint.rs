//! What light on patches comes to after any number of bounces, asked the other way around.
//!
//! ```text
//! <y, (K + K² + ...) d> = <(K + K² + ...)^T y, d>
//! ```
//!
//! One series tells for every d at once how it ends up in y: the importance of each patch's light for what y measures.
//!
//! Not handled: series that diverge; they are cut like all others.

use crate::light::{Light, Rgb};
use crate::operator::LinearOperator;

/// Bounces followed at most.
const MOST: usize = 16;
/// Share of y at which the rest is left out, in sums of the absolute values.
const REST: f32 = 0.02;

/// `(K + K² + ...)^T y` for invisible light, up to the first term below 2 % of y.
///
/// # Panics
/// If y does not have one entry a patch.
pub fn importance(k: &dyn LinearOperator, y: Vec<Rgb>) -> Vec<Rgb> {
    let mut sum = vec![Rgb::ZERO; y.len()];
    if !k.interreflects() {
        return sum;
    }
    let size = |x: &[Light]| -> f32 { x.iter().map(|l| l.invisible.abs().element_sum()).sum() };
    let mut term: Vec<Light> = y.into_iter().map(Light::unseen).collect();
    let least = REST * size(&term);
    for _ in 0..MOST {
        term = k.apply_transposed(&term);
        for (sum, term) in sum.iter_mut().zip(&term) {
            *sum += term.invisible;
        }
        if size(&term) <= least {
            break;
        }
    }
    sum
}
