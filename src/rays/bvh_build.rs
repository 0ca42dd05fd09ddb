//! Builds the tree over many boxes: [`BRANCHES`] branches a node, at most [`LANES`] boxes a leaf.
//!
//! The crate obvhs merges near boxes in pairs (PLOC) and moves large nodes to better places (reinsertion); the binary
//! tree is then collapsed to eight branches a node at the least expected cost of a ray.
//!
//! PLOC merges one pair a round, in quadratic time, where the costs of neighbours are equal or rise along a line: boxes
//! in one place, nested boxes, rows of equal ones. It is given at most [`GROUP`] boxes at a time, the cells of an
//! octree over the boxes' centres, and then the boxes around those cells. Below [`DEEP`] levels nodes are split into
//! equal parts. Groups are built in parallel; no step depends on the number of threads.
//!
//! Not handled: splitting a triangle between two leaves.
//!
//! Sources: D. Meister, J. Bittner, *Parallel locally-ordered clustering for bounding volume hierarchy construction*,
//! TVCG 24(3), 2018, and *Parallel reinsertion for bounding volume hierarchy optimization*, CGF 37(2), 2018.

use std::ops::Range;

use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::morton::morton_encode_u64_unorm;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use rayon::prelude::*;

use crate::rays::lanes::LANES;

/// Branches of a node.
pub(crate) const BRANCHES: usize = 8;

/// Marks the number of a leaf among those of nodes.
pub(crate) const LEAF: u32 = 1 << 31;

/// Boxes that PLOC merges at a time. Four or sixteen times as many give no cheaper trees.
const GROUP: usize = 256;

/// Share of the nodes, the largest, that are moved in the first round of reinsertion; in round k its (2k - 1)-th part.
const REINSERTED: f32 = 0.02;

/// Rounds of reinsertion.
const ROUNDS: usize = 16;

/// A binary tree whose depth may exceed this is made of piles, and nothing in it is moved.
const PILED: usize = 300;

/// Expected time of a node's test over that of a leaf's.
const NODE_PRICE: f32 = 0.5;

/// Levels below which nodes are split into equal parts, so that no arrangement makes a tree deep.
const DEEP: usize = 24;

/// A tree over boxes: its nodes, the root first, and its leaves as ranges of an order of the boxes' numbers.
pub(crate) struct Layout {
    pub order: Vec<u32>,
    pub leaves: Vec<Range<usize>>,
    pub nodes: Vec<Branches>,
}

/// At most [`BRANCHES`] branches of a node: their boxes, with the number of a node, or with that of a leaf and
/// [`LEAF`].
pub(crate) type Branches = Vec<(Aabb, u32)>;

impl Layout {
    /// The tree over boxes.
    pub(crate) fn new(boxes: &[Aabb]) -> Layout {
        if boxes.len() <= LANES {
            let leaves = std::iter::once(0..boxes.len()).collect();
            let nodes = vec![vec![(around(boxes), LEAF)]];
            return Layout { order: (0..boxes.len() as u32).collect(), leaves, nodes };
        }
        let binary = reinserted(merged_in_groups(boxes));
        let layout = Layout { order: Vec::with_capacity(boxes.len()), leaves: Vec::new(), nodes: Vec::new() };
        let costs = vec![[0.0; BRANCHES - 1]; binary.len()];
        let mut collapse = Collapse { boxes, binary, costs, layout };
        collapse.price(0);
        collapse.node(0, 0);
        collapse.layout
    }
}

/// The box around boxes.
fn around(boxes: &[Aabb]) -> Aabb {
    boxes.iter().fold(Aabb::INVALID, |all, b| all.union(b))
}

/// The binary tree over boxes, one in each leaf, with a bound on its depth.
fn merged_in_groups(boxes: &[Aabb]) -> Bvh2 {
    if boxes.len() <= GROUP {
        return merged(&mut PlocBuilder::new(), boxes);
    }
    let order = by_cell(boxes);
    let mut groups = Vec::new();
    divide(&order, 0..order.len(), &mut groups);
    let grow = |ploc: &mut PlocBuilder, group: &Range<usize>| {
        let numbers = &order[group.clone()];
        let own: Vec<Aabb> = numbers.iter().map(|&(_, k)| boxes[k as usize]).collect();
        let mut tree = merged(ploc, &own);
        let leaves = tree.nodes.iter_mut().filter(|node| node.is_leaf());
        leaves.for_each(|leaf| leaf.first_index = numbers[leaf.first_index as usize].1);
        tree
    };
    let grown: Vec<Bvh2> = groups.par_iter().map_init(PlocBuilder::new, grow).collect();
    let roots: Vec<Aabb> = grown.iter().map(|tree| tree.nodes[0].aabb).collect();
    joined(merged_in_groups(&roots), &grown)
}

/// The binary tree over a few boxes by PLOC.
fn merged(ploc: &mut PlocBuilder, boxes: &[Aabb]) -> Bvh2 {
    let numbers = (0..boxes.len() as u32).collect();
    ploc.build(PlocSearchDistance::Low, boxes, numbers, SortPrecision::U64, 0)
}

/// The binary tree that has the trees `below` in place of its leaves.
fn joined(mut tree: Bvh2, below: &[Bvh2]) -> Bvh2 {
    let nodes = &mut tree.nodes;
    nodes.reserve(below.iter().map(|own| own.nodes.len() - 1).sum());
    for k in 0..nodes.len() {
        if nodes[k].is_leaf() {
            let own = &below[nodes[k].first_index as usize].nodes;
            // Its node 1 comes next here.
            let shift = nodes.len() as u32 - 1;
            nodes[k] = shifted(&own[0], shift);
            nodes.extend(own[1..].iter().map(|node| shifted(node, shift)));
        }
    }
    tree.max_depth += below.iter().map(|own| own.max_depth).max().unwrap_or(0);
    tree
}

/// A node whose children have numbers larger by a shift.
fn shifted(node: &Bvh2Node, shift: u32) -> Bvh2Node {
    Bvh2Node { first_index: node.first_index + if node.is_leaf() { 0 } else { shift }, ..*node }
}

/// The numbers of boxes in the order of the Morton codes of their centres, with those.
fn by_cell(boxes: &[Aabb]) -> Vec<(u64, u32)> {
    let whole = around(boxes);
    let (low, scale) = (whole.min.as_dvec3(), whole.diagonal().as_dvec3().recip());
    let code = |b: &Aabb| morton_encode_u64_unorm((b.center().as_dvec3() - low) * scale);
    let mut order: Vec<(u64, u32)> = boxes.par_iter().zip(0..boxes.len() as u32).map(|(b, k)| (code(b), k)).collect();
    order.par_sort_unstable();
    order
}

/// Cuts a range of codes in order into cells of at most [`GROUP`], each where the first bit differs; halves where none
/// does.
fn divide(order: &[(u64, u32)], range: Range<usize>, groups: &mut Vec<Range<usize>>) {
    if range.len() <= GROUP {
        groups.push(range);
        return;
    }
    let codes = &order[range.clone()];
    let middle = range.start
        + match codes[0].0 ^ codes[codes.len() - 1].0 {
            0 => codes.len() / 2,
            differing => codes.partition_point(|(code, _)| code & (1 << differing.ilog2()) == 0),
        };
    divide(order, range.start..middle, groups);
    divide(order, middle..range.end, groups);
}

/// The nodes of a binary tree after its largest ones were moved to where they enlarge others least.
fn reinserted(mut tree: Bvh2) -> Vec<Bvh2Node> {
    if tree.max_depth > PILED {
        return tree.nodes;
    }
    let area = |&k: &u32| tree.nodes[k as usize].aabb.half_area();
    let by_area = |a: &u32, b: &u32| area(b).total_cmp(&area(a)).then(a.cmp(b));
    let mut largest: Vec<u32> = (1..tree.nodes.len() as u32).collect();
    let count = (REINSERTED * tree.nodes.len() as f32).ceil() as usize;
    largest.select_nth_unstable_by(count, by_area);
    largest.truncate(count);
    largest.sort_unstable_by(by_area);
    let mut optimizer = ReinsertionOptimizer::default();
    for round in 0..ROUNDS {
        let share = count.div_ceil(2 * round + 1);
        optimizer.run_with_candidates(&mut tree, &largest[..share], 1);
    }
    tree.nodes
}

/// Collapses a binary tree to [`BRANCHES`] branches a node.
///
/// A ray meets a convex box in proportion to its area, and a leaf costs the same however full it is: the cost of a tree
/// is the sum of the areas of its leaves and [`NODE_PRICE`] times those of its nodes.
struct Collapse<'a> {
    boxes: &'a [Aabb],
    /// The binary tree; `meta1` of a node is how many boxes it holds.
    binary: Vec<Bvh2Node>,
    /// Of each binary node, the least cost of what it holds in at most 1, 2, ... branches.
    costs: Vec<[f32; BRANCHES - 1]>,
    layout: Layout,
}

impl Collapse<'_> {
    /// Counts the boxes and finds the costs of a binary node and all below it.
    fn price(&mut self, k: usize) {
        let node = self.binary[k];
        let area = node.aabb.half_area();
        if node.is_leaf() {
            self.binary[k].meta1 = 1;
            self.costs[k] = [area; BRANCHES - 1];
            return;
        }
        let first = node.first_index as usize;
        self.price(first);
        self.price(first + 1);
        let count = self.binary[first].meta1 + self.binary[first + 1].meta1;
        self.binary[k].meta1 = count;
        let cheapest = |n: usize| (1..n).map(|own| self.shared(first, own, n)).fold(f32::INFINITY, f32::min);
        let as_leaf = if count <= LANES as u32 { area } else { f32::INFINITY };
        let mut least = as_leaf.min(NODE_PRICE * area + cheapest(BRANCHES));
        self.costs[k] = std::array::from_fn(|n| {
            least = least.min(cheapest(n + 1));
            least
        });
    }

    /// The cost of two siblings in n branches, `own` of them the first one's.
    #[inline(always)]
    fn shared(&self, first: usize, own: usize, n: usize) -> f32 {
        self.costs[first][own - 1] + self.costs[first + 1][n - own - 1]
    }

    /// Appends the binary nodes that the children of one become in at most n branches, at the least cost.
    fn spread(&self, k: usize, n: usize, branches: &mut Vec<usize>) {
        let first = self.binary[k].first_index as usize;
        let cost = |&own: &usize| self.shared(first, own, n);
        let own = (1..n).min_by(|a, b| cost(a).total_cmp(&cost(b))).unwrap_or(1);
        for (child, n) in [(first, own), (first + 1, n - own)] {
            if self.costs[child][n - 1] < self.costs[child][0] {
                self.spread(child, n, branches);
            } else {
                branches.push(child);
            }
        }
    }

    /// Adds the node that a binary one becomes, and all below it; returns its number.
    fn node(&mut self, k: usize, depth: usize) -> u32 {
        let mut branches = Vec::with_capacity(BRANCHES);
        self.spread(k, BRANCHES, &mut branches);
        let number = self.empty_node();
        let branch = |k: usize| (self.binary[k].aabb, self.branch(k, depth + 1));
        self.layout.nodes[number] = branches.into_iter().map(branch).collect();
        number as u32
    }

    /// Adds the leaf or the node that a binary node becomes; returns its number as a branch.
    fn branch(&mut self, k: usize, depth: usize) -> u32 {
        let is_leaf = self.binary[k].meta1 <= LANES as u32 && self.costs[k][0] == self.binary[k].aabb.half_area();
        if !is_leaf && depth <= DEEP {
            return self.node(k, depth);
        }
        let start = self.layout.order.len();
        self.number_boxes(k);
        self.equal_parts(start..self.layout.order.len())
    }

    /// Appends the numbers of the boxes of a binary node.
    fn number_boxes(&mut self, k: usize) {
        let node = self.binary[k];
        if node.is_leaf() {
            self.layout.order.push(node.first_index);
        } else {
            self.number_boxes(node.first_index as usize);
            self.number_boxes(node.first_index as usize + 1);
        }
    }

    /// Adds a tree over a range of the order in equal parts; returns its number as a branch.
    fn equal_parts(&mut self, range: Range<usize>) -> u32 {
        if range.len() <= LANES {
            self.layout.leaves.push(range);
            return LEAF | (self.layout.leaves.len() as u32 - 1);
        }
        let number = self.empty_node();
        let size = range.len().div_ceil(BRANCHES).max(LANES);
        let part = |start: usize| {
            let part = start..range.end.min(start + size);
            let own: Vec<Aabb> = self.layout.order[part.clone()].iter().map(|&k| self.boxes[k as usize]).collect();
            (around(&own), self.equal_parts(part))
        };
        self.layout.nodes[number] = range.clone().step_by(size).map(part).collect();
        number as u32
    }

    fn empty_node(&mut self) -> usize {
        self.layout.nodes.push(Vec::new());
        self.layout.nodes.len() - 1
    }
}
