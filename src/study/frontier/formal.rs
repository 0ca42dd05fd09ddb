//! The formal solution beyond the frontier: (I - K) L = E has one, and it is not light.
//!
//! If L >= 0 solved it with radius lambda > 1 and y > 0 the left eigenvector of B, then `y L = y E + lambda y L`, so
//! `y L = -y E/(lambda - 1) < 0`: some patch of every scene whose light reaches everything is negative. Solved by LU
//! ([`direct`]), O(patches³). Not handled: lambda an eigenvalue to rounding, where LU finds I - K singular.

use serde::Serialize;

use crate::light::Light;
use crate::operator::Operator;
use crate::render::memory::most_fitting;
use crate::render::{Prepared, Stored, Unfit};
use crate::solve::direct;

/// The formal solution in figures.
#[derive(Clone, Debug, Serialize)]
pub struct Formal {
    /// L, negative in places.
    #[serde(skip)]
    pub light: Vec<Light>,
    /// The smallest invisible radiance, W/(m² sr).
    pub smallest: f64,
    /// The largest.
    pub largest: f64,
    /// Patches with a negative channel.
    #[serde(rename = "negative_patches")]
    pub negative: usize,
}

/// Checks that the dense solves of a frontier's study fit in `limit` bytes.
///
/// # Errors
/// [`Unfit`] where three matrices of both halves' size do not.
pub fn check_dense(p: &Prepared, limit: f64) -> Result<(), Unfit> {
    // (2 n)² numbers of 8 bytes: I, K, and their difference.
    let bytes = |n: f64| 3.0 * 8.0 * (2.0 * n).powi(2);
    let patches = p.patches.len();
    let fitting = most_fitting(patches, limit, bytes).max(1);
    if bytes(patches as f64) <= limit {
        return Ok(());
    }
    Err(Unfit { patches, stored: Stored::Dense, bytes: bytes(patches as f64), limit, fitting })
}

/// Solves (I - K) L = E by LU; none where that is singular.
pub fn formal(k: &Operator) -> Option<Formal> {
    let light = direct(k)?;
    let least = |l: &Light| l.invisible.min_element().min(l.visible.min_element());
    let smallest = light.iter().map(|l| l.invisible.min_element());
    let largest = light.iter().map(|l| l.invisible.max_element());
    Some(Formal {
        smallest: smallest.fold(f32::INFINITY, f32::min).into(),
        largest: largest.fold(f32::NEG_INFINITY, f32::max).into(),
        negative: light.iter().filter(|l| least(l) < 0.0).count(),
        light,
    })
}
