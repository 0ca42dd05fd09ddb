//! A bounding volume hierarchy over many faces, and the three ways to walk it.
//!
//! Its leaves are blocks of triangles, its nodes boxes padded by 1e-5 of the scene's diagonal. Otherwise the boxes of axis-aligned
//! meshes are flat, and rounding in the box test could cull what the watertight triangle test would accept.
//!
//! A walk is compiled once for every level of vector instructions and the level is chosen at run time. Results do not depend on
//! it: Rust never fuses a multiplication with an addition by itself.
//!
//! Not handled: registers of more than eight lanes.

use std::ops::Range;

use pulp::{Arch, Scalar, Simd, WithSimd};
use rayon::prelude::*;

use crate::rays::Hit;
use crate::rays::accelerator::{Label, Query, SAME_PLACE, hit, precedes};
use crate::rays::bvh_build::Layout;
use crate::rays::bvh_traversal::Wide;
use crate::rays::simd_block::{Block, LANES, MISSED, bits};
use crate::rays::triangle::{Meeting, Triangle};

/// Ends a walk.
const STOP: f32 = -1.0;

/// A hierarchy, its leaves and their faces, [`LANES`] to a leaf.
pub(crate) struct Many {
    arch: Arch,
    wide: Wide,
    blocks: Vec<Block>,
    faces: Vec<[u32; LANES]>,
}

impl Many {
    /// The hierarchy of a layout; `face` tells what its numbers stand for, `None` of those left out.
    pub(crate) fn new(layout: &Layout, face: impl Fn(u32) -> Option<(Triangle, Label)> + Sync) -> Self {
        let (wide, leaves) = Wide::new(&layout.root);
        let leaf = |range: &Range<usize>| {
            let own = layout.order[range.clone()].iter().filter_map(|&i| face(i));
            let own: Vec<(Triangle, Label)> = own.collect();
            let face = |lane: usize| own.get(lane).map_or(u32::MAX, |(_, label)| label.face);
            (Block::new(&own), std::array::from_fn(face))
        };
        let (blocks, faces) = leaves.par_iter().with_min_len(64).map(leaf).unzip();
        Many { arch: Arch::new(), wide, blocks, faces }
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

    /// Every meeting, in no order, edges counted once for each face, appended to `out`; or false as soon as an opaque face is met.
    #[inline]
    pub(crate) fn all_unless(&self, opaque: impl Fn(u32) -> bool, query: &Query, out: &mut Vec<Hit>) -> bool {
        self.arch.dispatch(AllUnless(self, opaque, query, out))
    }

    /// Tells `meet` of the meetings with a leaf's triangles before `reach`, until it says that they are enough.
    #[inline(always)]
    fn meetings<S: Simd>(
        &self,
        simd: S,
        (leaf, query): (usize, &Query),
        reach: f32,
        mut meet: impl FnMut((Meeting, Label)) -> Enough,
    ) {
        let (distances, sure) = self.blocks[leaf].distances(query, reach);
        let mut met = match sure {
            true => bits(simd, &distances, 0.5 * MISSED),
            false => u32::MAX >> (u32::BITS - LANES as u32),
        };
        while met != 0 {
            let lane = met.trailing_zeros() as usize;
            met &= met - 1;
            if let Some(found) = self.candidate(leaf, lane, query, reach)
                && matches!(meet(found), Enough::Yes)
            {
                return;
            }
        }
    }

    /// The meeting with a triangle, if it is before `reach` and on no plane to skip.
    #[inline(always)]
    fn candidate(&self, leaf: usize, lane: usize, query: &Query, reach: f32) -> Option<(Meeting, Label)> {
        let label = Label { face: self.faces[leaf][lane], plane: self.blocks[leaf].plane(lane) };
        query.candidate(&self.blocks[leaf].triangle(lane), &label, reach)
    }
}

/// Whether further meetings are asked for.
enum Enough {
    No,
    Yes,
}

struct Closest<'a>(&'a Many, &'a Query);

impl WithSimd for Closest<'_> {
    type Output = Option<Hit>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Option<Hit> {
        if S::F32_LANES > LANES {
            return self.with_simd(Scalar::new());
        }
        let Closest(many, query) = self;
        let mut best: Option<(Meeting, Label)> = None;
        many.wide.walk(simd, query, |leaf, mut reach| {
            let window = best.map_or(query.end, |best| best.0.t + SAME_PLACE);
            many.meetings(simd, (leaf, query), window, |found| {
                if best.as_ref().is_none_or(|best| precedes(&found, best)) {
                    reach = found.0.t;
                    best = Some(found);
                }
                Enough::No
            });
            reach
        });
        best.map(|(meeting, label)| hit(&meeting, &label))
    }
}

struct IsClear<'a>(&'a Many, &'a Query);

impl WithSimd for IsClear<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        if S::F32_LANES > LANES {
            return self.with_simd(Scalar::new());
        }
        let IsClear(many, query) = self;
        let mut clear = true;
        many.wide.walk(simd, query, |leaf, reach| {
            many.meetings(simd, (leaf, query), query.end, |_| {
                clear = false;
                Enough::Yes
            });
            if clear { reach } else { STOP }
        });
        clear
    }
}

struct AllUnless<'a, F>(&'a Many, F, &'a Query, &'a mut Vec<Hit>);

impl<F: Fn(u32) -> bool> WithSimd for AllUnless<'_, F> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        if S::F32_LANES > LANES {
            return self.with_simd(Scalar::new());
        }
        let AllUnless(many, opaque, query, out) = self;
        let mut clear = true;
        many.wide.walk(simd, query, |leaf, reach| {
            many.meetings(simd, (leaf, query), query.end, |(meeting, label)| {
                if opaque(label.face) {
                    clear = false;
                    return Enough::Yes;
                }
                out.push(hit(&meeting, &label));
                Enough::No
            });
            if clear { reach } else { STOP }
        });
        clear
    }
}
