//! A sky: light that comes from everywhere outside the scene, one radiance from above and one from below.
//!
//! What stands for it in a scene are two faces ([`crate::scene::sky_faces`]).
//!
//! Not handled: a sun, and radiance that varies within a half.

use glam::Vec3;

use crate::light::Rgb;

/// Radiance of a sky, W/(m² sr).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyLight {
    /// From directions with a positive component along up.
    pub upper: Rgb,
    /// From all others.
    pub lower: Rgb,
}

/// The faces that stand for a scene's sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sky {
    /// Unit vector that tells above from below.
    pub up: Vec3,
    /// The face above; the one below follows it, and both are the last of the scene.
    pub first: u32,
    /// Radius of the smallest sphere about the origin of unit coordinates that holds all vertices.
    pub radius: f64,
}

impl Sky {
    /// The face that stands for the sky in a direction.
    #[inline]
    pub fn face(&self, direction: Vec3) -> u32 {
        self.first + u32::from(direction.dot(self.up) <= 0.0)
    }

    /// Whether a face stands for a half of the sky.
    #[inline]
    pub fn holds(&self, face: u32) -> bool {
        face >= self.first
    }
}
