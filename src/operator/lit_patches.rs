//! K on the patches that light reaches, which is all of K that a series from E ever asks.
//!
//! A hollow thing inside of which nothing emits stays dark whatever it is made of: `(KⁿE)_i = 0` there for every n. Its
//! part of K changes no light but has eigenvalues of its own, and white walls have one of 1: a closed white box in an
//! open scene would leave the series of the whole scene undecided. With alpha 0 on such patches every term is the same,
//! and the spectral radius and all bounds are those of the rest.
//!
//! Not handled: light that the rays of F miss; K as it was assembled counts.

use glam::Vec4;

use crate::light::{Light, Rgb};
use crate::operator::linear::LinearOperator;

/// K with alpha 0 on patches that no light from E reaches; K itself where there is no light at all.
pub struct LitPatches<'a> {
    k: &'a dyn LinearOperator,
    alphas: Vec<f32>,
}

impl<'a> LitPatches<'a> {
    /// Follows light from patch to patch until it reaches no more of them; takes as many products with F as light takes
    /// bounces to get everywhere, and none where it is everywhere at once.
    pub fn of(k: &'a dyn LinearOperator) -> LitPatches<'a> {
        let lit = lit(k);
        let alphas = k.alphas().iter().zip(lit).map(|(alpha, lit)| if lit { *alpha } else { 0.0 });
        LitPatches { k, alphas: alphas.collect() }
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
        self.k.emission()
    }

    fn incident(&self, x: &[Vec4]) -> Vec<Vec4> {
        self.k.incident(x)
    }

    fn sent(&self, y: &[Vec4]) -> Vec<Vec4> {
        self.k.sent(y)
    }

    fn first_bounce(&self) -> Vec<Light> {
        self.k.first_bounce()
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

    /// A white box with two sides once made every scene that it stood in undecided.
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
