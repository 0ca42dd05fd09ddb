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
//! Between whole objects, [`Bodies`] finds form factors by contour integrals and by quadrature, to as many digits as
//! requested, and [`Sampler`] by rays where there are too many faces for that.
//!
//! [`row_sums`] and [`reciprocity`] are checks for anyone to call; nothing is silently repaired.

pub(crate) mod adaptive_integration;
pub(crate) mod cast;
pub(crate) mod chebyshev;
pub(crate) mod columns;
pub(crate) mod contour_integral;
pub(crate) mod cubature;
pub(crate) mod exact;
pub(crate) mod facet;
pub(crate) mod hull;
pub(crate) mod lambert;
pub(crate) mod layers;
pub(crate) mod occluders;
pub(crate) mod plane;
pub(crate) mod product;
pub(crate) mod sampled;
pub(crate) mod shadow;
pub(crate) mod sparse;

pub use adaptive_integration::{Estimate, Tolerance};
pub use cast::{FormFactors, Progress, RowSums, Sampling, Variant, cast, cast_counts, reciprocity, row_sums};
pub use columns::{Columns, PANEL};
pub use exact::{Bodies, Method};
pub use lambert::{point_kernel, point_to_polygon};
pub use layers::{LayerNumbers, Layers, cast_layers};
pub use sampled::Sampler;
pub use sparse::Rows;
