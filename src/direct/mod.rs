//! Direct light: what a point receives as emitted from luminaires, in closed form times visibility.
//!
//! [`Lights`] integrates Lambert's closed form over the visible part of each [`Luminaire`] (`emitters`). Many
//! luminaires form a light tree, and each patch has a cut through it (`many`); nodes that the cut does not resolve
//! are sampled with the cut's light as control variate (B. Walter et al., *Lightcuts*, 2005; A. Conty Estevez, C.
//! Kulla, *Importance sampling of many lights with adaptive tree splitting*, 2018).
//!
//! Not handled: emitters of large solid angle (a furnace), whose light is in the rows of F.

pub(crate) mod drawn_light;
pub(crate) mod emitters;
pub(crate) mod highlights;
pub(crate) mod lights;
pub(crate) mod luminaire_light;
pub(crate) mod many;
pub(crate) mod punctual_light;
pub(crate) mod received;
pub(crate) mod systematic;

pub use emitters::luminaire::Luminaire;
pub use emitters::luminaire_texture::TOLERABLE;
pub use emitters::luminaires::Luminaires;
pub use emitters::occlusion::Occlusion;
pub use emitters::shafts::{Between, Shafts};
pub(crate) use highlights::Highlights;
pub use lights::Lights;
pub use luminaire_light::{DirectSum, Lamp, Scratch};
pub use received::{Choice, LightSum, Received};
