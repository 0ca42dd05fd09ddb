//! Eight triangles or eight boxes side by side, tested against one ray at a time.
//!
//! The test of triangles is that of [`crate::rays::triangle`] to the bit, written as a loop over lanes without branches,
//! which the compiler turns into vector instructions. Where an edge function is 0 the lanes cannot decide, and the exact
//! test must. A block gives lanes and distances; the rest of a hit is computed of the one triangle that counts.
//!
//! A ray meets a box where it runs through the slabs of all three axes at once (T. Kay, J. Kajiya, *Ray tracing complex
//! scenes*, 1986). Boxes must be padded by more than rounding moves them: each slab's distances are off by a few units
//! in their last place.
//!
//! Not handled: registers of more than eight lanes.

use std::array::from_fn;

use glam::Vec3A;
use obvhs::aabb::Aabb;
use pulp::Simd;

use crate::rays::lanes::{LANES, Lane, MISSED, least, most, select};
use crate::rays::triangle::{Label, Query, Triangle};

/// Bits of a key that tell the place in place of t's last.
const PLACE_BITS: u32 = 9;

/// Places there are keys for.
pub(crate) const PLACES: usize = 1 << PLACE_BITS;

/// The place's bits within a key.
const PLACE: u32 = (1 << PLACE_BITS) - 1;

/// Corners by axis, then by corner, and the triangles' planes. Empty lanes hold NaN, which meets nothing.
#[repr(align(64))]
pub(crate) struct Block {
    corners: [[Lane<f32>; 3]; 3],
    planes: Lane<u32>,
}

impl Block {
    /// At most [`LANES`] triangles, each with its plane.
    pub(crate) fn new(triangles: &[(Triangle, Label)]) -> Self {
        let mut block = Block { corners: [[[f32::NAN; LANES]; 3]; 3], planes: [0; LANES] };
        for (lane, (triangle, label)) in triangles.iter().enumerate() {
            for (own, along) in block.corners.iter_mut().zip(triangle.0) {
                own[0][lane] = along.x;
                own[1][lane] = along.y;
                own[2][lane] = along.z;
            }
            block.planes[lane] = label.plane;
        }
        block
    }

    /// The triangle of a lane.
    #[inline]
    pub(crate) fn triangle(&self, lane: usize) -> Triangle {
        let along = |axis: &[Lane<f32>; 3]| Vec3A::from_array(axis.each_ref().map(|c| c[lane]));
        Triangle(self.corners.each_ref().map(along))
    }

    /// The plane of a lane's triangle.
    #[inline]
    pub(crate) fn plane(&self, lane: usize) -> u32 {
        self.planes[lane]
    }

    /// The key of every lane, its place being `first` plus the lane; false if only the exact test can decide.
    #[inline(always)]
    pub(crate) fn keys(&self, query: &Query, first: usize) -> (Lane<f32>, bool) {
        self.met(query, query.end, |t, lane| key(t, first + lane))
    }

    /// The distance of every lane met before `reach`; false if only the exact test can decide.
    #[inline(always)]
    pub(crate) fn distances(&self, query: &Query, reach: f32) -> (Lane<f32>, bool) {
        self.met(query, reach, |t, _| t)
    }

    /// What `of` makes of the distance of every lane met before `reach`.
    ///
    /// Signs are compared through the product of the least and the greatest edge function: below 0 they differ. Where
    /// it is 0, or so small that it vanishes, the signs are in doubt.
    #[inline(always)]
    fn met(&self, query: &Query, reach: f32, of: impl Fn(f32, usize) -> f32) -> (Lane<f32>, bool) {
        let (mut keys, mut doubt) = ([MISSED; LANES], [0u32; LANES]);
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
            keys[l] = if met { of(t, l) } else { MISSED };
            doubt[l] = u32::from(signs == 0.0);
        }
        (keys, doubt.into_iter().fold(0, |a, b| a | b) == 0)
    }
}

/// t, its last bits replaced by the place: keys sort by t, and the least one names its triangle.
#[inline(always)]
pub(crate) fn key(t: f32, place: usize) -> f32 {
    f32::from_bits((t.to_bits() & !PLACE) | place as u32)
}

/// The place a key names.
#[inline(always)]
pub(crate) fn place(key: f32) -> usize {
    (key.to_bits() & PLACE) as usize
}

/// The greatest key of any t at most `window` beyond this one's.
#[inline(always)]
pub(crate) fn limit(key_: f32, window: f32) -> f32 {
    let latest = f32::from_bits(key_.to_bits() | PLACE) + window;
    f32::from_bits(latest.to_bits() | PLACE)
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
