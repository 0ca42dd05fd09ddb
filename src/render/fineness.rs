//! How finely K is sampled.

use crate::form_factors::Sampling;

/// Patches, and rays from each, that a search for an error of 1 % begins with.
const FIRST_PATCHES: f64 = 1000.0;
const FIRST_RAYS: f64 = 128.0;

/// How finely a scene is cut into patches, and how many rays each of them casts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fineness {
    /// About how many patches; small faces next to each other share one.
    pub patches: usize,
    /// Hemisphere rays from each patch.
    pub rays: u32,
}

impl Default for Fineness {
    fn default() -> Self {
        Fineness { patches: 4000, rays: Sampling::default().rays }
    }
}

impl Fineness {
    /// What a search for an error begins with: more patches and rays the smaller it is, within limits.
    pub fn first(tolerance: f64) -> Fineness {
        let finer = Fineness::over_one_percent(tolerance);
        let rays = (FIRST_RAYS * finer.sqrt()) as u32;
        Fineness { patches: (FIRST_PATCHES * finer) as usize, rays: rays.next_power_of_two() }
    }

    /// What the terms of the bounce series are solved with where their powers have a tolerance: the default at 1 %.
    pub fn of_terms(tolerance: f64) -> Fineness {
        let (finer, Fineness { patches, rays }) = (Fineness::over_one_percent(tolerance), Fineness::default());
        let rays = ((f64::from(rays) * finer) as u32).max(16);
        Fineness { patches: (patches as f64 * finer) as usize, rays }
    }

    /// How many times finer than for a tolerance of 1 % patches and rays are.
    fn over_one_percent(tolerance: f64) -> f64 {
        (0.01 / tolerance).clamp(0.1, 10.0)
    }

    /// The rays to cast from the patches, scrambled by `seed`.
    pub fn sampling(self, seed: u32) -> Sampling {
        Sampling { rays: self.rays, seed, ..Sampling::default() }
    }
}
