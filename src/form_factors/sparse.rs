//! Sparse rows (compressed row storage) of f32 with u32 columns, all here or each with the process that found it.
//!
//! Products accumulate in f32 over short runs and in f64 between them, so that the relative rounding error of a
//! non-negative row stays below [`Rows::ROUNDING`] however long the row.
//!
//! Where several processes share a solve, each keeps the rows of some patches, one after the other
//! ([`Rows::of_part`]): a product multiplies these and hands its numbers round, and rows of the transposed matrix lie
//! where their patches are. Not handled: the products themselves.

use std::ops::Range;

use halflight_team::Loop;
use rayon::prelude::*;

/// A sparse matrix of non-negative f32 by rows, columns ascending.
#[derive(Clone, Debug, PartialEq)]
pub struct Rows {
    /// Who keeps which of the rows.
    shared: Loop,
    /// Entries of all rows, wherever they are kept.
    entries: usize,
    /// Of the rows kept here.
    starts: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<f32>,
}

/// Length of the runs summed in f32.
pub(crate) const RUN: usize = 64;

impl Rows {
    /// Bound on the relative error of one component of a product with non-negative numbers: `RUN` additions and
    /// two roundings of f32.
    pub const ROUNDING: f64 = (RUN + 4) as f64 * 0.5 * f32::EPSILON as f64;

    /// Joins rows given as (columns ascending, values).
    pub fn from_rows(rows: Vec<(Vec<u32>, Vec<f32>)>) -> Rows {
        let entries = rows.iter().map(|r| r.0.len()).sum();
        Rows::joined(Loop::everyone(rows.len()), rows, entries)
    }

    /// Joins the rows that this process keeps; all processes are to call it together.
    pub(crate) fn of_part(shared: Loop, own: Vec<(Vec<u32>, Vec<f32>)>) -> Rows {
        let entries: usize = own.iter().map(|r| r.0.len()).sum();
        let all = shared.sum(entries as u64) as usize;
        Rows::joined(shared, own, all)
    }

    fn joined(shared: Loop, rows: Vec<(Vec<u32>, Vec<f32>)>, all: usize) -> Rows {
        let entries = rows.iter().map(|r| r.0.len()).sum();
        let mut joined = Rows {
            shared,
            entries: all,
            starts: Vec::with_capacity(rows.len() + 1),
            columns: Vec::with_capacity(entries),
            values: Vec::with_capacity(entries),
        };
        joined.starts.push(0);
        for (columns, values) in rows {
            joined.columns.extend(columns);
            joined.values.extend(values);
            joined.starts.push(joined.columns.len());
        }
        joined
    }

    /// A square matrix of its parts: row i has the entries `starts[i]..starts[i + 1]`; none where they are no such
    /// matrix of non-negative numbers.
    pub fn from_parts(starts: Vec<usize>, columns: Vec<u32>, values: Vec<f32>) -> Option<Rows> {
        let count = starts.len().checked_sub(1)?;
        let bounds = starts[0] == 0 && starts[count] == columns.len() && columns.len() == values.len();
        let rows = Rows { shared: Loop::everyone(count), entries: values.len(), starts, columns, values };
        let is_row = |i: usize| {
            let (columns, values) = rows.row(i);
            let inside = columns.last().is_none_or(|&last| (last as usize) < count);
            inside && columns.is_sorted_by(|a, b| a < b) && values.iter().all(|v| v.is_finite() && *v >= 0.0)
        };
        let is_matrix = bounds && rows.starts.is_sorted() && (0..count).into_par_iter().all(is_row);
        is_matrix.then_some(rows)
    }

    /// Where the entries of each row start, the columns of all entries, and their values; of the rows kept here.
    pub fn parts(&self) -> (&[usize], &[u32], &[f32]) {
        (&self.starts, &self.columns, &self.values)
    }

    /// The entries of some rows in some columns; all others are empty.
    pub fn restricted(&self, rows: &[bool], columns: &[bool]) -> Rows {
        let own = |i: usize| -> (Vec<u32>, Vec<f32>) {
            let (own, values) = self.row(i);
            let entries = own.iter().zip(values).filter(|(j, _)| rows[i] && columns[**j as usize]);
            entries.map(|(j, value)| (*j, *value)).unzip()
        };
        Rows::of_part(self.shared.clone(), self.own().into_par_iter().map(own).collect())
    }

    /// Who keeps which of the rows.
    pub(crate) fn shared(&self) -> &Loop {
        &self.shared
    }

    /// The rows that this process keeps: all, unless several share a solve.
    pub fn own(&self) -> Range<usize> {
        self.shared.own()
    }

    /// The matrix with all its rows here; all processes are to call it together.
    pub fn whole(self) -> Rows {
        if self.shared.is_everyone() { self } else { Rows::from_rows(self.shared.join(self.sent(self.own()))) }
    }

    /// Rows that are kept here, on their way to another process.
    fn sent(&self, rows: Range<usize>) -> Vec<(Vec<u32>, Vec<f32>)> {
        let sent = |(columns, values): (&[u32], &[f32])| (columns.to_vec(), values.to_vec());
        rows.map(|i| sent(self.row(i))).collect()
    }

    /// `n` empty rows.
    pub fn empty(n: usize) -> Rows {
        Rows::from_rows(vec![Default::default(); n])
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.shared.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of stored entries, by all processes together.
    pub fn entries(&self) -> usize {
        self.entries
    }

    /// Bytes of memory the matrix holds here.
    pub fn bytes(&self) -> usize {
        8 * self.starts.len() + 8 * self.values.len()
    }

    /// Columns and values of row i.
    ///
    /// # Panics
    /// If another process keeps it ([`Rows::own`], [`Rows::whole`]).
    pub fn row(&self, i: usize) -> (&[u32], &[f32]) {
        let k = i - self.own().start;
        let range = self.starts[k]..self.starts[k + 1];
        (&self.columns[range.clone()], &self.values[range])
    }

    /// Entry (i, j), 0 where none is stored.
    pub fn get(&self, i: usize, j: u32) -> f32 {
        let (columns, values) = self.row(i);
        columns.binary_search(&j).map_or(0.0, |k| values[k])
    }

    /// The transposed matrix; its row j is kept where row j of this one is.
    pub fn transposed(&self) -> Rows {
        let own = self.own_transposed();
        if self.shared.is_everyone() {
            return own;
        }
        let found = self.shared.hand_out(self.shared.ranges().map(|range| own.sent(range)).collect());
        drop(own);
        // Rows of this matrix ascend with the ranks, and so do columns of that one.
        let mut from_each: Vec<_> = found.into_iter().map(Vec::into_iter).collect();
        let join = |_| {
            let mut row = (Vec::new(), Vec::new());
            for (columns, values) in from_each.iter_mut().filter_map(Iterator::next) {
                row.0.extend(columns);
                row.1.extend(values);
            }
            row
        };
        let rows = self.own().map(join).collect();
        Rows::joined(self.shared.clone(), rows, self.entries)
    }

    /// The rows kept here, transposed: all its rows are here, too.
    fn own_transposed(&self) -> Rows {
        let n = self.len();
        let mut starts = vec![0usize; n + 1];
        for &j in &self.columns {
            starts[j as usize + 1] += 1;
        }
        for j in 0..n {
            starts[j + 1] += starts[j];
        }
        let mut next = starts.clone();
        let mut columns = vec![0; self.columns.len()];
        let mut values = vec![0.0; self.values.len()];
        for i in self.own() {
            let (row, f) = self.row(i);
            for (&j, &f) in row.iter().zip(f) {
                let k = &mut next[j as usize];
                columns[*k] = i as u32;
                values[*k] = f;
                *k += 1;
            }
        }
        Rows { shared: Loop::everyone(n), entries: values.len(), starts, columns, values }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec4;

    use super::*;

    fn sample() -> Rows {
        Rows::from_rows(vec![(vec![0, 2], vec![0.25, 0.5]), (vec![], vec![]), (vec![1], vec![1.0])])
    }

    #[test]
    fn product_and_transpose_by_hand() {
        let x: Vec<Vec4> = [1.0, 2.0, 4.0].map(Vec4::splat).to_vec();
        let first = |v: Vec<Vec4>| v.iter().map(|y| y.x).collect::<Vec<_>>();
        assert_eq!(first(sample().product(&x)), [2.25, 0.0, 2.0]);
        assert_eq!(first(sample().transposed().product(&x)), [0.25, 4.0, 0.5]);
        assert_eq!(sample().transposed().transposed(), sample());
    }

    #[test]
    fn parts_make_the_same_matrix_or_none() {
        let of = |starts: &[usize], columns: &[u32], values: &[f32]| {
            Rows::from_parts(starts.to_vec(), columns.to_vec(), values.to_vec())
        };
        let rows = sample();
        let (starts, columns, values) = rows.parts();
        assert_eq!(of(starts, columns, values).as_ref(), Some(&rows));
        for (starts, columns, values) in [
            (&[][..], &[][..], &[][..]),
            (&[1, 1], &[], &[]),
            (&[0, 2], &[0], &[1.0]),
            (&[0, 2, 1], &[0, 1], &[1.0, 1.0]),
            (&[0, 2, 2], &[1, 0], &[1.0, 1.0]),
            (&[0, 1], &[1], &[1.0]),
            (&[0, 1], &[0], &[f32::NAN]),
            (&[0, 1], &[0], &[-1.0]),
        ] {
            assert_eq!(of(starts, columns, values), None, "{starts:?} {columns:?} {values:?}");
        }
    }

    #[test]
    fn a_part_of_a_matrix_has_its_entries() {
        let part = sample().restricted(&[true, true, false], &[true, true, false]);
        assert_eq!(part, Rows::from_rows(vec![(vec![0], vec![0.25]), (vec![], vec![]), (vec![], vec![])]));
    }

    #[test]
    fn long_rows_keep_their_sum() {
        let n = 100_000;
        let rows = Rows::from_rows(vec![((0..n).collect(), vec![1.0 / n as f32; n as usize])]);
        let sum = rows.product(&vec![Vec4::ONE; n as usize])[0].x as f64;
        let exact = n as f64 * (1.0 / n as f32) as f64;
        assert!((sum - exact).abs() <= Rows::ROUNDING * exact);
    }
}
