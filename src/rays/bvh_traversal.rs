//! A tree of boxes, eight to a node, and the walk of a ray through it from near to far.
//!
//! One pass of vector instructions tests the eight boxes of a node. Those met are walked in order of their distance,
//! and boxes that begin behind the reach that is left are passed over.
//!
//! Not handled: what is in the leaves.

use std::array::from_fn;

use obvhs::aabb::Aabb;
use pulp::Simd;

use crate::rays::box_block::{BoxBlock, BoxRay};
use crate::rays::bvh_build::{BRANCHES, Branches, LEAF};
use crate::rays::query::Query;
use crate::rays::simd_block::{LANES, Lane, MISSED};
use crate::rays::vector_level::{bits, fetch};

/// Branches put off without asking for memory.
const FIXED: usize = 64;

/// The nodes, the root first.
pub(crate) struct WideNodes {
    nodes: Vec<Node>,
}

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

impl WideNodes {
    /// The nodes of a tree.
    pub(crate) fn new(nodes: &[Branches]) -> WideNodes {
        WideNodes { nodes: nodes.iter().map(|branches| Node::new(branches)).collect() }
    }

    /// Visits the leaves that the ray meets before its reach, with the reach there is left: `visit` returns what is
    /// left after the leaf; where that is negative the walk ends. Of leaves that it is likely to visit `soon` hears
    /// before.
    #[inline(always)]
    pub(crate) fn walk<S: Simd>(
        &self,
        simd: S,
        query: &Query,
        soon: impl Fn(usize),
        mut visit: impl FnMut(usize, f32) -> f32,
    ) {
        let ahead = |branch: u32| match branch & LEAF {
            0 => fetch(simd, &self.nodes[branch as usize]),
            _ => soon((branch & !LEAF) as usize),
        };
        let ray = BoxRay::new(simd, query);
        let mut later = PutOff::new();
        let (mut next, mut reach) = (0, query.end);
        loop {
            if next & LEAF == 0 {
                let node = &self.nodes[next as usize];
                let near = ray.distances(simd, &node.boxes, reach);
                let met = bits(simd, &near, 0.5 * MISSED);
                if met != 0 {
                    next = later.add(node, &near, met, ahead);
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

/// Branches put off, the nearest of each node last: distance in the high half, number in the low one.
struct PutOff {
    fixed: [u64; FIXED],
    count: usize,
    /// Those beyond `fixed`, of the deepest trees.
    beyond: Vec<u64>,
}

impl PutOff {
    #[inline(always)]
    fn new() -> Self {
        PutOff { fixed: [0; FIXED], count: 0, beyond: Vec::new() }
    }

    /// Puts off all branches met but the nearest, which is returned; `ahead` hears of each.
    #[inline(always)]
    fn add(&mut self, node: &Node, near: &Lane<f32>, mut met: u32, ahead: impl Fn(u32)) -> u32 {
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
        let mut later = PutOff::new();
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
        let bounds = Aabb::INVALID;
        let node = Node::new(&from_fn::<_, 8, _>(|k| (bounds, k as u32)));
        let mut later = PutOff::new();
        assert_eq!(later.add(&node, &near, 0b1011_0101, |_| ()), 7);
        let rest: Vec<u32> = std::iter::from_fn(|| later.nearest(3.5)).collect();
        assert_eq!(rest, [2, 5, 0]);
    }
}
