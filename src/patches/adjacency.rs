//! Which patches are neighbours on one surface, for light that is read as linear within a patch.
//!
//! On a grid the four cells that share an edge. A line of contact divides light from dark, so patches along it are no
//! one's neighbours.
//!
//! Lengths are in unit coordinates. Not handled: patches that small surfaces share, and cells cut along lines; they
//! have no neighbours.

use glam::Vec3;

use crate::patches::grid::{Grid, NONE};
use crate::patches::scene_patches::Patches;

/// The neighbours of each patch, and where they lie.
#[derive(Clone, Debug)]
pub struct Neighbours {
    /// Along the first axis after and before, along the second after and before; [`u32::MAX`] where there is none.
    beside: Vec<[u32; 4]>,
    /// Centroids.
    middles: Vec<Vec3>,
    /// Half the patch's size along both axes, as vectors.
    halves: Vec<[Vec3; 2]>,
}

impl Patches {
    /// Which patches are neighbours.
    pub fn neighbours(&self) -> Neighbours {
        let mut found = Neighbours {
            beside: vec![[NONE; 4]; self.len()],
            middles: (0..self.len()).map(|i| self.extent(i).middle).collect(),
            halves: vec![[Vec3::ZERO; 2]; self.len()],
        };
        for grid in &self.mesh.grids {
            for patch in grid.whole() {
                let middle = found.middles[patch as usize];
                let beside = grid.beside(patch, middle);
                found.set(patch, beside, grid);
                let behind = |p: u32| self.mesh.backs.get(p as usize).copied().unwrap_or(NONE);
                if behind(patch) != NONE {
                    found.set(behind(patch), beside.map(behind), grid);
                }
            }
        }
        if self.are_divided() {
            // The parts of a patch have no grid.
            found.beside.fill([NONE; 4]);
        }
        found.keep_mutual();
        found
    }
}

impl Neighbours {
    /// A cell that joined another's patch has that patch as a neighbour, but is none of the patch's own cell.
    fn keep_mutual(&mut self) {
        let before = self.beside.clone();
        for (i, beside) in self.beside.iter_mut().enumerate() {
            for (k, other) in beside.iter_mut().enumerate() {
                let back = before.get(*other as usize).map(|b| b[k ^ 1]);
                if back != Some(i as u32) {
                    *other = NONE;
                }
            }
        }
    }

    fn set(&mut self, patch: u32, beside: [u32; 4], grid: &Grid) {
        self.beside[patch as usize] = beside;
        self.halves[patch as usize] = grid.halves();
    }

    /// The neighbours of larger patches: `parents` has the one that each patch is part of, `areas` its size.
    pub fn larger(&self, parents: &[u32], areas: &[f64]) -> Neighbours {
        let count = parents.iter().max().map_or(0, |&p| p as usize + 1);
        let mut found = Neighbours {
            beside: vec![[NONE; 4]; count],
            middles: vec![Vec3::ZERO; count],
            halves: vec![[Vec3::ZERO; 2]; count],
        };
        let mut totals = vec![0.0; count];
        for (i, &p) in parents.iter().enumerate() {
            let p = p as usize;
            totals[p] += areas[i];
            let share = (areas[i] / totals[p]) as f32;
            found.middles[p] = found.middles[p].lerp(self.middles[i], share);
            // A part without neighbours has no size.
            if self.halves[i] != [Vec3::ZERO; 2] {
                found.halves[p] = self.halves[i].map(|half| 2.0 * half);
            }
            for (own, &j) in found.beside[p].iter_mut().zip(&self.beside[i]) {
                if let Some(&other) = parents.get(j as usize).filter(|&&other| other as usize != p) {
                    *own = other;
                }
            }
        }
        found
    }

    /// Number of patches.
    pub fn len(&self) -> usize {
        self.middles.len()
    }

    /// Whether there is no patch.
    pub fn is_empty(&self) -> bool {
        self.middles.is_empty()
    }

    /// Centroid of patch i.
    pub fn middle(&self, i: usize) -> Vec3 {
        self.middles[i]
    }

    /// Half the size of patch i along both axes, as vectors; zero where it has no neighbours.
    pub fn halves(&self, i: usize) -> [Vec3; 2] {
        self.halves[i]
    }

    /// Whether patch i has a neighbour along both axes, so that light on it can be read as linear.
    pub fn has_slopes(&self, i: usize) -> bool {
        [0, 1].into_iter().all(|axis| self.beside(i, axis) != [None; 2])
    }

    /// The patches after and before patch i along an axis, 0 or 1.
    pub fn beside(&self, i: usize, axis: usize) -> [Option<usize>; 2] {
        [0, 1].map(|k| {
            let other = self.beside[i][2 * axis + k];
            (other != NONE).then_some(other as usize)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::Rays;
    use crate::scene::Scene;

    fn neighbours(scene: &str, count: usize) -> (Patches, Neighbours) {
        let scene = Scene::open(scene).unwrap();
        let patches = Patches::new(&scene, &Rays::new(&scene), count);
        let found = patches.neighbours();
        (patches, found)
    }

    #[test]
    fn neighbours_are_mutual_and_lie_a_patch_apart() {
        for scene in ["cornell-box", "furnished-room"] {
            let (_, n) = neighbours(scene, 3000);
            let mut pairs = 0;
            for i in 0..n.len() {
                for axis in 0..2 {
                    for (side, other) in n.beside(i, axis).into_iter().enumerate() {
                        let Some(j) = other else { continue };
                        assert_eq!(n.beside(j, axis)[1 - side], Some(i), "{scene}: {i} {j}");
                        let half = n.halves(i)[axis];
                        let steps = (n.middle(j) - n.middle(i)).dot(half) / half.length_squared();
                        let steps = if side == 0 { steps } else { -steps };
                        // Two halves, less or more where a rim cuts a cell or a sliver joins it.
                        assert!((0.5..4.0).contains(&steps), "{scene}: {i} {j} {steps}");
                        pairs += 1;
                    }
                }
            }
            assert!(pairs > 2 * n.len(), "{scene}: {pairs} of {}", n.len());
        }
    }

    /// Slopes of a larger patch without a size would be 0 / 0.
    #[test]
    fn a_part_without_neighbours_leaves_a_larger_patch_its_size() {
        let halves = [0.1 * Vec3::X, 0.1 * Vec3::Y];
        let cells = Neighbours {
            beside: vec![[2, NONE, NONE, NONE], [NONE; 4], [NONE, 0, NONE, NONE]],
            middles: vec![Vec3::ZERO, 0.1 * Vec3::Y, 0.2 * Vec3::X],
            halves: vec![halves, [Vec3::ZERO; 2], halves],
        };
        let larger = cells.larger(&[0, 0, 1], &[0.04, 0.01, 0.04]);
        assert_eq!(larger.beside(0, 0), [Some(1), None]);
        assert_eq!(larger.halves(0), halves.map(|half| 2.0 * half));
    }

    #[test]
    fn larger_patches_have_the_middle_of_their_parts() {
        let (patches, n) = neighbours("furnace", 2400);
        let larger = n.larger(patches.parents(), patches.areas());
        assert!(larger.len() * 3 < n.len());
        for p in 0..larger.len() {
            let (mut sum, mut area) = (Vec3::ZERO, 0.0);
            for i in (0..n.len()).filter(|&i| patches.parents()[i] as usize == p) {
                sum += patches.areas()[i] as f32 * n.middle(i);
                area += patches.areas()[i] as f32;
            }
            assert!((larger.middle(p) - sum / area).length() < 1e-5);
            for other in [0, 1].into_iter().flat_map(|axis| larger.beside(p, axis)).flatten() {
                assert_ne!(other, p);
                let apart = (larger.middle(other) - larger.middle(p)).length();
                let size = larger.halves(p)[0].length() + larger.halves(p)[1].length();
                assert!(apart < 2.0 * size, "{apart} {size}");
            }
        }
    }
}
