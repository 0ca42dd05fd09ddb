//! K, the transport operator: how it is stored, what solvers see of it, and what is proved of its spectrum.
//!
//! ```text
//! K_ij = F_ij rho_i [ alpha_i  0 ]        (K L)_invisible = alpha rho F L_invisible
//!                   [ 1        0 ]        (K L)_visible   =       rho F L_invisible
//! ```
//!
//! for each channel. [`LinearOperator`] is what a solver of `L = E + K L` needs of K; [`Operator`] is the K of a scene,
//! stored factored; [`spectrum`] bounds its spectral radius.
//!
//! Not handled: the entries of F, which `form_factors` finds.

pub(crate) mod factored;
pub(crate) mod linear;
pub(crate) mod row_source;
pub(crate) mod spectrum;

pub use factored::{EmitterLight, Operator, PatchMaterials};
pub use linear::{LinearOperator, LitPatches, Source};
pub use row_source::{Cast, RowSource, Wanted, Whole};
pub use spectrum::{Bounds, Product, Spectrum, SpectrumEffort, operator_norm, spectrum, spectrum_of};
