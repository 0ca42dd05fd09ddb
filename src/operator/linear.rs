//! What a solver of `L = E + K L` needs of K: products, never how F is stored; and K on the patches that light reaches.
//!
//! Patch i receives `(F x)_i` and reflects it by its reflectance matrix, channel by channel:
//!
//! ```text
//! (K x)_i = rho_i [ alpha_i  0 ] (F x)_i          (K^T y)_j = sum_i F_ij rho_i (alpha_i y_i,invisible + y_i,visible)
//!                 [ 1        0 ]
//! ```
//!
//! so products with F and its transpose, and what the patches are made of, are all there is to implement.
//!
//! [`LitPatches`] is all of K that a series from E ever uses. A hollow thing inside of which nothing emits stays dark
//! whatever it is made of: `(KⁿE)_i = 0` there for every n. Its part of K changes no light but has eigenvalues of its
//! own, and white walls have one of 1: a closed white box in an open scene would leave the series of the whole scene
//! undecided. With alpha 0 on such patches every term is the same, and all bounds are those of the rest.
//!
//! Not handled: single columns of F, which progressive shooting takes from its [`Shooter`](crate::solve::Shooter);
//! light that the rays of F miss.

use glam::Vec4;

use crate::form_factors::Columns;
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

    /// `F x` of many columns, one number a patch and column.
    fn incident_columns(&self, x: &Columns) -> Columns {
        x.by_fours(|four| self.incident(four))
    }

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

/// One E, and what K makes of it.
#[derive(Clone, Debug, Default)]
pub struct Source {
    /// `E`, one light a patch, W/(m² sr).
    pub emission: Vec<Light>,
    /// `K E`, where that is known better than by the product with F.
    pub first_bounce: Option<Vec<Light>>,
}

/// K with alpha 0 on patches that no light from E reaches; K itself where there is no light at all.
pub struct LitPatches<'a> {
    k: &'a dyn LinearOperator,
    /// In place of that of K.
    source: Option<Source>,
    alphas: Vec<f32>,
}

impl<'a> LitPatches<'a> {
    /// Follows light from patch to patch until it reaches no more of them; takes as many products with F as light takes
    /// bounces to get everywhere, and none where it is everywhere at once.
    pub fn of(k: &'a dyn LinearOperator) -> LitPatches<'a> {
        LitPatches::reached(k, None)
    }

    /// K of the same patches with another E.
    pub fn of_source(k: &'a dyn LinearOperator, source: Source) -> LitPatches<'a> {
        LitPatches::reached(k, Some(source))
    }

    fn reached(k: &'a dyn LinearOperator, source: Option<Source>) -> LitPatches<'a> {
        let mut own = LitPatches { k, source, alphas: k.alphas().to_vec() };
        let lit = lit(&own);
        own.alphas.iter_mut().zip(lit).filter(|(_, lit)| !lit).for_each(|(alpha, _)| *alpha = 0.0);
        own
    }
}

/// Patches that some term of the series is above 0 on; all where E sends nothing.
fn lit(k: &dyn LinearOperator) -> Vec<bool> {
    let passes = |i: usize| k.passed_on(i) != Rgb::ZERO;
    let mut lit: Vec<bool> = k.first_bounce().iter().map(|l| l.invisible != Rgb::ZERO).collect();
    if !lit.contains(&true) {
        return vec![true; lit.len()];
    }
    loop {
        let mut reached: Vec<usize> = (0..lit.len()).filter(|&i| !lit[i] && passes(i)).collect();
        if !reached.is_empty() {
            let sent: Vec<Vec4> = lit.iter().map(|&lit| Vec4::X * f32::from(u8::from(lit))).collect();
            let arrives = k.incident(&sent);
            reached.retain(|&i| arrives[i].x > 0.0);
        }
        if reached.is_empty() {
            return lit;
        }
        reached.into_iter().for_each(|i| lit[i] = true);
    }
}

impl LinearOperator for LitPatches<'_> {
    fn areas(&self) -> &[f64] {
        self.k.areas()
    }

    fn reflectances(&self) -> &[Rgb] {
        self.k.reflectances()
    }

    fn alphas(&self) -> &[f32] {
        &self.alphas
    }

    fn emission(&self) -> &[Light] {
        self.source.as_ref().map_or_else(|| self.k.emission(), |source| &source.emission)
    }

    fn incident(&self, x: &[Vec4]) -> Vec<Vec4> {
        self.k.incident(x)
    }

    fn incident_columns(&self, x: &Columns) -> Columns {
        self.k.incident_columns(x)
    }

    fn sent(&self, y: &[Vec4]) -> Vec<Vec4> {
        self.k.sent(y)
    }

    fn first_bounce(&self) -> Vec<Light> {
        match &self.source {
            None => self.k.first_bounce(),
            Some(source) => source.first_bounce.clone().unwrap_or_else(|| self.k.apply(&source.emission)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factors::{FormFactors, Rows};
    use crate::operator::{Operator, PatchMaterials, spectrum};

    /// Two patches that see each other and the third, which sees the first; and two in a box of their own.
    fn boxed(received: [f32; 5]) -> Operator {
        let row = |entries: &[(u32, f32)]| entries.iter().copied().unzip();
        let rows = vec![
            row(&[(1, 0.4), (2, 0.4)]),
            row(&[(0, 0.4), (2, 0.4)]),
            row(&[(0, 0.4)]),
            row(&[(4, 1.0)]),
            row(&[(3, 1.0)]),
        ];
        let f = FormFactors { rows: Rows::from_rows(rows), row_sums: vec![None; 5] };
        let materials = PatchMaterials {
            rho: vec![Rgb::ONE; 5],
            alpha: vec![1.0; 5],
            emission: vec![Light::default(); 5],
            glows: vec![false; 5],
        };
        Operator::new(f, materials, vec![1.0; 5], received.map(Rgb::splat).to_vec())
    }

    #[test]
    fn a_white_box_that_no_light_enters_leaves_the_series_as_it_is() {
        let all = boxed([0.0, 0.0, 1.0, 0.0, 0.0]);
        let lit = LitPatches::of(&all);
        assert_eq!(lit.alphas(), [1.0, 1.0, 1.0, 0.0, 0.0]);
        assert!(spectrum(&all).worst().upper >= 1.0);
        assert!(spectrum(&lit).worst().upper < 0.8);
        // The general path: every term is the same.
        let mut terms = [all.first_bounce(), lit.first_bounce()];
        for _ in 0..20 {
            assert_eq!(terms[0], terms[1]);
            terms = [all.apply(&terms[0]), lit.apply(&terms[1])];
        }
        assert!(terms[0][0].invisible.x > 0.0);
    }

    #[test]
    fn a_box_that_light_enters_stays_a_part_of_k_and_so_does_all_of_it_without_light() {
        for received in [[0.0, 0.0, 1.0, 1e-20, 0.0], [0.0; 5]] {
            let all = boxed(received);
            assert_eq!(LitPatches::of(&all).alphas(), [1.0; 5]);
        }
    }
}
