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
use crate::rays::query::{Candidate, Label, Query, SAME_PLACE, hit};
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
        let nodes = WideNodes::new(&layout.nodes);
        let leaf = |range: &Range<usize>| {
            let own = layout.order[range.clone()].iter().filter_map(|&i| face(i));
            let own: Vec<(Triangle, Label)> = own.collect();
            let face = |lane: usize| own.get(lane).map_or(u32::MAX, |(_, label)| label.face);
            (Block::new(&own), std::array::from_fn(face))
        };
        let (blocks, faces) = layout.leaves.par_iter().with_min_len(64).map(leaf).unzip();
        Bvh { arch: Arch::new(), nodes, blocks, faces }
    }

    /// The face of a leaf's lane: it lies apart from what tests read, and only those that count are asked for it.
    #[inline(always)]
    fn face(&self, leaf: usize, lane: usize) -> u32 {
        self.faces[leaf][lane]
    }
}

/// Tells `meet` of the meetings with a block's triangles before `reach` and their lanes, until it breaks.
#[inline(always)]
fn meet_block<S: Simd>(
    simd: S,
    block: &Block,
    query: &Query,
    reach: f32,
    mut meet: impl FnMut(Candidate, usize) -> ControlFlow<()>,
) -> ControlFlow<()> {
    let (distances, sure) = block.distances(query, reach);
    let all = u32::MAX >> (u32::BITS - LANES as u32);
    let mut met = if sure { bits(simd, &distances, 0.5 * MISSED) } else { all };
    while met != 0 {
        let lane = met.trailing_zeros() as usize;
        met &= met - 1;
        if let Some(candidate) = query.candidate(&block.triangle(lane), block.plane(lane), reach) {
            meet(candidate, lane)?;
        }
    }
    ControlFlow::Continue(())
}

/// The best meeting so far.
#[derive(Clone, Copy)]
struct Found {
    candidate: Candidate,
    leaf: usize,
    lane: usize,
}

impl Found {
    #[inline(always)]
    fn precedes(&self, other: &Found, bvh: &Bvh) -> bool {
        let face = |found: &Found| bvh.face(found.leaf, found.lane);
        self.candidate.precedes(&other.candidate, || face(self) < face(other))
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
            let window = best.map_or(query.end, |best| best.candidate.meeting.t + SAME_PLACE);
            let block = &self.blocks[leaf];
            let _ = meet_block(simd, block, query, window, |candidate, lane| {
                let found = Found { candidate, leaf, lane };
                if best.as_ref().is_none_or(|best| found.precedes(best, self)) {
                    reach = candidate.meeting.t;
                    best = Some(found);
                }
                ControlFlow::Continue(())
            });
            reach
        });
        best.map(|found| hit(&found.candidate.meeting, self.face(found.leaf, found.lane)))
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
            let tell = |found: Candidate, lane| meet(found.meeting, self.face(leaf, lane));
            flow = meet_block(simd, &self.blocks[leaf], query, query.end, tell);
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
                meet_block(simd, block, query, query.end, |_, _| ControlFlow::Break(())).is_continue()
            };
            if clear { reach } else { STOP }
        });
        clear
    }
}
