//! Faces that hang together: a union-find over the corners that faces share.
//!
//! Not handled: faces that touch without a common corner count as apart.

use std::hash::Hash;

use rustc_hash::FxHashMap;

use crate::scene::Scene;

/// Parts of `faces` that hang together: faces of one `kind` that share a corner. Parts and the faces of each keep their
/// order.
pub(crate) fn connected<K: Copy + Eq + Hash>(scene: &Scene, faces: &[u32], kind: impl Fn(u32) -> K) -> Vec<Vec<u32>> {
    if let [face] = faces {
        return vec![vec![*face]];
    }
    let mut parents: Vec<u32> = (0..faces.len() as u32).collect();
    let mut first: FxHashMap<([u32; 3], K), u32> = FxHashMap::default();
    for (k, &face) in (0u32..).zip(faces) {
        let kind = kind(face);
        for corner in scene.corners(face) {
            // Corners are compared by position: exporters repeat vertices.
            let position = corner.to_array().map(|x| (x + 0.0).to_bits());
            let other = *first.entry((position, kind)).or_insert(k);
            let (a, b) = (root(&mut parents, k), root(&mut parents, other));
            // The first face of a part is its root.
            parents[a.max(b) as usize] = a.min(b);
        }
    }
    let mut parts: Vec<Vec<u32>> = vec![Vec::new(); faces.len()];
    for (k, &face) in (0u32..).zip(faces) {
        parts[root(&mut parents, k) as usize].push(face);
    }
    parts.retain(|faces| !faces.is_empty());
    parts
}

/// The root of k in a forest, whose paths it halves.
fn root(parents: &mut [u32], mut k: u32) -> u32 {
    while parents[k as usize] != k {
        parents[k as usize] = parents[parents[k as usize] as usize];
        k = parents[k as usize];
    }
    k
}
