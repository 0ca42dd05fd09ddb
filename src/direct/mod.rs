//! Direct light: what a point receives as emitted from luminaires, in closed form times visibility.
//!
//! [`Lights`] integrates Lambert's closed form over the visible part of each [`Luminaire`] (`emitters`). Many
//! luminaires form a light tree, and each patch has a cut through it (`many`); nodes that the cut does not resolve
//! are sampled with the cut's light as control variate (B. Walter et al., *Lightcuts*, 2005; A. Conty Estevez, C.
//! Kulla, *Importance sampling of many lights with adaptive tree splitting*, 2018).
//!
//! The words for what emits, here and in all rooms. An *emitter* is whatever has E > 0 and a name: an object or a
//! material, a punctual light, the sky ([`crate::scene::Emitters`]). A *luminaire* is an emitting surface, or part of
//! one, whose light is found by closed form (P. Shirley et al. 1996, J. Arvo 1995). A *punctual light* has no area
//! (glTF's `KHR_lights_punctual`). *Light* is what travels, L, and never what sends it; the type [`Lights`] holds the
//! luminaires and punctual lights of one (alpha, tau).
//!
//! Not handled: emitters of large solid angle (a furnace), whose light is in the rows of F.

pub(crate) mod agreement;
pub(crate) mod drawn_light;
pub(crate) mod emitters;
pub(crate) mod highlights;
pub(crate) mod lights;
pub(crate) mod many;
pub(crate) mod punctual_light;
pub(crate) mod received;
pub(crate) mod systematic;

pub use drawn_light::Scratch;
pub use emitters::luminaire::Luminaire;
pub use emitters::luminaire_texture::TOLERABLE;
pub use emitters::luminaires::Luminaires;
pub use emitters::occlusion::Occlusion;
pub(crate) use highlights::Highlights;
pub use lights::{Cuts, Lights, OwnCuts};
pub use received::{Choice, LightSum, Received};
