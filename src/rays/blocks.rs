//! Eight triangles or eight boxes side by side, tested against one ray at a time.
//!
//! The test of triangles is that of [`crate::rays::triangle`] to the bit, written as a loop over lanes without
//! branches, which the compiler turns into vector instructions. Where an edge function is 0 the lanes cannot decide,
//! and the exact test must. A block gives lanes and distances; the rest of a hit is computed of the one triangle that
//! counts.
//!
//! A ray meets a box where it runs through the slabs of all three axes at once (T. Kay, J. Kajiya, *Ray tracing complex
//! scenes*, 1986). Boxes must be padded by more than rounding moves them: each slab's distances are off by a few units
//! in their last place.
//!
//! Not handled: registers of more than eight lanes.

use std::array::from_fn;
use std::ops::ControlFlow;

use glam::Vec3A;
use obvhs::aabb::Aabb;
use pulp::Simd;

use crate::rays::lanes::{LANES, Lane, MISSED, bits, least, most, select};
use crate::rays::triangle::{Candidate, Label, Query, Triangle};

/// Corners by axis, then by corner, and the triangles' planes. Empty lanes hold NaN, which meets nothing.
#[repr(align(64))]
pub(crate) struct Block {
    corners: [[Lane<f32>; 3]; 3],
    planes: Lane<u32>,
}

impl Block {
    /// A block of at most [`LANES`] triangles, and their faces by lane.
    pub(crate) fn new(triangles: &[(Triangle, Label)]) -> (Block, [u32; LANES]) {
        let mut block = Block { corners: [[[f32::NAN; LANES]; 3]; 3], planes: [0; LANES] };
        for (lane, (triangle, label)) in triangles.iter().enumerate() {
            for (own, along) in block.corners.iter_mut().zip(triangle.0) {
                own[0][lane] = along.x;
                own[1][lane] = along.y;
                own[2][lane] = along.z;
            }
            block.planes[lane] = label.plane;
        }
        (block, from_fn(|lane| triangles.get(lane).map_or(u32::MAX, |(_, label)| label.face)))
    }

    /// The distance of every lane met before `reach`, else [`MISSED`]; false if only the exact test can decide.
    ///
    /// Signs are compared through the product of the least and the greatest edge function: below 0 they differ. Where
    /// it is 0, or so small that it vanishes, the signs are in doubt.
    #[inline(always)]
    pub(crate) fn distances(&self, query: &Query, reach: f32) -> (Lane<f32>, bool) {
        let (mut distances, mut doubt) = ([MISSED; LANES], [0u32; LANES]);
        let shear = &query.shear;
        let [x, y, z] = shear.axes.map(|axis| &self.corners[axis]);
        let [ox, oy, oz] = shear.origin;
        let [sx, sy, sz] = shear.slope;
        for l in 0..LANES {
            // Shear the corners a, b, c.
            let (az, bz, cz) = (z[0][l] - oz, z[1][l] - oz, z[2][l] - oz);
            let (ax, ay) = ((x[0][l] - ox) + az * sx, (y[0][l] - oy) + az * sy);
            let (bx, by) = ((x[1][l] - ox) + bz * sx, (y[1][l] - oy) + bz * sy);
            let (cx, cy) = ((x[2][l] - ox) + cz * sx, (y[2][l] - oy) + cz * sy);
            // Compute the edge functions of bc, ca, ab.
            let (a, b, c) = (by * cx - cy * bx, cy * ax - ay * cx, ay * bx - by * ax);
            let signs = least(least(a, b), c) * most(most(a, b), c);
            let t = (a * (az * sz) + b * (bz * sz) + c * (cz * sz)) * (1.0 / (a + b + c));
            // Keep what counts.
            let plane = self.planes[l];
            let skipped = (plane == query.skip[0]) | (plane == query.skip[1]);
            let met = (signs > 0.0) & (t > 0.0) & (t < reach) & !skipped;
            distances[l] = if met { t } else { MISSED };
            doubt[l] = u32::from(signs == 0.0);
        }
        (distances, doubt.into_iter().fold(0, |a, b| a | b) == 0)
    }

    /// The meeting with the triangle of a lane, if it counts and is before `reach`.
    #[inline(always)]
    pub(crate) fn candidate(&self, query: &Query, lane: usize, reach: f32) -> Option<Candidate> {
        let along = |axis: &[Lane<f32>; 3]| Vec3A::from_array(axis.each_ref().map(|c| c[lane]));
        query.candidate(&Triangle(self.corners.each_ref().map(along)), self.planes[lane], reach)
    }

    /// Calls `meet` with the meetings before `reach` and their lanes, until it breaks.
    #[inline(always)]
    pub(crate) fn meet<S: Simd>(
        &self,
        simd: S,
        query: &Query,
        reach: f32,
        mut meet: impl FnMut(Candidate, usize) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let (distances, sure) = self.distances(query, reach);
        let all = u32::MAX >> (u32::BITS - LANES as u32);
        let mut met = if sure { bits(simd, &distances, 0.5 * MISSED) } else { all };
        while met != 0 {
            let lane = met.trailing_zeros() as usize;
            met &= met - 1;
            if let Some(candidate) = self.candidate(query, lane, reach) {
                meet(candidate, lane)?;
            }
        }
        ControlFlow::Continue(())
    }

    /// Whether there is no meeting.
    #[inline(always)]
    pub(crate) fn is_clear<S: Simd>(&self, simd: S, query: &Query) -> bool {
        let (distances, sure) = self.distances(query, query.end);
        if sure {
            bits(simd, &distances, 0.5 * MISSED) == 0
        } else {
            (0..LANES).all(|lane| self.candidate(query, lane, query.end).is_none())
        }
    }
}

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
