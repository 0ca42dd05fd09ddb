//! Light on clusters of small faces, smooth from cluster to cluster: what faces receive of light that was reflected is the
//! mean of what the patches around them do, those of their material that face the same way.
//!
//! ```text
//! weight of patch j  =  A_j exp(-|x - c_j|² / (2 h²)) max(0, n n_j)^4,      h the size of the patches
//! ```
//!
//! with x and n the mean place and normal of the faces. Not handled: thin things of one material, side by side and facing
//! the same way, whose light is mixed.

use glam::Vec3;
use rustc_hash::FxHashMap;

use crate::patches::Patches;
use crate::patches::scene_patches::Owner;
use crate::rays::Side;
use crate::scene::Scene;
use crate::surfaces::coplanar::normal;

/// Patches farther away than so many sizes do not count.
const FAR: f32 = 2.0;

/// Where patches of small faces lie.
pub(super) struct Clusters<'a> {
    scene: &'a Scene,
    patches: &'a Patches,
    middles: Vec<Vec3>,
    normals: Vec<Vec3>,
    /// Patches by cubes of the size of a patch.
    near: FxHashMap<[i32; 3], Vec<u32>>,
    size: f32,
}

impl<'a> Clusters<'a> {
    pub fn new(scene: &'a Scene, patches: &'a Patches) -> Clusters<'a> {
        let size = patches.size() as f32;
        let middles: Vec<Vec3> = (0..patches.len()).map(|i| patches.middle(i)).collect();
        let normals = (0..patches.len()).map(|i| patches.mean_normal(i)).collect();
        let mut near: FxHashMap<[i32; 3], Vec<u32>> = FxHashMap::default();
        let (owners, _) = patches.layout();
        let mut fronts: Vec<u32> = owners[..scene.solid_faces() as usize]
            .iter()
            .filter_map(|owner| match owner {
                Owner::Patch(patch) if (*patch as usize) < patches.len() => Some(*patch),
                _ => None,
            })
            .collect();
        fronts.sort_unstable();
        fronts.dedup();
        for patch in fronts.iter().flat_map(|&front| [Some(front), patches.behind(front)]).flatten() {
            near.entry(cube(middles[patch as usize], size)).or_default().push(patch);
        }
        Clusters { scene, patches, middles, normals, near, size }
    }

    /// The patches around the faces of a cell, with weights that add up to 1; its own where none counts.
    pub fn around(&self, faces: &[u32], side: Side, own: u32) -> Vec<(u32, f32)> {
        let count = faces.len().max(1) as f32;
        let middle = |face: &u32| self.scene.corners(*face).into_iter().sum::<Vec3>() / 3.0;
        let x = faces.iter().map(middle).sum::<Vec3>() / count;
        let sign = if side == Side::Back { -1.0 } else { 1.0 };
        let n = sign * faces.iter().map(|&face| normal(self.scene.corners(face)).as_vec3()).sum::<Vec3>();
        let n = n.normalize_or_zero();
        let material = self.patches.materials()[own as usize];
        let [i, j, k] = cube(x, self.size);
        let reach = FAR as i32;
        let cubes = (-reach..=reach)
            .flat_map(|a| (-reach..=reach).flat_map(move |b| (-reach..=reach).map(move |c| [i + a, j + b, k + c])));
        let mut found: Vec<(u32, f32)> = cubes
            .filter_map(|cube| self.near.get(&cube))
            .flatten()
            .filter(|&&patch| {
                self.patches.materials()[patch as usize] == material && self.patches.side(patch as usize) == side
            })
            .map(|&patch| (patch, self.weight(patch, x, n)))
            .filter(|(_, weight)| *weight > 0.0)
            .collect();
        let sum: f32 = found.iter().map(|(_, weight)| weight).sum();
        if sum <= 0.0 {
            return vec![(own, 1.0)];
        }
        found.iter_mut().for_each(|(_, weight)| *weight /= sum);
        found
    }

    fn weight(&self, patch: u32, x: Vec3, n: Vec3) -> f32 {
        let apart = x.distance(self.middles[patch as usize]) / self.size;
        if apart > FAR {
            return 0.0;
        }
        let along = n.dot(self.normals[patch as usize]).max(0.0);
        self.patches.areas()[patch as usize] as f32 * (-0.5 * apart * apart).exp() * along.powi(4)
    }
}

fn cube(x: Vec3, size: f32) -> [i32; 3] {
    (x / size).floor().to_array().map(|x| x as i32)
}

/// Where a point of unit coordinates comes on a curve through all of space that keeps neighbours together (G. Morton
/// 1966): the bits of its coordinates, in turn.
pub(super) fn along_curve(x: Vec3) -> u32 {
    let cells = x.to_array().map(|x| ((x + 1.0) * 512.0).clamp(0.0, 1023.0) as u32);
    (0..10).fold(0, |code, bit| (0..3).fold(code, |code, axis| code | (cells[axis] >> bit & 1) << (3 * bit + axis)))
}
