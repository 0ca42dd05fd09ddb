//! What is measured of a term `KⁿE`, and the proven bound on everything after it.

use std::f64::consts::PI;

use glam::DVec3;

use crate::light::Light;
use crate::operator::{Operator, Spectrum};

/// Figures of one term of the series.
#[derive(Clone, Copy, Debug, PartialEq)]
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
    /// Proven bound on the norm of the sum of all later terms; none where there is none.
    pub tail_bound: Option<f64>,
}

/// Measures a term; `before` is the norm of the one before it.
pub fn measure(k: &Operator, n: usize, term: &[Light], before: Option<f64>) -> Bounce {
    let power = |half: fn(&Light) -> glam::Vec3| {
        let sum: DVec3 = term
            .iter()
            .zip(k.areas())
            .map(|(l, a)| PI * a * half(l).as_dvec3())
            .sum();
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
        let squared =
            l.invisible.as_dvec3().length_squared() + l.visible.as_dvec3().length_squared();
        sum += a * squared;
        area += a;
    }
    (sum / (6.0 * area)).sqrt()
}

/// Bounds the tail of the series from one term and the vectors that prove the spectral radius below 1.
///
/// With `B x <= lambda x`, lambda < 1, and `term_invisible <= c x`, the invisible halves of all later terms sum to at
/// most `c lambda/(1-lambda) x`, and the visible ones, each `rho F` of the invisible term before, to at most
/// `c/(1-lambda) rho F x`, patch by patch and channel by channel, since F >= 0.
pub struct TailBound {
    lambda: [f64; 3],
    x: Vec<DVec3>,
    /// Norms of x and of `w = rho F x` per channel, as in [`norm`].
    norms: [[f64; 2]; 3],
}

impl TailBound {
    /// `None` where the upper bound on the radius is not below 1.
    pub fn new(k: &Operator, spectrum: &Spectrum) -> Option<TailBound> {
        if spectrum.worst().upper >= 1.0 {
            return None;
        }
        let x: Vec<DVec3> = spectrum.x.iter().map(|x| x.truncate().as_dvec3()).collect();
        let w: Vec<DVec3> = (0..k.len())
            .map(|i| (k.reflectance(i) * spectrum.fx[i].truncate()).as_dvec3())
            .collect();
        let squares = |v: &[DVec3], c: usize| -> f64 {
            let sum: f64 = v.iter().zip(k.areas()).map(|(v, a)| a * v[c] * v[c]).sum();
            sum / (6.0 * k.areas().iter().sum::<f64>())
        };
        Some(TailBound {
            lambda: spectrum.channels.map(|b| b.upper),
            norms: [0, 1, 2].map(|c| [squares(&x, c).sqrt(), squares(&w, c).sqrt()]),
            x,
        })
    }

    /// Bound on the norm of everything after this term; `None` if the term is not 0 somewhere x is.
    pub fn after(&self, term: &[Light]) -> Option<f64> {
        let mut sum = 0.0;
        for c in 0..3 {
            let scale = self.scale(term, c)?;
            let [x, w] = self.norms[c];
            let rest = scale / (1.0 - self.lambda[c]);
            sum += (self.lambda[c] * rest * x).powi(2) + (rest * w).powi(2);
        }
        Some(sum.sqrt())
    }

    /// The smallest c with `|term_invisible| <= c x` in one channel.
    fn scale(&self, term: &[Light], channel: usize) -> Option<f64> {
        let mut scale = 0.0f64;
        for (l, x) in term.iter().zip(&self.x) {
            let value = f64::from(l.invisible[channel].abs());
            if value > 0.0 {
                if x[channel] <= 0.0 {
                    return None;
                }
                scale = scale.max(value / x[channel]);
            }
        }
        Some(scale)
    }
}
