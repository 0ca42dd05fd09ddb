//! Eight boxes side by side, tested against one ray at a time.
//!
//! A ray meets a box where it runs through the slabs of all three axes at once (T. Kay, J. Kajiya, *Ray tracing complex
//! scenes*, 1986). Boxes must be padded by more than rounding moves them: each slab's distances are off by a few units
//! in their last place.
//!
//! Not handled: what is in the boxes.

use obvhs::aabb::Aabb;
use std::array::from_fn;

use pulp::Simd;

use crate::rays::query::Query;
use crate::rays::simd_block::{LANES, Lane, MISSED, most, select};

/// The boxes' ends by end (low, high), axis and box.
#[repr(align(64))]
pub(crate) struct BoxBlock {
    ends: [[Lane<f32>; 3]; 2],
}

impl BoxBlock {
    /// The boxes by number; empty ones are never met.
    pub(crate) fn new(bounds: impl Fn(usize) -> Aabb) -> BoxBlock {
        BoxBlock {
            ends: [from_fn(|axis| from_fn(|k| bounds(k).min[axis])), from_fn(|axis| from_fn(|k| bounds(k).max[axis]))],
        }
    }
}

/// What the box test needs of a ray, spread over registers.
pub(crate) struct BoxRay<S: Simd> {
    start: [S::f32s; 3],
    inverse: [S::f32s; 3],
    /// Which end of a box the ray meets first, by axis.
    entry: [usize; 3],
}

impl<S: Simd> BoxRay<S> {
    /// Spreads a ray's start and inverse direction over registers.
    #[inline(always)]
    pub(crate) fn new(simd: S, query: &Query) -> Self {
        let inverse = query.direction.to_array().map(inverse);
        BoxRay {
            start: query.origin.to_array().map(|o| simd.splat_f32s(o)),
            inverse: inverse.map(|i| simd.splat_f32s(i)),
            entry: inverse.map(|i| usize::from(i < 0.0)),
        }
    }

    /// Where the ray enters each box, at least 0; [`MISSED`] where it does not within its reach.
    ///
    /// Written in registers: of eight lanes in a row the compiler makes scalars.
    #[inline(always)]
    pub(crate) fn distances(&self, simd: S, boxes: &BoxBlock, reach: f32) -> Lane<f32> {
        let lanes = |end: usize, axis: usize| S::as_simd_f32s(&boxes.ends[end][axis]).0;
        let near: [_; 3] = from_fn(|axis| lanes(self.entry[axis], axis));
        let far: [_; 3] = from_fn(|axis| lanes(1 - self.entry[axis], axis));
        let (zero, reach) = (simd.splat_f32s(0.0), simd.splat_f32s(reach));
        let missed = simd.splat_f32s(MISSED);
        let least = |a, b| simd.min_f32s(a, b);
        let most = |a, b| simd.max_f32s(a, b);
        let mut found = [MISSED; LANES];
        for (r, found) in S::as_mut_simd_f32s(&mut found).0.iter_mut().enumerate() {
            let at = |ends: &[S::f32s], axis: usize| {
                simd.mul_f32s(simd.sub_f32s(ends[r], self.start[axis]), self.inverse[axis])
            };
            let first = most(most(most(at(near[0], 0), at(near[1], 1)), at(near[2], 2)), zero);
            let last = least(least(at(far[0], 0), at(far[1], 1)), at(far[2], 2));
            let met = simd.less_than_or_equal_f32s(first, least(last, reach));
            *found = select(simd, met, first, missed);
        }
        found
    }
}

/// 1 over a component of a direction, finite.
#[inline(always)]
fn inverse(component: f32) -> f32 {
    1.0 / most(component.abs(), 1e-20).copysign(component)
}
