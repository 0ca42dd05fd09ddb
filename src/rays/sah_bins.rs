//! Where to divide boxes in two: they are counted in bins along each axis, and the cheapest border between bins is
//! taken.
//!
//! The surface area heuristic: a ray meets a box in proportion to its area. A leaf is a block of [`LANES`] triangles
//! and costs the same however full it is, so both sides are counted in blocks (I. Wald, *On fast construction of
//! SAH-based bounding volume hierarchies*, RT 2007).
//!
//! Many boxes are counted by several threads; counts and boxes are exact whatever the order.
//!
//! Not handled: borders between middles of one bin.

use glam::{Vec3A, Vec4};
use rayon::prelude::*;

use crate::rays::bounds::Bounds;
use crate::rays::simd_block::LANES;

/// Bins along each axis.
const BINS: usize = 16;

/// Boxes that one thread counts at a time.
const CHUNK: usize = 1 << 14;

/// A box, with its number in the fourth place of its low corner.
#[derive(Clone, Copy)]
pub(crate) struct Item {
    low: Vec4,
    high: Vec4,
}

impl Item {
    pub(crate) fn new(bounds: Bounds, number: u32) -> Item {
        Item { low: bounds.low.extend(f32::from_bits(number)), high: bounds.high.extend(0.0) }
    }

    pub(crate) fn number(&self) -> u32 {
        self.low.w.to_bits()
    }

    #[inline(always)]
    pub(crate) fn bounds(&self) -> Bounds {
        Bounds { low: Vec3A::from_vec4(self.low), high: Vec3A::from_vec4(self.high) }
    }

    #[inline(always)]
    fn doubled_middle(&self) -> Vec3A {
        self.bounds().doubled_middle()
    }
}

/// The box around boxes of all items.
pub(crate) fn joined(items: &[Item], of: impl Fn(&Item) -> Bounds + Sync) -> Bounds {
    let join = |all: Bounds, item: &Item| all.join(of(item));
    if items.len() <= CHUNK {
        return items.iter().fold(Bounds::EMPTY, join);
    }
    let chunks = items.par_chunks(CHUNK).map(|chunk| chunk.iter().fold(Bounds::EMPTY, join));
    chunks.reduce(|| Bounds::EMPTY, Bounds::join)
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
            Bounds { low: middle, high: middle }
        });
        let extent = middles.high - middles.low;
        let per_bin = BINS as f32 * (1.0 - 1e-6) / extent;
        Scale { low: middles.low, per_bin: Vec3A::select(extent.cmpgt(Vec3A::ZERO), per_bin, Vec3A::ZERO) }
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
        if items.len() <= CHUNK {
            return Bins::of(items, scale);
        }
        let chunks = items.par_chunks(CHUNK).map(|chunk| Bins::of(chunk, scale));
        chunks.reduce(|| Bins::EMPTY, Bins::join)
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
pub(crate) struct Split {
    scale: Scale,
    axis: usize,
    bin: usize,
    /// The boxes around both sides.
    pub sides: [Bounds; 2],
}

impl Split {
    /// The division of least cost; none where all middles are one.
    pub(crate) fn cheapest(items: &[Item]) -> Option<Split> {
        let scale = Scale::new(items);
        let bins = Bins::new(items, &scale);
        let costs = (0..3).flat_map(|axis| {
            let costs = costs(&bins.0[axis]);
            (1..BINS).map(move |bin| (costs[bin], axis, bin))
        });
        let (cost, axis, bin) = costs.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let (left, right) = bins.0[axis].split_at(bin);
        let around = |side: &[(Bounds, u32)]| side.iter().fold(Bounds::EMPTY, |a, b| a.join(b.0));
        (cost < f32::INFINITY).then(|| Split { scale, axis, bin, sides: [around(left), around(right)] })
    }

    #[inline(always)]
    pub(crate) fn is_left(&self, item: &Item) -> bool {
        self.scale.bins(item)[self.axis] < self.bin
    }
}

/// Sum over both sides of area times blocks, for a division before each bin; infinite where a side is empty.
fn costs(bins: &[(Bounds, u32); BINS]) -> [f32; BINS] {
    let mut costs = [f32::INFINITY; BINS];
    let (mut all, mut count) = (Bounds::EMPTY, 0);
    for at in 1..BINS {
        grow(&mut all, &mut count, bins[at - 1]);
        costs[at] = cost(all, count);
    }
    (all, count) = (Bounds::EMPTY, 0);
    for at in (1..BINS).rev() {
        grow(&mut all, &mut count, bins[at]);
        costs[at] += cost(all, count);
    }
    costs
}

#[inline(always)]
fn grow(all: &mut Bounds, count: &mut u32, (bounds, more): (Bounds, u32)) {
    *all = all.join(bounds);
    *count += more;
}

/// Area times blocks of one side.
#[inline(always)]
fn cost(all: Bounds, count: u32) -> f32 {
    match count {
        0 => f32::INFINITY,
        n => all.half_area() * n.div_ceil(LANES as u32) as f32,
    }
}
