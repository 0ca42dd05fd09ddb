//! Small surfaces that share one patch: same material and side of space, near-equal normals, close together.
//!
//! Grouped by a voxel of the target size and by the cell of a cube map that the normal points to (26 cells, about 45°
//! wide), so that the cost is linear and neither connectivity nor order of the faces matters.
//!
//! Not handled: light that differs between the surfaces of a group; they share one value.

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

use crate::surfaces::coplanar::Surface;

/// What surfaces of one group agree in: material, voxel, cell of the normal, size.
type Key = (u32, [i64; 3], [i8; 3], u64);

/// The keys of surfaces with the size of their patches, at sizes larger by a factor.
fn keys(small: &[(&Surface, f64)], factor: f64) -> Vec<Key> {
    let key = |(s, size): &(&Surface, f64)| {
        let middle = s.origin + 0.5 * (s.axes[0] * s.extent[0] + s.axes[1] * s.extent[1]);
        let voxel = (middle / (factor * size)).floor().as_i64vec3();
        let cell = direction_cell(s.normal);
        (s.material, voxel.to_array(), cell, size.to_bits())
    };
    small.par_iter().with_min_len(1024).map(key).collect()
}

/// Number of groups.
pub(crate) fn count(small: &[(&Surface, f64)]) -> usize {
    let keys = keys(small, 1.0);
    let distinct: FxHashSet<Key> = keys.into_iter().collect();
    distinct.len()
}

/// Indices into `small`, surfaces with the size of their patches, that belong together at sizes larger by a factor, in
/// the order of their first members.
pub(crate) fn groups(small: &[(&Surface, f64)], factor: f64) -> Vec<Vec<usize>> {
    let mut order: FxHashMap<Key, usize> = FxHashMap::default();
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (k, key) in keys(small, factor).into_iter().enumerate() {
        let g = *order.entry(key).or_insert_with(|| {
            groups.push(Vec::new());
            groups.len() - 1
        });
        groups[g].push(k);
    }
    groups
}

/// For each of the groups, numbered from `first`, the number of the group of twice the size that it is part of.
pub(crate) fn parents(small: &[(&Surface, f64)], clusters: &[Vec<usize>], first: u32) -> Vec<(u32, u32)> {
    let mut larger = vec![0; small.len()];
    for (g, group) in groups(small, 2.0).iter().enumerate() {
        group.iter().for_each(|&k| larger[k] = g as u32);
    }
    let numbered = clusters.iter().zip(first..);
    numbered.map(|(group, own)| (own, larger[group[0]])).collect()
}

/// Cell of a cube map with 3×3 cells a face; cells on an edge or corner of the cube belong to all its faces.
fn direction_cell(n: DVec3) -> [i8; 3] {
    let along = n / n.abs().max_element();
    // Nudged so that directions on a cell's border, as of a box at 45°, fall on one side whatever the rounding.
    (along * 1.4999).round().to_array().map(|x| x as i8)
}
