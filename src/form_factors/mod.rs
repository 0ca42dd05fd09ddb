//! Form factors: the share of light that gets from patch to patch.
//!
//! ```text
//! F^tau_ij = mean over cosine-distributed rays from i of  sum over crossings c of the ray
//!            [crossing c is a reflecting side of patch j] * product of tau of the surfaces crossed before c
//! ```
//!
//! Two estimators of one operator, kept apart. [`cast`] fills rows of F with hemisphere rays, for light as
//! reflected: in a closed opaque scene its row sums are exactly 1. [`receive_emitted`] evaluates light as emitted by
//! [`Luminaire`]s, closed form of the polygon times visibility, which needs some sixty times less work for the same
//! error. Surfaces that emit but are no luminaires (everything, in a furnace) go by the rows.
//!
//! Between whole objects, [`planar`] finds form factors by contour integrals and by quadrature, to as many digits as asked
//! for, and [`sampled`] by rays where there are too many faces for that.
//! [`cast_layers`] keeps the crossings of the rays apart, so that one cast gives `F^tau` for every tau.
//!
//! [`closure`] and [`reciprocity`] are checks for anyone to call; nothing is silently repaired.

mod asked;
mod body;
mod cast;
mod checks;
mod convex;
mod drawn;
mod emitted;
mod facing;
mod lamps;
mod large;
mod layers;
mod links;
mod luminaire;
mod many;
mod moments;
mod outline;
mod pieces;
pub mod planar;
mod polygon;
pub mod sampled;
mod shadow;
mod shaft;
mod sight;
mod smooth;
mod sparse;
mod walk;

pub use asked::Lighting;
pub use cast::{FormFactors, Variant, cast, cast_counts};
pub use checks::{Closure, closure, reciprocity};
pub use emitted::{DirectSum, Receiver, Scratch, gather_luminaire, receive_emitted};
pub use layers::{Layers, cast_layers};
pub use links::Links;
pub use luminaire::{Luminaire, Luminaires};
pub use polygon::{point_kernel, point_to_polygon};
pub use shaft::{Between, Shafts};
pub use sight::{Occlusion, Sight};
pub use sparse::Rows;

/// How many rays, and which.
#[derive(Clone, Copy, Debug)]
pub struct Sampling {
    /// Hemisphere rays a patch, for the rows of F.
    pub rays: u32,
    /// Receiver points a patch and luminaire, each with one visibility ray, for light as emitted.
    pub emitter_rays: u32,
    /// Chooses the scrambling of the points; the same seed gives the same bits.
    pub seed: u32,
}

impl Default for Sampling {
    fn default() -> Self {
        Sampling { rays: 256, emitter_rays: 64, seed: 0 }
    }
}

/// Called with the number of rows that were just finished.
pub type Progress<'a> = &'a (dyn Fn(u64) + Sync);
