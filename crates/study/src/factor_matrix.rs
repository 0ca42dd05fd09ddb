//! Form factors as matrices: between objects under their names, and between patches; with what they leave of closure
//! and reciprocity.
//!
//! ```text
//! closure_i         = 1 - sum over j of F_ij, the sky's column among them      0 in a closed opaque scene
//! reciprocity_ij    = (A_i F_ij - A_j F_ji) / max(A_i F_ij, A_j F_ji)          objects
//! reciprocity_i     = sqrt(sum over j of (A_i F_ij - A_j F_ji)² / sum over j of (A_i F_ij)²)     patches
//! ```
//!
//! Nothing is repaired: residuals show the rays' noise, and what light gets lost. Not handled: how factors are found.

use rayon::prelude::*;

use crate::factors::FactorTable;
use halflight::form_factors::{FormFactors, Rows, Sampling, Variant, reciprocity};
use halflight::operator::Wanted;
use halflight::pictures::unlike;
use halflight::render::{Discretization, Watch};

/// Form factors between n objects as a matrix, whose columns are the objects and, where there is one, the sky.
#[derive(Clone, Debug)]
pub struct FactorMatrix {
    /// Names of the objects; no two are the same.
    pub rows: Vec<String>,
    /// Names of what receives.
    pub columns: Vec<String>,
    /// `F_ij`, row by row.
    pub values: Vec<f64>,
    /// Standard errors of them.
    pub errors: Vec<f64>,
    /// Areas of the objects, in the file's units squared.
    pub areas: Vec<f64>,
    /// What is missing of 1 in each row.
    pub closure: Vec<f64>,
    /// Residuals of the objects' pairs, n × n: that of (j, i) is that of (i, j) with the other sign.
    pub reciprocity: Vec<f64>,
}

impl FactorMatrix {
    /// That of a table.
    pub fn of(table: &FactorTable) -> FactorMatrix {
        let n = table.rows.len();
        let columns = unlike(table.columns.iter().cloned(), |name, k| format!("{name} ({k})"));
        let mut reciprocity = vec![0.0; n * n];
        for r in &table.reciprocity {
            let (i, j) = r.pair;
            (reciprocity[i * n + j], reciprocity[j * n + i]) = (r.residual, -r.residual);
        }
        FactorMatrix {
            rows: columns[..n].to_vec(),
            columns,
            values: table.factors.iter().map(|f| f.share.value).collect(),
            errors: table.factors.iter().map(|f| f.share.error).collect(),
            areas: table.rows.iter().map(|row| row.area).collect(),
            closure: table.rows.iter().map(|row| 1.0 - row.sum.value).collect(),
            reciprocity,
        }
    }

    /// The residual of row i that is the largest by its size.
    pub fn worst_reciprocity(&self, i: usize) -> f64 {
        let n = self.rows.len();
        let own = &self.reciprocity[i * n..(i + 1) * n];
        own.iter().fold(0.0, |worst: f64, r| if r.abs() > worst.abs() { *r } else { worst })
    }
}

/// Form factors between patches.
pub struct PatchFactors {
    /// F: all rows but those of the sky, and all columns.
    pub factors: FormFactors,
    /// Share of each patch's rays that reach the sky; 0 where there is none.
    pub sky: Vec<f32>,
    /// Areas, in the file's units squared.
    pub areas: Vec<f64>,
    /// The object of each patch; that of its first face where it is a part of several.
    pub objects: Vec<u32>,
    /// What is missing of 1 in each row; 0 in rows of the sky.
    pub closure: Vec<f32>,
    /// The residual of each row, without what goes to the sky.
    pub reciprocity: Vec<f32>,
    /// The residual of all rows together, likewise.
    pub residual: f64,
    /// Rays cast.
    pub rays: u64,
}

/// Finds the form factors between all patches by rays; `tau` holds one number per material.
pub fn patch_factors(p: &Discretization, tau: &[f32], sampling: &Sampling, watch: &dyn Watch) -> PatchFactors {
    let (geometry, patches) = (&*p.geometry, &*p.patches);
    let scene = &geometry.scene;
    let face = |i: usize| patches.pieces(i).next().map_or(0, |piece| piece.0);
    let variants = [Variant::whole(scene, patches, tau)];
    watch.begin("form factors", patches.len() as u64);
    let tick = |done| watch.tick(done);
    let (mut found, rays) = p.rows.rows(&Wanted { geometry, patches, variants: &variants, sampling, tick: &tick });
    let factors = found.remove(0).whole();
    let areas = patches.file_areas(scene);
    let sky = |i: usize| {
        let (columns, values) = factors.rows.row(i);
        let own = columns.iter().zip(values).filter(|(j, _)| patches.is_sky(scene, **j as usize));
        own.fold(0.0, |sum, (_, value)| sum + f64::from(*value)) as f32
    };
    let objects = (0..patches.len()).map(|i| scene.faces[face(i) as usize].object);
    // What goes to the sky does not come back by rows of F, which the sky has none of.
    let solid: Vec<bool> = (0..patches.len()).map(|i| !patches.is_sky(scene, i)).collect();
    let among = if scene.sky.is_some() { &factors.rows.restricted(&solid, &solid) } else { &factors.rows };
    let (each, residual) = (row_residuals(among, &areas), reciprocity(among, &areas));
    PatchFactors {
        sky: (0..patches.len()).map(sky).collect(),
        objects: objects.collect(),
        closure: factors.row_sums.iter().map(|sum| sum.map_or(0.0, |sum| 1.0 - sum)).collect(),
        reciprocity: each,
        residual,
        areas,
        factors,
        rays,
    }
}

/// The reciprocity residual of each row.
fn row_residuals(f: &Rows, areas: &[f64]) -> Vec<f32> {
    let transposed = f.transposed();
    let row = |i: usize| {
        let ((sent, values), (back, returned)) = (f.row(i), transposed.row(i));
        let norm: f64 = values.iter().map(|v| (areas[i] * f64::from(*v)).powi(2)).sum();
        // Pairs that are stored one way only count as well.
        let one = sent.iter().zip(values).map(|(&j, v)| (j, areas[i] * f64::from(*v), f64::from(transposed.get(i, j))));
        let both: f64 = one.map(|(j, sent, back)| (sent - areas[j as usize] * back).powi(2)).sum();
        let alone = back.iter().zip(returned).filter(|(j, _)| sent.binary_search(j).is_err());
        let alone: f64 = alone.map(|(&j, v)| (areas[j as usize] * f64::from(*v)).powi(2)).sum();
        if norm > 0.0 { ((both + alone) / norm).sqrt() as f32 } else { 0.0 }
    };
    (0..f.len()).into_par_iter().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn residuals_of_rows_by_hand() {
        let f = Rows::from_rows(vec![(vec![1], vec![0.5]), (vec![0], vec![0.5]), (vec![0], vec![0.25])]);
        let residuals = row_residuals(&f, &[1.0, 2.0, 4.0]);
        // Row 0: A F is 0.5, back come 1 and 1.
        assert_eq!(residuals, [(0.25f32 + 1.0).sqrt() / 0.5, 0.5, 1.0]);
    }
}
