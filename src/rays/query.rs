//! A ray made ready for the accelerators, and which of several meetings counts as the first.
//!
//! Meetings that are close together are put in order by [`Candidate::precedes`], whatever order they are found in.
//!
//! Not handled: the test itself, which is that of [`crate::rays::triangle`].

use glam::Vec3A;

use crate::rays::ray::{Hit, Side};
use crate::rays::triangle::{Meeting, Shear, Triangle};

/// Two meetings further apart than this are not taken for the same place of one plane. t errs by about 2e-7 over the
/// cosine between ray and normal, so this covers all but the most grazing rays.
pub(crate) const SAME_PLACE: f32 = 1e-3;

/// No plane: nothing is skipped.
pub(crate) const NO_PLANE: u32 = u32::MAX;

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

    /// The meeting with a triangle of a plane, if it is before `reach` and the plane is none to skip.
    #[inline(always)]
    pub(crate) fn candidate(&self, triangle: &Triangle, plane: u32, reach: f32) -> Option<Candidate> {
        let meeting = self.shear.meet(triangle)?;
        let within = meeting.t > 0.0 && meeting.t < reach;
        (within && plane != self.skip[0] && plane != self.skip[1]).then_some(Candidate { meeting, plane })
    }
}

/// A meeting that counts, and the plane of the triangle met.
#[derive(Clone, Copy)]
pub(crate) struct Candidate {
    pub meeting: Meeting,
    pub plane: u32,
}

/// Sorting key of a meeting: backs count as a few ulps further, so that of a thin sheet the front comes first.
#[inline]
pub(crate) fn depth(t: f32, side: Side) -> f32 {
    match side {
        Side::Front => t,
        Side::Back => t + 5e-7 * (1.0 + t),
    }
}

impl Candidate {
    /// Whether it is met before another: by depth, then front before back, then by face, which `by_face` tells.
    ///
    /// Within one plane, which a line meets once, the front comes first whatever the rounding of t.
    #[inline]
    pub(crate) fn precedes(&self, other: &Candidate, by_face: impl FnOnce() -> bool) -> bool {
        let (a, b) = (&self.meeting, &other.meeting);
        if self.plane == other.plane && a.side != b.side {
            return a.side == Side::Front;
        }
        let (near, far) = (depth(a.t, a.side), depth(b.t, b.side));
        near < far || (near == far && (a.side < b.side || (a.side == b.side && by_face())))
    }
}

/// A meeting told in full.
#[inline]
pub(crate) fn hit(meeting: &Meeting, face: u32) -> Hit {
    Hit { t: meeting.t, face, side: meeting.side, u: meeting.u, v: meeting.v }
}
