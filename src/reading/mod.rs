//! Reading the light on patches along rays: what a ray meets in a scene, which light leaves there for its pixel, and
//! from how near the light of a patch may stand for that of its points.
//!
//! Not handled: how many rays there are, and what their mean is off by.

pub(crate) mod patch_light;
pub(crate) mod reflection;
pub(crate) mod view;

pub use patch_light::{Fields, Linear, READINGS, Reading, invisible, linear};
pub use view::View;
