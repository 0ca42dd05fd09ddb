//! Splits many boxes into a tree of eight branches a node, by the surface area heuristic.
//!
//! A node is divided in two, and the larger of its parts again, until there are eight or all fit a leaf (I. Wald, C.
//! Benthin, S. Boulos, *Getting rid of packets*, RT 2008).
//!
//! Parts are divided side by side. No step depends on the number of threads: counts and boxes are exact whatever the
//! order.
//!
//! Not handled: splitting a triangle between two leaves.

use std::ops::Range;

use rayon::prelude::*;

use crate::rays::bounds::Bounds;
use crate::rays::sah_bins::{Item, Split, joined};
use crate::rays::simd_block::LANES;

/// Branches of a node.
pub(crate) const BRANCHES: usize = 8;

/// Parts of more boxes are divided by several threads.
const PARALLEL: usize = 4096;

/// Levels below which parts are halved, so that no arrangement makes a tree deep.
const DEEP: usize = 24;

/// An order of the boxes' numbers, and the tree over it.
pub(crate) struct Layout {
    pub order: Vec<u32>,
    pub root: Branch,
}

/// A tree over ranges of an order of the boxes.
pub(crate) enum Branch {
    /// At most [`LANES`] boxes.
    Leaf(Range<usize>),
    /// At most [`BRANCHES`] branches with their boxes.
    Node(Vec<(Bounds, Branch)>),
}

/// Consecutive items with their box.
struct Part<'a> {
    items: &'a mut [Item],
    start: usize,
    bounds: Bounds,
}

impl Layout {
    /// The tree over boxes.
    pub(crate) fn new(boxes: &[Bounds]) -> Layout {
        let numbered = boxes.par_iter().enumerate();
        let mut items: Vec<Item> = numbered.map(|(i, b)| Item::new(*b, i as u32)).collect();
        let whole = Part::new(&mut items, 0);
        let single = whole.items.len() <= LANES;
        let root = if single { Branch::Node(vec![(whole.bounds, whole.branch(0))]) } else { whole.branch(0) };
        Layout { order: items.iter().map(Item::number).collect(), root }
    }
}

impl<'a> Part<'a> {
    fn new(items: &'a mut [Item], start: usize) -> Self {
        let bounds = joined(items, Item::bounds);
        Part { items, start, bounds }
    }

    /// The tree over the part.
    fn branch(self, depth: usize) -> Branch {
        if self.items.len() <= LANES {
            return Branch::Leaf(self.start..self.start + self.items.len());
        }
        let many = self.items.len() > PARALLEL;
        let parts = self.divided(depth);
        let grow = |part: Part| (part.bounds, part.branch(depth + 1));
        Branch::Node(if many {
            parts.into_par_iter().map(grow).collect()
        } else {
            parts.into_iter().map(grow).collect()
        })
    }

    /// The part in at most [`BRANCHES`] parts.
    fn divided(self, depth: usize) -> Vec<Part<'a>> {
        let mut parts = vec![self];
        while parts.len() < BRANCHES {
            let large = (0..parts.len()).filter(|&k| parts[k].items.len() > LANES);
            let area = |k: &usize| parts[*k].bounds.half_area();
            let Some(largest) = large.max_by(|a, b| area(a).total_cmp(&area(b))) else {
                break;
            };
            let [left, right] = parts.swap_remove(largest).halves(depth);
            parts.extend([left, right]);
        }
        parts
    }

    fn halves(self, depth: usize) -> [Part<'a>; 2] {
        let split = (depth < DEEP).then(|| Split::cheapest(self.items)).flatten();
        let at = match &split {
            Some(split) => partition(self.items, |item| split.is_left(item)),
            None => self.items.len() / 2,
        };
        let (left, right) = self.items.split_at_mut(at);
        let [first, second] = match split {
            Some(split) => split.sides,
            None => [&*left, &*right].map(|side| joined(side, Item::bounds)),
        };
        let part = |items, start, bounds| Part { items, start, bounds };
        [part(left, self.start, first), part(right, self.start + at, second)]
    }
}

/// Puts the items that are `left` first and tells how many they are.
fn partition(items: &mut [Item], left: impl Fn(&Item) -> bool) -> usize {
    let (mut first, mut last) = (0, items.len());
    while first < last {
        if left(&items[first]) {
            first += 1;
        } else {
            last -= 1;
            items.swap(first, last);
        }
    }
    first
}
