//! Five ways to one picture, each given the same ladder of time, and whether they agree.
//!
//! Patch methods (Neumann over K, progressive shooting over K and with rays alone) climb a ladder of fineness as long
//! as the next rung fits the time; path tracers (with and without next-event estimation) go on adding samples. Errors
//! of the patch methods are taken against the path tracer with next-event estimation, those of the path tracers
//! against the finest Neumann solution: a reference is never of the kind under test, and its own noise is subtracted.
//!
//! Verdicts rest on answers of their own: the patch methods' on patches as fine as time allows ([`answers`]), the path
//! tracers' after all samples.
//!
//! Not handled: adaptive fineness; scenes whose series diverges.

pub(crate) mod arithmetic;
pub(crate) mod comparison;
#[cfg(feature = "plot")]
pub(crate) mod figures;
pub(crate) mod patchwise;
pub(crate) mod replicas;
pub(crate) mod tracing;
pub(crate) mod verdict;

pub use comparison::{CompareError, Comparison, Plan, Point, Stage, Track, compare};
#[cfg(feature = "plot")]
pub use figures::{FigureSheet, error_chart, markdown, order_chart, pairs_table, picture_sheet, points_table, verdict};
pub use patchwise::{Rung, climb};
pub use replicas::answers;
pub use tracing::{Traced, trace};
pub use verdict::{Difference, Pair, judge};

use crate::pictures::{Picture, relative_rms};

/// Bounce orders that are compared one by one: n = 0 to this.
pub const ORDERS: usize = 5;

/// A way to a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// The Neumann series over an assembled K.
    Neumann,
    /// Progressive shooting over an assembled K.
    ShootingAssembled,
    /// Progressive shooting with rays from the shooter; no K.
    ShootingRays,
    /// Path tracing with next-event estimation.
    PathsNextEvent,
    /// Path tracing as in the paper.
    Paths,
}

impl Method {
    /// All five.
    pub const ALL: [Method; 5] =
        [Method::Neumann, Method::ShootingAssembled, Method::ShootingRays, Method::PathsNextEvent, Method::Paths];

    /// As in tables and legends.
    pub fn name(self) -> &'static str {
        match self {
            Method::Neumann => "Neumann over K",
            Method::ShootingAssembled => "shooting over K",
            Method::ShootingRays => "shooting with rays",
            Method::PathsNextEvent => "path tracing, next event",
            Method::Paths => "path tracing",
        }
    }

    /// Whether it solves on patches.
    pub fn is_patchwise(self) -> bool {
        !matches!(self, Method::PathsNextEvent | Method::Paths)
    }
}

/// A picture and its bounce orders after some time.
#[derive(Clone, Debug, Default)]
pub struct Estimate {
    /// Seconds it took, scene loading excluded.
    pub seconds: f64,
    /// How fine: patches and rays, or samples a pixel.
    pub effort: String,
    /// All bounces.
    pub picture: Picture,
    /// Standard error of each pixel and channel; none where it is not known.
    pub noise: Option<Picture>,
    /// Estimated size of the error that more samples do not reduce, per pixel and channel.
    pub systematic: Option<Picture>,
    /// Bounces n = 0 to [`ORDERS`].
    pub orders: Vec<Picture>,
    /// Standard errors of the orders.
    pub order_noise: Option<Vec<Picture>>,
    /// Means over the mask: of the picture, then of the orders. Empty where no verdict rests on this.
    pub means: Vec<Mean>,
    /// Degrees of freedom behind the standard errors of the means.
    pub freedom: f64,
    /// The most that one sample adds to each pixel; none where noise counts as normal.
    pub sample: Option<Picture>,
}

/// A mean over the mask, per channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mean {
    /// Radiance, W/(m² sr).
    pub value: [f64; 3],
    /// Its standard error.
    pub noise: [f64; 3],
    /// Bound on the error that the size of patches makes.
    pub systematic: [f64; 3],
}

/// What a method reached.
#[derive(Clone, Debug)]
pub struct Run {
    /// Which.
    pub method: Method,
    /// After each step of the ladder.
    pub ladder: Vec<Estimate>,
    /// The best, with its errors estimated: what verdicts are based on.
    pub best: Estimate,
}

/// Relative RMS error against a reference over the mask, the reference's noise subtracted; `None` where the reference
/// is black.
pub fn error_against(picture: &Picture, reference: &Picture, noise: Option<&Picture>, mask: &Picture) -> Option<f64> {
    relative_rms(picture, reference, Some(mask), noise).ok()
}
