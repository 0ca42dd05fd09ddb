//! What is known of the variance of one pixel between rounds of sampling, and what that rests on.
//!
//! Not handled: which pixels get more rays ([`crate::gather::pixels::adaptive_sampling`]).

use glam::DVec3;

/// What the variance of a pixel rests on, and how it went from round to round; channels added but where they are kept.
#[derive(Default)]
pub(crate) struct PixelNoise {
    pub basis: Basis,
    /// The variance when that was last noted.
    pub differed: f64,
    /// The variance predicted before the last rays were cast, independent of them.
    pub predicted: f64,
    /// Camera rays of each half when the variance was last noted; 0 before the first time.
    pub noted: u32,
    /// Whether a face smaller than the pixel may explain the variance last noted.
    pub is_explained: bool,
}

/// What the variance of a pixel rests on.
#[derive(Default)]
pub(crate) enum Basis {
    /// All its rays: it was neither resampled nor chosen.
    #[default]
    AllRays,
    /// The rays of its last resampling alone, which gave this variance.
    Resampled(DVec3),
    /// All its rays: it was chosen for its variance since the last resampling, of which so much shows nowhere else: the
    /// estimate for pixels that missed the same.
    Chosen { unseen: f64 },
}

impl PixelNoise {
    /// The variance by the rays of the last resampling; none where the pixel was never resampled, or chosen since.
    pub(crate) fn resampled(&self) -> Option<DVec3> {
        if let Basis::Resampled(variance) = self.basis { Some(variance) } else { None }
    }

    /// The variance for which it was chosen since the last resampling of any pixel.
    pub(crate) fn unseen(&self) -> f64 {
        if let Basis::Chosen { unseen } = self.basis { unseen } else { 0.0 }
    }

    /// Counts nothing as unseen, as pixels are resampled to see it.
    pub(crate) fn forget_unseen(&mut self) {
        if let Basis::Chosen { unseen } = &mut self.basis {
            *unseen = 0.0;
        }
    }

    /// Marks it as chosen to get more rays because of its variance, which counts as unseen unless it shows around it as
    /// well or a known face explains it.
    pub(crate) fn choose(&mut self, is_seen_around: bool) {
        if !matches!(self.basis, Basis::Chosen { .. }) {
            let unseen = if self.is_explained || is_seen_around { 0.0 } else { self.differed };
            self.basis = Basis::Chosen { unseen };
        }
    }

    /// Takes the variance that resampling gave it, with so many camera rays of each half now.
    pub(crate) fn resample(&mut self, variance: DVec3, count: u32) {
        self.basis = Basis::Resampled(variance);
        self.predicted = variance.element_sum();
        (self.differed, self.noted) = (self.predicted, count);
    }

    /// Notes the variance with so many camera rays of each half, and predicts it from the one noted before times the
    /// share `remaining` that the rays since are expected to leave.
    pub(crate) fn note(&mut self, variance: f64, count: u32, remaining: f64) {
        if self.noted == 0 {
            self.predicted = variance;
        } else if self.noted < count {
            self.predicted = remaining * self.differed;
        }
        (self.differed, self.noted) = (variance, count);
    }
}
