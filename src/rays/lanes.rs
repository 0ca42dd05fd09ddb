//! Eight numbers side by side, in vector registers: what pulp has no name for, and what it does not inline.
//!
//! Results do not depend on the level of instructions: where it lacks one, others take its place or nothing is done.
//!
//! Not handled: registers of more than eight lanes.

use pulp::Simd;

/// Triangles of a block, boxes of a node.
pub(crate) const LANES: usize = 8;

/// A number for each lane.
pub(crate) type Lane<T> = [T; LANES];

/// The distance of a lane that is not met.
pub(crate) const MISSED: f32 = f32::MAX;

/// A bit for each lane whose number is at most `limit`.
#[inline(always)]
pub(crate) fn bits<S: Simd>(simd: S, numbers: &Lane<f32>, limit: f32) -> u32 {
    #[cfg(target_arch = "x86_64")]
    if let Some(avx2) = x86::avx2(simd) {
        return x86::bits(avx2, numbers, limit);
    }
    let met = S::as_simd_f32s(numbers).0.iter().zip(S::as_simd_f32s(&BIT).0).map(|(numbers, bit)| {
        let met = simd.less_than_or_equal_f32s(*numbers, simd.splat_f32s(limit));
        // Sums of different powers of two: exact, in any order.
        simd.reduce_sum_f32s(select(simd, met, *bit, simd.splat_f32s(0.0)))
    });
    met.sum::<f32>() as u32
}

/// The bit of each lane.
const BIT: Lane<f32> = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0];

/// Prefetches what is likely to be read soon: a ray in a large tree waits for memory half of its time.
#[inline(always)]
pub(crate) fn prefetch<S: Simd, T>(simd: S, soon: &T) {
    #[cfg(target_arch = "x86_64")]
    if let Some(avx2) = x86::avx2(simd) {
        x86::prefetch(avx2, soon);
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (simd, soon);
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

/// The greater, as [`least`].
#[inline(always)]
pub(crate) fn most(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::any::Any;

    use pulp::Simd;
    use pulp::bytemuck::cast;
    use pulp::x86::V3;

    use crate::rays::lanes::Lane;

    /// Bytes that come at once.
    const LINE: usize = 64;

    /// The instructions of AVX2, where the level has them.
    #[inline(always)]
    pub(super) fn avx2<S: Simd>(simd: S) -> Option<V3> {
        (&simd as &dyn Any).downcast_ref::<V3>().copied()
    }

    #[inline(always)]
    pub(super) fn bits(avx2: V3, numbers: &Lane<f32>, limit: f32) -> u32 {
        const AT_MOST: i32 = 2;
        let met = avx2.avx._mm256_cmp_ps::<AT_MOST>(cast(*numbers), avx2.avx._mm256_set1_ps(limit));
        avx2.avx._mm256_movemask_ps(met) as u32
    }

    #[inline(always)]
    pub(super) fn prefetch<T>(avx2: V3, soon: &T) {
        const ALL_LEVELS: i32 = 3;
        let start = std::ptr::from_ref(soon).cast::<i8>();
        for line in (0..size_of::<T>()).step_by(LINE) {
            avx2.sse._mm_prefetch::<ALL_LEVELS>(start.wrapping_add(line));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pulp::{Arch, Scalar, WithSimd};

    struct Bits<'a>(&'a Lane<f32>, f32);

    impl WithSimd for Bits<'_> {
        type Output = u32;

        fn with_simd<S: Simd>(self, simd: S) -> u32 {
            bits(simd, self.0, self.1)
        }
    }

    #[test]
    fn every_level_finds_the_lanes_at_most_the_limit() {
        let numbers = [1.0, f32::MAX, 2.0, f32::NAN, -0.0, 2.5, f32::INFINITY, 2.0];
        let expected = 0b1001_0101;
        assert_eq!(bits(Scalar::new(), &numbers, 2.0), expected);
        assert_eq!(Arch::new().dispatch(Bits(&numbers, 2.0)), expected);
    }
}
