//! Form factors: the share of light that gets from patch to patch.
//!
//! ```text
//! F^tau_ij = mean over cosine-distributed rays from i of  sum over crossings c of the ray
//!            [crossing c is a reflecting side of patch j] * product of tau of the surfaces crossed before c
//! ```
//!
//! [`cast`](cast()) fills rows of F with hemisphere rays, for light as reflected: in a closed opaque scene its row sums
//! are exactly 1. [`cast_layers`] keeps the crossings of the rays apart, so that one cast gives `F^tau` for every tau.
//! Light as emitted by luminaires goes by the other estimator of the same operator, in `direct`.
//!
//! Between whole objects, [`objects::exact`] finds form factors by contour integrals and by quadrature, to as many
//! digits as asked for, and [`objects::sampled`] by rays where there are too many faces for that.
//!
//! [`closure`] and [`reciprocity`] are checks for anyone to call; nothing is silently repaired.

pub mod geometry;
pub mod objects;
pub mod rows;
pub(crate) mod sampling;

pub use geometry::lambert::{point_kernel, point_to_polygon};
pub use rows::cast::{FormFactors, Variant, cast, cast_counts};
pub use rows::checks::{Closure, closure, reciprocity};
pub use rows::layers::{Layers, cast_layers};
pub use rows::sparse::Rows;
pub use sampling::{Progress, Sampling};
