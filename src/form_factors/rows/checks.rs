//! Checks of F that anyone may call: closure (row sums) and reciprocity (`A_i F_ij = A_j F_ji`).

use crate::form_factors::rows::cast::FormFactors;
use crate::form_factors::rows::sparse::Rows;

/// Sums of the rows of F: 1 in a closed opaque scene, less where light escapes or meets black backs, more where
/// surfaces transmit.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Closure {
    /// The smallest row sum.
    pub min: f64,
    /// The largest row sum.
    pub max: f64,
    /// The area-weighted mean.
    pub mean: f64,
}

/// Row sums over the patches rays were cast from; `None` where no ray was cast at all.
pub fn closure(f: &FormFactors, areas: &[f64]) -> Option<Closure> {
    let mut found: Option<Closure> = None;
    let (mut weighted, mut area) = (0.0, 0.0);
    for (sum, a) in f.row_sums.iter().zip(areas) {
        let Some(sum) = sum.map(f64::from) else {
            continue;
        };
        weighted += a * sum;
        area += a;
        let (min, max) = found.map_or((sum, sum), |c| (c.min.min(sum), c.max.max(sum)));
        let mean = weighted / area;
        found = Some(Closure { min, max, mean });
    }
    found
}

/// Reciprocity residual: the Frobenius norm of `A F - (A F)^T` over that of `A F`, A the diagonal of areas.
///
/// Noise of the rays makes it positive even where F is right; 0 for an empty matrix.
pub fn reciprocity(f: &Rows, areas: &[f64]) -> f64 {
    let transposed = f.transposed();
    let (mut residual, mut norm) = (0.0, 0.0);
    for i in 0..f.len() {
        let (columns, values) = f.row(i);
        for (&j, &value) in columns.iter().zip(values) {
            let sent = areas[i] * value as f64;
            let back = areas[j as usize] * transposed.get(i, j) as f64;
            // A pair stored on one side only is met once: count it for both.
            let twice = if back == 0.0 { 2.0 } else { 1.0 };
            residual += twice * (sent - back).powi(2);
            norm += sent * sent;
        }
    }
    if norm > 0.0 { (residual / norm).sqrt() } else { 0.0 }
}
