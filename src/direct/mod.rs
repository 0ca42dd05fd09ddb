//! Direct light: what a place receives as emitted from luminaires, in closed form times what is seen of them.
//!
//! [`Lights`] integrates Lambert's closed form over the part of each
//! [`Luminaire`] that the place sees. Where there are many luminaires they stand in a light tree (`light_tree`); each
//! patch keeps a cut through it (`light_cut`), and what the cut leaves open is drawn by chance with the cut's light as
//! control variate. After B. Walter et al., *Lightcuts*, 2005, and A. Conty, C. Kulla, *Importance sampling of many
//! lights*, 2018.
//!
//! Lights without area are closed forms times visibility alone.
//!
//! Not handled: emitters that fill much of what is seen (a furnace); those go by the rows of F.

pub(crate) mod drawn_light;
pub(crate) mod emission_parts;
pub(crate) mod emission_tree;
pub(crate) mod highlights;
pub(crate) mod light_cut;
pub(crate) mod light_tree;
pub(crate) mod lights;
pub(crate) mod luminaire;
pub(crate) mod luminaire_light;
pub(crate) mod luminaire_texture;
pub(crate) mod luminaires;
pub(crate) mod moments;
pub(crate) mod occlusion;
pub(crate) mod punctual_light;
pub(crate) mod shafts;

pub(crate) use highlights::Highlights;
pub use lights::{Choice, LightSum, Lights, Received};
pub use luminaire::Luminaire;
pub use luminaire_light::{DirectSum, Lamp, Scratch};
pub(crate) use luminaire_texture::TOLERABLE;
pub use luminaires::Luminaires;
pub use occlusion::Occlusion;
pub use shafts::{Between, Shafts};
