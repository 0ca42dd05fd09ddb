//! Patches divided where the light on them differs, as samples of it tell.
//!
//! A patch is one value of light, but what it stands for may be lit here and dark there. A regression tree over samples
//! of the light ([`crate::patches::regression_tree`]) tells where it differs.
//!
//! Parts have the pieces of the patch they were cut from; areas are shared out by samples.
//!
//! Not handled: borders that are not across an axis; they take several planes.

use rayon::prelude::*;

use crate::patches::parts::{Part, Parts, number};
use crate::patches::pieces::NONE;
use crate::patches::regression_tree::{Sample, Tree, grow};
use crate::patches::scene_patches::Patches;
use crate::surfaces::SurfacePoint;

impl Patches {
    /// Whether patches were divided by light.
    pub fn are_divided(&self) -> bool {
        self.parts.count > 0
    }

    /// The patch that a patch is a part of; itself where it was not divided.
    pub fn whole(&self, patch: u32) -> u32 {
        self.parts.whole(patch as usize) as u32
    }

    /// Divides the patches as they were cut by the light sampled on them, and has their rays start from where it was
    /// sampled; `samples` are those of every patch before any was divided.
    pub fn divide(&mut self, mut samples: Vec<Vec<Sample>>) {
        self.restore();
        samples.resize_with(self.len(), Vec::new);
        let trees: Vec<Tree> = samples.into_par_iter().map(grow).collect();
        let mut starts: Vec<Vec<SurfacePoint>> = Vec::new();
        starts.resize_with(self.len(), Vec::new);
        let mut parts =
            Parts { roots: vec![NONE; self.len()], count: self.len(), areas: self.areas.clone(), ..Parts::default() };
        for (i, tree) in trees.into_iter().enumerate() {
            let total = tree.count();
            let area = self.areas[i];
            let mut first = true;
            let mut add = |own: Vec<Sample>| {
                let share = area * own.len() as f64 / total.max(1) as f64;
                let points = own.iter().map(|s| s.point).collect();
                if std::mem::take(&mut first) {
                    starts[i] = points;
                    if total > 0 {
                        self.areas[i] = share;
                    }
                    return i as u32;
                }
                starts.push(points);
                parts.whole.push(i as u32);
                self.areas.push(share);
                self.materials.push(self.materials[i]);
                self.sides.push(self.sides[i]);
                self.parents.push(self.parents[i]);
                self.areas.len() as u32 - 1
            };
            if let Part::Divided(root) = number(tree, &mut parts.planes, &mut add) {
                parts.roots[i] = root;
            }
        }
        self.parts = parts;
        self.start_from(starts);
    }

    /// Takes all parts back.
    fn restore(&mut self) {
        if !self.are_divided() {
            return;
        }
        let Parts { count, areas, .. } = std::mem::take(&mut self.parts);
        self.areas = areas;
        self.materials.truncate(count);
        self.sides.truncate(count);
        self.parents.truncate(count);
    }
}
