//! Eight triangles side by side, tested against one ray at a time.
//!
//! The test is that of [`crate::rays::triangle`] to the bit, written as a loop over lanes without branches, which the
//! compiler turns into vector instructions. Where an edge function is 0 the lanes cannot tell, and the exact test is
//! asked instead.
//!
//! Not handled: the hit in full. A block says which lanes are met and about where; the rest is asked of the one
//! triangle that counts; registers of more than eight lanes.

use glam::Vec3A;
use pulp::Simd;

use crate::rays::query::{Label, Query};
use crate::rays::triangle::Triangle;

/// Triangles of a block.
pub(crate) const LANES: usize = 8;

/// A number for each lane.
pub(crate) type Lane<T> = [T; LANES];

/// The key of a lane that is not met.
pub(crate) const MISSED: f32 = f32::MAX;

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

    /// The key of every lane, its place being `first` plus the lane; false if the exact test must be asked for them.
    #[inline(always)]
    pub(crate) fn keys(&self, query: &Query, first: usize) -> (Lane<f32>, bool) {
        self.tell(query, query.end, |t, lane| key(t, first + lane))
    }

    /// The distance of every lane met before `reach`; false if the exact test must be asked for them.
    #[inline(always)]
    pub(crate) fn distances(&self, query: &Query, reach: f32) -> (Lane<f32>, bool) {
        self.tell(query, reach, |t, _| t)
    }

    /// What `tell` makes of the distance of every lane met before `reach`.
    ///
    /// Signs are compared through the product of the least and the greatest edge function: below 0 they differ. Where
    /// it is 0, or so small that it vanishes, the signs are in doubt.
    #[inline(always)]
    fn tell(&self, query: &Query, reach: f32, tell: impl Fn(f32, usize) -> f32) -> (Lane<f32>, bool) {
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
            keys[l] = if met { tell(t, l) } else { MISSED };
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

/// The least of all lanes.
#[inline(always)]
pub(crate) fn least_of(lanes: &Lane<f32>) -> f32 {
    let half: [f32; 4] = std::array::from_fn(|l| least(lanes[l], lanes[l + 4]));
    least(least(half[0], half[2]), least(half[1], half[3]))
}

/// Of each lane `chosen` where the mask is set, else `other`.
///
/// pulp's own `select_f32s` need not be inlined, and where a build without link-time optimisation leaves it a function,
/// the vector instruction within becomes one more call: rays then take half as long again.
#[inline(always)]
pub(crate) fn select<S: Simd>(simd: S, mask: S::m32s, chosen: S::f32s, other: S::f32s) -> S::f32s {
    let [chosen, other] = [chosen, other].map(|lanes| simd.transmute_u32s_f32s(lanes));
    simd.transmute_f32s_u32s(simd.select_u32s(mask, chosen, other))
}

/// The lesser; unlike `f32::min` one instruction, as NaN is not looked after.
#[inline(always)]
pub(crate) fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The greater.
#[inline(always)]
pub(crate) fn most(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
