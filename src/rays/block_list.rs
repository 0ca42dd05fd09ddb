//! The faces of a small scene, eight at a time: boxes of eight blocks of eight triangles, without a hierarchy.
//!
//! One pass finds the blocks whose padded boxes the ray meets, a second tests their triangles. No order is kept: with few
//! blocks, sorting them would cost more than it spares.
//!
//! The passes are compiled once for every level of vector instructions and the level is chosen at run time. Results do
//! not depend on it: Rust never fuses a multiplication with an addition by itself.

use std::array::from_fn;

use pulp::{Arch, Scalar, Simd, WithSimd};

use crate::rays::Hit;
use crate::rays::accelerator::{Label, Query, SAME_PLACE, hit, precedes};
use crate::rays::simd_block::{Block, LANES, Lane, MISSED, PLACES, bits, key, least, least_of, limit, most, place};
use crate::rays::triangle::{Meeting, Triangle};

/// Blocks there can be: a bit of u64 each, and a place for each triangle.
pub(crate) const BLOCKS: usize = PLACES / LANES;

/// Faces in blocks; triangles and labels stand by place, eight to a block.
pub(crate) struct Few {
    arch: Arch,
    boxes: Vec<Boxes>,
    blocks: Vec<Block>,
    triangles: Vec<Triangle>,
    labels: Vec<Label>,
}

/// The boxes of eight blocks: by end (low, high), axis, block. Those of no block are never met.
struct Boxes([[Lane<f32>; 3]; 2]);

impl Few {
    /// Puts clusters of at most [`LANES`] triangles into blocks, at most [`BLOCKS`]; their boxes are padded.
    pub(crate) fn new(clusters: &[Vec<(Triangle, Label)>], pad: f32) -> Self {
        let nothing = (Triangle::NOTHING, Label::NONE);
        let padded = clusters.iter().flat_map(|cluster| {
            let lanes = |lane| cluster.get(lane).copied().unwrap_or(nothing);
            (0..LANES).map(lanes)
        });
        let (triangles, labels) = padded.unzip();
        Few {
            arch: Arch::new(),
            boxes: clusters.chunks(LANES).map(|c| Boxes::new(c, pad)).collect(),
            blocks: clusters.iter().map(|own| Block::new(own)).collect(),
            triangles,
            labels,
        }
    }

    /// The first meeting.
    #[inline]
    pub(crate) fn closest(&self, query: &Query) -> Option<Hit> {
        self.arch.dispatch(Closest(self, query))
    }

    /// Whether there is no meeting at all.
    #[inline]
    pub(crate) fn is_clear(&self, query: &Query) -> bool {
        self.arch.dispatch(IsClear(self, query))
    }

    /// Every meeting, in no order, appended to `out`; or false as soon as `stop` says so of a face.
    #[inline]
    pub(crate) fn all_unless(&self, stop: impl Fn(u32) -> bool, query: &Query, out: &mut Vec<Hit>) -> bool {
        self.arch.dispatch(AllUnless(self, stop, query, out))
    }

    /// A bit for each block whose box the ray meets.
    #[inline(always)]
    fn near<S: Simd>(&self, simd: S, query: &Query) -> u64 {
        let inverse = query.direction.to_array().map(inverse);
        let mut near = 0;
        for (k, boxes) in self.boxes.iter().enumerate() {
            near |= u64::from(boxes.met(simd, query, inverse)) << (LANES * k);
        }
        near
    }

    /// The keys of a block's triangles.
    #[inline(always)]
    fn keys(&self, b: usize, query: &Query) -> Lane<f32> {
        let (keys, sure) = self.blocks[b].keys(query, b * LANES);
        if sure { keys } else { self.exact_keys(b, query) }
    }

    /// The same from the exact test.
    #[cold]
    fn exact_keys(&self, b: usize, query: &Query) -> Lane<f32> {
        from_fn(|lane| {
            let place = b * LANES + lane;
            self.candidate(place, query).map_or(MISSED, |(meeting, _)| key(meeting.t, place))
        })
    }

    /// The meeting with the triangle of a place, if it counts.
    #[inline(always)]
    fn candidate(&self, place: usize, query: &Query) -> Option<(Meeting, Label)> {
        query.candidate(&self.triangles[place], &self.labels[place], query.end)
    }

    #[inline(always)]
    fn hit(&self, place: usize, query: &Query) -> Option<Hit> {
        let (meeting, label) = self.candidate(place, query)?;
        Some(hit(&meeting, &label))
    }

    /// The first meeting where several are close together.
    #[cold]
    fn first_of_several(&self, query: &Query) -> Option<Hit> {
        let met = (0..self.labels.len()).filter_map(|place| self.candidate(place, query));
        let first = met.reduce(|best, next| match precedes(&next, &best) {
            true => next,
            false => best,
        });
        first.map(|(meeting, label)| hit(&meeting, &label))
    }
}

impl Boxes {
    fn new(clusters: &[Vec<(Triangle, Label)>], pad: f32) -> Self {
        let ends = |axis: usize, block: usize| {
            let Some(cluster) = clusters.get(block) else {
                return (f32::NAN, f32::NAN);
            };
            let along = cluster.iter().map(|(triangle, _)| triangle.0[axis]);
            let (low, high) = (f32::INFINITY, f32::NEG_INFINITY);
            along.fold((low, high), |(low, high), corners| {
                let (first, last) = (corners.min_element() - pad, corners.max_element() + pad);
                (low.min(first), high.max(last))
            })
        };
        Boxes([
            from_fn(|axis| from_fn(|block| ends(axis, block).0)),
            from_fn(|axis| from_fn(|block| ends(axis, block).1)),
        ])
    }

    /// A bit for each box the ray meets. The padding is far more than what rounding moves a box by.
    ///
    /// Written in registers: of eight lanes in a row the compiler makes scalars.
    #[inline(always)]
    fn met<S: Simd>(&self, simd: S, query: &Query, inverse: [f32; 3]) -> u32 {
        let origin = query.origin.to_array();
        let start = origin.map(|o| simd.splat_f32s(o));
        let scale = inverse.map(|i| simd.splat_f32s(i));
        let ends = |end: usize, axis: usize| {
            let entry = usize::from(inverse[axis] < 0.0);
            S::as_simd_f32s(&self.0[if end == 0 { entry } else { 1 - entry }][axis]).0
        };
        let (near, far) = ([0, 1, 2].map(|a| ends(0, a)), [0, 1, 2].map(|a| ends(1, a)));
        let (zero, end) = (simd.splat_f32s(0.0), simd.splat_f32s(query.end));
        let missed = simd.splat_f32s(MISSED);
        let mut short = [MISSED; LANES];
        for (r, short) in S::as_mut_simd_f32s(&mut short).0.iter_mut().enumerate() {
            let at = |ends: &[S::f32s], axis: usize| simd.mul_f32s(simd.sub_f32s(ends[r], start[axis]), scale[axis]);
            let least = |a, b| simd.select_f32s(simd.less_than_f32s(a, b), a, b);
            let most = |a, b| simd.select_f32s(simd.less_than_f32s(b, a), a, b);
            let first = most(zero, most(at(near[2], 2), most(at(near[0], 0), at(near[1], 1))));
            let last = least(end, least(at(far[2], 2), least(at(far[0], 0), at(far[1], 1))));
            let met = simd.less_than_or_equal_f32s(first, last);
            *short = simd.select_f32s(met, zero, missed);
        }
        bits(simd, &short, 0.0)
    }
}

/// 1 over a component of a direction, finite.
#[inline(always)]
fn inverse(component: f32) -> f32 {
    1.0 / most(component.abs(), 1e-20).copysign(component)
}

struct Closest<'a>(&'a Few, &'a Query);

impl WithSimd for Closest<'_> {
    type Output = Option<Hit>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Option<Hit> {
        if S::F32_LANES > LANES {
            return self.with_simd(Scalar::new());
        }
        let Closest(few, query) = self;
        let (mut first, mut second) = ([MISSED; LANES], [MISSED; LANES]);
        let mut near = few.near(simd, query);
        while near != 0 {
            let keys = few.keys(near.trailing_zeros() as usize, query);
            near &= near - 1;
            for l in 0..LANES {
                second[l] = least(second[l], most(first[l], keys[l]));
                first[l] = least(first[l], keys[l]);
            }
        }
        let key = least_of(&first);
        if key == MISSED {
            return None;
        }
        let limit = limit(key, SAME_PLACE);
        let alone = bits(simd, &first, limit).is_power_of_two() && bits(simd, &second, limit) == 0;
        match alone {
            true => few.hit(place(key), query),
            false => few.first_of_several(query),
        }
    }
}

struct IsClear<'a>(&'a Few, &'a Query);

impl WithSimd for IsClear<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        if S::F32_LANES > LANES {
            return self.with_simd(Scalar::new());
        }
        let IsClear(few, query) = self;
        let mut near = few.near(simd, query);
        while near != 0 {
            let keys = few.keys(near.trailing_zeros() as usize, query);
            near &= near - 1;
            if least_of(&keys) < MISSED {
                return false;
            }
        }
        true
    }
}

struct AllUnless<'a, F>(&'a Few, F, &'a Query, &'a mut Vec<Hit>);

impl<F: Fn(u32) -> bool> WithSimd for AllUnless<'_, F> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        if S::F32_LANES > LANES {
            return self.with_simd(Scalar::new());
        }
        let AllUnless(few, stop, query, out) = self;
        let mut near = few.near(simd, query);
        while near != 0 {
            let b = near.trailing_zeros() as usize;
            near &= near - 1;
            let mut met = bits(simd, &few.keys(b, query), 0.5 * MISSED);
            while met != 0 {
                let place = b * LANES + met.trailing_zeros() as usize;
                met &= met - 1;
                if stop(few.labels[place].face) {
                    return false;
                }
                out.extend(few.hit(place, query));
            }
        }
        true
    }
}
