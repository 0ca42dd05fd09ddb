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

use crate::rays::blocks::{Block, BoxBlock, BoxRay, PLACES, key, limit, place};
use crate::rays::lanes::{LANES, Lane, MISSED, bits, least, least_of, most};
use crate::rays::meetings::Faces;
use crate::rays::triangle::{Candidate, Hit, Label, Meeting, Query, SAME_PLACE, Triangle};

/// Blocks at most: a bit of u64 each, and a place for each triangle.
pub(crate) const BLOCKS: usize = PLACES / LANES;

/// Faces in blocks; triangles and labels stand by place, eight to a block.
pub(crate) struct BlockList {
    arch: Arch,
    boxes: Vec<BoxBlock>,
    blocks: Vec<Block>,
    triangles: Vec<Triangle>,
    labels: Vec<Label>,
}

impl BlockList {
    /// Puts clusters of at most [`LANES`] triangles into blocks, at most [`BLOCKS`]; their boxes are padded.
    pub(crate) fn new(clusters: &[Vec<(Triangle, Label)>], pad: f32) -> Self {
        let nothing = (Triangle::NOTHING, Label::NONE);
        let padded = clusters.iter().flat_map(|cluster| {
            let lanes = |lane| cluster.get(lane).copied().unwrap_or(nothing);
            (0..LANES).map(lanes)
        });
        let (triangles, labels) = padded.unzip();
        let around = |own: &Vec<(Triangle, Label)>| {
            own.iter().fold(Aabb::INVALID, |all, (triangle, _)| all.union(&triangle.padded_box(pad)))
        };
        let boxes = |own: &[Vec<(Triangle, Label)>]| BoxBlock::new(|k| own.get(k).map_or(Aabb::INVALID, around));
        BlockList {
            arch: Arch::new(),
            boxes: clusters.chunks(LANES).map(boxes).collect(),
            blocks: clusters.iter().map(|own| Block::new(own)).collect(),
            triangles,
            labels,
        }
    }

    /// A bit for each block whose box the ray meets.
    #[inline(always)]
    fn near<S: Simd>(&self, simd: S, query: &Query) -> u64 {
        let ray = BoxRay::new(simd, query);
        let mut near = 0;
        for (k, boxes) in self.boxes.iter().enumerate() {
            let met = bits(simd, &ray.distances(simd, boxes, query.end), 0.5 * MISSED);
            near |= u64::from(met) << (LANES * k);
        }
        near
    }

    /// The keys of a block's triangles.
    #[inline(always)]
    fn keys(&self, b: usize, query: &Query) -> Lane<f32> {
        let (keys, sure) = self.blocks[b].keys(query, b * LANES);
        if sure { keys } else { self.exact_keys(b, query) }
    }

    /// The keys of a block's triangles by the exact test.
    #[cold]
    fn exact_keys(&self, b: usize, query: &Query) -> Lane<f32> {
        from_fn(|lane| {
            let place = b * LANES + lane;
            self.candidate(place, query).map_or(MISSED, |found| key(found.meeting.t, place))
        })
    }

    /// The meeting with the triangle of a place, if it counts.
    #[inline(always)]
    fn candidate(&self, place: usize, query: &Query) -> Option<Candidate> {
        query.candidate(&self.triangles[place], self.labels[place].plane, query.end)
    }

    /// The first meeting, and its place, where several are close together.
    #[cold]
    fn first_of_several(&self, query: &Query) -> Option<(Candidate, usize)> {
        let met = (0..self.labels.len()).filter_map(|place| Some((self.candidate(place, query)?, place)));
        met.reduce(|best, next| {
            let by_face = || self.labels[next.1].face < self.labels[best.1].face;
            if next.0.precedes(&best.0, by_face) { next } else { best }
        })
    }
}

impl Faces for BlockList {
    #[inline]
    fn arch(&self) -> Arch {
        self.arch
    }

    #[inline(always)]
    fn first<S: Simd>(&self, simd: S, query: &Query) -> Option<Hit> {
        let (mut first, mut second) = ([MISSED; LANES], [MISSED; LANES]);
        let mut near = self.near(simd, query);
        while near != 0 {
            let keys = self.keys(near.trailing_zeros() as usize, query);
            near &= near - 1;
            for l in 0..LANES {
                second[l] = least(second[l], most(first[l], keys[l]));
                first[l] = least(first[l], keys[l]);
            }
        }
        let key = least_of(&first);
        if key == MISSED {
            return None;
        }
        let limit = limit(key, SAME_PLACE);
        let alone = bits(simd, &first, limit).is_power_of_two() && bits(simd, &second, limit) == 0;
        let met = if alone {
            let place = place(key);
            self.candidate(place, query).map(|found| (found, place))
        } else {
            self.first_of_several(query)
        };
        met.map(|(found, place)| found.meeting.hit(self.labels[place].face))
    }

    #[inline(always)]
    fn each<S: Simd>(
        &self,
        simd: S,
        query: &Query,
        mut meet: impl FnMut(Meeting, u32) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let mut near = self.near(simd, query);
        while near != 0 {
            let b = near.trailing_zeros() as usize;
            near &= near - 1;
            let mut met = bits(simd, &self.keys(b, query), 0.5 * MISSED);
            while met != 0 {
                let place = b * LANES + met.trailing_zeros() as usize;
                met &= met - 1;
                if let Some(found) = self.candidate(place, query) {
                    meet(found.meeting, self.labels[place].face)?;
                }
            }
        }
        ControlFlow::Continue(())
    }

    #[inline(always)]
    fn clear<S: Simd>(&self, simd: S, query: &Query) -> bool {
        self.each(simd, query, |_, _| ControlFlow::Break(())).is_continue()
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
