//! Direct light: what a point receives as emitted, one estimator for patches, points, camera rays and paths.
//!
//! ```text
//! D(x)  =  sum over parts p of  c_p F_p(x) E_p   +   1/n sum over draws of  F_p(x) E_p (T - c_p) / P(p)
//! ```
//!
//! The parts are nodes of a tree of luminaires, of each emitter that is kept apart one. F_p E_p is known in closed
//! form: Lambert's sum for a [`Luminaire`], a quadtree of moments for its texture, moments of nodes, polynomials over
//! flat patches for sums of many. c_p is the share of it that is expected to arrive, whatever it is: 1 where nothing
//! stands between, exact where the shadows of few faces are cut out, by trial rays elsewhere. Where c_p is not known
//! for certain the rest is drawn: a part by its P, a luminaire in it by power, a point of that by what it sends, and
//! one visibility ray finds the transmittance T. No P is 0 where light may come, and no ratio is taken: there is no
//! bias but for what nodes and polynomials may be off by ([`Lights::stand_ins`]), which samples for the error of a
//! picture do without.
//!
//! A ray's light through the files: luminaires and points on them (`emitters`), the tree and the cut through it that a
//! patch or a point reads (`many`), all of both for one (alpha, tau) ([`Lights`]), the estimate at one receiver
//! (`drawn_light`), and what patches and pixels add up (`received`). Punctual lights and highlights are sampled beside.
//!
//! Sources: B. Walter et al., *Lightcuts*, 2005; A. Conty Estevez, C. Kulla, *Importance sampling of many lights with
//! adaptive tree splitting*, PACMCGIT 1(2), 2018; J. Arvo, *Stratified sampling of spherical triangles*, 1995; E.
//! Veach, *Robust Monte Carlo methods for light transport simulation*, 1997. Worth: docs/validation.md, Points on
//! luminaires.
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
pub(crate) mod strata_light;
pub(crate) mod systematic;

pub use drawn_light::Scratch;
pub use emitters::luminaire::Luminaire;
pub use emitters::luminaire_texture::TOLERABLE;
pub use emitters::luminaires::Luminaires;
pub use emitters::occlusion::Occlusion;
pub use highlights::Highlights;
pub use lights::{Cuts, Lights, OwnCuts};
pub use received::{Choice, LightSum, Received};
