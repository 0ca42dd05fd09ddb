//! Answers found another way: a vector-valued path tracer, the witness to the solver, and real OpenGL ([`opengl`]).
//!
//! It gathers light into the camera, as the paper did, along random paths, and knows nothing of patches, form factors
//! or operators. It shares with the solver the light, the scene and the rays; random numbers and directions are its
//! own. A picture comes with the standard error of every pixel, and each bounce order comes apart.
//!
//! ```text
//! pixel        = E_visible + rho I + highlights of E        at the first surface, whatever its tau
//! I (incident) = mean over cosine-distributed directions of
//!                sum over crossings c of [c is met on a side that sends] T_c (E_c + alpha_c rho_c I_c)
//! T_c          = product of tau of the surfaces crossed before c
//! ```
//!
//! Not handled: whether the series converges. A tracer sees finitely many bounces; it counts the paths that were cut.
//!
//! Source: D. C. Banks, K. M. Beason, *Retro-rendering with vector-valued light*, SPIE 6060, 2006.

pub(crate) mod lights;
pub mod opengl;
pub(crate) mod path;
pub(crate) mod random;
pub(crate) mod surfaces;
pub(crate) mod tracer;

pub use path::{KEPT, NextEvent};
pub use tracer::Tracer;
pub use tracer::{Counts, Mean, Overflow, TraceSettings};
