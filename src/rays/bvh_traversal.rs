//! A tree of boxes, eight to a node, and the walk of a ray through it from near to far.
//!
//! One pass of vector instructions tests the eight boxes of a node. Those met are walked in order of their distance, and
//! boxes that begin behind the reach that is left are passed over.
//!
//! Boxes must be padded by more than rounding moves them: a box is met where its slabs' distances say so, each off by a few
//! units in its last place.
//!
//! Not handled: what is in the leaves.

use std::array::from_fn;
use std::ops::Range;

use pulp::Simd;

use crate::rays::accelerator::Query;
use crate::rays::bounds::Bounds;
use crate::rays::bvh_build::{BRANCHES, Branch};
use crate::rays::simd_block::{LANES, Lane, MISSED, bits, most};

/// Marks the number of a leaf among those of nodes.
const LEAF: u32 = 1 << 31;

/// Branches put off without asking for memory.
const FIXED: usize = 64;

/// The nodes, the root first.
pub(crate) struct Wide {
    nodes: Vec<Node>,
}

/// Eight boxes by end (low, high), axis, branch, and what they hold. Boxes of no branch are never met.
#[repr(align(64))]
struct Node {
    ends: [[Lane<f32>; 3]; 2],
    branches: [u32; BRANCHES],
}

impl Node {
    fn new(branches: &[(Bounds, u32)]) -> Node {
        let bounds = |k: usize| branches.get(k).map_or(Bounds::EMPTY, |b| b.0);
        Node {
            ends: [from_fn(|axis| from_fn(|k| bounds(k).low[axis])), from_fn(|axis| from_fn(|k| bounds(k).high[axis]))],
            branches: from_fn(|k| branches.get(k).map_or(0, |b| b.1)),
        }
    }
}

impl Wide {
    /// The nodes of a tree, and the ranges of its leaves by number.
    pub(crate) fn new(root: &Branch) -> (Wide, Vec<Range<usize>>) {
        let (mut nodes, mut leaves) = (Vec::new(), Vec::new());
        enter(root, &mut nodes, &mut leaves);
        (Wide { nodes }, leaves)
    }

    /// Visits the leaves that the ray meets before its reach, with the reach there is left: `visit` returns what is left after
    /// the leaf; where that is negative the walk ends.
    #[inline(always)]
    pub(crate) fn walk<S: Simd>(&self, simd: S, query: &Query, mut visit: impl FnMut(usize, f32) -> f32) {
        let ray = BoxRay::new(simd, query);
        let mut later = Later::new();
        let (mut next, mut reach) = (0, query.end);
        loop {
            if next & LEAF == 0 {
                let node = &self.nodes[next as usize];
                let near = ray.distances(simd, node, reach);
                let met = bits(simd, &near, 0.5 * MISSED);
                if met != 0 {
                    next = later.add(node, &near, met);
                    continue;
                }
            } else {
                reach = visit((next & !LEAF) as usize, reach);
                if reach < 0.0 {
                    return;
                }
            }
            match later.nearest(reach) {
                Some(branch) => next = branch,
                None => return,
            }
        }
    }
}

/// Enters a branch and those below it; returns its number.
fn enter(branch: &Branch, nodes: &mut Vec<Node>, leaves: &mut Vec<Range<usize>>) -> u32 {
    match branch {
        Branch::Leaf(range) => {
            leaves.push(range.clone());
            LEAF | (leaves.len() as u32 - 1)
        }
        Branch::Node(branches) => {
            let own = nodes.len();
            nodes.push(Node::new(&[]));
            let numbered = |(bounds, branch): &(Bounds, Branch)| (*bounds, enter(branch, nodes, leaves));
            let branches: Vec<_> = branches.iter().map(numbered).collect();
            nodes[own] = Node::new(&branches);
            own as u32
        }
    }
}

/// What the box test needs of a ray, spread over registers.
struct BoxRay<S: Simd> {
    start: [S::f32s; 3],
    inverse: [S::f32s; 3],
    /// Which end of a box the ray meets first, by axis.
    entry: [usize; 3],
}

impl<S: Simd> BoxRay<S> {
    #[inline(always)]
    fn new(simd: S, query: &Query) -> Self {
        let inverse = query.direction.to_array().map(inverse);
        BoxRay {
            start: query.origin.to_array().map(|o| simd.splat_f32s(o)),
            inverse: inverse.map(|i| simd.splat_f32s(i)),
            entry: inverse.map(|i| usize::from(i < 0.0)),
        }
    }

    /// Where the ray enters each box of a node, at least 0; [`MISSED`] where it does not within its reach.
    #[inline(always)]
    fn distances(&self, simd: S, node: &Node, reach: f32) -> Lane<f32> {
        let lanes = |end: usize, axis: usize| S::as_simd_f32s(&node.ends[end][axis]).0;
        let near: [_; 3] = from_fn(|axis| lanes(self.entry[axis], axis));
        let far: [_; 3] = from_fn(|axis| lanes(1 - self.entry[axis], axis));
        let (zero, reach) = (simd.splat_f32s(0.0), simd.splat_f32s(reach));
        let missed = simd.splat_f32s(MISSED);
        let least = |a, b| simd.select_f32s(simd.less_than_f32s(a, b), a, b);
        let most = |a, b| simd.select_f32s(simd.less_than_f32s(b, a), a, b);
        let mut found = [MISSED; LANES];
        for (r, found) in S::as_mut_simd_f32s(&mut found).0.iter_mut().enumerate() {
            let at = |ends: &[S::f32s], axis: usize| {
                simd.mul_f32s(simd.sub_f32s(ends[r], self.start[axis]), self.inverse[axis])
            };
            // Zero comes last: of two zeros the positive one is taken, so that bits sort as numbers do.
            let first = most(most(at(near[0], 0), at(near[1], 1)), at(near[2], 2));
            let first = most(first, zero);
            let last = least(least(at(far[0], 0), at(far[1], 1)), at(far[2], 2));
            let met = simd.less_than_or_equal_f32s(first, least(last, reach));
            *found = simd.select_f32s(met, first, missed);
        }
        found
    }
}

/// 1 over a component of a direction, finite.
#[inline(always)]
fn inverse(component: f32) -> f32 {
    1.0 / most(component.abs(), 1e-20).copysign(component)
}

/// Branches put off, the nearest of each node last: distance in the high half, number in the low one.
struct Later {
    fixed: [u64; FIXED],
    count: usize,
    /// Those beyond `fixed`, of the deepest trees.
    beyond: Vec<u64>,
}

impl Later {
    #[inline(always)]
    fn new() -> Self {
        Later { fixed: [0; FIXED], count: 0, beyond: Vec::new() }
    }

    /// Puts off all branches met but the nearest, which is returned.
    #[inline(always)]
    fn add(&mut self, node: &Node, near: &Lane<f32>, mut met: u32) -> u32 {
        let entry = |k: usize| u64::from(near[k].to_bits()) << 32 | u64::from(node.branches[k]);
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

    /// The branch put off last that begins within reach.
    #[inline(always)]
    fn nearest(&mut self, reach: f32) -> Option<u32> {
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
        let mut later = Later::new();
        for k in 0..3 * FIXED as u64 {
            later.insert(k, 0);
        }
        let mut found: Vec<u32> = std::iter::from_fn(|| later.nearest(1.0)).collect();
        found.sort_unstable();
        assert!(found.into_iter().eq(0..3 * FIXED as u32));
    }

    #[test]
    fn the_nearest_of_a_node_is_walked_first_and_what_is_out_of_reach_is_not() {
        let near = [3.0, MISSED, 1.0, MISSED, 4.0, 2.0, MISSED, 0.0];
        let bounds = Bounds::EMPTY;
        let node = Node::new(&from_fn::<_, 8, _>(|k| (bounds, k as u32)));
        let mut later = Later::new();
        assert_eq!(later.add(&node, &near, 0b1011_0101), 7);
        let rest: Vec<u32> = std::iter::from_fn(|| later.nearest(3.5)).collect();
        assert_eq!(rest, [2, 5, 0]);
    }
}
