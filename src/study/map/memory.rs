//! How much memory the crossings of a survey will take, told before they are cast.
//!
//! ```text
//! n (12 x + 4 c + 4 r + 72)    x crossings, c columns and r rays a patch; three lists
//! n (24 c + 72)                one matrix made from them, apart and joined
//! n (32 s + 200)               eigenvectors of s columns of the map, and other lists
//! ```
//!
//! x and c are measured on a few patches. Not handled: the scene itself, which is already loaded.

use crate::form_factors::{Sampling, Variant, cast_layers};
use crate::light::Transport;

use crate::render::memory::{most_fitting, pilots};
use crate::render::{Prepared, Stored, Unfit};

/// Bytes of a crossing, of a column or ray that is listed, and of a patch's three lists.
const CROSSING: f64 = 12.0;
const LISTED: f64 = 4.0;
const LISTS: f64 = 72.0;
/// Bytes of an entry of a matrix while it is made, and of its row.
const ENTRY: f64 = 24.0;
const ROW: f64 = 72.0;
/// Bytes of a patch for each column of the map, and for all other lists.
const VECTORS: f64 = 32.0;
const PATCH: f64 = 200.0;

/// Checks that the crossings of a [`map`](crate::study::map::map) of so many `steps` each way fit in `limit` bytes;
/// infinity asks nothing.
///
/// # Errors
/// [`Unfit`], with the number of patches that would.
pub fn check_crossings(p: &Prepared, sampling: &Sampling, steps: usize, limit: f64) -> Result<(), Unfit> {
    if limit.is_infinite() {
        return Ok(());
    }
    let n = p.patches.len();
    let (crossings, columns) = pilot(p, sampling);
    let needs = |n: f64| {
        let c = columns.min(n);
        let kept = CROSSING * crossings + LISTED * (c + f64::from(sampling.rays)) + LISTS;
        n * (kept + ENTRY * c + ROW + VECTORS * steps as f64 + PATCH)
    };
    let bytes = needs(n as f64);
    if bytes <= limit {
        return Ok(());
    }
    let fitting = most_fitting(n, limit, needs).max(1);
    Err(Unfit { patches: n, stored: Stored::Crossings(crossings), bytes, limit, fitting })
}

/// Mean crossings and columns of a few patches at alpha = tau = 1.
fn pilot(p: &Prepared, sampling: &Sampling) -> (f64, f64) {
    let n = p.patches.len();
    let mut receives = vec![false; n];
    let chosen = pilots(n, sampling);
    for &i in &chosen {
        receives[i] = true;
    }
    let corner = Transport { alpha: 1.0, tau: 1.0 };
    let transports = p.scene.transports(corner);
    let tau: Vec<f32> = transports.iter().map(|t| t.tau).collect();
    let own = Variant { tau, rows: receives, columns: vec![true; n] };
    let (layers, _) = cast_layers(&p.rays, &p.patches, &own, sampling, &|_| ());
    let mean = |count: usize| count as f64 / chosen.len().max(1) as f64;
    (mean(layers.crossings()), mean(layers.columns()))
}
