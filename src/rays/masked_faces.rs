//! Faces with masks: rays meet them where there is a surface, and pass where there is none.
//!
//! A share a of a surface between 0 and 1 is met with the chance a, drawn from the bits of the place itself (stochastic
//! transparency: E. Enderton et al., 2010). So the mean over rays is that of a surface with tau = 1 - a, one ray always
//! finds the same, and what casts rays need not know of masks. Rays of the camera, each of which shows in the
//! picture, see through uniform masks by weight instead.
//!
//! Not handled: closed forms, which take faces as whole; [`crate::direct::Shafts`] leave masked ones to rays.

use std::sync::Arc;

use glam::Vec2;
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

use crate::rays::accelerator::Accelerator;
use crate::rays::ray::settle;
use crate::rays::sobol::{fraction, hash};
use crate::rays::triangle::{Hit, Query};
use crate::scene::Scene;
use crate::scene::textures::Maps;

/// Where less than this of a ray's light remains, surfaces are met by chance: each that is met by weight is lit.
const LITTLE: f32 = 1.0 / 64.0;

/// What a ray sees through uniform masks, each with its share.
pub(crate) type Seen = SmallVec<[(Hit, f32); 1]>;

/// The masked faces of a scene.
pub(super) struct MaskedFaces {
    tree: Accelerator,
    faces: FxHashMap<u32, MaskedFace>,
}

/// The mask of a face: its material's, with coordinates and alpha of its corners.
struct MaskedFace {
    maps: Arc<Maps>,
    coordinates: [Vec2; 3],
    alpha: [f32; 3],
}

impl MaskedFaces {
    /// The masked faces by number, in the tree that `tree` makes of them; none where there are none.
    pub(super) fn new(scene: &Scene, masked: &[u32], tree: impl Fn(&[u32]) -> Accelerator) -> Option<MaskedFaces> {
        let own = |&face: &u32| {
            let maps = scene.material(face).maps.clone()?;
            let coordinates = scene.coordinates.get(face as usize).copied().unwrap_or_default();
            let colours = scene.colours.get(face as usize).filter(|_| maps.vertex_colours);
            let alpha = colours.map_or([1.0; 3], |corners| corners.map(|colour| colour.w));
            Some((face, MaskedFace { maps, coordinates, alpha }))
        };
        (!masked.is_empty()).then(|| MaskedFaces { tree: tree(masked), faces: masked.iter().filter_map(own).collect() })
    }

    /// Whether there is a surface where a ray meets a face.
    fn is_there(&self, hit: &Hit) -> bool {
        let Some(MaskedFace { maps, coordinates: [a, b, c], alpha }) = self.faces.get(&hit.face) else { return true };
        let at = *a + hit.u * (*b - *a) + hit.v * (*c - *a);
        let alpha = alpha[0] + hit.u * (alpha[1] - alpha[0]) + hit.v * (alpha[2] - alpha[0]);
        // Of faces in one place the first that is there is met, so what lies over this one is looked up by itself.
        let share = maps.mask.as_ref().map_or(1.0, |mask| mask.alone_at(at.as_dvec2(), alpha));
        let drawn = || fraction(hash(hit.u.to_bits(), hash(hit.v.to_bits(), hit.face)));
        share >= 1.0 || (share > 0.0 && drawn() < share)
    }

    /// The share of a surface where a ray meets a face: that of a uniform mask, else 1 or 0 by chance.
    fn share(&self, hit: &Hit) -> f32 {
        let of = |face: &MaskedFace| {
            let mask = face.maps.mask.as_ref().filter(|_| face.alpha == [1.0; 3])?;
            mask.uniform()
        };
        let uniform = self.faces.get(&hit.face).and_then(of);
        uniform.unwrap_or_else(|| f32::from(u8::from(self.is_there(hit))))
    }

    /// Appends what a ray sees of a meeting with other faces and of all with these, each with the share of the light of
    /// the ray that comes from there; returns the share that comes from none.
    pub(super) fn seen(&self, query: &Query, other: Option<Hit>, planes: &[u32], out: &mut Seen) -> f32 {
        let mut hits = Vec::new();
        self.tree.all(query, &mut hits);
        hits.extend(other);
        settle(&mut hits, planes);
        let mut remaining = 1.0;
        for hit in hits {
            let share = match remaining < LITTLE {
                true => f32::from(u8::from(self.is_there(&hit))),
                false => self.share(&hit),
            };
            if share > 0.0 {
                out.push((hit, remaining * share));
                remaining *= 1.0 - share;
            }
            if remaining == 0.0 {
                break;
            }
        }
        remaining
    }

    /// Appends every meeting with a surface to `out`, in no order.
    pub(super) fn meet(&self, query: &Query, out: &mut Vec<Hit>) {
        let before = out.len();
        self.tree.all(query, out);
        let mut kept = before;
        for k in before..out.len() {
            let hit = out[k];
            if self.is_there(&hit) {
                out[kept] = hit;
                kept += 1;
            }
        }
        out.truncate(kept);
    }

    /// The first of a meeting with other faces and all with these.
    pub(super) fn first(&self, query: &Query, other: Option<Hit>, planes: &[u32]) -> Option<Hit> {
        let mut hits = Vec::new();
        self.meet(query, &mut hits);
        if hits.is_empty() {
            return other;
        }
        hits.extend(other);
        settle(&mut hits, planes);
        hits.first().copied()
    }

    /// Whether no surface is met.
    pub(super) fn is_clear(&self, query: &Query) -> bool {
        let mut hits = Vec::new();
        self.meet(query, &mut hits);
        hits.is_empty()
    }
}
