//! The gather pass: the visible half of L at every pixel, by final gathering from the solution on patches.
//!
//! Camera rays find what a pixel sees; direct light is evaluated there in closed form; indirect light is gathered by
//! hemisphere rays at irradiance records (G. Ward, F. Rubinstein, R. Clear, *A ray tracing solution for diffuse
//! interreflection*, 1988) and interpolated between them. Every part of the error is estimated beside the picture.
//!
//! Not handled: specular reflection of what was reflected before, depth of field, motion.

pub(crate) mod adaptive_sampling;
pub(crate) mod bright_patches;
pub(crate) mod cache_refinement;
pub(crate) mod cached_irradiance;
pub(crate) mod camera_rays;
pub(crate) mod continuation;
pub(crate) mod cross_validation;
pub(crate) mod face_projection;
pub(crate) mod fields;
pub(crate) mod final_gather;
pub(crate) mod fit_error;
pub(crate) mod gathered;
pub(crate) mod gradients;
pub(crate) mod guiding;
pub(crate) mod guiding_density;
pub(crate) mod importance_paths;
pub(crate) mod indirect_light;
pub(crate) mod interpolation;
pub(crate) mod irradiance_cache;
pub(crate) mod irradiance_record;
pub(crate) mod layer_fits;
pub(crate) mod pass;
pub(crate) mod path_errors;
pub(crate) mod path_samples;
pub(crate) mod pixel;
pub(crate) mod pixel_cells;
pub(crate) mod pixel_lattice;
pub(crate) mod pixel_layer;
pub(crate) mod pixel_noise;
pub(crate) mod pixel_texture;
pub(crate) mod reading;
pub(crate) mod reading_distance;
pub(crate) mod record_rounds;
pub(crate) mod reflection;
pub(crate) mod sampled_pixels;
pub(crate) mod sampling;
pub(crate) mod settings;
pub(crate) mod small_face;
pub(crate) mod view;

pub(crate) use bright_patches::add_samples_of_bright;
pub use fields::{Fields, invisible};
pub use gathered::{GatherError, Gathered};
pub use gradients::{Linear, linear};
pub use importance_paths::ImportancePaths;
pub use pass::gather;
pub use reading::{READINGS, Reading};
pub(crate) use reading_distance::nearest_read;
pub(crate) use sampled_pixels::{Effort, SampledPixels, SquaredError};
pub use sampling::{GatherPass, GatherSampling, Gathering};
pub use view::View;
