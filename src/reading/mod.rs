//! Reading the light on patches along rays: what a ray meets in a scene, and which light it carries back.
//!
//! Not handled: how many rays there are, and the error of their mean.

pub(crate) mod patch_light;
pub(crate) mod reflection;
pub(crate) mod view;

pub use patch_light::{Fields, Linear, invisible, linear};
pub use view::View;
