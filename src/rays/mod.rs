//! Rays: the first face met, every face met in order, and whether two points see each other.
//!
//! Watertight: a closed surface is never slipped through at its edges or vertices, neither by rays that cross them nor
//! by rays that start next to them. A face is found by its id and the side met. Results depend on the scene and the ray
//! alone, so any number of threads may cast them.
//!
//! Not handled: curved primitives, instances, moving scenes. Lengths are unit coordinates throughout.

pub(crate) mod accelerator;
pub(crate) mod block_clusters;
pub(crate) mod block_list;
pub(crate) mod box_block;
pub(crate) mod bvh;
pub(crate) mod bvh_build;
pub(crate) mod bvh_traversal;
pub(crate) mod crossings;
pub(crate) mod hull_faces;
pub(crate) mod masked_faces;
pub(crate) mod meetings;
pub(crate) mod packet;
pub(crate) mod purpose;
pub(crate) mod query;
pub(crate) mod ray;
pub(crate) mod ray_offset;
pub(crate) mod scene_rays;
pub(crate) mod simd_block;
pub mod sobol;
#[cfg(test)]
mod tests;
pub(crate) mod transmit;
pub(crate) mod triangle;
pub(crate) mod vector_level;
pub mod warp;

pub use packet::{FAN, Fan};
pub use ray::{End, Hit, Ray, Side};
pub use scene_rays::Rays;
