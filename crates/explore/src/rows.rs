//! Rows of F between coarse patches, layer by layer, for the question where a patch gets its light from.
//!
//! ```text
//! F^tau_ij = sum over k of tau^k F^(k)_ij,     k the surfaces crossed before
//! ```
//!
//! so that one cast of rays has the rows of every tau exactly. All rows of F would fill a page many times over: these
//! are of few large patches, with more rays each. Materials with a tau of their own count by it at the page's tau 1.
//!
//! Not handled: layers beyond [`DEPTHS`], which count as the last.

use crate::numbers::factor_code;
use halflight::form_factors::{Sampling, Variant, cast_layers};
use halflight::light::Transport;
use halflight::patches::Patches;
use halflight::scene::Scene;
use halflight::surfaces::Geometry;

/// Coarse patches, about.
const PATCHES: usize = 300;
/// Rays of each.
const RAYS: u32 = 1024;
/// Layers at most.
const DEPTHS: usize = 4;

/// Coarse patches, and F between them.
pub(super) struct CoarseRows {
    pub patches: Patches,
    /// Layers.
    pub depths: usize,
    /// Codes of F, layer by layer and row by row.
    pub codes: Vec<u8>,
}

impl CoarseRows {
    /// Casts the rays of coarse patches.
    pub fn new(geometry: &Geometry, seed: u32) -> CoarseRows {
        let Geometry { scene, rays, .. } = geometry;
        let patches = Patches::cut(geometry, PATCHES);
        let transports = scene.transports(Transport { alpha: 1.0, tau: 1.0 });
        let all = vec![true; patches.len()];
        let tau = transports.iter().map(|t| t.tau).collect();
        let own = Variant { tau, rows: reflecting(scene, &patches), columns: all };
        let sampling = Sampling { rays: RAYS, seed, ..Sampling::default() };
        let numbers = cast_layers(rays, &patches, &own, &sampling, &|_| ()).0.whole().numbers();
        let count = patches.len();
        let depths = numbers.depths.iter().max().map_or(1, |deepest| (*deepest as usize + 1).min(DEPTHS));
        let mut f = vec![0.0_f32; depths * count * count];
        let (mut columns, mut ends) = (&numbers.columns[..], &numbers.ends[..]);
        let mut first = 0;
        for i in 0..count {
            let (own, own_ends);
            (own, columns) = columns.split_at(numbers.columns_of[i]);
            (own_ends, ends) = ends.split_at(numbers.rays_of[i]);
            let crossings = own_ends.last().map_or(0, |&end| end as usize);
            for k in first..first + crossings {
                let depth = (numbers.depths[k] as usize).min(depths - 1);
                let j = own[numbers.slots[k] as usize] as usize;
                f[(depth * count + i) * count + j] += numbers.weights[k] / RAYS as f32;
            }
            first += crossings;
        }
        CoarseRows { patches, depths, codes: f.into_iter().map(factor_code).collect() }
    }
}

/// Patches that reflect.
fn reflecting(scene: &Scene, patches: &Patches) -> Vec<bool> {
    (0..patches.len()).map(|i| patches.reflectance(scene, i).max_element() > 0.0).collect()
}
