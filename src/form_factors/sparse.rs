//! Sparse rows (compressed row storage) of f32 with u32 columns.
//!
//! Products accumulate in f32 over short runs and in f64 between them, so that the relative rounding error of a
//! non-negative row stays below [`Rows::ROUNDING`] however long the row. Not handled: the products themselves.

/// A sparse matrix of non-negative f32 by rows, columns ascending.
#[derive(Clone, Debug, PartialEq)]
pub struct Rows {
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
        let mut joined = Rows {
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

    /// `n` empty rows.
    pub fn empty(n: usize) -> Rows {
        Rows::from_rows(vec![Default::default(); n])
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of stored entries.
    pub fn entries(&self) -> usize {
        self.values.len()
    }

    /// Bytes of memory the matrix holds.
    pub fn bytes(&self) -> usize {
        8 * self.starts.len() + 8 * self.values.len()
    }

    /// Columns and values of row i.
    pub fn row(&self, i: usize) -> (&[u32], &[f32]) {
        let range = self.starts[i]..self.starts[i + 1];
        (&self.columns[range.clone()], &self.values[range])
    }

    /// Entry (i, j), 0 where none is stored.
    pub fn get(&self, i: usize, j: u32) -> f32 {
        let (columns, values) = self.row(i);
        columns.binary_search(&j).map_or(0.0, |k| values[k])
    }

    /// The transposed matrix.
    pub fn transposed(&self) -> Rows {
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
        for i in 0..n {
            let (row, f) = self.row(i);
            for (&j, &f) in row.iter().zip(f) {
                let k = &mut next[j as usize];
                columns[*k] = i as u32;
                values[*k] = f;
                *k += 1;
            }
        }
        Rows { starts, columns, values }
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
    fn long_rows_keep_their_sum() {
        let n = 100_000;
        let rows = Rows::from_rows(vec![((0..n).collect(), vec![1.0 / n as f32; n as usize])]);
        let sum = rows.product(&vec![Vec4::ONE; n as usize])[0].x as f64;
        let exact = n as f64 * (1.0 / n as f32) as f64;
        assert!((sum - exact).abs() <= Rows::ROUNDING * exact);
    }
}
