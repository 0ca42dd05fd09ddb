//! The gather pass: the visible half of L at every pixel, by final gathering from the solution on patches.
//!
//! Camera rays determine what a pixel sees; direct light is evaluated there in closed form; indirect light is gathered
//! by hemisphere rays at irradiance records (G. Ward, F. Rubinstein, R. Clear, *A ray tracing solution for diffuse
//! interreflection*, 1988) and interpolated between them. Every part of the error is estimated with the picture.
//!
//! Not handled: specular reflection of what was reflected before, depth of field, motion.

pub(crate) mod gathered;
pub(crate) mod irradiance;
pub(crate) mod nearness;
pub(crate) mod pass;
pub(crate) mod pixels;
pub(crate) mod records;
pub(crate) mod sampling;

pub use gathered::{GatherError, Gathered, GatheredLayer};
pub use nearness::{Nearness, Told};
pub use pass::gather;
pub use sampling::{GatherPass, GatherSampling, Gathering, Limit};
