//! Luminaires with a texture: the emission of their points over the mean of its material's faces.
//!
//! All of a luminaire has a closed form ([`crate::direct::emitters::emission_tree`]); where a part of it is hidden
//! points are drawn by what they send ([`crate::direct::emitters::toward`]). The tree of luminaires takes the moments
//! of their emission ([`crate::direct::many::moments`]).
//!
//! Not handled: texels that are smaller than the leaves.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

use crate::direct::emitters::emission_tree::{EmissionMoments, EmissionTree, EmittingPart};
use crate::light::shares::Shares;
use crate::light::{Rgb, over};
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

/// Luminaires that have [`LEAVES`] each; more have together as many as these, which bounds the memory.
const FEW_LUMINAIRES: usize = 16;
/// Least and most leaves of the trees of one luminaire, about.
const LEAVES: [f64; 2] = [4096.0, 65_536.0];
/// Leaves per texel within those bounds.
const ON_TEXEL: f64 = 4.0;
/// Relative error of a luminaire's light by one node of its closed form, where no error is requested. That of all nodes
/// is up to twice as much in RMS (`wide_luminaires_are_as_exact_as_a_node`).
pub const TOLERABLE: f64 = 5e-4;
/// `pi r² k` in the mean over all directions of both normals that face each other: tolerable errors are no smaller for
/// receivers at the luminaire's horizon.
const TYPICAL: f64 = 0.25;

/// The emission of one luminaire over its mean.
#[derive(Clone, Debug)]
pub(crate) struct UnevenEmission {
    texture: Arc<EmissionTexture>,
    /// Of each triangle.
    trees: Vec<EmissionTree>,
}

/// Whether the emission of a material has a texture.
pub(crate) fn is_textured(scene: &Scene, material: usize) -> bool {
    scene.materials[material].maps.as_ref().is_some_and(|maps| maps.emission.is_some())
}

impl UnevenEmission {
    /// That of a luminaire of these faces with their corners, one of `luminaires`.
    pub(crate) fn new(texture: Arc<EmissionTexture>, faces: &[(u32, [DVec3; 3])], luminaires: usize) -> UnevenEmission {
        let parts = faces.len() as f64 * (luminaires as f64 / FEW_LUMINAIRES as f64).max(1.0);
        let trees = faces.par_iter().map(|&(face, corners)| texture.tree(face, corners, parts)).collect();
        UnevenEmission { texture, trees }
    }

    /// Whether any of it emits.
    pub(crate) fn shines(&self) -> bool {
        self.trees.iter().any(|tree| tree.moments.mean != DVec3::ZERO)
    }

    /// Moments of triangle k's emission.
    pub(crate) fn moments(&self, k: usize) -> EmissionMoments {
        self.trees[k].moments
    }

    /// `E(y)` over the mean, channel by channel.
    pub(crate) fn share(&self, face: u32, position: Vec3) -> DVec3 {
        self.texture.share(face, position)
    }

    /// The light of all of it over that of its mean radiance at a point with unit normal to which its form factor is
    /// `form`, without occlusion.
    pub(crate) fn light(&self, x: DVec3, n: DVec3, form: f64, share: f64) -> DVec3 {
        let tolerable = share * self.scale(x, form);
        self.trees.iter().map(|tree| tree.beyond(x, n, tolerable)).sum::<DVec3>() + form
    }

    /// The triangle, and the part of it, that a number u of the unit interval draws for a receiver with unit normal n,
    /// by about what each part sends; none where nothing is sent.
    pub(crate) fn draw(&self, x: DVec3, n: DVec3, u: f64) -> Option<(usize, EmittingPart)> {
        let sent = Shares::of(self.trees.iter().map(|tree| tree.sent_to(x, n)));
        if sent.total() <= 0.0 {
            return None;
        }
        let drawn = sent.draw(u);
        let part = self.trees[drawn.index].draw(x, n, f64::from(drawn.again()))?;
        Some((drawn.index, EmittingPart { chance: part.chance * drawn.weight / sent.total(), ..part }))
    }

    /// The form factor that errors of nodes are relative to.
    fn scale(&self, x: DVec3, form: f64) -> f64 {
        let seen: f64 = self.trees.iter().map(|tree| tree.seen(x)).sum();
        form.max(TYPICAL * seen.min(1.0))
    }
}

impl EmissionTexture {
    /// That of a material, if it has one.
    pub(crate) fn new(scene: &Scene, material: usize) -> Option<EmissionTexture> {
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
    pub(crate) fn mean(&self) -> Rgb {
        self.mean.as_vec3()
    }

    /// `E(y)` over the mean, channel by channel; 0 where the mean is.
    pub(crate) fn share(&self, face: u32, position: Vec3) -> DVec3 {
        let at = self.coordinates(face, position.as_dvec3());
        at.map_or(DVec3::ONE, |at| self.over_mean(self.texture.colour(at).as_dvec3()))
    }

    /// The closed form of a face's light, its corners as seen from the side that emits, with one of `parts` of the
    /// leaves.
    fn tree(&self, face: u32, corners: [DVec3; 3], parts: f64) -> EmissionTree {
        let [p, q, r] = corners.map(|at| self.coordinates(face, at).unwrap_or_default());
        let place = |at: DVec2| p + at.x * (q - p) + at.y * (r - p);
        let mean = |part: [DVec2; 3]| self.over_mean(self.texture.mean(part.map(place)));
        let [least, most] = LEAVES.map(|leaves| (leaves / parts).max(1.0));
        let leaves = (ON_TEXEL * self.texture.texels_of([p, q, r])).clamp(least, most);
        EmissionTree::new(corners, (leaves.ln() / 4.0_f64.ln()).ceil() as u32, mean)
    }

    /// Texture coordinates of a point of a face.
    fn coordinates(&self, face: u32, position: DVec3) -> Option<DVec2> {
        let ([a, u, v], [p, q, r]) = self.faces.get(&face)?;
        let d = position - *a;
        let (uu, uv, vv) = (u.length_squared(), u.dot(*v), v.length_squared());
        let (s, t) = (vv * d.dot(*u) - uv * d.dot(*v), uu * d.dot(*v) - uv * d.dot(*u));
        Some(*p + (s * (*q - *p) + t * (*r - *p)) / (uu * vv - uv * uv))
    }

    /// Emission over its mean.
    fn over_mean(&self, own: DVec3) -> DVec3 {
        over(own, self.mean)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::direct::emitters::emission_tree::SubTriangle;
    use crate::direct::emitters::emission_tree::samples::uniform;
    use crate::form_factors::point_to_polygon;

    /// A floor that is one luminaire, at receivers above it: the RMS error is below twice that of a node.
    #[test]
    fn wide_luminaires_are_as_exact_as_a_node() {
        let corners = [DVec3::new(-2.0, -2.0, 0.0), DVec3::new(2.0, -2.0, 0.0), DVec3::new(2.0, 2.0, 0.0)];
        let emission = |part: [DVec2; 3]| {
            let at = SubTriangle { corners: part, scale: 1.0 }.middle();
            DVec3::splat(1.0 + 0.6 * (39.0 * (at.x + at.y)).sin() + 0.4 * (18.0 * at.y).cos())
        };
        let tree = EmissionTree::new(corners, 6, emission);
        for normal in [DVec3::X, -DVec3::Z, DVec3::new(0.5, 0.1, -0.5).normalize()] {
            let place = |k: u32| DVec3::new(3.9 * uniform(k, 2), 3.8 * uniform(k, 0), 0.05 + 2.0 * uniform(k, 1));
            for tolerable in [4.0 * TOLERABLE, TOLERABLE, 0.25 * TOLERABLE] {
                let mut squares = Vec::new();
                for x in (0..100).map(|k| place(k) - DVec3::new(2.0, 1.9, 0.0)) {
                    let form = point_to_polygon(normal, &corners.map(|p| p - x));
                    let [estimate, exact] = [tolerable, 0.0].map(|share| tree.beyond(x, normal, share * form).x);
                    squares.extend((form > 0.0).then(|| ((estimate - exact) / form).powi(2)));
                }
                let error = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
                assert!(squares.len() > 40 && error < 2.0 * tolerable, "{normal}, {tolerable}: {error}");
            }
        }
    }
}
