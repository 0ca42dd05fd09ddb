//! Many columns at once, and their product with F in one pass over it.
//!
//! A row of F is read once from memory for all columns: runs of it stay in the nearest cache while one block of
//! [`BLOCK`] columns after another is summed in registers. Sums are those of [`Rows::product`], column by column: f32
//! within runs, f64 between them.
//!
//! Worth: `cargo bench --bench columns`. Not handled: columns with zeros in most places.

use glam::Vec4;
use rayon::prelude::*;

use crate::form_factors::sparse::{RUN, Rows};

/// Columns summed together.
pub const BLOCK: usize = 16;

/// A number for each of n patches and each of several columns, patch by patch.
#[derive(Clone, Debug, PartialEq)]
pub struct Columns {
    count: usize,
    /// Numbers of a patch, a multiple of [`BLOCK`]; those beyond `count` are 0.
    stride: usize,
    values: Vec<f32>,
}

impl Columns {
    /// `count` columns of zeros.
    pub fn zeros(patches: usize, count: usize) -> Columns {
        let stride = count.next_multiple_of(BLOCK);
        Columns { count, stride, values: vec![0.0; patches * stride] }
    }

    /// Number of patches.
    pub fn patches(&self) -> usize {
        self.values.len().checked_div(self.stride).unwrap_or(0)
    }

    /// Number of columns.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The numbers of patch i.
    pub fn of(&self, i: usize) -> &[f32] {
        &self.values[i * self.stride..i * self.stride + self.count]
    }

    /// The numbers of patch i, to be changed.
    pub fn of_mut(&mut self, i: usize) -> &mut [f32] {
        &mut self.values[i * self.stride..i * self.stride + self.count]
    }

    /// Column c.
    pub fn column(&self, c: usize) -> Vec<f32> {
        (0..self.patches()).map(|i| self.of(i)[c]).collect()
    }

    /// `f(i, numbers of patch i)` for all patches in parallel.
    pub fn for_each(&mut self, f: impl Fn(usize, &mut [f32]) + Sync + Send) {
        let count = self.count;
        let rows = self.values.par_chunks_mut(self.stride.max(1)).with_min_len(64).enumerate();
        rows.for_each(|(i, row)| f(i, &mut row[..count]));
    }

    /// The product of each four columns by a function that multiplies four at once.
    pub(crate) fn by_fours(&self, product: impl Fn(&[Vec4]) -> Vec<Vec4>) -> Columns {
        let mut all = Columns::zeros(self.patches(), self.count);
        for first in (0..self.count).step_by(4) {
            let own = first..(first + 4).min(self.count);
            let four = |i: usize| {
                let mut x = [0.0; 4];
                x[..own.len()].copy_from_slice(&self.of(i)[own.clone()]);
                Vec4::from(x)
            };
            let found = product(&(0..self.patches()).map(four).collect::<Vec<_>>());
            for (i, y) in found.into_iter().enumerate() {
                all.of_mut(i)[own.clone()].copy_from_slice(&y.to_array()[..own.len()]);
            }
        }
        all
    }
}

impl Rows {
    /// `F x` of many columns; the same bits for any number of threads.
    pub fn product_of_columns(&self, x: &Columns) -> Columns {
        let stride = x.stride;
        let mut product = Columns::zeros(self.len(), x.count);
        let rows = product.values.par_chunks_mut(stride.max(1)).with_min_len(16).enumerate();
        rows.for_each_init(Vec::new, |totals: &mut Vec<[f64; BLOCK]>, (i, out)| {
            let (columns, values) = self.row(i);
            totals.clear();
            totals.resize(stride / BLOCK, [0.0; BLOCK]);
            for (columns, values) in columns.chunks(RUN).zip(values.chunks(RUN)) {
                for (block, total) in totals.iter_mut().enumerate() {
                    let run = run_product((columns, values), &x.values, (stride, block * BLOCK));
                    total.iter_mut().zip(run).for_each(|(total, run)| *total += f64::from(run));
                }
            }
            for (out, total) in out.chunks_exact_mut(BLOCK).zip(totals.iter()) {
                out.iter_mut().zip(total).for_each(|(out, total)| *out = *total as f32);
            }
        });
        product
    }
}

/// The product of a run of a row with one block of columns, which begins at `first` of every patch's numbers.
#[inline]
fn run_product((columns, values): (&[u32], &[f32]), x: &[f32], (stride, first): (usize, usize)) -> [f32; BLOCK] {
    let mut run = [0.0f32; BLOCK];
    for (&j, &f) in columns.iter().zip(values) {
        let start = j as usize * stride + first;
        let own: &[f32; BLOCK] = x[start..start + BLOCK].try_into().expect("a block has its length");
        for (sum, x) in run.iter_mut().zip(own) {
            *sum += f * x;
        }
    }
    run
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::sobol::Stream;

    #[test]
    fn columns_have_the_products_that_each_has_alone() {
        let mut random = Stream::new(5);
        let n = 300;
        let mut row = |length: u32| {
            let columns: Vec<u32> = (0..length).collect();
            let values = columns.iter().map(|_| random.uniform()).collect();
            (columns, values)
        };
        let f = Rows::from_rows((0..n).map(|i| row(i as u32)).collect());
        for count in [0, 1, 3, 16, 37] {
            let mut x = Columns::zeros(n, count);
            (0..n).for_each(|i| x.of_mut(i).iter_mut().for_each(|x| *x = random.uniform()));
            let together = f.product_of_columns(&x);
            assert_eq!(together, x.by_fours(|four| f.product(four)));
            assert_eq!(together.count(), count);
        }
    }
}
