//! The triangles of one plane in a tree of boxes, which finds those that overlap a polygon.
//!
//! The tree is made once, of all triangles, which are then inserted one after the other. A branch of which no triangle
//! is inserted, or none early enough, is passed over, so n triangles are tested against each other in about n log n
//! steps, also in a pile of which one is inserted, and in rows of which each is shifted beyond the last.
//!
//! Not handled: polygons that many overlap of which none is wanted; each of those is looked at.

use std::ops::Range;

use glam::DVec2;
use smallvec::{SmallVec, smallvec};

use crate::scene::bounds::{Bounds, Coordinates};
use crate::scene::coincident::division::overlap;

/// Triangles of a leaf, at most about.
const LEAF: usize = 4;

/// The first triangle of a node of which none is inserted.
const NEVER: u32 = u32::MAX;

/// Triangles of one plane, by number.
pub(super) struct TriangleTree {
    tiles: Vec<[DVec2; 3]>,
    is_inserted: Vec<bool>,
    /// The triangles leaf by leaf.
    order: Vec<u32>,
    /// The leaf of each triangle.
    leaf: Vec<u32>,
    /// The two of node i are 2i and 2i + 1; the first is 1, and the leaves are the last half.
    nodes: Vec<Node>,
}

#[derive(Clone, Copy)]
struct Node {
    bounds: Bounds<DVec2>,
    /// The first of its triangles that is inserted.
    first: u32,
}

impl TriangleTree {
    /// Of triangles, counter-clockwise, of which none is inserted.
    pub(super) fn new(tiles: Vec<[DVec2; 3]>) -> TriangleTree {
        let leaves = tiles.len().div_ceil(LEAF).next_power_of_two();
        let middles: Vec<DVec2> = tiles.iter().map(|&tile| Bounds::of(tile).middle()).collect();
        let mut order: Vec<u32> = (0..tiles.len() as u32).collect();
        sort(&mut order, 0..leaves, leaves, &middles);
        let (mut leaf, mut nodes) =
            (vec![0; tiles.len()], vec![Node { bounds: DVec2::NONE, first: NEVER }; 2 * leaves]);
        for own in 0..leaves {
            for &k in &order[part(tiles.len(), leaves, own)] {
                leaf[k as usize] = own as u32;
                nodes[leaves + own].bounds = nodes[leaves + own].bounds.union(Bounds::of(tiles[k as usize]));
            }
        }
        for node in (1..leaves).rev() {
            nodes[node].bounds = nodes[2 * node].bounds.union(nodes[2 * node + 1].bounds);
        }
        TriangleTree { is_inserted: vec![false; tiles.len()], tiles, order, leaf, nodes }
    }

    /// Inserts a triangle, after all inserted before it in their order.
    pub(super) fn insert(&mut self, k: usize) {
        let mut node = self.nodes.len() / 2 + self.leaf[k] as usize;
        while node > 0 && self.nodes[node].first == NEVER {
            self.nodes[node].first = k as u32;
            node /= 2;
        }
        self.is_inserted[k] = true;
    }

    /// One that is inserted, comes before a number, overlaps a polygon by more than rounding and is `wanted`: about the
    /// next to the polygon's middle.
    pub(super) fn find(&self, polygon: &[DVec2], before: usize, wanted: impl Fn(usize) -> bool) -> Option<usize> {
        let (around, leaves) = (Bounds::of(polygon.iter().copied()), self.nodes.len() / 2);
        let middle = around.middle();
        let mut remaining: SmallVec<[usize; 64]> = smallvec![1];
        while let Some(node) = remaining.pop() {
            if self.nodes[node].first as usize >= before || !self.nodes[node].bounds.meets(&around) {
                continue;
            }
            if node < leaves {
                let away = |node: usize| self.nodes[node].bounds.middle().distance_squared(middle);
                let near = if away(2 * node) <= away(2 * node + 1) { 0 } else { 1 };
                remaining.extend([2 * node + 1 - near, 2 * node + near]);
                continue;
            }
            let mut own = self.order[part(self.tiles.len(), leaves, node - leaves)].iter().map(|&k| k as usize);
            let is_over = |k: usize| k < before && self.is_inserted[k] && overlap(&self.tiles[k], polygon);
            let found = own.find(|&k| is_over(k) && wanted(k));
            if found.is_some() {
                return found;
            }
        }
        None
    }
}

/// The places of a leaf's triangles in the order of the tree.
fn part(tiles: usize, leaves: usize, leaf: usize) -> Range<usize> {
    leaf * tiles / leaves..(leaf + 1) * tiles / leaves
}

/// Parts triangles by their middles, along the side on which these lie furthest apart, until each leaf has its own.
fn sort(order: &mut [u32], leaves: Range<usize>, all: usize, middles: &[DVec2]) {
    if leaves.len() == 1 {
        return;
    }
    let extent = Bounds::of(order.iter().map(|&k| middles[k as usize])).size();
    let axis = usize::from(extent.y > extent.x);
    let along = |k: u32| middles[k as usize][axis];
    let half = leaves.start + leaves.len() / 2;
    let start = |leaf: usize| part(middles.len(), all, leaf).start;
    let before = start(half) - start(leaves.start);
    if before < order.len() {
        order.select_nth_unstable_by(before, |&a, &b| along(a).total_cmp(&along(b)).then(a.cmp(&b)));
    }
    let (first, last) = order.split_at_mut(before);
    sort(first, leaves.start..half, all, middles);
    sort(last, half..leaves.end, all, middles);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles of many sizes scattered by a simple rule.
    fn scattered(k: u32) -> [DVec2; 3] {
        let at = |m: u32| f64::from(k * m % 97) / 97.0;
        let size = 0.5_f64.powi((k % 7) as i32);
        let corner = DVec2::new(at(31), at(53));
        [corner, corner + size * DVec2::new(1.0, 0.1), corner + size * DVec2::new(0.2, 0.9)]
    }

    #[test]
    fn the_tree_finds_what_a_walk_through_all_finds() {
        let all: Vec<[DVec2; 3]> = (0..300).map(scattered).collect();
        let mut tree = TriangleTree::new(all.clone());
        for (k, tile) in all.iter().enumerate() {
            let expected: Vec<usize> = (0..k).filter(|&j| j % 3 > 0 && overlap(&all[j], tile)).collect();
            assert_eq!(tree.find(tile, k, |j| j % 5 == 0).is_some(), expected.iter().any(|j| j % 5 == 0));
            if k % 3 > 0 {
                tree.insert(k);
            }
        }
    }
}
