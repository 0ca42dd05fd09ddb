//! Splits many boxes into a tree of eight branches a node, by the surface area heuristic.
//!
//! A node is divided in two, and the larger of its parts again, until there are eight or all fit a leaf (I. Wald, C. Benthin,
//! S. Boulos, *Getting rid of packets*, RT 2008). Where to divide is told by counting boxes in bins along each axis (I. Wald, *On
//! fast construction of SAH-based bounding volume hierarchies*, RT 2007). A leaf is a block of [`LANES`] triangles and costs the
//! same however full it is, so both sides are counted in blocks.
//!
//! Parts are divided side by side. No step depends on the number of threads: counts and boxes are exact whatever the order.
//!
//! Not handled: splitting a triangle between two leaves.

use std::ops::Range;

use glam::{Vec3A, Vec4};
use rayon::prelude::*;

use super::block::LANES;
use super::bounds::Bounds;

/// Branches of a node.
pub(super) const BRANCHES: usize = 8;

/// Bins along each axis.
const BINS: usize = 16;

/// Parts of more boxes are divided by several threads.
const PARALLEL: usize = 4096;

/// Boxes that one thread counts at a time.
const CHUNK: usize = 1 << 14;

/// Levels below which parts are halved, so that no arrangement makes a tree deep.
const DEEP: usize = 24;

/// A tree over ranges of an order of the boxes.
pub(super) enum Branch {
    /// At most [`LANES`] boxes.
    Leaf(Range<usize>),
    /// At most [`BRANCHES`] branches with their boxes.
    Node(Vec<(Bounds, Branch)>),
}

/// A box, with its number in the fourth place of its low corner.
#[derive(Clone, Copy)]
struct Item {
    low: Vec4,
    high: Vec4,
}

/// Consecutive items with their box.
struct Part<'a> {
    items: &'a mut [Item],
    start: usize,
    bounds: Bounds,
}

/// The order of the boxes' numbers, and the tree over it.
pub(super) fn tree(boxes: &[Bounds]) -> (Vec<u32>, Branch) {
    let numbered = boxes.par_iter().enumerate();
    let mut items: Vec<Item> = numbered.map(|(i, b)| Item::new(*b, i as u32)).collect();
    let whole = Part::new(&mut items, 0);
    let root = match whole.items.len() <= LANES {
        true => Branch::Node(vec![(whole.bounds, whole.branch(0))]),
        false => whole.branch(0),
    };
    (items.iter().map(Item::number).collect(), root)
}

impl Item {
    fn new(bounds: Bounds, number: u32) -> Item {
        Item {
            low: bounds.low.extend(f32::from_bits(number)),
            high: bounds.high.extend(0.0),
        }
    }

    fn number(&self) -> u32 {
        self.low.w.to_bits()
    }

    #[inline(always)]
    fn bounds(&self) -> Bounds {
        Bounds {
            low: Vec3A::from_vec4(self.low),
            high: Vec3A::from_vec4(self.high),
        }
    }

    #[inline(always)]
    fn doubled_middle(&self) -> Vec3A {
        self.bounds().doubled_middle()
    }
}

impl<'a> Part<'a> {
    fn new(items: &'a mut [Item], start: usize) -> Self {
        let bounds = joined(items, |item| item.bounds());
        Part {
            items,
            start,
            bounds,
        }
    }

    /// The tree over the part.
    fn branch(self, depth: usize) -> Branch {
        if self.items.len() <= LANES {
            return Branch::Leaf(self.start..self.start + self.items.len());
        }
        let many = self.items.len() > PARALLEL;
        let parts = self.divided(depth);
        let grow = |part: Part| (part.bounds, part.branch(depth + 1));
        Branch::Node(match many {
            true => parts.into_par_iter().map(grow).collect(),
            false => parts.into_iter().map(grow).collect(),
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
        let split = (depth < DEEP)
            .then(|| Split::cheapest(self.items))
            .flatten();
        let at = match split {
            Some(split) => partition(self.items, |item| split.is_left(item)),
            None => self.items.len() / 2,
        };
        let (left, right) = self.items.split_at_mut(at);
        [
            Part::new(left, self.start),
            Part::new(right, self.start + at),
        ]
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

/// The box around boxes of all items.
fn joined(items: &[Item], of: impl Fn(&Item) -> Bounds + Sync) -> Bounds {
    let join = |all: Bounds, item: &Item| all.join(of(item));
    let chunks = items.par_chunks(CHUNK);
    match items.len() > CHUNK {
        true => chunks
            .map(|chunk| chunk.iter().fold(Bounds::EMPTY, join))
            .reduce(|| Bounds::EMPTY, Bounds::join),
        false => items.iter().fold(Bounds::EMPTY, join),
    }
}

/// How a box's middle finds its bin.
#[derive(Clone, Copy)]
struct Scale {
    low: Vec3A,
    per_bin: Vec3A,
}

impl Scale {
    /// Bins over the middles of the items.
    fn new(items: &[Item]) -> Scale {
        let middles = joined(items, |item| {
            let middle = item.doubled_middle();
            Bounds {
                low: middle,
                high: middle,
            }
        });
        let extent = middles.high - middles.low;
        let per_bin = BINS as f32 * (1.0 - 1e-6) / extent;
        Scale {
            low: middles.low,
            per_bin: Vec3A::select(extent.cmpgt(Vec3A::ZERO), per_bin, Vec3A::ZERO),
        }
    }

    #[inline(always)]
    fn bins(&self, item: &Item) -> [usize; 3] {
        let at = (item.doubled_middle() - self.low) * self.per_bin;
        // Casts to i32 are one instruction, to usize some ten.
        let bin = |x: f32| (x as i32).clamp(0, BINS as i32 - 1) as usize;
        [bin(at.x), bin(at.y), bin(at.z)]
    }
}

/// Boxes and counts by axis and bin.
#[derive(Clone)]
struct Bins([[(Bounds, u32); BINS]; 3]);

impl Bins {
    const EMPTY: Bins = Bins([[(Bounds::EMPTY, 0); BINS]; 3]);

    fn new(items: &[Item], scale: &Scale) -> Bins {
        let chunks = items.par_chunks(CHUNK);
        match items.len() > CHUNK {
            true => chunks
                .map(|chunk| Bins::of(chunk, scale))
                .reduce(|| Bins::EMPTY, Bins::join),
            false => Bins::of(items, scale),
        }
    }

    fn of(items: &[Item], scale: &Scale) -> Bins {
        let mut bins = Bins::EMPTY;
        for item in items {
            let bounds = item.bounds();
            for (axis, bin) in scale.bins(item).into_iter().enumerate() {
                let (all, count) = &mut bins.0[axis][bin];
                *all = all.join(bounds);
                *count += 1;
            }
        }
        bins
    }

    fn join(mut self, other: Bins) -> Bins {
        let own = self.0.iter_mut().flatten();
        for ((all, count), (bounds, more)) in own.zip(other.0.iter().flatten()) {
            *all = all.join(*bounds);
            *count += more;
        }
        self
    }
}

/// A division: the items in bins before `bin` along an axis are left.
struct Split {
    scale: Scale,
    axis: usize,
    bin: usize,
}

impl Split {
    /// The division of least cost; none where all middles are one.
    fn cheapest(items: &[Item]) -> Option<Split> {
        let scale = Scale::new(items);
        let bins = Bins::new(items, &scale);
        let costs = (0..3).flat_map(|axis| {
            let costs = costs(&bins.0[axis]);
            (1..BINS).map(move |bin| (costs[bin], axis, bin))
        });
        let (cost, axis, bin) = costs.min_by(|a, b| a.0.total_cmp(&b.0))?;
        (cost < f32::INFINITY).then_some(Split { scale, axis, bin })
    }

    #[inline(always)]
    fn is_left(&self, item: &Item) -> bool {
        self.scale.bins(item)[self.axis] < self.bin
    }
}

/// Sum over both sides of area times blocks, for a division before each bin; infinite where a side is empty.
fn costs(bins: &[(Bounds, u32); BINS]) -> [f32; BINS] {
    let mut costs = [0.0; BINS];
    let mut side = |bins: &mut dyn Iterator<Item = (usize, &(Bounds, u32))>| {
        let (mut all, mut count) = (Bounds::EMPTY, 0);
        for (at, (bounds, more)) in bins {
            all = all.join(*bounds);
            count += more;
            costs[at] += match count {
                0 => f32::INFINITY,
                n => all.half_area() * n.div_ceil(LANES as u32) as f32,
            };
        }
    };
    side(&mut (1..BINS).zip(bins));
    side(&mut (1..BINS).zip(&bins[1..]).rev());
    costs
}
