//! Textures: images on surfaces, looked up at points and averaged over triangles.
//!
//! Not handled: bump and normal maps, textures that are computed.

mod edge_bands;
pub(crate) mod maps;
pub(crate) mod mean;
mod polygon_mean;
pub(crate) mod stored_image;
pub(crate) mod texture;

pub use maps::{Maps, Mask};
pub use stored_image::{Channel, Image};
pub use texture::{Filter, Texture, Wrap};
