//! What is measured of a term `KⁿE`.

use std::f64::consts::PI;

use glam::DVec3;

use crate::light::Light;
use crate::operator::LinearOperator;

/// Figures of one term of the series.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Bounce {
    /// Number of reflections.
    pub n: usize,
    /// Power of the visible half per channel, W: `pi sum A_i L_i`.
    pub power: [f64; 3],
    /// Power of the invisible half per channel, W.
    pub power_invisible: [f64; 3],
    /// Area-weighted RMS over patches, channels and halves, W/(m² sr).
    pub norm: f64,
    /// Norm over that of the term before; none for n = 0 or after a zero term.
    pub ratio: Option<f64>,
    /// Proven bound on the norm of the sum of all later terms; none where there is none that says anything.
    pub tail_bound: Option<f64>,
}

/// Measures a term; `before` is the norm of the one before it.
pub fn measure(k: &dyn LinearOperator, n: usize, term: &[Light], before: Option<f64>) -> Bounce {
    let power = |half: fn(&Light) -> glam::Vec3| {
        let sum: DVec3 = term.iter().zip(k.areas()).map(|(l, a)| PI * a * half(l).as_dvec3()).sum();
        sum.to_array()
    };
    let norm = norm(k.areas(), term);
    Bounce {
        n,
        power: power(|l| l.visible),
        power_invisible: power(|l| l.invisible),
        norm,
        ratio: before.filter(|&b| b > 0.0).map(|b| norm / b),
        tail_bound: None,
    }
}

/// Area-weighted RMS over patches, channels and halves: `sqrt(sum A_i |L_i|² / (6 sum A_i))`.
pub fn norm(areas: &[f64], x: &[Light]) -> f64 {
    let (mut sum, mut area) = (0.0, 0.0);
    for (l, a) in x.iter().zip(areas) {
        let squared = l.invisible.as_dvec3().length_squared() + l.visible.as_dvec3().length_squared();
        sum += a * squared;
        area += a;
    }
    (sum / (6.0 * area)).sqrt()
}
