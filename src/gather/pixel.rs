//! What the camera rays of one pixel found, in two halves whose difference tells the standard error.
//!
//! Not handled: indirect light that is gathered; until then the light that patches receive stands for it.

use glam::DVec3;

use crate::gather::pixel_layer::{Layer, SurfaceKey};
use crate::gather::pixel_texture::PixelTexture;
use crate::light::Rgb;
use crate::surfaces::SurfacePoint;

/// What one pixel found, sums over its camera rays.
#[derive(Default)]
pub(crate) struct Pixel {
    /// Light as emitted, of each half.
    pub emitted: [DVec3; 2],
    pub direct: DVec3,
    /// Direct light of each half.
    pub lit: [DVec3; 2],
    /// Indirect light of each half: what the patches themselves receive, until it is gathered.
    pub ambient: [DVec3; 2],
    /// Camera rays of each half.
    pub count: u32,
    pub layers: Vec<Layer>,
    /// The texture, where it is the same surface everywhere.
    pub texture: PixelTexture,
    pub backs: u32,
    /// Camera rays that met light as emitted.
    pub emitting: u32,
    /// Whether the pixel counts in the error whatever it emits, as where the picture shows nothing but luminaires.
    pub counts_emission: bool,
    /// Camera rays that met a side that reflects.
    pub reflecting: u32,
    pub rays: u64,
    /// The variance by the difference of the halves, when that was last noted.
    pub differed: f64,
    /// The variance as it was foreseen before the last rays were cast, which knows nothing of what they found.
    pub foreseen: f64,
    /// Camera rays of each half when the difference was last noted.
    pub noted: u32,
}

/// Rays that tell whether a pixel sees a luminaire.
const LOOKS: i32 = 16;

impl Pixel {
    /// The layer of a surface seen; a new one if no camera ray has seen it before.
    pub fn layer(&mut self, key: SurfaceKey, seen: SurfacePoint, rho: Rgb) -> &mut Layer {
        let found = self.layers.iter().position(|l| l.holds(key, &seen));
        let k = found.unwrap_or_else(|| {
            self.layers.push(Layer::new(key, seen, rho));
            self.layers.len() - 1
        });
        &mut self.layers[k]
    }

    /// Camera rays of both halves.
    pub fn camera(&self) -> f64 {
        f64::from(2 * self.count)
    }

    /// Whether some camera rays met light as emitted, but not all.
    pub fn shows_outline(&self) -> bool {
        0 < self.emitting && self.emitting < 2 * self.count
    }

    /// Light as emitted, sum over the camera rays.
    pub fn emission(&self) -> DVec3 {
        self.emitted[0] + self.emitted[1]
    }

    /// All light of each half, sums over its camera rays.
    pub fn halves(&self) -> [DVec3; 2] {
        self.halves_below(f64::INFINITY)
    }

    /// The light of each half, of which what is emitted counts no more than `bright`, sums over its camera rays.
    pub fn halves_below(&self, bright: f64) -> [DVec3; 2] {
        let most = if self.counts_emission { f64::INFINITY } else { bright * f64::from(self.count) };
        [0, 1].map(|half| self.emitted[half].min(DVec3::splat(most)) + self.lit[half] + self.ambient[half])
    }

    /// Standard error squared of the mean of two halves of the camera rays, all channels.
    pub fn variance(&self, [a, b]: [DVec3; 2]) -> DVec3 {
        let d = (a - b) / self.camera();
        d * d
    }

    /// Takes note of what the halves differ by, their emission up to `bright`; what they differed by before the last
    /// rays counts by the share `left` that those rays are expected to leave.
    pub fn note_difference(&mut self, bright: f64, left: f64) {
        let now = self.variance(self.halves_below(bright)).element_sum();
        if self.noted == 0 {
            self.foreseen = now;
        } else if self.noted < self.count {
            self.foreseen = left * self.differed;
        }
        (self.differed, self.noted) = (now, self.count);
    }

    /// How much the pixel counts in the error: the chance that none of [`LOOKS`] rays through it meets light as
    /// emitted. Pixels that see a luminaire count nothing, those that a sliver of one lies in count a little less than
    /// others.
    pub fn weight(&self) -> f64 {
        if self.counts_emission {
            return 1.0;
        }
        let share = f64::from(self.emitting) / self.camera().max(1.0);
        (1.0 - share).powi(LOOKS)
    }
}
