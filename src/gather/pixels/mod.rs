//! What pixels see: camera rays, the surfaces that they meet, and how many of them each pixel gets.

pub(crate) mod adaptive_sampling;
pub(crate) mod camera_rays;
pub(crate) mod emission;
pub(crate) mod pixel;
pub(crate) mod pixel_cell;
pub(crate) mod pixel_layer;
pub(crate) mod pixel_light;
pub(crate) mod pixel_noise;
pub(crate) mod pixel_texture;
pub(crate) mod projection;
pub(crate) mod small_faces;
pub(crate) mod smoothing;
pub(crate) mod textured_light;
pub(crate) mod window;
