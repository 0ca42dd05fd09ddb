//! Points of surfaces, which rays leave from.
//!
//! Not handled: the patch a point belongs to, which [`Patches::at`](crate::patches::Patches::at) finds.

use glam::Vec3;

use crate::rays::End;

/// A point on one side of a face, that sends or receives light there.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Unit coordinates.
    pub position: Vec3,
    /// Unit normal of the side.
    pub normal: Vec3,
    /// The face it lies on; [`SurfacePoint::NO_FACE`] for a point in the air.
    pub face: u32,
}

impl SurfacePoint {
    /// The face of points that lie on none.
    pub const NO_FACE: u32 = u32::MAX;

    /// The face that rays from the point cannot meet.
    #[inline]
    pub fn source(&self) -> Option<u32> {
        (self.face != SurfacePoint::NO_FACE).then_some(self.face)
    }

    /// The point as an end of a visibility ray.
    pub fn end(&self) -> End {
        (self.position, self.source())
    }
}
