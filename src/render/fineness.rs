//! How finely K is sampled.

use crate::form_factors::Sampling;

/// How finely a scene is cut into patches, and how many rays each of them casts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fineness {
    /// About how many patches; never fewer than the scene has faces.
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
    /// The rays to cast from the patches, scrambled by `seed`.
    pub fn sampling(self, seed: u32) -> Sampling {
        Sampling { rays: self.rays, seed, ..Sampling::default() }
    }
}
