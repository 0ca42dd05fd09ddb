//! Rays: the first face met, every face met in order, and whether two points see each other.
//!
//! Watertight: a closed surface is never slipped through at its edges or vertices, neither by rays that cross them nor
//! by rays that start next to them. A face is found by its id and the side met. Results depend on the scene and the ray
//! alone, so any number of threads may cast them.
//!
//! Not handled: curved primitives, instances, moving scenes. Lengths are unit coordinates throughout.

pub(crate) mod accelerator;
pub(crate) mod block_list;
pub(crate) mod blocks;
pub(crate) mod bvh;
pub(crate) mod bvh_build;
pub(crate) mod hull_faces;
pub(crate) mod lanes;
pub(crate) mod masked_faces;
pub(crate) mod meetings;
pub mod purpose;
pub(crate) mod ray;
pub(crate) mod ray_offset;
pub(crate) mod scene_rays;
pub mod sobol;
#[cfg(test)]
mod tests;
pub(crate) mod triangle;
pub mod warp;

pub use masked_faces::{Cell, Seen};
pub use ray::{End, Ray};
pub use scene_rays::Rays;
pub use triangle::{Hit, Side};
pub use warp::{FAN, Fan};
