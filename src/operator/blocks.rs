//! K written out as a sparse matrix of explicit 2×2 blocks, one channel at a time: for inspection, and as an oracle.

use nalgebra::{DMatrix, Matrix2};
use sprs::{CsMat, TriMat};

use crate::light::reflectance;
use crate::operator::factored::Operator;

impl Operator {
    /// K of channel c (0 red, 1 green, 2 blue) with blocks `K_ij = F_ij rho_i [[alpha_i, 0], [1, 0]]`.
    pub fn blocks(&self, c: usize) -> CsMat<Matrix2<f32>> {
        let n = self.len();
        let mut k = TriMat::new((n, n));
        for i in 0..n {
            let matrix = reflectance(self.reflectance(i)[c], self.alpha(i));
            let (columns, values) = self.form_factors().row(i);
            for (&j, &f) in columns.iter().zip(values) {
                k.add_triplet(i, j as usize, f * matrix);
            }
        }
        k.to_csr()
    }

    /// K of channel c as a dense 2n×2n matrix, components of a patch side by side (invisible, visible).
    pub fn dense(&self, c: usize) -> DMatrix<f64> {
        let n = self.len();
        let mut k = DMatrix::zeros(2 * n, 2 * n);
        for (block, (i, j)) in self.blocks(c).iter() {
            let mut place = k.fixed_view_mut::<2, 2>(2 * i, 2 * j);
            place.copy_from(&block.cast::<f64>());
        }
        k
    }
}
