//! Errors of the light on patches, measured without patches: the residual of the equation along paths from the camera,
//! its squared sum over sampled pixels, and walks of light from the emitters, to where they land, from surface to
//! surface and on to the camera.
//!
//! Not handled: errors of the gather pass, which it estimates itself with `halves::Halves`; what is done about an
//! error, which is up to [`crate::render`].

pub(crate) mod bounce_powers;
pub(crate) mod halves;
pub(crate) mod importance_paths;
pub(crate) mod landings;
pub(crate) mod light_tracing;
pub(crate) mod light_walks;
pub(crate) mod reading_distance;
pub(crate) mod residual;
pub(crate) mod sampled_pixels;
pub(crate) mod walk_sources;

pub use importance_paths::ImportancePaths;
pub(crate) use reading_distance::nearest_read;
pub(crate) use residual::add_samples_of_bright;
pub(crate) use sampled_pixels::{SampledPixels, SamplingGoal, SquaredError};
