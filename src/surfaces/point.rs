//! A point of the scene's surface: where it lies, which way it faces and on which face.
//!
//! Not handled: the patch it belongs to, which [`Patches::at`](crate::patches::Patches::at) tells.

use glam::Vec3;

use crate::rays::End;

/// A point on one side of a face, that sends or receives light there.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Unit coordinates.
    pub position: Vec3,
    /// Unit normal of the side.
    pub normal: Vec3,
    /// The face it lies on.
    pub face: u32,
}

impl SurfacePoint {
    /// The point as an end of a visibility ray.
    pub fn end(&self) -> End {
        (self.position, Some(self.face))
    }
}
