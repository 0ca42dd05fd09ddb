//! How far light on patches is off, measured without patches: paths from the camera and what of the equation they find
//! unmet, pixels drawn by chance that add it up to a squared error, and walks of light from the emitters.
//!
//! Not handled: errors of the gather pass, which it estimates itself with [`Halves`]; what is done about an error,
//! which is the business of those that render.

pub(crate) mod deadline;
pub(crate) mod halves;
pub(crate) mod importance_paths;
pub(crate) mod light_walks;
pub(crate) mod reading_distance;
pub(crate) mod residual;
pub(crate) mod sampled_pixels;

pub use importance_paths::ImportancePaths;
pub(crate) use reading_distance::nearest_read;
pub(crate) use residual::add_samples_of_bright;
pub(crate) use sampled_pixels::{Effort, SampledPixels, SquaredError};
