//! What patches with textures reflect and emit: means over their pieces.
//!
//! A patch of a masked surface counts the area of what there is of it, and reflects and emits the mean over that.
//!
//! Not handled: parts of patches divided by light, which have the means of the patch they were cut from.

use glam::Vec3;
use rayon::prelude::*;

use crate::light::{Light, Rgb};
use crate::patches::scene_patches::Patches;
use crate::scene::{Means, Scene};
use crate::surfaces::face_means::FaceMeans;

/// Share of its area that a patch has at least: one of which there is nothing still has a row of K.
const LEAST: f64 = 1e-6;

impl Patches {
    /// Finds the means of all patches, and takes what is cut away from their areas; nothing where no material has
    /// textures.
    pub(super) fn take_textures(&mut self, scene: &Scene, of_faces: &FaceMeans) {
        if !scene.is_textured() {
            return;
        }
        let own = |i: usize| {
            let of_piece = |(face, [a, b, c]): (u32, [Vec3; 3])| {
                let whole = of_faces.whole(face).filter(|_| scene.corners(face) == [a, b, c]);
                let means = whole.copied().unwrap_or_else(|| scene.means(face, [a, b, c]));
                (f64::from((b - a).cross(c - a).length()), means)
            };
            mean(&self.pieces(i).map(of_piece).collect::<Vec<_>>())
        };
        let textured = |i: &usize| scene.materials[self.materials[*i] as usize].maps.is_some();
        let found: Vec<Option<Means>> =
            (0..self.len()).into_par_iter().map(|i| textured(&i).then(|| own(i)).flatten()).collect();
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

    /// Reflectance over the mean of patch i, channel by channel; 1 where the patch has no texture or reflects nothing.
    pub(crate) fn over_mean(&self, i: usize, rho: Rgb) -> Rgb {
        let Some(means) = self.mean(i) else { return Rgb::ONE };
        let mean = means.of_surface().0;
        Rgb::select(mean.cmpgt(Rgb::ZERO), rho / mean.max(Rgb::splat(f32::MIN_POSITIVE)), Rgb::ONE)
    }

    /// Mean emission of patch i: `(E_invisible, E_visible)`, W/(m² sr).
    pub fn emitted(&self, scene: &Scene, i: usize) -> Light {
        let material = &scene.materials[self.materials[i] as usize];
        let textured = |means: &Means| Light::emitted(means.of_surface().1, material.visibility);
        self.mean(i).map_or_else(|| material.emitted(), textured)
    }
}

/// The mean over pieces by their areas; none of no piece.
///
/// Pieces so thin that rounding leaves none of them an area count alike.
fn mean(pieces: &[(f64, Means)]) -> Option<Means> {
    let area: f64 = pieces.iter().map(|piece| piece.0).sum();
    let weight = |own: f64| if area > 0.0 { own } else { 1.0 };
    let (mut sum, mut mean) = (Means::default(), Means::default());
    pieces.iter().for_each(|(own, means)| sum.add(weight(*own), means));
    mean.add(1.0 / if area > 0.0 { area } else { pieces.len() as f64 }, &sum);
    (!pieces.is_empty()).then_some(mean)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// A patch whose pieces rounding leaves without an area once reflected what is no number.
    #[test]
    fn pieces_without_an_area_have_a_mean() {
        let means = |rho: f64| Means { coverage: 1.0, rho: DVec3::splat(rho), emission: DVec3::ZERO };
        let of = |pieces: &[(f64, Means)]| mean(pieces).map(|mean| mean.rho.x);
        assert_eq!(of(&[]), None);
        assert_eq!(of(&[(0.0, means(0.5)), (0.0, means(0.25))]), Some(0.375));
        assert_eq!(of(&[(3.0, means(0.5)), (1.0, means(0.25)), (0.0, means(0.0))]), Some(0.4375));
    }
}
