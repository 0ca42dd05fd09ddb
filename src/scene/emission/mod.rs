//! What emits in a scene: the sky around it, and all emitters by name.

mod emitters;
mod radiance_matrix;
mod sky;
mod sky_patches;

pub use emitters::{Emitters, MOST_EMITTERS};
pub use radiance_matrix::RadianceMatrix;
pub use sky::SkyLight;
pub use sky_patches::SkyPatches;
