//! What rays that agree say: a share found to be 0 or 1 is known to `1 / (n + 2)` and not better.
//!
//! Of a share s nothing is known before (it is uniform on 0 to 1). After n rays of which m arrived its mean and
//! variance are (T. Bayes 1763; P. S. Laplace's rule of succession 1774)
//!
//! ```text
//! s = (m + 1) / (n + 2),      s (1 - s) / (n + 3)
//! ```
//!
//! Not handled: rays whose transmittance is neither 0 nor 1 count as parts of one that arrived.

/// A share after some rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LikelyShare {
    /// Its mean.
    pub share: f64,
    rays: f64,
}

impl LikelyShare {
    /// After so many rays, of which so many arrived.
    pub(crate) fn of(rays: f64, arrived: f64) -> LikelyShare {
        LikelyShare { share: (arrived + 1.0) / (rays + 2.0), rays }
    }

    /// Standard deviation of whether one more ray arrives.
    pub(crate) fn spread(&self) -> f64 {
        (self.share * (1.0 - self.share)).sqrt()
    }

    /// Standard deviation of the share.
    pub(crate) fn deviation(&self) -> f64 {
        self.spread() / (self.rays + 3.0).sqrt()
    }
}

/// The visibility rays of a receiver, or of several, and what they may have missed.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Agreement {
    /// Light of the points drawn without occlusion, over their probabilities, added up.
    unhidden: glam::DVec3,
    rays: f64,
    arrived: f64,
    /// Two rays differ.
    differs: bool,
}

impl Agreement {
    /// Notes a ray to a point of such light, of which a share arrived.
    pub(crate) fn note(&mut self, unhidden: glam::DVec3, arrived: f64) {
        self.differs |= self.rays > 0.0 && arrived * self.rays != self.arrived;
        self.unhidden += unhidden;
        self.rays += 1.0;
        self.arrived += arrived;
    }

    /// Adds the rays of others.
    pub(crate) fn join(&mut self, other: &Agreement) {
        let both = self.rays > 0.0 && other.rays > 0.0;
        self.differs |= other.differs || both && self.arrived * other.rays != other.arrived * self.rays;
        self.unhidden += other.unhidden;
        self.rays += other.rays;
        self.arrived += other.arrived;
    }

    /// Rays noted.
    pub(crate) fn rays(&self) -> f64 {
        self.rays
    }

    /// Standard deviation of the mean light that rays which all agree leave; 0 where they differ, as their own spread
    /// tells it then.
    pub(crate) fn doubt(&self) -> glam::DVec3 {
        if self.differs || self.rays == 0.0 {
            return glam::DVec3::ZERO;
        }
        self.unhidden / self.rays * LikelyShare::of(self.rays, self.arrived).deviation()
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn rays_that_agree_know_a_share_to_one_over_their_number() {
        for n in [1.0, 8.0, 1000.0] {
            for arrived in [0.0, n] {
                let deviation = LikelyShare::of(n, arrived).deviation();
                assert!((deviation * (n + 2.0) - 1.0).abs() < 0.3 && deviation * (n + 2.0) <= 1.0, "{n}: {deviation}");
            }
        }
        // Half of many: the binomial's.
        assert!((LikelyShare::of(1e6, 5e5).deviation() - 0.5e-3).abs() < 1e-8);
    }

    #[test]
    fn doubt_ends_where_two_rays_differ() {
        let mut alike = Agreement::default();
        (0..6).for_each(|_| alike.note(DVec3::splat(2.0), 0.0));
        assert!((alike.doubt().x - 2.0 * LikelyShare::of(6.0, 0.0).deviation()).abs() < 1e-12);
        let mut other = Agreement::default();
        other.note(DVec3::ONE, 1.0);
        other.join(&alike);
        assert_eq!(other.doubt(), DVec3::ZERO);
        alike.note(DVec3::ONE, 0.5);
        assert_eq!(alike.doubt(), DVec3::ZERO);
    }
}
