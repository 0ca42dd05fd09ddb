//! Notices a diverging series from the light shot so far.
//!
//! Let s be the invisible light that patches have shot after at least one reflection, and r = B s, B = alpha rho F, what they received of
//! it. Where F is reciprocal, A F is symmetric, so B is self-adjoint under `<x, y> = sum A x y / (alpha rho)` and
//!
//! ```text
//! <s, B s> / <s, s>  <=  spectral radius,        whatever s is, in every channel  (Rayleigh).
//! ```
//!
//! Since r = s + unshot - (first bounce), the quotient passes 1 when, weighted by s, more light waits than the
//! emitters once brought: that happens in the end wherever the series diverges, since s turns towards
//! the dominating eigenvector, and never where it converges.
//!
//! What is proof and what is evidence: the inequality is a proof for the exact, reciprocal F. Rays sample F; each
//! shot draws its own columns, and a quotient above 1 is evidence, to within their noise. The upper bound
//! `max r_i / s_i` (Collatz-Wielandt) is a proof for the columns as drawn, and infinite while some patch has not
//! shot. At tau = 0 no check is needed: no column carries more than was sent, so the radius is at most max alpha rho.
//!
//! Not handled: a radius within the noise of 1. Such a run ends undecided at its largest number of shots.

use glam::DVec3;

use super::ledger::Ledger;
use super::shooter::Surfaces;
use crate::operator::Bounds;

/// Bounds on the spectral radius, worst channel, from the light `shot` by every patch after its first reflection.
pub(super) fn bounds(surfaces: &Surfaces, ledger: &Ledger, shot: &[DVec3]) -> Bounds {
    let mut products = DVec3::ZERO;
    let mut squares = DVec3::ZERO;
    let mut upper = 0.0f64;
    for (i, &s) in shot.iter().enumerate() {
        let passed = (surfaces.alpha[i] * surfaces.rho[i]).as_dvec3();
        let incident: DVec3 = ledger.all_incident(i).iter().skip(1).sum();
        for c in (0..3).filter(|&c| passed[c] > 0.0) {
            let r = passed[c] * incident[c];
            products[c] += surfaces.areas[i] * s[c] * r / passed[c];
            squares[c] += surfaces.areas[i] * s[c] * s[c] / passed[c];
            if r > 0.0 {
                upper = upper.max(r / s[c]);
            }
        }
    }
    let quotient = |c: usize| match squares[c] > 0.0 {
        true => products[c] / squares[c],
        false => 0.0,
    };
    let lower = (0..3).map(quotient).fold(0.0, f64::max);
    Bounds {
        lower,
        upper: upper.max(lower),
    }
}
