//! What patches with textures reflect and emit: means over their pieces.
//!
//! A patch of a masked surface counts the area of what there is of it, and reflects and emits the mean over that.
//!
//! Not handled: parts of patches divided by light, which have the means of the patch they were cut from.

use rayon::prelude::*;

use crate::light::{Light, Rgb};
use crate::patches::scene_patches::Patches;
use crate::scene::{Means, Scene};

/// Share of its area that a patch has at least: one of which there is nothing still has a row of K.
const LEAST: f64 = 1e-6;

impl Patches {
    /// Finds the means of all patches, and takes what is cut away from their areas; nothing where no material has
    /// textures.
    pub(super) fn take_textures(&mut self, scene: &Scene) {
        if !scene.is_textured() {
            return;
        }
        let own = |i: usize| {
            let mut sum = Means::default();
            let mut area = 0.0;
            for (face, corners) in self.pieces(i) {
                let weight = f64::from((corners[1] - corners[0]).cross(corners[2] - corners[0]).length());
                sum.add(weight, &scene.means(face, corners));
                area += weight;
            }
            let mut mean = Means::default();
            mean.add(1.0 / area, &sum);
            mean
        };
        let textured = |i: &usize| scene.materials[self.materials[*i] as usize].maps.is_some();
        let found: Vec<Option<Means>> = (0..self.len()).into_par_iter().map(|i| textured(&i).then(|| own(i))).collect();
        for (area, means) in self.areas.iter_mut().zip(&found) {
            *area *= means.map_or(1.0, |means| means.coverage.max(LEAST));
        }
        self.means = found;
    }

    fn mean(&self, i: usize) -> Option<&Means> {
        self.means.get(self.parts.whole(i))?.as_ref()
    }

    /// Mean reflectance of patch i.
    pub fn reflectance(&self, scene: &Scene, i: usize) -> Rgb {
        self.mean(i).map_or_else(|| scene.materials[self.materials[i] as usize].rho, |means| means.of_surface().0)
    }

    /// Mean emission of patch i: `(E_invisible, E_visible)`, W/(m² sr).
    pub fn emitted(&self, scene: &Scene, i: usize) -> Light {
        let material = &scene.materials[self.materials[i] as usize];
        let textured = |means: &Means| Light::emitted(means.of_surface().1, material.visibility);
        self.mean(i).map_or_else(|| material.emitted(), textured)
    }
}
