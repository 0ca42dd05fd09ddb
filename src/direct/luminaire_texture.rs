//! Luminaires with a texture: what a point emits over the mean of its material's faces.
//!
//! The closed form is that of a luminaire of the mean radiance; points drawn on it carry `E(y)` over that mean, so that
//! the ratio and resampling estimators find what the texture does to shadows and to receivers nearby.
//!
//! Not handled: many luminaires; their light cuts take each as even, so textured ones are not carried there.

use std::collections::HashMap;

use glam::{DVec2, DVec3, Vec3};

use crate::light::Rgb;
use crate::scene::Scene;
use crate::scene::textures::Texture;

/// The texture of an emitting material.
#[derive(Clone, Debug)]
pub(crate) struct EmissionTexture {
    texture: Texture,
    /// Its mean over the material's faces.
    mean: DVec3,
    /// Places of the faces: a corner, the two edges from it, and the texture coordinates of all three.
    faces: HashMap<u32, ([DVec3; 3], [DVec2; 3])>,
}

/// Whether the emission of a material has a texture.
pub(crate) fn is_textured(scene: &Scene, material: usize) -> bool {
    scene.materials[material].maps.as_ref().is_some_and(|maps| maps.emission.is_some())
}

impl EmissionTexture {
    /// That of a material, if it has one.
    pub fn new(scene: &Scene, material: usize) -> Option<EmissionTexture> {
        let texture = scene.materials[material].maps.as_ref()?.emission.clone()?;
        let (mut faces, mut sum, mut area) = (HashMap::new(), DVec3::ZERO, 0.0);
        for face in (0..scene.faces.len() as u32).filter(|&f| scene.faces[f as usize].material as usize == material) {
            let [a, b, c] = scene.corners(face).map(|p| p.as_dvec3());
            let places = scene.coordinates.get(face as usize).copied().unwrap_or_default().map(|at| at.as_dvec2());
            sum += scene.area(face) * texture.mean(places);
            area += scene.area(face);
            faces.insert(face, ([a, b - a, c - a], places));
        }
        Some(EmissionTexture { texture, mean: sum / area, faces })
    }

    /// The mean over the material's faces, as a factor on its emission.
    pub fn mean(&self) -> Rgb {
        self.mean.as_vec3()
    }

    /// `E(y)` over the mean, channel by channel; 0 where the mean is.
    pub fn share(&self, face: u32, position: Vec3) -> DVec3 {
        let Some(([a, u, v], [p, q, r])) = self.faces.get(&face) else { return DVec3::ONE };
        let d = position.as_dvec3() - *a;
        let (uu, uv, vv) = (u.length_squared(), u.dot(*v), v.length_squared());
        let (s, t) = (vv * d.dot(*u) - uv * d.dot(*v), uu * d.dot(*v) - uv * d.dot(*u));
        let at = *p + (s * (*q - *p) + t * (*r - *p)) / (uu * vv - uv * uv);
        let own = self.texture.colour(at).as_dvec3();
        DVec3::select(self.mean.cmpgt(DVec3::ZERO), own / self.mean.max(DVec3::splat(f64::MIN_POSITIVE)), DVec3::ZERO)
    }
}
