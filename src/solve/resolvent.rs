//! The resolvent applied to ones: a bound on all later terms by the largest patch of one.
//!
//! Where a few patches keep light to themselves (a corner whose rays meet each other) lambda is that of these few, and
//! the bound is many times too large for all others. There the resolvent itself, applied to ones, is the better
//! measure:
//!
//! ```text
//! z = 1 + B 1 + ... + B^m 1 + c/(1-lambda) y,     B^(m+1) 1 <= c y       z >= 1 + B 1 + B² 1 + ...
//! ```
//!
//! so that if no patch of the term exceeds g, all later terms sum to at most `g (z - 1)`, the visible halves to
//! `g rho F z`.
//!
//! Not handled: radii that are not proved to be below 1.

use glam::Vec4;

use crate::light::{Light, Rgb};
use crate::operator::{LinearOperator, Spectrum};

/// Products with B that z may take, and the size of its last term that ends it.
const MOST_ONES: usize = 64;
const SMALL: f32 = 1e-4;

/// z of all channels; infinite where nothing is proved.
#[derive(Default)]
pub(crate) struct Resolvent {
    /// z less the ones.
    pub rest: Vec<Vec4>,
    /// `rho F z`.
    pub seen: Vec<Vec4>,
    /// Norms of both in each channel.
    pub norms: [[f64; 2]; 3],
}

impl Resolvent {
    /// z, from products with B and a bound on what follows the last, which `after` gives patch by patch.
    pub fn new(k: &dyn LinearOperator, b: &[Vec4], after: impl Fn(&[Light]) -> Option<Vec<Light>>) -> Resolvent {
        let mut term: Vec<Vec4> = b.iter().map(support).collect();
        let mut rest = vec![Vec4::ZERO; b.len()];
        for _ in 0..MOST_ONES {
            term = scaled(&k.incident(&term), b);
            for (sum, t) in rest.iter_mut().zip(&term) {
                *sum += *t;
            }
            if term.iter().all(|t| t.max_element() <= SMALL) {
                break;
            }
        }
        // Each product is off by its rounding at the most, and so is each sum.
        let wide = (1.0 + 2.0 * MOST_ONES as f64 * Spectrum::ROUNDING) as f32;
        let last: Vec<Light> = term.iter().map(|t| Light::unseen(wide * t.truncate())).collect();
        let field = after(&last);
        let left = |i: usize| match &field {
            Some(field) => field[i].invisible,
            None => Rgb::INFINITY,
        };
        for (i, sum) in rest.iter_mut().enumerate() {
            *sum = wide * *sum + left(i).extend(0.0);
        }
        let whole: Vec<Vec4> = rest.iter().zip(b).map(|(r, b)| *r + support(b)).collect();
        let seen: Vec<Vec4> = k.incident(&whole);
        let rho = k.reflectances().iter();
        let seen: Vec<Vec4> = seen.iter().zip(rho).map(|(f, r)| wide * *f * r.extend(0.0)).collect();
        let areas = k.areas();
        let norm = |v: &[Vec4], c: usize| -> f64 {
            let squares = v.iter().zip(areas).map(|(v, a)| a * f64::from(v[c]).powi(2));
            (squares.sum::<f64>() / (6.0 * areas.iter().sum::<f64>())).sqrt()
        };
        Resolvent { norms: [0, 1, 2].map(|c| [norm(&rest, c), norm(&seen, c)]), rest, seen }
    }
}

/// 1 where alpha rho is above 0.
pub(crate) fn support(b: &Vec4) -> Vec4 {
    Vec4::select(b.cmpgt(Vec4::ZERO), Vec4::ONE, Vec4::ZERO)
}

/// `x_i b_i` for every patch.
pub(crate) fn scaled(x: &[Vec4], b: &[Vec4]) -> Vec<Vec4> {
    x.iter().zip(b).map(|(x, b)| *x * *b).collect()
}
