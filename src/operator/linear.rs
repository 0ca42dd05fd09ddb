//! What a solver of `L = E + K L` asks of K: products, never how F is stored.
//!
//! Patch i receives `(F x)_i` and reflects it by its reflectance matrix, channel by channel:
//!
//! ```text
//! (K x)_i = rho_i [ alpha_i  0 ] (F x)_i          (K^T y)_j = sum_i F_ij rho_i (alpha_i y_i,invisible + y_i,visible)
//!                 [ 1        0 ]
//! ```
//!
//! so products with F and its transpose, and what the patches are made of, are all there is to implement. Not handled:
//! single columns of F, which progressive shooting asks of its [`Shooter`](crate::solve::Shooter).

use glam::Vec4;

use crate::light::{Light, Rgb};

/// K of n patches, and the E it acts on first. Whoever can multiply with F has every solver and bound of
/// [`crate::solve`].
pub trait LinearOperator: Sync {
    /// Areas of the n patches, in any one unit; norms and powers are weighted by them.
    fn areas(&self) -> &[f64];

    /// `rho_i`, n reflectances in 0..=1.
    fn reflectances(&self) -> &[Rgb];

    /// `alpha_i`, n shares in 0..=1 of what is reflected that travels on.
    fn alphas(&self) -> &[f32];

    /// `E`, one light a patch, W/(m² sr).
    fn emission(&self) -> &[Light];

    /// `F x` of several columns at once: every component of the n vectors is a column of its own.
    ///
    /// F >= 0, and the relative error of the result is at most [`Rows::ROUNDING`](crate::form_factors::Rows::ROUNDING)
    /// where x >= 0, or the bounds of [`spectrum`](crate::operator::spectrum()) are no proofs.
    fn incident(&self, x: &[Vec4]) -> Vec<Vec4>;

    /// `F^T y` of several columns at once.
    fn sent(&self, y: &[Vec4]) -> Vec<Vec4>;

    /// `K E`; an operator may know a better way for it than its product with F.
    fn first_bounce(&self) -> Vec<Light> {
        self.apply(self.emission())
    }

    /// `K x`, all six numbers of a patch at once.
    fn apply(&self, x: &[Light]) -> Vec<Light> {
        let incident = self.incident(&padded(x));
        let patches = self.reflectances().iter().zip(self.alphas());
        patches.zip(incident).map(|((rho, alpha), incident)| reflected(*rho, *alpha, incident.truncate())).collect()
    }

    /// `K^T y`; its visible halves are 0, since nothing visible is reflected again.
    fn apply_transposed(&self, y: &[Light]) -> Vec<Light> {
        let patches = self.reflectances().iter().zip(self.alphas());
        let seen = patches.zip(y).map(|((rho, alpha), y)| (*rho * (*alpha * y.invisible + y.visible)).extend(0.0));
        self.sent(&seen.collect::<Vec<_>>()).into_iter().map(|v| Light::unseen(v.truncate())).collect()
    }

    /// `alpha_i rho_i`: the eigenvalues of K in a channel are those of `alpha rho F`.
    fn passed_on(&self, i: usize) -> Rgb {
        self.alphas()[i] * self.reflectances()[i]
    }

    /// Whether anything reflected travels on; if not, `K²E = 0` exactly.
    fn interreflects(&self) -> bool {
        (0..self.areas().len()).any(|i| self.passed_on(i).max_element() > 0.0)
    }
}

/// The light that leaves a patch for what it receives: `rho [[alpha, 0], [1, 0]]` applied.
pub(crate) fn reflected(rho: Rgb, alpha: f32, incident: Rgb) -> Light {
    let visible = rho * incident;
    Light { invisible: alpha * visible, visible }
}

/// The halves that F acts on, padded to four components.
pub(crate) fn padded(x: &[Light]) -> Vec<Vec4> {
    x.iter().map(|l| l.invisible.extend(0.0)).collect()
}
