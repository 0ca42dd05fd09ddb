//! The dense oracle: LU of `I - K`, both halves, for scenes of a few hundred patches.
//!
//! `L = E + (I - K)^-1 K E`, with `K E` as the operator computes it, so that it solves the very system Neumann sums.
//! O((2n)³) per channel. Where the series diverges it still returns the formal solution, which is not light.

use nalgebra::{DMatrix, DVector};

use crate::light::Light;
use crate::operator::{LinearOperator, Operator};

/// Solves `L = E + K L` by LU; `None` where `I - K` is singular.
pub fn direct(k: &Operator) -> Option<Vec<Light>> {
    let n = k.len();
    let first = k.first_bounce();
    let mut light = k.emission().to_vec();
    for c in 0..3 {
        let system = DMatrix::identity(2 * n, 2 * n) - k.dense(c);
        let right = DVector::from_fn(2 * n, |row, _| {
            let l = first[row / 2];
            f64::from(if row % 2 == 0 { l.invisible[c] } else { l.visible[c] })
        });
        let reflected = system.lu().solve(&right)?;
        for (i, l) in light.iter_mut().enumerate() {
            l.invisible[c] += reflected[2 * i] as f32;
            l.visible[c] += reflected[2 * i + 1] as f32;
        }
    }
    Some(light)
}
