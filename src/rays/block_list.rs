//! The faces of a small scene, eight at a time: boxes of eight blocks of eight triangles, without a hierarchy.
//!
//! One pass finds the blocks whose padded boxes the ray meets, a second tests their triangles. No order is kept: with
//! few blocks, sorting them would cost more than it spares.
//!
//! Not handled: more than [`BLOCKS`] blocks; their faces go into a hierarchy.

use obvhs::aabb::Aabb;
use std::array::from_fn;
use std::ops::ControlFlow;

use pulp::{Arch, Simd};

use crate::rays::box_block::{BoxBlock, BoxRay};
use crate::rays::meetings::Faces;
use crate::rays::query::{Candidate, Label, Query, SAME_PLACE, hit};
use crate::rays::ray::Hit;
use crate::rays::simd_block::{Block, LANES, Lane, MISSED, PLACES, key, least, least_of, limit, most, place};
use crate::rays::triangle::{Meeting, Triangle};
use crate::rays::vector_level::bits;

/// Blocks there can be: a bit of u64 each, and a place for each triangle.
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
        met.map(|(found, place)| hit(&found.meeting, self.labels[place].face))
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
