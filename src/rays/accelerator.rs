//! Some of the scene's faces made ready for rays, and the three ways to ask for meetings.
//!
//! Few faces are tested in blocks ([`crate::rays::block_list`]), many through a hierarchy ([`crate::rays::bvh`]). Both give the same
//! meetings: of those close together the first is chosen by [`precedes`], whatever order they are found in.

use glam::Vec3A;
use rayon::prelude::*;

use crate::rays::block_clusters::clusters;
use crate::rays::block_list::{BLOCKS, Few};
use crate::rays::bounds::Bounds;
use crate::rays::bvh::Many;
use crate::rays::bvh_build::Layout;
use crate::rays::simd_block::LANES;
use crate::rays::triangle::{Meeting, Shear, Triangle};
use crate::rays::{Hit, Side};

/// Faces from which a hierarchy is built at once. Blocks are still 1.7 times as fast at 384 faces, so they are used as far
/// as there is room for them (`benches/rays.rs`).
pub(crate) const MANY: usize = 512;

/// Two meetings further apart than this are not taken for the same place of one plane. t errs by about 2e-7 over the
/// cosine between ray and normal, so this covers all but the most grazing rays.
pub(crate) const SAME_PLACE: f32 = 1e-3;

/// No plane: nothing is skipped.
pub(crate) const NO_PLANE: u32 = u32::MAX;

/// Faces ready for rays.
pub(crate) enum Tree {
    Few(Few),
    Many(Many),
}

/// What a triangle belongs to.
#[derive(Clone, Copy)]
pub(crate) struct Label {
    pub face: u32,
    pub plane: u32,
}

/// A ray made ready: where it runs, how far, and the planes it cannot meet.
pub(crate) struct Query {
    pub shear: Shear,
    pub origin: Vec3A,
    pub direction: Vec3A,
    pub end: f32,
    pub skip: [u32; 2],
}

impl Label {
    /// Of no face.
    pub(crate) const NONE: Label = Label { face: u32::MAX, plane: NO_PLANE };
}

impl Query {
    /// Meetings with `0 < t < end` of planes other than `skip`.
    #[inline]
    pub(crate) fn new(origin: Vec3A, direction: Vec3A, end: f32, skip: [u32; 2]) -> Self {
        // Zeros are made positive: -0.0 and its inverse would disagree in sign.
        let direction = direction + Vec3A::ZERO;
        Query { shear: Shear::new(origin, direction), origin, direction, end, skip }
    }

    /// The meeting with a triangle, if it is before `reach` and on no plane to skip.
    #[inline(always)]
    pub(crate) fn candidate(&self, triangle: &Triangle, label: &Label, reach: f32) -> Option<(Meeting, Label)> {
        let meeting = self.shear.meet(triangle)?;
        if !(meeting.t > 0.0 && meeting.t < reach) {
            return None;
        }
        let skipped = label.plane == self.skip[0] || label.plane == self.skip[1];
        (!skipped).then_some((meeting, *label))
    }
}

impl Tree {
    /// In blocks if there are fewer than `many` faces and the blocks suffice, otherwise in a hierarchy.
    pub(crate) fn of(faces: &[(Triangle, Label)], pad: f32, many: usize) -> Self {
        let boxes: Vec<Bounds> = faces.par_iter().map(|(t, _)| t.padded_box(pad)).collect();
        if faces.len() < many {
            let groups = clusters(&boxes, LANES);
            if groups.len() <= BLOCKS {
                let cluster = |g: &Vec<u32>| g.iter().map(|&i| faces[i as usize]).collect();
                let clusters: Vec<_> = groups.iter().map(cluster).collect();
                return Tree::Few(Few::new(&clusters, pad));
            }
        }
        let face = |i: u32| Some(faces[i as usize]);
        Tree::Many(Many::new(&Layout::new(&boxes), face))
    }

    /// The first meeting.
    #[inline]
    pub(crate) fn closest(&self, query: &Query) -> Option<Hit> {
        match self {
            Tree::Few(few) => few.closest(query),
            Tree::Many(many) => many.closest(query),
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
            Tree::Few(few) => few.is_clear(query),
            Tree::Many(many) => many.is_clear(query),
        }
    }

    /// Every meeting as [`Tree::all`], or false as soon as an opaque face is met.
    #[inline]
    pub(crate) fn all_unless(&self, opaque: impl Fn(u32) -> bool, query: &Query, out: &mut Vec<Hit>) -> bool {
        match self {
            Tree::Few(few) => few.all_unless(opaque, query, out),
            Tree::Many(many) => many.all_unless(opaque, query, out),
        }
    }
}

/// Sorting key of a meeting: backs count as a few ulps further, so that of a thin sheet the front comes first.
#[inline]
pub(crate) fn depth(t: f32, side: Side) -> f32 {
    match side {
        Side::Front => t,
        Side::Back => t + 5e-7 * (1.0 + t),
    }
}

/// Whether `a` is met before `b`: by depth, then front before back, then face.
///
/// Within one plane, which a line meets once, the front comes first whatever the rounding of t.
#[inline]
pub(crate) fn precedes(a: &(Meeting, Label), b: &(Meeting, Label)) -> bool {
    let ((a, of_a), (b, of_b)) = (a, b);
    if of_a.plane == of_b.plane && a.side != b.side {
        return a.side == Side::Front;
    }
    let (near, far) = (depth(a.t, a.side), depth(b.t, b.side));
    near < far || (near == far && (a.side, of_a.face) < (b.side, of_b.face))
}

/// A meeting told in full.
#[inline]
pub(crate) fn hit(meeting: &Meeting, label: &Label) -> Hit {
    Hit { t: meeting.t, face: label.face, side: meeting.side, u: meeting.u, v: meeting.v }
}
