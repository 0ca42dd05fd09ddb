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
use crate::rays::simd_block::{Block, LANES, MISSED, bits};
use crate::rays::triangle::{Meeting, Triangle};

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

    /// Tells `meet` of the meetings with a leaf's triangles before `reach`, until it breaks.
    #[inline(always)]
    fn meet_leaf<S: Simd>(
        &self,
        simd: S,
        leaf: usize,
        query: &Query,
        reach: f32,
        mut meet: impl FnMut(Meeting, Label) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let (distances, sure) = self.blocks[leaf].distances(query, reach);
        let all = u32::MAX >> (u32::BITS - LANES as u32);
        let mut met = if sure { bits(simd, &distances, 0.5 * MISSED) } else { all };
        while met != 0 {
            let lane = met.trailing_zeros() as usize;
            met &= met - 1;
            let label = Label { face: self.faces[leaf][lane], plane: self.blocks[leaf].plane(lane) };
            if let Some((meeting, label)) = query.candidate(&self.blocks[leaf].triangle(lane), &label, reach) {
                meet(meeting, label)?;
            }
        }
        ControlFlow::Continue(())
    }
}

impl Faces for Bvh {
    #[inline]
    fn arch(&self) -> Arch {
        self.arch
    }

    #[inline(always)]
    fn first<S: Simd>(&self, simd: S, query: &Query) -> Option<Hit> {
        let mut best: Option<(Meeting, Label)> = None;
        self.nodes.walk(simd, query, |leaf, mut reach| {
            let window = best.map_or(query.end, |best| best.0.t + SAME_PLACE);
            let _ = self.meet_leaf(simd, leaf, query, window, |meeting, label| {
                let found = (meeting, label);
                if best.as_ref().is_none_or(|best| precedes(&found, best)) {
                    reach = meeting.t;
                    best = Some(found);
                }
                ControlFlow::Continue(())
            });
            reach
        });
        best.map(|(meeting, label)| hit(&meeting, &label))
    }

    #[inline(always)]
    fn each<S: Simd>(
        &self,
        simd: S,
        query: &Query,
        mut meet: impl FnMut(Meeting, Label) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let mut flow = ControlFlow::Continue(());
        self.nodes.walk(simd, query, |leaf, reach| {
            flow = self.meet_leaf(simd, leaf, query, query.end, &mut meet);
            if flow.is_break() { STOP } else { reach }
        });
        flow
    }
}
