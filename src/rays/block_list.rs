//! The faces of a small scene, eight at a time: boxes of eight blocks of eight triangles, without a hierarchy.
//!
//! One pass finds the blocks whose padded boxes the ray meets, a second tests their triangles. No order is kept: with
//! few blocks, sorting them would cost more than it spares.
//!
//! Blocks are found by splitting the faces' boxes in two by the surface area heuristic, until they fit: a ray meets a
//! convex box in proportion to its area, and a block costs the same however full it is.
//!
//! Not handled: more than [`BLOCKS`] blocks; their faces go into a hierarchy. The search tries every split along every
//! axis, n² log n in the worst case.

use std::array::from_fn;
use std::ops::ControlFlow;

use obvhs::aabb::Aabb;
use pulp::{Arch, Simd};
use smallvec::SmallVec;

use crate::rays::blocks::{Block, BoxBlock, BoxRay};
use crate::rays::lanes::{LANES, Lane, MISSED, bits, least, least_of};
use crate::rays::meetings::Faces;
use crate::rays::triangle::{Candidate, Hit, Label, Meeting, Query, SAME_PLACE, Triangle};

/// Blocks at most: a bit of u64 each.
pub(crate) const BLOCKS: usize = u64::BITS as usize;

/// Faces in blocks.
pub(crate) struct BlockList {
    arch: Arch,
    boxes: Vec<BoxBlock>,
    blocks: Vec<Block>,
    faces: Vec<[u32; LANES]>,
}

impl BlockList {
    /// Puts clusters of at most [`LANES`] triangles into blocks, at most [`BLOCKS`]; their boxes are padded.
    pub(crate) fn new(clusters: &[Vec<(Triangle, Label)>], pad: f32) -> Self {
        let around = |own: &Vec<(Triangle, Label)>| {
            own.iter().fold(Aabb::INVALID, |all, (triangle, _)| all.union(&triangle.padded_box(pad)))
        };
        let boxes = |own: &[Vec<(Triangle, Label)>]| BoxBlock::new(|k| own.get(k).map_or(Aabb::INVALID, around));
        let (blocks, faces) = clusters.iter().map(|own| Block::new(own)).unzip();
        BlockList { arch: Arch::new(), boxes: clusters.chunks(LANES).map(boxes).collect(), blocks, faces }
    }

    /// The blocks whose boxes the ray meets, in order.
    #[inline(always)]
    fn near<S: Simd>(&self, simd: S, query: &Query) -> impl Iterator<Item = usize> {
        let ray = BoxRay::new(simd, query);
        let mut near = 0;
        for (k, boxes) in self.boxes.iter().enumerate() {
            let met = bits(simd, &ray.distances(simd, boxes, query.end), 0.5 * MISSED);
            near |= u64::from(met) << (LANES * k);
        }
        std::iter::from_fn(move || {
            let next = (near != 0).then_some(near.trailing_zeros() as usize);
            near &= near.wrapping_sub(1);
            next
        })
    }

    /// The distance of every lane of a block.
    #[inline(always)]
    fn distances(&self, b: usize, query: &Query) -> Lane<f32> {
        let (distances, sure) = self.blocks[b].distances(query, query.end);
        if sure { distances } else { self.exact_distances(b, query) }
    }

    #[cold]
    fn exact_distances(&self, b: usize, query: &Query) -> Lane<f32> {
        let met = |lane| self.blocks[b].candidate(query, lane, query.end);
        from_fn(|lane| met(lane).map_or(MISSED, |found| found.meeting.t))
    }
}

impl Faces for BlockList {
    #[inline]
    fn arch(&self) -> Arch {
        self.arch
    }

    #[inline(always)]
    fn first<S: Simd>(&self, simd: S, query: &Query) -> Option<Hit> {
        let mut met: SmallVec<[(usize, Lane<f32>); 16]> = SmallVec::new();
        let mut nearest = [MISSED; LANES];
        for b in self.near(simd, query) {
            let distances = self.distances(b, query);
            nearest = from_fn(|lane| least(nearest[lane], distances[lane]));
            met.push((b, distances));
        }
        let nearest = least_of(&nearest);
        if nearest == MISSED {
            return None;
        }
        let mut best: Option<(Candidate, u32)> = None;
        for (b, distances) in &met {
            let mut lanes = bits(simd, distances, nearest + SAME_PLACE);
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize;
                lanes &= lanes - 1;
                let Some(candidate) = self.blocks[*b].candidate(query, lane, query.end) else { continue };
                let face = self.faces[*b][lane];
                if best.as_ref().is_none_or(|(other, first)| candidate.precedes(other, || face < *first)) {
                    best = Some((candidate, face));
                }
            }
        }
        best.map(|(found, face)| found.meeting.hit(face))
    }

    #[inline(always)]
    fn each<S: Simd>(
        &self,
        simd: S,
        query: &Query,
        mut meet: impl FnMut(Meeting, u32) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        for b in self.near(simd, query) {
            self.blocks[b].meet(simd, query, query.end, |found, lane| meet(found.meeting, self.faces[b][lane]))?;
        }
        ControlFlow::Continue(())
    }

    #[inline(always)]
    fn clear<S: Simd>(&self, simd: S, query: &Query) -> bool {
        self.near(simd, query).all(|b| self.blocks[b].is_clear(simd, query))
    }
}

/// Groups of at most `size` box numbers, each number once.
pub(crate) fn clusters(boxes: &[Aabb], size: usize) -> Vec<Vec<u32>> {
    let mut found = Vec::new();
    let mut numbers: Vec<u32> = (0..boxes.len() as u32).collect();
    split(boxes, &mut numbers, size, &mut found);
    found
}

fn split(boxes: &[Aabb], numbers: &mut [u32], size: usize, found: &mut Vec<Vec<u32>>) {
    if numbers.len() <= size {
        if !numbers.is_empty() {
            found.push(numbers.to_vec());
        }
        return;
    }
    let splits = (0..3).map(|axis| {
        sort(boxes, numbers, axis);
        let (cost, at) = cheapest(boxes, numbers, size);
        (cost, axis, at)
    });
    let best = splits.min_by(|a, b| a.0.total_cmp(&b.0));
    let (_, axis, at) = best.expect("three axes");
    sort(boxes, numbers, axis);
    let (left, right) = numbers.split_at_mut(at);
    split(boxes, left, size, found);
    split(boxes, right, size, found);
}

/// By centre along an axis, ties by number.
fn sort(boxes: &[Aabb], numbers: &mut [u32], axis: usize) {
    let center = |n: u32| boxes[n as usize].center()[axis];
    numbers.sort_unstable_by(|&a, &b| center(a).total_cmp(&center(b)).then(a.cmp(&b)));
}

/// The least cost of a split in this order, and how many boxes are before it.
fn cheapest(boxes: &[Aabb], numbers: &[u32], size: usize) -> (f32, usize) {
    let n = numbers.len();
    let before = areas(boxes, numbers.iter());
    let after = areas(boxes, numbers.iter().rev());
    let cost = |k: usize| {
        let blocks = |k: usize| k.div_ceil(size) as f32;
        before[k - 1] * blocks(k) + after[n - k - 1] * blocks(n - k)
    };
    let costs = (1..n).map(|k| (cost(k), k));
    costs.min_by(|a, b| a.0.total_cmp(&b.0)).expect("more than one box")
}

/// Half the area of the box around the first, the first two, and so on.
fn areas<'a>(boxes: &[Aabb], numbers: impl Iterator<Item = &'a u32>) -> Vec<f32> {
    let grown = numbers.scan(Aabb::INVALID, |grown, &n| {
        *grown = grown.union(&boxes[n as usize]);
        Some(grown.half_area())
    });
    grown.collect()
}
