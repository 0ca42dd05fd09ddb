//! Textures: images on surfaces, looked up at points and averaged over triangles.
//!
//! Not handled: bump and normal maps, mipmaps, textures that are computed.

pub(crate) mod image;
pub(crate) mod maps;
pub(crate) mod mean;
pub(crate) mod texture;

pub use image::{Channel, Image};
pub use maps::{Maps, Mask};
pub use texture::{Filter, Texture, Wrap};
