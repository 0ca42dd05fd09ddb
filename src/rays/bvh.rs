//! A bounding volume hierarchy over many faces: nodes of eight boxes, leaves of eight triangles.
//!
//! One pass of vector instructions tests the eight boxes of a node. Those met are walked from near to far, and boxes
//! that begin beyond the remaining reach are passed over. Boxes are padded by 1e-5 of the scene's diagonal: those of
//! axis-aligned meshes would be flat, and rounding in the box test could cull what the watertight triangle test
//! accepts.
//!
//! Not handled: faces that move; a hierarchy is built anew.

use std::array::from_fn;
use std::ops::{ControlFlow, Range};

use obvhs::aabb::Aabb;
use pulp::{Arch, Simd};
use rayon::prelude::*;

use crate::rays::blocks::{Block, BoxBlock, BoxRay};
use crate::rays::bvh_build::{BRANCHES, LEAF, Layout};
use crate::rays::lanes::{LANES, Lane, MISSED, bits, prefetch};
use crate::rays::meetings::Faces;
use crate::rays::triangle::{Candidate, Hit, Label, Meeting, Query, SAME_PLACE, Triangle};

/// Ends a walk.
const STOP: f32 = -1.0;

/// A hierarchy, its leaves and their faces, [`LANES`] to a leaf.
pub(crate) struct Bvh {
    arch: Arch,
    /// The root first.
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    faces: Vec<[u32; LANES]>,
}

impl Bvh {
    /// The hierarchy of a layout; `face` maps its numbers to triangles, those left out to `None`.
    pub(crate) fn new(layout: &Layout, face: impl Fn(u32) -> Option<(Triangle, Label)> + Sync) -> Self {
        let nodes = layout.nodes.iter().map(|branches| Node::new(branches)).collect();
        let leaf = |range: &Range<usize>| {
            let own = layout.order[range.clone()].iter().filter_map(|&i| face(i));
            Block::new(&own.collect::<Vec<_>>())
        };
        let (blocks, faces) = layout.leaves.par_iter().with_min_len(64).map(leaf).unzip();
        Bvh { arch: Arch::new(), nodes, blocks, faces }
    }

    /// The face of a leaf's lane. Faces lie apart from what the tests read, and are read of meetings that count.
    #[inline(always)]
    fn face(&self, leaf: usize, lane: usize) -> u32 {
        self.faces[leaf][lane]
    }

    /// Visits the leaves that the ray meets within its reach, with the remaining reach: `visit` returns what remains
    /// after the leaf; [`STOP`] ends the walk.
    #[inline(always)]
    fn walk<S: Simd>(&self, simd: S, query: &Query, mut visit: impl FnMut(usize, f32) -> f32) {
        let ahead = |branch: u32| match branch & LEAF {
            0 => prefetch(simd, &self.nodes[branch as usize]),
            _ => prefetch(simd, &self.blocks[(branch & !LEAF) as usize]),
        };
        let ray = BoxRay::new(simd, query);
        let mut stack = Stack::new();
        let (mut next, mut reach) = (0, query.end);
        loop {
            if next & LEAF == 0 {
                let node = &self.nodes[next as usize];
                let near = ray.distances(simd, &node.boxes, reach);
                let met = bits(simd, &near, 0.5 * MISSED);
                if met != 0 {
                    next = stack.push_met(node, &near, met, ahead);
                    continue;
                }
            } else {
                reach = visit((next & !LEAF) as usize, reach);
                if reach < 0.0 {
                    return;
                }
            }
            match stack.pop(reach) {
                Some(branch) => next = branch,
                None => return,
            }
        }
    }
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
        self.walk(simd, query, |leaf, mut reach| {
            let window = best.map_or(query.end, |best| best.candidate.meeting.t + SAME_PLACE);
            let _ = self.blocks[leaf].meet(simd, query, window, |candidate, lane| {
                let found = Found { candidate, leaf, lane };
                if best.as_ref().is_none_or(|best| found.precedes(best, self)) {
                    reach = candidate.meeting.t;
                    best = Some(found);
                }
                ControlFlow::Continue(())
            });
            reach
        });
        best.map(|found| found.candidate.meeting.hit(self.face(found.leaf, found.lane)))
    }

    #[inline(always)]
    fn each<S: Simd>(
        &self,
        simd: S,
        query: &Query,
        mut meet: impl FnMut(Meeting, u32) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let mut flow = ControlFlow::Continue(());
        self.walk(simd, query, |leaf, reach| {
            let met = |found: Candidate, lane| meet(found.meeting, self.face(leaf, lane));
            flow = self.blocks[leaf].meet(simd, query, query.end, met);
            if flow.is_break() { STOP } else { reach }
        });
        flow
    }

    #[inline(always)]
    fn clear<S: Simd>(&self, simd: S, query: &Query) -> bool {
        let mut clear = true;
        self.walk(simd, query, |leaf, reach| {
            clear = self.blocks[leaf].is_clear(simd, query);
            if clear { reach } else { STOP }
        });
        clear
    }
}

/// Branches that the stack holds without an allocation.
const FIXED: usize = 64;

/// Eight boxes and what they hold.
#[repr(align(64))]
struct Node {
    boxes: BoxBlock,
    branches: [u32; BRANCHES],
}

impl Node {
    fn new(branches: &[(Aabb, u32)]) -> Node {
        Node {
            boxes: BoxBlock::new(|k| branches.get(k).map_or(Aabb::INVALID, |b| b.0)),
            branches: from_fn(|k| branches.get(k).map_or(0, |b| b.1)),
        }
    }
}

/// The branches still to be visited, the nearest of each node on top: distance in the high half, number in the low one.
struct Stack {
    fixed: [u64; FIXED],
    count: usize,
    /// Those beyond `fixed`, of the deepest trees.
    beyond: Vec<u64>,
}

impl Stack {
    #[inline(always)]
    fn new() -> Self {
        Stack { fixed: [0; FIXED], count: 0, beyond: Vec::new() }
    }

    /// Pushes all branches met but the nearest, which is returned; calls `ahead` with each.
    #[inline(always)]
    fn push_met(&mut self, node: &Node, near: &Lane<f32>, mut met: u32, ahead: impl Fn(u32)) -> u32 {
        // Without its sign a zero sorts as the least number, whichever zero it is.
        let key = |k: usize| near[k].abs().to_bits();
        let entry = |k: usize| {
            ahead(node.branches[k]);
            u64::from(key(k)) << 32 | u64::from(node.branches[k])
        };
        let mut nearest = entry(met.trailing_zeros() as usize % LANES);
        let floor = self.count;
        met &= met - 1;
        while met != 0 {
            let other = entry(met.trailing_zeros() as usize % LANES);
            met &= met - 1;
            self.insert(nearest.max(other), floor);
            nearest = nearest.min(other);
        }
        nearest as u32
    }

    /// Puts a branch in its place among those above `floor`.
    #[inline(always)]
    fn insert(&mut self, entry: u64, floor: usize) {
        if self.count == FIXED {
            self.beyond.push(entry);
            return;
        }
        let mut at = self.count;
        while at > floor && self.fixed[at - 1] < entry {
            self.fixed[at] = self.fixed[at - 1];
            at -= 1;
        }
        self.fixed[at] = entry;
        self.count += 1;
    }

    /// Pops branches until one begins within reach.
    #[inline(always)]
    fn pop(&mut self, reach: f32) -> Option<u32> {
        let within = |entry: u64| f32::from_bits((entry >> 32) as u32) <= reach;
        while let Some(entry) = self.beyond.pop() {
            if within(entry) {
                return Some(entry as u32);
            }
        }
        while self.count > 0 {
            self.count -= 1;
            let entry = self.fixed[self.count % FIXED];
            if within(entry) {
                return Some(entry as u32);
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn branches_beyond_the_fixed_places_are_kept() {
        let mut stack = Stack::new();
        for k in 0..3 * FIXED as u64 {
            stack.insert(k, 0);
        }
        let mut found: Vec<u32> = std::iter::from_fn(|| stack.pop(1.0)).collect();
        found.sort_unstable();
        assert!(found.into_iter().eq(0..3 * FIXED as u32));
    }

    #[test]
    fn the_nearest_of_a_node_is_walked_first_and_what_is_out_of_reach_is_not() {
        let near = [3.0, MISSED, 1.0, MISSED, 4.0, 2.0, MISSED, 0.0];
        let bounds = Aabb::INVALID;
        let node = Node::new(&from_fn::<_, 8, _>(|k| (bounds, k as u32)));
        let mut stack = Stack::new();
        assert_eq!(stack.push_met(&node, &near, 0b1011_0101, |_| ()), 7);
        let rest: Vec<u32> = std::iter::from_fn(|| stack.pop(3.5)).collect();
        assert_eq!(rest, [2, 5, 0]);
    }
}
