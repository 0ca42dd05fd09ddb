//! The gather pass: the visible half of L at every pixel, by final gathering from the solution on patches.
//!
//! Camera rays find what a pixel sees; direct light is evaluated there in closed form; indirect light is gathered by
//! hemisphere rays at irradiance records (G. Ward, F. Rubinstein, R. Clear, *A ray tracing solution for diffuse
//! interreflection*, 1988) and interpolated between them. Every part of the error is estimated beside the picture.
//!
//! Not handled: specular reflection of what was reflected before, depth of field, motion.

pub(crate) mod adaptive_sampling;
pub(crate) mod camera_rays;
pub(crate) mod final_gather;
pub(crate) mod fit_error;
pub(crate) mod gathered;
pub(crate) mod guiding;
pub(crate) mod indirect_light;
pub(crate) mod interpolation;
pub(crate) mod irradiance_cache;
pub(crate) mod pass;
pub(crate) mod pixel;
pub(crate) mod pixel_lattice;
pub(crate) mod pixel_texture;
pub(crate) mod record_rounds;
pub(crate) mod sampling;
pub(crate) mod small_faces;

pub use gathered::{GatherError, Gathered};
pub use pass::gather;
pub use sampling::{GatherPass, GatherSampling, Gathering};
