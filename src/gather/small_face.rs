//! A face smaller than a pixel, which the pixel's first camera rays may all miss, and the variance that it makes.
//!
//! A face that covers a share a of a pixel is missed by n rays with the chance `(1 - a)^n`. If its light differs from
//! that of the pixel by c, the mean of n rays through the pixel has the variance
//!
//! ```text
//! a (1 - a) |c|² / n · min(1, (a n)^-1/2)
//! ```
//!
//! which halves that both missed the face know nothing of, and of which the difference of two halves is a poor estimate
//! in the one pixel that has the face. (Of more than one ray that meets it the points are well spread, and only those
//! by its outline are left to chance.)
//!
//! Not handled: which faces those are ([`crate::gather::face_projection`]).

use glam::DVec3;

/// Standard deviations of the number of rays that meet a face, and one ray more, which chance may make it differ by.
const CHANCE: f64 = 4.0;
/// A face within a pixel, or the part of one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SmallFace {
    /// Share of the pixel that it covers.
    pub share: f64,
    /// The light of its middle, as camera rays count it.
    pub light: DVec3,
}

impl SmallFace {
    /// Variance of the mean of so many rays of a pixel with this mean.
    pub fn variance(&self, mean: DVec3, rays: f64) -> DVec3 {
        let c = self.light - mean;
        let spread = (self.share * rays).sqrt().recip().min(1.0);
        self.share * (1.0 - self.share) / rays * spread * c * c
    }

    /// Whether chance may have made a variance by how many of so many rays met it.
    pub fn explains(&self, variance: f64, mean: DVec3, rays: f64) -> bool {
        let met = 1.0 + self.share * rays;
        CHANCE * CHANCE * met * (self.light - mean).length_squared() >= variance * rays * rays
    }
}
