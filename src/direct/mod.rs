//! Direct light: what a place receives as emitted from luminaires, in closed form times what is seen of them.
//!
//! [`receive_emitted`] and [`Lighting::gather_luminaire`] integrate Lambert's closed form over the part of each
//! [`Luminaire`] that the place sees. Where there are many luminaires they stand in a light tree (`light_tree`); each
//! patch keeps a cut through it (`light_cut`), and what the cut leaves open is drawn by chance with the cut's light as
//! control variate. After B. Walter et al., *Lightcuts*, 2005, and A. Conty, C. Kulla, *Importance sampling of many
//! lights*, 2018.
//!
//! Lights without area are closed forms times visibility alone ([`Lighting::gather_punctual`]).
//!
//! Not handled: emitters that fill much of what is seen (a furnace); those go by the rows of F.

pub(crate) mod convex_body;
pub(crate) mod convex_luminaires;
pub(crate) mod cut_light;
pub(crate) mod cut_refinement;
pub(crate) mod emission_moments;
pub(crate) mod emission_parts;
pub(crate) mod emission_tree;
pub(crate) mod emitting_triangle;
pub(crate) mod large_emitters;
pub(crate) mod light_choice;
pub(crate) mod light_cut;
pub(crate) mod light_halving;
pub(crate) mod light_sampling;
pub(crate) mod light_tree;
pub(crate) mod luminaire;
pub(crate) mod luminaire_parts;
pub(crate) mod luminaire_texture;
pub(crate) mod moments;
pub(crate) mod normal_cone;
pub(crate) mod occlusion;
pub(crate) mod punctual_light;
pub(crate) mod ratio_estimator;
pub(crate) mod receive;
pub(crate) mod resampled_light;
pub(crate) mod shaft_culling;
pub(crate) mod visibility;

pub use light_cut::LightCuts;
pub use luminaire::{Luminaire, Luminaires};
pub use occlusion::Occlusion;
pub use ratio_estimator::{DirectSum, Lamp, Scratch};
pub use receive::{receive_emitted, receive_punctual};
pub use resampled_light::Asking;
pub use shaft_culling::{Between, Shafts};
pub use visibility::{Lighting, Sight};
