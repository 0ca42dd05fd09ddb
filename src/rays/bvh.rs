//! A bounding volume hierarchy over many faces.
//!
//! Its leaves are blocks of triangles, its nodes boxes padded by 1e-5 of the scene's diagonal. Otherwise the boxes of
//! axis-aligned meshes are flat, and rounding in the box test could cull what the watertight triangle test would
//! accept.
//!
//! Not handled: faces that move; a hierarchy is built anew.

use std::ops::{ControlFlow, Range};

use pulp::{Arch, Simd};
use rayon::prelude::*;

use crate::rays::bvh_build::Layout;
use crate::rays::bvh_traversal::WideNodes;
use crate::rays::meetings::Faces;
use crate::rays::query::{Label, Query, SAME_PLACE, hit, precedes};
use crate::rays::ray::Hit;
use crate::rays::simd_block::{Block, LANES, MISSED};
use crate::rays::triangle::{Meeting, Triangle};
use crate::rays::vector_level::{bits, fetch};

/// Ends a walk.
const STOP: f32 = -1.0;

/// A hierarchy, its leaves and their faces, [`LANES`] to a leaf.
pub(crate) struct Bvh {
    arch: Arch,
    nodes: WideNodes,
    blocks: Vec<Block>,
    faces: Vec<[u32; LANES]>,
}

impl Bvh {
    /// The hierarchy of a layout; `face` tells what its numbers stand for, `None` of those left out.
    pub(crate) fn new(layout: &Layout, face: impl Fn(u32) -> Option<(Triangle, Label)> + Sync) -> Self {
        let (nodes, leaves) = WideNodes::new(&layout.root);
        let leaf = |range: &Range<usize>| {
            let own = layout.order[range.clone()].iter().filter_map(|&i| face(i));
            let own: Vec<(Triangle, Label)> = own.collect();
            let face = |lane: usize| own.get(lane).map_or(u32::MAX, |(_, label)| label.face);
            (Block::new(&own), std::array::from_fn(face))
        };
        let (blocks, faces) = leaves.par_iter().with_min_len(64).map(leaf).unzip();
        Bvh { arch: Arch::new(), nodes, blocks, faces }
    }

    /// Tells `meet` of the meetings with a leaf's triangles before `reach` and their lanes, until it breaks.
    #[inline(always)]
    fn meet_leaf<S: Simd>(
        &self,
        simd: S,
        block: &Block,
        query: &Query,
        reach: f32,
        mut meet: impl FnMut(Meeting, usize) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let (distances, sure) = block.distances(query, reach);
        let all = u32::MAX >> (u32::BITS - LANES as u32);
        let mut met = if sure { bits(simd, &distances, 0.5 * MISSED) } else { all };
        while met != 0 {
            let lane = met.trailing_zeros() as usize;
            met &= met - 1;
            if let Some(meeting) = query.candidate(&block.triangle(lane), block.plane(lane), reach) {
                meet(meeting, lane)?;
            }
        }
        ControlFlow::Continue(())
    }

    /// The face of a leaf's lane: it lies apart from what tests read, and only those that count are asked for it.
    #[inline(always)]
    fn face(&self, leaf: usize, lane: usize) -> u32 {
        self.faces[leaf][lane]
    }
}

/// The best meeting so far.
#[derive(Clone, Copy)]
struct Found {
    meeting: Meeting,
    leaf: usize,
    lane: usize,
    plane: u32,
}

impl Found {
    #[inline(always)]
    fn precedes(&self, other: &Found, bvh: &Bvh) -> bool {
        let [own, others] = [self, other].map(|found| (&found.meeting, found.plane));
        let face = |found: &Found| bvh.face(found.leaf, found.lane);
        precedes(own, others, || face(self) < face(other))
    }
}

impl Faces for Bvh {
    #[inline]
    fn arch(&self) -> Arch {
        self.arch
    }

    #[inline(always)]
    fn first<S: Simd>(&self, simd: S, query: &Query) -> Option<Hit> {
        let mut best: Option<Found> = None;
        let soon = |leaf: usize| fetch(simd, &self.blocks[leaf]);
        self.nodes.walk(simd, query, soon, |leaf, mut reach| {
            let window = best.map_or(query.end, |best| best.meeting.t + SAME_PLACE);
            let block = &self.blocks[leaf];
            let _ = self.meet_leaf(simd, block, query, window, |meeting, lane| {
                let found = Found { meeting, leaf, lane, plane: block.plane(lane) };
                if best.as_ref().is_none_or(|best| found.precedes(best, self)) {
                    reach = meeting.t;
                    best = Some(found);
                }
                ControlFlow::Continue(())
            });
            reach
        });
        best.map(|found| hit(&found.meeting, self.face(found.leaf, found.lane)))
    }

    #[inline(always)]
    fn each<S: Simd>(
        &self,
        simd: S,
        query: &Query,
        mut meet: impl FnMut(Meeting, u32) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let mut flow = ControlFlow::Continue(());
        let soon = |leaf: usize| fetch(simd, &self.blocks[leaf]);
        self.nodes.walk(simd, query, soon, |leaf, reach| {
            let tell = |meeting, lane| meet(meeting, self.face(leaf, lane));
            flow = self.meet_leaf(simd, &self.blocks[leaf], query, query.end, tell);
            if flow.is_break() { STOP } else { reach }
        });
        flow
    }

    #[inline(always)]
    fn clear<S: Simd>(&self, simd: S, query: &Query) -> bool {
        let mut clear = true;
        let soon = |leaf: usize| fetch(simd, &self.blocks[leaf]);
        self.nodes.walk(simd, query, soon, |leaf, reach| {
            let block = &self.blocks[leaf];
            let (distances, sure) = block.distances(query, query.end);
            clear = if sure {
                bits(simd, &distances, 0.5 * MISSED) == 0
            } else {
                self.meet_leaf(simd, block, query, query.end, |_, _| ControlFlow::Break(())).is_continue()
            };
            if clear { reach } else { STOP }
        });
        clear
    }
}
