//! L alone, by the Neumann series with its slowest part summed at a stroke: for spectral radii near 1.
//!
//! Late terms turn towards the dominating eigenvector, `t' = K t ~ lambda t`, and what follows is nearly a geometric
//! series (L. A. Lyusternik 1947; Aitken's rule with vectors). So
//!
//! ```text
//! L  <-  L + lambda/(1-lambda) t,     whose residual is   r = (t' - lambda t) / (1 - lambda),   without a product
//! ```
//!
//! with lambda from least squares, channel by channel, and the iteration goes on with r as its term. The step is taken
//! where it at least halves the bound on the rest, so it cannot do harm, and that bound is proved whatever lambda was:
//! `|L - exact| <= (I - K)^-1 K |t|`, the same [`TailBound`] that ends the Neumann series. One product a step; in a
//! furnished room at 0.9, 0.99 and 0.999 of the largest alpha 32, 52 and 66 of them in place of 81, 936 and 11,124.
//!
//! Not handled: the bounces. What is summed at a stroke has no bounce number; [`neumann`](crate::solve::neumann) keeps
//! them apart.

use glam::DVec3;

use crate::light::Light;
use crate::operator::{Bounds, LinearOperator, LitPatches};
use crate::solve::neumann::{Diverges, Settings, Verdict, norm, refuse, verdict_on_lit};
use crate::solve::tail::TailBound;

/// L, and what it took.
#[derive(Clone, Debug)]
pub struct Extrapolated {
    /// `L`, both halves, per patch.
    pub light: Vec<Light>,
    /// Products with K, that with E included.
    pub products: usize,
    /// Times that the rest of a series was summed at a stroke.
    pub strokes: usize,
    /// Proved bound on the norm of what is missing.
    pub rest: f64,
    /// How the series behaves.
    pub verdict: Verdict,
    /// Proved bounds on the spectral radius; both 0 where the series ends.
    pub radius: Bounds,
}

/// Solves `L = E + K L` to the requested bound on the rest, a share of the reflected light's norm; `settings.max_terms`
/// bounds the products.
///
/// # Errors
/// [`Diverges`] where the spectral radius is not proved to be below 1.
pub fn extrapolated(k: &dyn LinearOperator, settings: &Settings) -> Result<Extrapolated, Diverges> {
    let k = &LitPatches::of(k);
    let (verdict, spectrum) = verdict_on_lit(k);
    let tail = spectrum.as_ref().and_then(|s| TailBound::new(k, s));
    if matches!(verdict, Verdict::Diverges | Verdict::Undecided) {
        return Err(refuse(k, verdict, spectrum.as_ref()));
    }
    let radius = spectrum.as_ref().map(|s| s.worst()).unwrap_or_default();
    let bound = |term: &[Light]| match &tail {
        Some(tail) => tail.after(term).unwrap_or(f64::INFINITY),
        None => 0.0,
    };
    let mut term = k.first_bounce();
    // Reflected light only, until the end.
    let rest = bound(&term);
    let mut found = Extrapolated { light: term.clone(), products: 1, strokes: 0, rest, verdict, radius };
    let wanted = |found: &Extrapolated| settings.tolerance * norm(k.areas(), &found.light);
    while found.rest > wanted(&found) && found.products < settings.max_terms {
        let next = k.apply(&term);
        found.products += 1;
        let lambda = growth(k.areas(), &term, &next);
        let residual = combined(&next, &term, lambda.map(|l| [1.0 / (1.0 - l), -l / (1.0 - l)]));
        let plain = bound(&next);
        let stroke = bound(&residual);
        if stroke < 0.5 * plain {
            let geometric = combined(&next, &term, lambda.map(|l| [0.0, l / (1.0 - l)]));
            found.light = sum(&found.light, &geometric);
            found.strokes += 1;
            (term, found.rest) = (residual, stroke);
        } else {
            (term, found.rest) = (next, plain);
        }
        found.light = sum(&found.light, &term);
    }
    found.light = sum(k.emission(), &found.light);
    Ok(found)
}

fn sum(a: &[Light], b: &[Light]) -> Vec<Light> {
    combined(a, b, [[1.0, 1.0]; 3])
}

/// `f a + g b`, with f and g of each channel.
fn combined(a: &[Light], b: &[Light], factors: [[f64; 2]; 3]) -> Vec<Light> {
    let [f, g] = [0, 1].map(|k| DVec3::from_array(factors.map(|pair| pair[k])));
    let mix = |a: glam::Vec3, b: glam::Vec3| (f * a.as_dvec3() + g * b.as_dvec3()).as_vec3();
    let pairs = a.iter().zip(b);
    pairs.map(|(a, b)| Light { invisible: mix(a.invisible, b.invisible), visible: mix(a.visible, b.visible) }).collect()
}

/// The lambda of each channel that brings `next - lambda term` nearest to 0, invisible halves; kept below 1.
fn growth(areas: &[f64], term: &[Light], next: &[Light]) -> [f64; 3] {
    let (mut products, mut squares) = (DVec3::ZERO, DVec3::ZERO);
    for ((t, n), a) in term.iter().zip(next).zip(areas) {
        let (t, n) = (t.invisible.as_dvec3(), n.invisible.as_dvec3());
        products += *a * t * n;
        squares += *a * t * t;
    }
    [0, 1, 2].map(|c| if squares[c] > 0.0 { (products[c] / squares[c]).clamp(0.0, 1.0 - 1e-6) } else { 0.0 })
}
