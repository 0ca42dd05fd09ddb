//! Products of rows of F with several columns at once: one pass over a row, sums in registers.
//!
//! ```text
//! y_i = sum over runs of [ sum over the run of F_ij x_j in f32 ] in f64          of each of W numbers
//! ```
//!
//! The order of all sums is that of the row, whatever W is and whatever instructions the machine has, so the bits are
//! the same for any of them. pulp compiles the loops for AVX2 too, which multiplies 16 RGB columns in half the time.
//!
//! Worth: `cargo bench --bench columns`. Not handled: blocks of rows and patches that would keep x in the nearest
//! cache, which lose more by short loops than they gain.

use glam::Vec4;
use halflight_team::heed_interrupt;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use crate::form_factors::sparse::{RUN, Rows};

/// Rows that a thread takes at once.
const CHUNK: usize = 64;
/// Products of an entry with four numbers below which one thread does all: they take some ten microseconds, and another
/// thread longer to wake.
const ALONE: usize = 1 << 14;

/// W numbers of a patch.
pub(crate) trait Numbers<const W: usize>: Sync + Send {
    fn numbers(&self) -> &[f32; W];
    fn set(&mut self, numbers: [f32; W]);
}

impl Numbers<4> for Vec4 {
    #[inline(always)]
    fn numbers(&self) -> &[f32; 4] {
        self.as_ref()
    }

    #[inline(always)]
    fn set(&mut self, numbers: [f32; 4]) {
        *self = Vec4::from_array(numbers);
    }
}

impl<const W: usize> Numbers<W> for [f32; W] {
    #[inline(always)]
    fn numbers(&self) -> &[f32; W] {
        self
    }

    #[inline(always)]
    fn set(&mut self, numbers: [f32; W]) {
        *self = numbers;
    }
}

impl Rows {
    /// `F x` for all components at once, row-parallel where there is enough to do; the same bits for any number of
    /// threads.
    pub fn product(&self, x: &[Vec4]) -> Vec<Vec4> {
        let mut product = vec![Vec4::ZERO; self.own().len()];
        multiply(self, x, &mut product);
        self.shared().join_numbers(product, Vec4::to_array, Vec4::from_array)
    }
}

/// `F x` into `out`, which has one entry for each row that is kept here; row-parallel where there is enough to do.
pub(crate) fn multiply<const W: usize, N: Numbers<W>>(f: &Rows, x: &[N], out: &mut [N]) {
    heed_interrupt();
    let arch = Arch::new();
    let first = f.own().start;
    let chunk = |(k, out)| arch.dispatch(Chunk::<W, N> { f, x, first: first + k * CHUNK, out });
    if f.parts().2.len() * W / 4 < ALONE {
        out.chunks_mut(CHUNK).enumerate().for_each(chunk);
    } else {
        out.par_chunks_mut(CHUNK).enumerate().for_each(chunk);
    }
}

/// Some rows of a product.
struct Chunk<'a, const W: usize, N> {
    f: &'a Rows,
    x: &'a [N],
    /// The first row.
    first: usize,
    out: &'a mut [N],
}

impl<const W: usize, N: Numbers<W>> WithSimd for Chunk<'_, W, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for (k, out) in self.out.iter_mut().enumerate() {
            let (columns, values) = self.f.row(self.first + k);
            let mut total = [0.0f64; W];
            for (columns, values) in columns.chunks(RUN).zip(values.chunks(RUN)) {
                let run = run_product(columns, values, self.x);
                for (total, run) in total.iter_mut().zip(run) {
                    *total += f64::from(run);
                }
            }
            out.set(total.map(|total| total as f32));
        }
    }
}

#[inline(always)]
fn run_product<const W: usize, N: Numbers<W>>(columns: &[u32], values: &[f32], x: &[N]) -> [f32; W] {
    let mut run = [0.0f32; W];
    for (&j, &f) in columns.iter().zip(values) {
        for (sum, x) in run.iter_mut().zip(x[j as usize].numbers()) {
            *sum += f * x;
        }
    }
    run
}

#[cfg(test)]
mod tests {
    use pulp::Scalar;

    use super::*;

    #[test]
    fn bits_do_not_depend_on_the_instructions() {
        let n = 200u32;
        let number = |i: u32, c: usize| ((i as usize * 31 + c * 17) % 101) as f32 / 101.0;
        let row = |i: u32| ((0..i).collect(), (0..i).map(|j| number(i * j, 3)).collect());
        let f = Rows::from_rows((0..n).map(row).collect());
        let x: Vec<[f32; 48]> = (0..n).map(|i| std::array::from_fn(|c| number(i, c))).collect();
        let mut chosen = vec![[0.0; 48]; n as usize];
        let mut scalar = chosen.clone();
        multiply(&f, &x, &mut chosen);
        Chunk { f: &f, x: &x, first: 0, out: &mut scalar }.with_simd(Scalar::new());
        assert_eq!(chosen, scalar);
        let fours: Vec<Vec4> = x.iter().map(|x| Vec4::from_slice(x)).collect();
        assert!(f.product(&fours).iter().zip(&scalar).all(|(four, all)| four.to_array() == all[..4]));
    }
}
