//! Where rows of F come from: cast, as always, or known already.
//!
//! F of one choice of tau depends on the geometry, the patches, the rays and their seed, and on nothing else: not on
//! what surfaces reflect and emit, nor on alpha, which only choose the rows and columns that are needed. So a source
//! may answer with what it has as long as that is what [`Cast`] would give.
//!
//! Not handled: where known rows are; whoever has them is a source of its own.

use std::sync::Arc;

use crate::form_factors::{FormFactors, Progress, Sampling, Variant, cast_counts};
use crate::light::team;
use crate::patches::Patches;
use crate::surfaces::Geometry;

/// Rows of F that are wanted.
#[derive(Clone, Copy)]
pub struct Wanted<'a> {
    /// The scene, its rays and its surfaces.
    pub geometry: &'a Geometry,
    /// The patches.
    pub patches: &'a Patches,
    /// The choices of tau, and the rows and columns of each.
    pub variants: &'a [Variant],
    /// How many rays, and which.
    pub sampling: &'a Sampling,
    /// Called with the number of rows that were just finished.
    pub tick: Progress<'a>,
}

/// What gives rows of F.
pub trait RowSource: Send + Sync {
    /// F of every variant, and how many rays were cast for it.
    fn rows(&self, wanted: &Wanted) -> (Vec<FormFactors>, u64);

    /// Whether it takes no ray.
    fn knows(&self, wanted: &Wanted) -> bool;

    /// The largest share of all rows that one process keeps: 1, unless several share a solve and each keeps its own.
    fn kept_share(&self) -> f64 {
        1.0
    }
}

/// All rows of a source, with every process.
pub struct Whole(pub Arc<dyn RowSource>);

impl RowSource for Whole {
    fn rows(&self, wanted: &Wanted) -> (Vec<FormFactors>, u64) {
        let (found, rays) = self.0.rows(wanted);
        (found.into_iter().map(FormFactors::whole).collect(), rays)
    }

    fn knows(&self, wanted: &Wanted) -> bool {
        self.0.knows(wanted)
    }
}

/// Casts all rays.
pub struct Cast;

impl RowSource for Cast {
    fn rows(&self, wanted: &Wanted) -> (Vec<FormFactors>, u64) {
        let Wanted { geometry, patches, variants, sampling, tick } = *wanted;
        cast_counts(&geometry.rays, patches, variants, sampling, &patches.ray_counts(sampling.rays), tick)
    }

    fn knows(&self, _wanted: &Wanted) -> bool {
        false
    }
    fn kept_share(&self) -> f64 {
        team::kept_share()
    }
}
