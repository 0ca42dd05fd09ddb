//! The materials of pieces: one side of two, and masks of faces that lie over them.
//!
//! A mask over a piece is given in the texture coordinates of the piece itself. A piece without textures takes those of
//! the first face over it; one with textures keeps its own, from which an affine map leads to those of each face over
//! it.
//!
//! Alpha of the vertices of a face that lies over a piece counts as the mean of its corners.
//!
//! Not handled: pieces whose own texture coordinates are all one; masks with textures over them count as nothing.

use std::sync::Arc;

use glam::{DAffine2, DMat2, DVec2};
use rustc_hash::FxHashMap;

use crate::scene::coincident::division::Marks;
use crate::scene::textures::{Maps, Mask};
use crate::scene::{Material, Scene, Sides};

/// Steps of a map's numbers below which two maps are one material.
const STEP: f64 = 1.0 / (1 << 20) as f64;

/// A material, whether its back is behind something, and the masks over it.
type Key = (u32, bool, Vec<Over>);

/// A mask over a piece.
#[derive(Clone, PartialEq, Eq, Hash)]
struct Over {
    material: u32,
    /// Steps of the map from the piece's texture coordinates to those of the mask.
    map: [i64; 6],
    /// Steps of the mean alpha of the vertices.
    alpha: i64,
}

/// New materials, after those of the scene.
#[derive(Default)]
pub(super) struct Materials {
    pub list: Vec<Material>,
    known: FxHashMap<Key, u32>,
}

/// How a piece of a face is made: its material, and texture coordinates by weights of the face's corners.
pub(super) struct Made {
    pub material: u32,
    pub coordinates: DAffine2,
}

impl Materials {
    /// What a piece of a face with marks is made of.
    pub(super) fn of(&mut self, scene: &Scene, face: u32, marks: &Marks) -> Made {
        let material = scene.faces[face as usize].material;
        let own = coordinates(scene, face);
        let over: Vec<(u32, DAffine2)> = marks.masked.iter().map(|&mask| (mask, beyond(scene, face, mask))).collect();
        let plain = scene.material(face).maps.is_none();
        let coordinates = over.first().filter(|_| plain).map_or(own, |(_, first)| *first);
        let back = coordinates.inverse();
        let masks = over.into_iter().filter_map(|(mask, to)| {
            let map = if plain && to == coordinates { DAffine2::IDENTITY } else { to * back };
            seen_over(scene, mask, map)
        });
        let (over, masks): (Vec<Over>, Vec<Mask>) = masks.unzip();
        let next = (scene.materials.len() + self.list.len()) as u32;
        let number = *self.known.entry((material, marks.is_backed, over)).or_insert(next);
        if number == next {
            self.list.push(changed(scene, material, marks.is_backed, masks));
        }
        Made { material: number, coordinates }
    }
}

/// The mask of a face, to whose texture coordinates a map leads, as one over others; none where the map is needed and
/// is no number.
fn seen_over(scene: &Scene, face: u32, map: DAffine2) -> Option<(Over, Mask)> {
    let maps = scene.maps(face)?;
    let mask = maps.mask.as_ref()?;
    let map = if mask.texture.is_none() { DAffine2::IDENTITY } else { map };
    let corners = scene.colours.get(face as usize).filter(|_| maps.vertex_colours);
    let alpha = corners.map_or(1.0, |corners| corners.iter().map(|colour| colour.w).sum::<f32>() / 3.0);
    let steps = |x: f64| (x / STEP).round() as i64;
    let material = scene.faces[face as usize].material;
    let over = Over { material, map: map.to_cols_array().map(steps), alpha: steps(f64::from(alpha)) };
    map.is_finite().then(|| (over, Mask { factor: mask.factor * alpha, ..mask.clone().seen_through(map) }))
}

/// A material without its back, and with masks over it.
fn changed(scene: &Scene, material: u32, is_backed: bool, over: Vec<Mask>) -> Material {
    let mut changed = scene.materials[material as usize].clone();
    if is_backed {
        changed.sides = Sides::One;
    }
    if !over.is_empty() {
        let maps = changed.maps.as_deref().cloned().unwrap_or_default();
        let own = maps.mask.clone().unwrap_or(Mask::WHOLE);
        changed.maps = Some(Arc::new(Maps { mask: Some(Mask { over, ..own }), ..maps }));
    }
    changed
}

/// From weights of a face's second and third corner to its texture coordinates.
fn coordinates(scene: &Scene, face: u32) -> DAffine2 {
    let corners = scene.coordinates.get(face as usize).copied().unwrap_or_default();
    affine(corners.map(|at| at.as_dvec2()))
}

/// From weights of a face's corners to the texture coordinates of another face in its plane.
fn beyond(scene: &Scene, face: u32, other: u32) -> DAffine2 {
    affine(scene.exact_corners(face).map(|corner| scene.coordinates_beyond(other, corner)))
}

fn affine([a, b, c]: [DVec2; 3]) -> DAffine2 {
    DAffine2 { matrix2: DMat2::from_cols(b - a, c - a), translation: a }
}
