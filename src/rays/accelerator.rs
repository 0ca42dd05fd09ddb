//! Some of the scene's faces made ready for rays, and the three queries for meetings.
//!
//! Few faces are tested in blocks ([`crate::rays::block_list`]), many through a hierarchy ([`crate::rays::bvh`]). Both
//! give the same meetings: of those close together the first is chosen by
//! [`crate::rays::triangle::Candidate::precedes`], whatever order they are found in.
//!
//! Not handled: the dispatch to vector instructions; that is [`crate::rays::meetings`].

use obvhs::aabb::Aabb;
use rayon::prelude::*;

use crate::rays::block_list::{BLOCKS, BlockList, clusters};
use crate::rays::bvh::Bvh;
use crate::rays::bvh_build::Layout;
use crate::rays::lanes::LANES;
use crate::rays::meetings::Faces;
use crate::rays::triangle::{Hit, Label, Query, Triangle};

/// Faces from which a hierarchy is built at once. Blocks are still 1.7 times as fast at 384 faces, so they are used as
/// far as there is room for them (`benches/rays.rs`).
pub(crate) const MANY: usize = 512;

/// Faces ready for rays.
pub(crate) enum Accelerator {
    Blocks(BlockList),
    Bvh(Bvh),
}

impl Accelerator {
    /// In blocks if there are fewer than `many` faces and the blocks suffice, otherwise in a hierarchy.
    pub(crate) fn of(faces: &[(Triangle, Label)], pad: f32, many: usize) -> Self {
        let boxes: Vec<Aabb> = faces.par_iter().map(|(t, _)| t.padded_box(pad)).collect();
        if faces.len() < many {
            let groups = clusters(&boxes, LANES);
            if groups.len() <= BLOCKS {
                let cluster = |g: &Vec<u32>| g.iter().map(|&i| faces[i as usize]).collect();
                let clusters: Vec<_> = groups.iter().map(cluster).collect();
                return Accelerator::Blocks(BlockList::new(&clusters, pad));
            }
        }
        let face = |i: u32| Some(faces[i as usize]);
        Accelerator::Bvh(Bvh::new(&Layout::new(&boxes), face))
    }

    /// The first meeting.
    #[inline]
    pub(crate) fn closest(&self, query: &Query) -> Option<Hit> {
        match self {
            Accelerator::Blocks(blocks) => blocks.closest(query),
            Accelerator::Bvh(bvh) => bvh.closest(query),
        }
    }

    /// Every meeting, in no order, edges counted once for each face; appended to `out`.
    #[inline]
    pub(crate) fn all(&self, query: &Query, out: &mut Vec<Hit>) {
        self.all_unless(|_| false, query, out);
    }

    /// Whether there is no meeting at all.
    #[inline]
    pub(crate) fn is_clear(&self, query: &Query) -> bool {
        match self {
            Accelerator::Blocks(blocks) => blocks.is_clear(query),
            Accelerator::Bvh(bvh) => bvh.is_clear(query),
        }
    }

    /// Appends every meeting to `out`, in no order, edges counted once for each face; false as soon as an opaque face
    /// is met.
    #[inline]
    pub(crate) fn all_unless(&self, opaque: impl Fn(u32) -> bool, query: &Query, out: &mut Vec<Hit>) -> bool {
        match self {
            Accelerator::Blocks(blocks) => blocks.all_unless(opaque, query, out),
            Accelerator::Bvh(bvh) => bvh.all_unless(opaque, query, out),
        }
    }
}
