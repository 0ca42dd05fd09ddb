//! What whole faces with textures reflect and emit: means over them, found once for a scene.
//!
//! Exporters map the leaves of a tree, all of them, onto the same few triangles of a texture: what agrees in material
//! and coordinates is integrated once.
//!
//! Not handled: parts of faces; [`Scene::means`] integrates those.

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::scene::{Means, Scene};

/// A face whose material is the same everywhere.
const NONE: u32 = u32::MAX;

/// Material, and the bits of coordinates and colours at the corners: what the means of a whole face depend on.
type Key = (u32, [[u32; 2]; 3], [[u32; 4]; 3]);

/// The means over whole faces.
#[derive(Debug, Default)]
pub(crate) struct FaceMeans {
    /// Which of the means is each face's; empty where no material has textures.
    of_face: Vec<u32>,
    means: Vec<Means>,
}

impl FaceMeans {
    /// Of all faces of a scene.
    pub(crate) fn new(scene: &Scene) -> FaceMeans {
        if !scene.is_textured() {
            return FaceMeans::default();
        }
        let mut known: FxHashMap<Key, u32> = FxHashMap::default();
        let mut first: Vec<u32> = Vec::new();
        let number = |face: u32| {
            let Some(maps) = scene.maps(face) else { return NONE };
            let coordinates = scene.coordinates.get(face as usize).copied().unwrap_or_default();
            let colours = scene.colours.get(face as usize).filter(|_| maps.vertex_colours);
            let colours = colours.map_or([[0; 4]; 3], |all| all.map(|colour| colour.to_array().map(f32::to_bits)));
            let places = coordinates.map(|at| at.to_array().map(f32::to_bits));
            let key = (scene.faces[face as usize].material, places, colours);
            *known.entry(key).or_insert_with(|| {
                first.push(face);
                first.len() as u32 - 1
            })
        };
        let of_face = (0..scene.faces.len() as u32).map(number).collect();
        FaceMeans { means: first.into_par_iter().map(|face| scene.means_of_face(face)).collect(), of_face }
    }

    /// The means over a whole face, where its material has textures.
    pub(crate) fn whole(&self, face: u32) -> Option<&Means> {
        self.means.get(*self.of_face.get(face as usize)? as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_faces_have_the_means_of_their_triangles() {
        let room = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/textured/room.toml");
        let scene = Scene::open(room).expect("a scene");
        let means = FaceMeans::new(&scene);
        let mut textured = 0;
        for face in 0..scene.faces.len() as u32 {
            let Some(whole) = means.whole(face) else {
                assert!(scene.maps(face).is_none(), "{face}");
                continue;
            };
            let part = scene.means(face, scene.corners(face));
            // Points give coordinates within some 1e-6, so 48 texels within 1e-4 of one; a mask's points are 1/576
            // each.
            let apart = [whole.rho - part.rho, whole.emission - part.emission].map(|d| d.abs().max_element());
            assert!(apart[0].max(apart[1]) < 2e-3 && (whole.coverage - part.coverage).abs() < 2e-3, "{face} {apart:?}");
            textured += 1;
        }
        assert!(textured > 4, "{textured}");
    }
}
