//! Direct light: what a place receives as emitted from luminaires, in closed form times what is seen of them.
//!
//! [`Lights`] integrates Lambert's closed form over the part of each [`Luminaire`] that the place sees ([`emitters`]).
//! Where there are many luminaires they stand in a light tree and each patch keeps a cut through it ([`many`]); what
//! the cut leaves open is drawn by chance with the cut's light as control variate. After B. Walter et al., *Lightcuts*,
//! 2005, and A. Conty, C. Kulla, *Importance sampling of many lights*, 2018.
//!
//! Lights without area are closed forms times visibility alone.
//!
//! Not handled: emitters that fill much of what is seen (a furnace); those go by the rows of F.

pub(crate) mod drawn_light;
pub(crate) mod emitters;
pub(crate) mod highlights;
pub(crate) mod lights;
pub(crate) mod luminaire_light;
pub(crate) mod many;
pub(crate) mod punctual_light;
pub(crate) mod received;

pub use emitters::luminaire::Luminaire;
pub(crate) use emitters::luminaire_texture::TOLERABLE;
pub use emitters::luminaires::Luminaires;
pub use emitters::occlusion::Occlusion;
pub use emitters::shafts::{Between, Shafts};
pub(crate) use highlights::Highlights;
pub use lights::Lights;
pub use luminaire_light::{DirectSum, Lamp, Scratch};
pub use received::{Choice, LightSum, Received};
