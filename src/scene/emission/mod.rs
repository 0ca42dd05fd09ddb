//! What emits in a scene: the sky around it, and all emitters by name.

mod emitters;
mod sky;

pub use emitters::{Emitters, MOST_EMITTERS};
pub use sky::SkyLight;
