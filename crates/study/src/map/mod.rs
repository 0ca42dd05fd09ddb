//! The stability map: bounds on the spectral radius over the (alpha, tau) square, and the two frontiers, from one cast
//! of rays.
//!
//! A material without numbers of its own takes (alpha, tau); one with its own takes alpha times its alpha and tau times
//! its tau. Then with `B(alpha, tau) = alpha b F^tau`, b = own alpha rho,
//!
//! ```text
//! radius(alpha, tau) = alpha radius(1, tau)               so alpha_c(tau) = 1 / radius(1, tau): one column a tau
//! second moment of a path's weight ~ (alpha² radius of M(tau))ⁿ     so alpha_v(tau) = radius(M(tau))^(-1/2)
//! ```
//!
//! M is the operator of squared weights of the path tracer ([`Survey::moment`]). alpha_v <= alpha_c always
//! (Cauchy-Schwarz: M x² >= (B x)² ray by ray). The bounds are those of
//! [`spectrum_of`](halflight::operator::spectrum_of): proofs for F as cast.
//!
//! Not handled: noise of F itself, which the number of rays sets.

pub(crate) mod contour;
pub(crate) mod stability;
pub(crate) mod survey;
pub(crate) mod variance;

pub use contour::MapChart;
pub use stability::{Column, FrontierPoint, GridPoint, Map, TauPoint, at, map};
pub use survey::Survey;
pub use survey::check_crossings;
pub use variance::{Growth, Variance, growth};
