//! Light as a vector: what travels, what is seen, and the matrix a surface reflects with.
//!
//! Light at a point is the pair `(invisible, visible)`. The invisible half travels through the scene and is
//! reflected again; the visible half is only collected by the camera. A surface with reflectance `rho` and the two
//! numbers `(alpha, tau)` of [`Transport`] reflects by
//!
//! ```text
//! reflectance matrix = [ alpha*rho  0 ]      alpha scales what is passed on (interreflection),
//!                      [ rho        0 ]      tau what passes through a surface (transmission).
//! ```
//!
//! Transmission does not change direction, so tau acts inside the form factors and not in this matrix. Radiance is in
//! W/(m² sr) per RGB channel. Not handled: spectra, polarisation, glossy reflection but for highlights of direct light
//! ([`Gloss`]).
//!
//! Source: D. C. Banks, K. M. Beason, *Retro-rendering with vector-valued light*, SPIE 6060, 2006.

pub mod budget;
pub(crate) mod gloss;
pub(crate) mod mode;
pub mod shares;

pub use gloss::Gloss;
pub use mode::{Mode, Transport, TransportError, nothing_passes};

use glam::DVec3;
use nalgebra::Matrix2;

/// Radiance, reflectance or emission of the three channels red, green, blue.
pub type Rgb = glam::Vec3;

/// Quotients channel by channel; 0 where `whole` is none.
pub(crate) fn over(part: DVec3, whole: DVec3) -> DVec3 {
    DVec3::select(whole.cmpgt(DVec3::ZERO), part / whole.max(DVec3::splat(f64::MIN_POSITIVE)), DVec3::ZERO)
}

/// Light of one point or patch: `(L_invisible, L_visible)`, each an RGB radiance in W/(m² sr); six numbers in memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Light {
    /// The half that travels: `L_inv = E_inv + alpha rho F L_inv`.
    pub invisible: Rgb,
    /// The half the camera sees: `L_vis = E_vis + rho F L_inv`.
    pub visible: Rgb,
}

impl Light {
    /// Light emitted by a surface of radiance `emission`; a hidden luminaire has no visible half.
    pub fn emitted(emission: Rgb, visibility: Visibility) -> Self {
        let visible = match visibility {
            Visibility::Seen => emission,
            Visibility::Hidden => Rgb::ZERO,
        };
        Light { invisible: emission, visible }
    }

    /// Light that travels and that no camera sees.
    pub fn unseen(invisible: Rgb) -> Self {
        Light { invisible, visible: Rgb::ZERO }
    }

    /// The six numbers in the order the operator stores them: invisible RGB, visible RGB.
    pub fn components(self) -> [f32; 6] {
        let (i, v) = (self.invisible, self.visible);
        [i.x, i.y, i.z, v.x, v.y, v.z]
    }
}

/// Whether the camera sees the emission of an emitter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Visibility {
    /// `E_visible = E_invisible`.
    #[default]
    Seen,
    /// `E_visible = 0`: the emitter lights the scene and is black itself.
    Hidden,
}

/// The 2×2 reflectance matrix of one channel, `rho [[alpha, 0], [1, 0]]`, acting on `(L_invisible, L_visible)`.
pub fn reflectance(rho: f32, alpha: f32) -> Matrix2<f32> {
    Matrix2::new(alpha * rho, 0.0, rho, 0.0)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use super::*;

    #[test]
    fn the_visible_half_is_never_reflected_again() {
        let twice = reflectance(0.7, 0.0) * reflectance(0.7, 0.0);
        assert_eq!(twice, Matrix2::zeros());
        let seen = reflectance(0.7, 1.0) * Vector2::new(0.0, 3.0);
        assert_eq!(seen, Vector2::zeros());
    }

    #[test]
    fn a_hidden_luminaire_keeps_its_invisible_half() {
        let light = Light::emitted(Rgb::splat(2.0), Visibility::Hidden);
        assert_eq!(light.components(), [2.0, 2.0, 2.0, 0.0, 0.0, 0.0]);
    }
}
