//! The light that the camera rays of one pixel found, sums over them in two halves.
//!
//! Not handled: indirect light that is gathered; until then the light that patches receive stands for it.

use glam::DVec3;

/// Sums of light over the camera rays of a pixel, of each half.
#[derive(Default)]
pub(crate) struct PixelLight {
    /// Light as emitted.
    pub emitted: [DVec3; 2],
    /// Direct light.
    pub lit: [DVec3; 2],
    /// Indirect light: what the patches themselves receive, until it is gathered.
    pub ambient: [DVec3; 2],
    /// Each emitter's part of light as emitted and of direct light; empty where they are not kept apart.
    pub emitters: Vec<[DVec3; 2]>,
}

impl PixelLight {
    /// All light of each half, of which what is emitted counts no more than `most`.
    pub(crate) fn halves(&self, most: f64) -> [DVec3; 2] {
        [0, 1].map(|half| self.emitted[half].min(DVec3::splat(most)) + self.lit[half] + self.ambient[half])
    }

    /// The sums of an emitter that is kept apart.
    pub(crate) fn emitter(&mut self, number: usize) -> &mut [DVec3; 2] {
        if self.emitters.len() <= number {
            self.emitters.resize(number + 1, [DVec3::ZERO; 2]);
        }
        &mut self.emitters[number]
    }
}
