//! Surfaces: flat pieces of the scene's geometry, where others touch them, and the normals of faces.
//!
//! All of it depends on the scene alone and is found once, however often patches are cut from it. A [`SurfacePoint`] is
//! a place on it.

pub(crate) mod atlas;
pub(crate) mod coplanar;
pub(crate) mod discontinuities;
pub(crate) mod face_means;
pub(crate) mod geometry;
pub(crate) mod surface_point;

pub use atlas::Atlas;
pub use geometry::{Geometry, Surfaces};
pub use surface_point::SurfacePoint;
