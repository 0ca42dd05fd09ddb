//! Faces with masks: rays meet them where there is a surface, and pass where there is none.
//!
//! A share a of a surface between 0 and 1 is met with the chance a, drawn from the bits of the place itself (stochastic
//! transparency: E. Enderton et al., 2010). So the mean over rays is that of a surface with tau = 1 - a, one ray always
//! finds the same, and what casts rays need not know of masks.
//!
//! Rays of the camera, each of which shows in the picture, see by weight instead: what lies behind a face counts by one
//! minus the mean of a over the part of the face within the ray's [`Cell`], which is exact. What the face itself sends
//! counts by that mean too, or where its reflectance or emission is an image, which goes with the mask from texel to
//! texel, by a at the point. Both are right in the mean over rays. Along a ray that meets several faces whose masks are
//! uneven all count by a at their points, since holes may lie behind holes.
//!
//! Not handled: closed forms, which take faces as whole; light cuts leave masked ones to rays. Within a
//! cell, a part of a face that another hides counts in the mean like the part that is seen; so does what lies beyond
//! the end of a neighbour over which the mask goes on.

use std::sync::Arc;

use glam::{DVec2, DVec3, Vec2, Vec3};
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

use crate::rays::accelerator::Accelerator;
use crate::rays::ray::{Ray, settle, settle_all};
use crate::rays::sobol::{fraction, hash};
use crate::rays::triangle::{Hit, Query};
use crate::scene::Scene;
use crate::scene::convex_polygon::half_plane;
use crate::scene::textures::Maps;

/// Where less than this of a ray's light remains, surfaces are met by chance: each that is met by weight is lit.
const LITTLE: f32 = 1.0 / 64.0;

/// What a ray sees through masks, each with its share.
pub type Seen = SmallVec<[(Hit, f32); 1]>;

/// What of the picture a camera ray stands for: the rays through its corners, in order around it. Of a cell without an
/// area the point seen counts.
pub type Cell = [Ray; 4];

/// The masked faces of a scene.
pub(super) struct MaskedFaces {
    tree: Accelerator,
    faces: FxHashMap<u32, MaskedFace>,
}

/// The mask of a face: its material's, with the place, coordinates and alpha of its corners.
struct MaskedFace {
    maps: Arc<Maps>,
    corners: [Vec3; 3],
    coordinates: [Vec2; 3],
    alpha: [f32; 3],
    /// Whether the mask goes on beyond the edges opposite to the corners.
    goes_on: [bool; 3],
}

impl MaskedFaces {
    /// The masked faces by number, in the tree that `tree` makes of them; none where there are none.
    pub(super) fn new(scene: &Scene, masked: &[u32], tree: impl Fn(&[u32]) -> Accelerator) -> Option<MaskedFaces> {
        let own = |&face: &u32| {
            let maps = scene.material(face).maps.clone()?;
            let coordinates = scene.coordinates.get(face as usize).copied().unwrap_or_default();
            let colours = scene.colours.get(face as usize).filter(|_| maps.vertex_colours);
            let alpha = colours.map_or([1.0; 3], |corners| corners.map(|colour| colour.w));
            Some((face, MaskedFace { maps, corners: scene.corners(face), coordinates, alpha, goes_on: [false; 3] }))
        };
        let mut faces: FxHashMap<u32, MaskedFace> = masked.iter().filter_map(own).collect();
        continue_masks(scene, masked, &mut faces);
        (!masked.is_empty()).then(|| MaskedFaces { tree: tree(masked), faces })
    }

    /// Whether there is a surface where a ray meets a face.
    fn is_there(&self, hit: &Hit) -> bool {
        let Some(face) = self.faces.get(&hit.face) else { return true };
        let share = face.at(hit);
        let drawn = || fraction(hash(hit.u.to_bits(), hash(hit.v.to_bits(), hit.face)));
        share >= 1.0 || (share > 0.0 && drawn() < share)
    }

    /// The shares of a ray's light that come from a face which it meets, and from what lies behind; by the mean over a
    /// cell, if one is given.
    fn shares(&self, hit: &Hit, cell: Option<&Cell>) -> [f32; 2] {
        let Some(face) = self.faces.get(&hit.face) else { return [1.0, 0.0] };
        let mean = cell.and_then(|cell| face.mean(cell));
        let is_uneven = || face.maps.reflectance.is_some() || face.maps.emission.is_some();
        let own = mean.filter(|_| !is_uneven()).unwrap_or_else(|| face.at(hit));
        [own, 1.0 - mean.unwrap_or(own)]
    }

    /// Whether more than one of the faces met has a mask that is not the same everywhere.
    fn are_several_uneven(&self, hits: &[Hit]) -> bool {
        let is_uneven = |hit: &&Hit| self.faces.get(&hit.face).is_some_and(MaskedFace::is_uneven);
        hits.iter().filter(is_uneven).nth(1).is_some()
    }

    /// Appends what a ray sees of a meeting with other faces and of all with these, each with the share of the light of
    /// the ray that comes from there; returns the share that comes from none. `cell` is asked for where masks are met.
    pub(super) fn seen(
        &self,
        (query, cell): (&Query, impl Fn() -> Cell),
        other: Option<Hit>,
        planes: &[u32],
        out: &mut Seen,
    ) -> f32 {
        let mut hits = Vec::new();
        self.tree.all(query, &mut hits);
        if hits.is_empty() {
            out.extend(other.map(|hit| (hit, 1.0)));
            return if other.is_some() { 0.0 } else { 1.0 };
        }
        hits.extend(other);
        settle_all(&mut hits, planes);
        // Holes of one may lie behind those of another, which the product of their means would not know.
        let cell = (!self.are_several_uneven(&hits)).then(cell);
        let mut remaining = 1.0;
        for hit in hits {
            let [own, behind] = match remaining < LITTLE {
                true if self.is_there(&hit) => [1.0, 0.0],
                true => [0.0, 1.0],
                false => self.shares(&hit, cell.as_ref()),
            };
            if own > 0.0 {
                out.push((hit, remaining * own));
            }
            remaining *= behind;
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

/// Finds the edges beyond which masks go on in the plane of their face, as over the diagonal of a quadrangle.
fn continue_masks(scene: &Scene, masked: &[u32], faces: &mut FxHashMap<u32, MaskedFace>) {
    let mut edges: FxHashMap<[u32; 2], (u32, usize)> = FxHashMap::default();
    for &face in masked {
        let corners = scene.faces[face as usize].vertices;
        for k in 0..3 {
            let [from, to] = [corners[(k + 1) % 3], corners[(k + 2) % 3]];
            // A neighbour that faces the same way has the edge the other way round.
            let Some(&(other, j)) = edges.get(&[to, from]) else {
                edges.insert([from, to], (face, k));
                continue;
            };
            let is_one = scene.faces[face as usize].material == scene.faces[other as usize].material;
            let goes_on = match (faces.get(&face), faces.get(&other)) {
                (Some(a), Some(b)) => is_one && a.holds_at(b.corners[j], b.coordinates[j], b.alpha[j]),
                _ => false,
            };
            for (face, k) in [(face, k), (other, j)] {
                faces.entry(face).and_modify(|face| face.goes_on[k] |= goes_on);
            }
        }
    }
}

/// Distance from a plane, in lengths of edges, and difference of coordinates and alpha below which a mask goes on.
const GOES_ON: f64 = 1e-4;

impl MaskedFace {
    /// Whether its mask beyond its edges has these coordinates and alpha at a point of its plane.
    fn holds_at(&self, point: Vec3, coordinates: Vec2, alpha: f32) -> bool {
        let [a, b, c] = self.corners.map(|corner| corner.as_dvec3());
        let (u, v) = (b - a, c - a);
        let weights = self.weights_at(point.as_dvec3());
        let off = (point.as_dvec3() - a).dot(u.cross(v).normalize_or_zero()).abs();
        let [d, e, f] = self.coordinates.map(|at| at.as_dvec2());
        let apart = (d + weights.x * (e - d) + weights.y * (f - d)).distance(coordinates.as_dvec2());
        let own = f64::from(self.alpha(weights.x as f32, weights.y as f32));
        let largest = weights.abs().max_element().max(1.0);
        let extent = (e - d).length().max((f - d).length());
        off <= GOES_ON * u.length().max(v.length())
            && apart <= GOES_ON * largest * extent
            && (own - f64::from(alpha)).abs() <= GOES_ON
    }

    /// The share of a surface where a ray meets it. Of faces in one place the first that is there is met, so what lies
    /// over this one is looked up by itself.
    fn at(&self, hit: &Hit) -> f32 {
        let [u, v] = [hit.u, hit.v];
        let [a, b, c] = self.coordinates;
        let at = a + u * (b - a) + v * (c - a);
        let mask = self.maps.mask.as_ref();
        mask.map_or(1.0, |mask| mask.alone_at(at.as_dvec2(), self.alpha(u, v)))
    }

    /// Whether its mask is not the same everywhere.
    fn is_uneven(&self) -> bool {
        let has_image = self.maps.mask.as_ref().is_some_and(|mask| mask.texture.is_some());
        has_image || self.alpha != [self.alpha[0]; 3]
    }

    /// Alpha of the vertices by the weights of the second and third corner.
    fn alpha(&self, u: f32, v: f32) -> f32 {
        let [a, b, c] = self.alpha;
        a + u * (b - a) + v * (c - a)
    }

    /// The mean share of a surface over the part of it within a cell; none where a cutoff leaves no shares, or the cell
    /// goes beyond the horizon of its plane.
    fn mean(&self, cell: &Cell) -> Option<f32> {
        let mask = self.maps.mask.as_ref().filter(|mask| mask.cutoff.is_none())?;
        if !self.is_uneven() {
            return mask.mean_alone(&[], self.alpha[0]);
        }
        let part = self.part_within(cell)?;
        let DVec2 { x, y } = part.iter().sum::<DVec2>() / part.len() as f64;
        let [a, b, c] = self.coordinates.map(|at| at.as_dvec2());
        let place: SmallVec<[DVec2; 7]> = part.iter().map(|w| a + w.x * (b - a) + w.y * (c - a)).collect();
        mask.mean_alone(&place, self.alpha(x as f32, y as f32))
    }

    /// The part of the face within a cell, and of what its mask goes on over: a convex polygon of weights of the second
    /// and third corner.
    fn part_within(&self, cell: &Cell) -> Option<Vec<DVec2>> {
        let mut part = Vec::with_capacity(7);
        for ray in cell {
            part.push(self.weights_in_plane(ray)?);
        }
        // The edges opposite to the first, second and third corner.
        let inside = [(DVec2::NEG_ONE, -1.0), (DVec2::X, 0.0), (DVec2::Y, 0.0)];
        for ((normal, offset), _) in inside.into_iter().zip(self.goes_on).filter(|(_, goes_on)| !goes_on) {
            part = half_plane(&part, normal, offset);
        }
        (part.len() >= 3).then_some(part)
    }

    /// The weights of the second and third corner where a ray meets the face's plane.
    fn weights_in_plane(&self, ray: &Ray) -> Option<DVec2> {
        let [a, b, c] = self.corners.map(|corner| corner.as_dvec3());
        let (u, v, direction) = (b - a, c - a, ray.direction.as_dvec3());
        let normal: DVec3 = u.cross(v);
        let t = (a - ray.origin.as_dvec3()).dot(normal) / direction.dot(normal);
        if !(t > 0.0 && t.is_finite()) {
            return None;
        }
        let weights = self.weights_at(ray.origin.as_dvec3() + t * direction);
        weights.is_finite().then_some(weights)
    }

    /// The weights of the second and third corner at the point of the face's plane below or above a point.
    fn weights_at(&self, point: DVec3) -> DVec2 {
        let [a, b, c] = self.corners.map(|corner| corner.as_dvec3());
        let (u, v, p) = (b - a, c - a, point - a);
        let normal = u.cross(v);
        DVec2::new(p.cross(v).dot(normal), u.cross(p).dot(normal)) / normal.length_squared()
    }
}
