//! The materials of pieces: one side of two, and masks of faces that lie over them.
//!
//! A mask over a piece is told in the texture coordinates of the piece itself. A piece without textures takes those of
//! the first face over it; one with textures keeps its own, from which an affine map leads to those of each face over
//! it.
//!
//! Not handled: pieces whose own texture coordinates are all one; masks over them count as nothing.

use std::sync::Arc;

use glam::{DAffine2, DMat2, DVec2};
use rustc_hash::FxHashMap;

use crate::scene::coincident::division::Marks;
use crate::scene::textures::{Maps, Mask};
use crate::scene::{Material, Scene, Sides};

/// Steps of a map's numbers below which two maps are one material.
const STEP: f64 = 1.0 / (1 << 20) as f64;

/// A material, whether its back is behind something, and the masked materials over it with the maps to their
/// coordinates.
type Key = (u32, bool, Vec<(u32, [i64; 6])>);

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
    pub fn of(&mut self, scene: &Scene, face: u32, marks: &Marks) -> Made {
        let material = scene.faces[face as usize].material;
        let own = coordinates(scene, face);
        let over: Vec<(u32, DAffine2)> = marks.masked.iter().map(|&mask| (mask, beyond(scene, face, mask))).collect();
        let plain = scene.material(face).maps.is_none();
        let coordinates = over.first().filter(|_| plain).map_or(own, |(_, first)| *first);
        let back = coordinates.inverse();
        let usable = over.into_iter().filter(|_| back.is_finite()).map(|(mask, to)| {
            let map = if plain && to == coordinates { DAffine2::IDENTITY } else { to * back };
            (scene.faces[mask as usize].material, map)
        });
        let masks: Vec<(u32, DAffine2)> = usable.collect();
        let steps = |map: &DAffine2| map.to_cols_array().map(|x| (x / STEP).round() as i64);
        let key = (material, marks.is_backed, masks.iter().map(|(m, map)| (*m, steps(map))).collect());
        let next = (scene.materials.len() + self.list.len()) as u32;
        let number = *self.known.entry(key).or_insert(next);
        if number == next {
            self.list.push(changed(scene, material, marks.is_backed, &masks));
        }
        Made { material: number, coordinates }
    }
}

/// A material without its back, and with masks over it.
fn changed(scene: &Scene, material: u32, is_backed: bool, masks: &[(u32, DAffine2)]) -> Material {
    let mut changed = scene.materials[material as usize].clone();
    if is_backed {
        changed.sides = Sides::One;
    }
    let of = |&(other, map): &(u32, DAffine2)| {
        let mask = scene.materials[other as usize].maps.as_ref()?.mask.clone()?;
        Some(mask.seen_through(map))
    };
    let over: Vec<Mask> = masks.iter().filter_map(of).collect();
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
