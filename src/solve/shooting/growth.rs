//! Notices a diverging series from the light shot so far.
//!
//! Let s be the invisible light that patches have shot after at least one reflection, and r = B s, B = alpha rho F,
//! what they received of it. Where F is reciprocal, A F is symmetric, so B is self-adjoint under
//! `<x, y> = sum A x y / (alpha rho)` and
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

use crate::operator::Bounds;
use crate::solve::neumann::{Diverges, Verdict};
use crate::solve::shooting::ledger::{Ledger, Shot};
use crate::solve::shooting::shooter::{Foreknowledge, Surfaces};

/// Watches a run whose convergence is not known beforehand.
pub(crate) struct Growth {
    watched: bool,
    /// Invisible light each patch has shot after its first reflection.
    shot: Vec<DVec3>,
    /// Shots after which to look next.
    next: u64,
    /// Shots after which to give up.
    most: u64,
}

impl Growth {
    /// Nothing shot yet.
    pub fn new(patches: usize, foreknowledge: Foreknowledge, shots_per_patch: u64) -> Growth {
        Growth {
            watched: foreknowledge == Foreknowledge::Unknown,
            shot: vec![DVec3::ZERO; patches],
            next: patches as u64,
            most: shots_per_patch.saturating_mul(patches as u64),
        }
    }

    /// Notes what patch i shoots; light as emitted does not count.
    pub fn add(&mut self, i: usize, shot: &Shot) {
        let reflected = shot.iter().filter(|(n, _)| *n >= 1).map(|(_, l)| *l);
        self.shot[i] += reflected.sum::<DVec3>();
    }

    /// Looks four times a sweep over all patches whether the light shot so far shows growth.
    pub fn look(&mut self, surfaces: &Surfaces, ledger: &Ledger, shots: u64) -> Result<(), Diverges> {
        if !self.watched || shots < self.next {
            return Ok(());
        }
        self.next = shots + (self.shot.len() as u64).div_ceil(4);
        let radius = bounds(surfaces, ledger, &self.shot);
        let verdict = if radius.lower >= 1.0 {
            Verdict::Diverges
        } else if shots >= self.most {
            Verdict::Undecided
        } else {
            return Ok(());
        };
        Err(Diverges::new(surfaces.rho, surfaces.alpha, verdict, radius))
    }
}

/// Bounds on the spectral radius, worst channel, from the light `shot` by every patch after its first reflection.
fn bounds(surfaces: &Surfaces, ledger: &Ledger, shot: &[DVec3]) -> Bounds {
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
    let quotient = |c: usize| if squares[c] > 0.0 { products[c] / squares[c] } else { 0.0 };
    let lower = (0..3).map(quotient).fold(0.0, f64::max);
    Bounds { lower, upper: upper.max(lower) }
}
