//! A ray, what it meets, and the ends of a segment.
//!
//! Not handled: how they are found; that is [`crate::rays::Rays`].

use glam::Vec3;

/// A ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts; on `source` if there is one.
    pub origin: Vec3,
    /// Unit vector.
    pub direction: Vec3,
    /// The face it starts on. Faces of the same plane are not met again.
    pub source: Option<u32>,
}

impl Ray {
    /// The point at distance t, unit coordinates.
    #[inline]
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + t * self.direction
    }
}

/// One meeting of a ray and a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray, unit coordinates.
    pub t: f32,
    /// The face's index in the scene.
    pub face: u32,
    /// The side of the face the ray meets.
    pub side: Side,
    /// Barycentric weight of the face's second corner.
    pub u: f32,
    /// Barycentric weight of the face's third corner.
    pub v: f32,
}

/// A side of a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Side {
    /// From which its corners run counter-clockwise.
    Front,
    /// The other.
    Back,
}

/// A point and the face it lies on, if any.
pub type End = (Vec3, Option<u32>);
