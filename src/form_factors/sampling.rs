//! How many rays form factors are sampled with, and how their progress is told.
//!
//! Not handled: rays as an error asks for; every patch gets as many.

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
