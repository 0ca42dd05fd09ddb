//! Many columns at once, and their product with F.
//!
//! Columns are kept in panels of [`PANEL`], each a table of its own: a product reads F once for each panel and sums all
//! of it in registers. Where the numbers of a patch were side by side for all columns, 64 RGB columns of 100,000
//! patches would be 80 MB that every row picks from, far beyond the caches, and a product takes five times as long.
//!
//! Worth: `cargo bench --bench columns`. Not handled: columns with zeros in most places.

use glam::Vec4;
use rayon::prelude::*;

use crate::form_factors::product::multiply;
use crate::form_factors::sparse::Rows;
use crate::light::Rgb;

/// Columns kept and summed together: 16 of RGB.
pub const PANEL: usize = 48;

/// Patches that a thread takes at once, or more.
const ROWS: usize = 64;

/// A number for each of n patches and each of several columns.
#[derive(Clone, Debug, PartialEq)]
pub struct Columns {
    patches: usize,
    count: usize,
    /// Of each panel its numbers patch by patch, as many as [`width`] says; those beyond `count` are 0.
    panels: Vec<Vec<f32>>,
}

/// Numbers of a patch in a panel of so many columns.
fn width(columns: usize) -> usize {
    if columns <= 4 { 4 } else { columns.next_multiple_of(16) }
}

impl Columns {
    /// `count` columns of zeros.
    pub fn zeros(patches: usize, count: usize) -> Columns {
        let panel = |first: usize| vec![0.0; patches * width((count - first).min(PANEL))];
        Columns { patches, count, panels: (0..count).step_by(PANEL).map(panel).collect() }
    }

    /// Number of patches.
    pub fn patches(&self) -> usize {
        self.patches
    }

    /// Number of columns.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The numbers of patch i in the panel whose first column is `first`, a multiple of [`PANEL`].
    ///
    /// # Panics
    /// Without such a panel or patch.
    pub fn of(&self, i: usize, first: usize) -> &[f32] {
        let own = (self.count - first).min(PANEL);
        &self.panels[first / PANEL][i * width(own)..][..own]
    }

    /// Column c.
    ///
    /// # Panics
    /// Without such a column.
    pub fn column(&self, c: usize) -> Vec<f32> {
        let (first, own) = (c / PANEL * PANEL, c % PANEL);
        (0..self.patches).map(|i| self.of(i, first)[own]).collect()
    }

    /// Columns 3c, 3c + 1 and 3c + 2, which are red, green and blue of RGB column c.
    ///
    /// # Panics
    /// Without such columns.
    pub fn triples(&self, c: usize) -> impl Iterator<Item = Rgb> {
        let (first, own) = (3 * c / PANEL * PANEL, 3 * c % PANEL);
        (0..self.patches).map(move |i| Rgb::from_slice(&self.of(i, first)[own..own + 3]))
    }

    /// `f(i, first, numbers of patch i)` for all patches in parallel, panel after panel, whose first column is `first`.
    pub fn for_each(&mut self, f: impl Fn(usize, usize, &mut [f32]) + Sync + Send) {
        let count = self.count;
        for (k, panel) in self.panels.iter_mut().enumerate() {
            let own = (count - k * PANEL).min(PANEL);
            let patches = panel.par_chunks_mut(width(own)).with_min_len(ROWS).enumerate();
            patches.for_each(|(i, numbers)| f(i, k * PANEL, &mut numbers[..own]));
        }
    }

    /// `f(i, first, numbers of patch i of each)` for three of one shape at once, panel after panel.
    pub(crate) fn for_each_of(all: [&mut Columns; 3], f: impl Fn(usize, usize, [&mut [f32]; 3]) + Sync + Send) {
        let [a, b, c] = all;
        let panels = a.panels.iter_mut().zip(&mut b.panels).zip(&mut c.panels);
        for (k, ((x, y), z)) in panels.enumerate() {
            let own = (a.count - k * PANEL).min(PANEL);
            let [x, y, z] = [x, y, z].map(|panel| panel.par_chunks_mut(width(own)).with_min_len(ROWS));
            let patches = x.zip(y).zip(z).enumerate();
            patches.for_each(|(i, ((x, y), z))| f(i, k * PANEL, [x, y, z].map(|numbers| &mut numbers[..own])));
        }
    }

    /// The product of each four columns by a function that multiplies four at once.
    pub(crate) fn by_fours(&self, product: impl Fn(&[Vec4]) -> Vec<Vec4>) -> Columns {
        let mut all = Columns::zeros(self.patches, self.count);
        for c in (0..self.count).step_by(4) {
            let (first, from) = (c / PANEL * PANEL, c % PANEL);
            let own = from..(from + 4).min(self.count - first);
            let four = |i: usize| {
                let mut x = [0.0; 4];
                x[..own.len()].copy_from_slice(&self.of(i, first)[own.clone()]);
                Vec4::from(x)
            };
            let found = product(&(0..self.patches).map(four).collect::<Vec<_>>());
            let panel = &mut all.panels[first / PANEL];
            let width = width((self.count - first).min(PANEL));
            for (numbers, y) in panel.chunks_exact_mut(width).zip(found) {
                numbers[own.clone()].copy_from_slice(&y.to_array()[..own.len()]);
            }
        }
        all
    }
}

impl Rows {
    /// `F x` of many columns; the same bits for any number of threads, and for each column those of [`Rows::product`].
    pub fn product_of_columns(&self, x: &Columns) -> Columns {
        let panel = |(k, panel): (usize, &Vec<f32>)| match width((x.count - k * PANEL).min(PANEL)) {
            4 => self.panel_product::<4>(panel),
            16 => self.panel_product::<16>(panel),
            32 => self.panel_product::<32>(panel),
            _ => self.panel_product::<PANEL>(panel),
        };
        let panels = x.panels.iter().enumerate().map(panel).collect();
        Columns { patches: self.len(), count: x.count, panels }
    }

    fn panel_product<const W: usize>(&self, x: &[f32]) -> Vec<f32> {
        let mut own = vec![[0.0; W]; self.own().len()];
        multiply::<W, [f32; W]>(self, x.as_chunks().0, &mut own);
        self.shared().join_numbers(own, |numbers| *numbers, |numbers| numbers).into_flattened()
    }
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
        for count in [0, 1, 4, 16, 37, 48, 101] {
            let mut x = Columns::zeros(n, count);
            let number = |i: usize, c: usize| ((i * 31 + c * 17) % 101) as f32 / 101.0;
            x.for_each(|i, first, row| row.iter_mut().enumerate().for_each(|(c, x)| *x = number(i, first + c)));
            assert!((0..count).all(|c| x.column(c)[7] == number(7, c)));
            let together = f.product_of_columns(&x);
            assert_eq!(together, x.by_fours(|four| f.product(four)));
            assert_eq!(together.count(), count);
        }
    }
}
