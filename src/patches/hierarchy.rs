//! The larger patch that each patch would be part of at twice the size, about four to one.
//!
//! On a grid it is a block of two by two cells, among clusters the cluster of twice the size. A solution on the larger
//! patches tells what patch size does to the light.
//!
//! Not handled: patches along lines of contact, which separate light from dark, and surfaces of a single patch; they
//! are their own parents.

use std::collections::HashMap;

use crate::patches::grid::Grid;
use crate::patches::pieces::NONE;
use crate::patches::scene_patches::Patches;

/// What larger patches the patches would be part of: patches with a number for the larger one.
pub(crate) struct Parents {
    /// Of grids: (patch, grid, block).
    blocks: Vec<(u32, u32, u32)>,
    /// Of clusters: (patch, cluster of twice the size).
    clusters: Vec<(u32, u32)>,
}

impl Parents {
    /// Blocks of cells of the grids, and clusters with the cluster of twice the size.
    pub fn new(grids: &[Grid], clusters: Vec<(u32, u32)>) -> Parents {
        let of = |(g, grid): (usize, &Grid)| {
            let blocks: Vec<_> = grid.blocks().map(|(p, b)| (p, g as u32, b)).collect();
            blocks
        };
        Parents { blocks: grids.iter().enumerate().flat_map(of).collect(), clusters }
    }

    /// The parent of each of `count` patches, numbered without gaps.
    pub fn of(self, count: usize) -> Vec<u32> {
        let mut parents = vec![NONE; count];
        let mut numbers: HashMap<(u32, u32), u32> = HashMap::new();
        let clusters = self.clusters.into_iter().map(|(p, c)| (p, NONE, c));
        for (patch, grid, block) in self.blocks.into_iter().chain(clusters) {
            let next = numbers.len() as u32;
            let own = &mut parents[patch as usize];
            if *own == NONE {
                *own = *numbers.entry((grid, block)).or_insert(next);
            }
        }
        let alone = parents.iter_mut().filter(|p| **p == NONE);
        for (own, next) in alone.zip(numbers.len() as u32..) {
            *own = next;
        }
        parents
    }
}

impl Patches {
    /// Whether each patch is no part of a larger one.
    pub fn each_alone(&self) -> Vec<bool> {
        let mut parts = vec![0_u32; self.len()];
        self.parents.iter().for_each(|&p| parts[p as usize] += 1);
        let alone = |&p: &u32| parts[p as usize] == 1;
        self.parents.iter().map(alone).collect()
    }

    /// Share of the area whose patches are no part of a larger one.
    pub fn alone(&self) -> f64 {
        let each = self.each_alone().into_iter().zip(&self.areas);
        let alone: f64 = each.filter(|own| own.0).map(|own| own.1).sum();
        alone / self.areas.iter().sum::<f64>()
    }
}
