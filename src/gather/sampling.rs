//! How many rays a picture is gathered with: the same for every pixel, or adaptively to a requested error.
//!
//! Not handled: how an error is divided between kinds of rays ([`crate::light::budget`]).

use std::time::Instant;

use halflight_team::is_over;

use crate::pictures::Size;

/// The variance of a pixel with an edge falls as this power of its rays, which are scrambled nets.
pub(crate) const EDGES: f64 = 1.5;
/// That of records falls as this power of their hemisphere rays.
pub(crate) const RATE: f64 = 1.4;

/// How many rays every pixel gets.
#[derive(Clone, Copy, Debug)]
pub struct GatherSampling {
    /// Camera rays a pixel, in two halves.
    pub camera: u32,
    /// Visibility rays a camera ray and luminaire.
    pub luminaire: u32,
    /// Hemisphere rays for each camera ray.
    pub hemisphere: u32,
    /// Chooses the scrambling of the points.
    pub seed: u32,
}

impl GatherSampling {
    /// Spreads about `samples` hemisphere rays a pixel over camera rays: 16 of those at least, then one for each 8,
    /// which balances noise at edges and within surfaces of the Cornell box.
    pub fn with_samples(samples: u32, seed: u32) -> GatherSampling {
        let samples = samples.clamp(1, 1 << 20).next_power_of_two();
        let camera = (samples / 8).max(samples.min(16));
        let hemisphere = samples / camera;
        GatherSampling { camera, luminaire: (hemisphere / 2).max(1), hemisphere, seed }
    }
}

/// Where a gather pass ends at any error: no round of it begins beyond.
#[derive(Clone, Copy, Debug)]
pub struct Limit {
    /// When; no end where there is none.
    pub deadline: Option<Instant>,
    /// Rays of the camera with those to luminaires, and of hemispheres.
    pub rays: u64,
}

impl Limit {
    /// None.
    pub const NONE: Limit = Limit { deadline: None, rays: u64::MAX };

    /// Whether it is reached, so many rays having been cast.
    pub(crate) fn is_over(&self, rays: u64) -> bool {
        rays >= self.rays || is_over(self.deadline)
    }
}

/// How well the picture is to be gathered.
#[derive(Clone, Copy, Debug)]
pub enum Gathering {
    /// As many rays for one pixel as for another, and a record at each.
    Uniform(GatherSampling),
    /// Adaptive until the estimated error is below `error`: RMS, as a share of the RMS picture, over the pixels that
    /// see no luminaire.
    Within {
        /// The error.
        error: f64,
        /// Share of its square that camera rays may make where there is indirect light.
        camera: f64,
        /// Chooses the scrambling of the points.
        seed: u32,
        /// When to stop at any error.
        limit: Limit,
    },
}

/// A gather pass: how large its picture is, and how well that is to be gathered.
#[derive(Clone, Copy, Debug)]
pub struct GatherPass {
    /// Pixels across and down.
    pub size: Size,
    /// How many rays its pixels get.
    pub gathering: Gathering,
}

impl GatherPass {
    /// A pass for a picture of so many pixels across and down.
    pub fn new(size: impl Into<Size>, gathering: impl Into<Gathering>) -> GatherPass {
        GatherPass { size: size.into(), gathering: gathering.into() }
    }
}

impl From<&GatherSampling> for Gathering {
    fn from(sampling: &GatherSampling) -> Gathering {
        Gathering::Uniform(*sampling)
    }
}
