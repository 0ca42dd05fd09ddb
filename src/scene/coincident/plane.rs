//! What is there of the faces of one plane.
//!
//! Faces whose boxes meet are tested for overlaps pair by pair; where that would take long, all faces of the plane are
//! taken to overlap. Those that do are taken in the order of the file, but for whole ones that emit, which come before
//! whole ones that do not, those of either way by themselves. What earlier ones cover of a face is cut out of it; under
//! a masked one that is not the same once more a piece stays that is there where the mask is not. Where the front of a
//! face of the other way lies on the back of one with two sides, a piece stays that has no back.
//!
//! Not handled: masks by alpha of vertices given twice, of which the second stays for what the first leaves; masked
//! fronts on backs. Rays see the back through the mask; where it emits, closed forms count all.

use glam::{DVec2, DVec3};
use rustc_hash::FxHashMap;

use crate::scene::bounds::Bounds;
use crate::scene::coincident::division::{Covering, Marks, Piece, Polygon, divided, overlap};
use crate::scene::coincident::planes::Plane;
use crate::scene::coincident::triangle_tree::TriangleTree;
use crate::scene::model::{Scene, Sides};

/// How far texture coordinates of one place may lie apart to be the same.
const TWICE: f64 = 1e-4;

/// Pairs of faces tested for each face of a plane in the mean, at most.
const MOST: usize = 256;

/// Faces of a plane up to which all pairs are tested.
const FEW: usize = 8;

/// A face of which not all is there as the file has it.
pub(super) struct Covered {
    pub face: u32,
    /// One of the faces that cover some of it; none where only its back is behind others.
    pub by: Option<u32>,
    /// What is there. Corners are given by the weights of the face's second and third corner, in the order of its own.
    pub pieces: Vec<Piece>,
}

/// A face in its plane.
#[derive(Clone, Copy)]
struct Tile {
    face: u32,
    corners: [DVec2; 3],
    /// Whether its corners run counter-clockwise there.
    is_upright: bool,
    bounds: Bounds<DVec2>,
}

/// The faces of one way.
struct Layer<'a> {
    scene: &'a Scene,
    tiles: Vec<Tile>,
    /// Those of which some is there.
    tree: TriangleTree,
    /// Of each face that others of its way lie over, what is there.
    remaining: FxHashMap<usize, Remaining>,
}

/// What faces of its way leave of a face.
struct Remaining {
    /// One of them.
    by: u32,
    pieces: Vec<Piece>,
}

/// Those of a plane's faces of which not all is there, in no order; `faces` are in the order of the file.
pub(super) fn covered(scene: &Scene, plane: &Plane, faces: &[u32]) -> Vec<Covered> {
    let axes = plane.normal.any_orthonormal_pair();
    let tiles = overlapping(scene, faces.iter().map(|&face| Tile::new(scene, face, axes)).collect());
    if tiles.is_empty() {
        return Vec::new();
    }
    let (upright, turned): (Vec<Tile>, Vec<Tile>) = tiles.into_iter().partition(|tile| tile.is_upright);
    let [upright, turned] = [upright, turned].map(|tiles| Layer::of(scene, emitters_first(scene, tiles)));
    upright.covered(&turned).chain(turned.covered(&upright)).collect()
}

/// Puts whole faces that emit before all whole ones that do not. What is cut out of a face before those stays over
/// them.
fn emitters_first(scene: &Scene, mut tiles: Vec<Tile>) -> Vec<Tile> {
    let is_whole = |tile: &Tile| !scene.is_masked(tile.face);
    let emits = |tile: &Tile| scene.material(tile.face).emits();
    let first = tiles.iter().position(|tile| is_whole(tile) && !emits(tile)).unwrap_or(tiles.len());
    tiles[first..].sort_by_key(|tile| !(is_whole(tile) && emits(tile)));
    tiles
}

/// Of the tiles of a plane those that overlap another one; all where the pairs are too many to test.
fn overlapping(scene: &Scene, mut tiles: Vec<Tile>) -> Vec<Tile> {
    let mut found = vec![false; tiles.len()];
    let are_all_tested = pairs(&tiles, |j, k| {
        let is_known = found[j] && found[k];
        if !is_known && tiles[j].overlaps(&tiles[k]) && may_meet(scene, &tiles[j], &tiles[k]) {
            (found[j], found[k]) = (true, true);
        }
    });
    let mut found = found.into_iter();
    tiles.retain(|_| found.next() == Some(true) || !are_all_tested);
    tiles
}

/// Calls `visit` with pairs of tiles, of which others do not overlap; whether with all of them.
fn pairs(tiles: &[Tile], mut visit: impl FnMut(usize, usize)) -> bool {
    let n = tiles.len();
    if n <= FEW {
        (1..n).for_each(|k| (0..k).for_each(|j| visit(j, k)));
        return true;
    }
    let extent = tiles.iter().fold(DVec2::ZERO, |extent, own| extent.max((own.bounds.low - tiles[0].bounds.low).abs()));
    let axis = extent.max_position();
    let mut order: Vec<(f64, usize)> = tiles.iter().map(|tile| tile.bounds.low[axis]).zip(0..).collect();
    order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut remaining = MOST * n;
    for (place, &(_, k)) in order.iter().enumerate() {
        for &(_, j) in order[place + 1..].iter().take_while(|(low, _)| *low < tiles[k].bounds.high[axis]) {
            if remaining == 0 {
                return false;
            }
            remaining -= 1;
            visit(j, k);
        }
    }
    true
}

/// Whether two faces face the same way or have a back that counts, and are not neighbours.
fn may_meet(scene: &Scene, a: &Tile, b: &Tile) -> bool {
    let opposite = a.is_upright != b.is_upright;
    let two_sided = |face: u32| scene.material(face).sides == Sides::Two;
    !are_neighbours(scene, a.face, b.face, opposite) && (!opposite || two_sided(a.face) || two_sided(b.face))
}

/// Whether two faces lie on the two sides of an edge that they share.
fn are_neighbours(scene: &Scene, a: u32, b: u32, opposite: bool) -> bool {
    let [own, other] = [a, b].map(|face| scene.faces[face as usize].vertices);
    let other = if opposite { [other[0], other[2], other[1]] } else { other };
    let edges = |[a, b, c]: [u32; 3]| [(a, b), (b, c), (c, a)];
    let other = edges(other);
    edges(own).iter().any(|&(from, to)| other.contains(&(to, from)))
}

impl Tile {
    fn new(scene: &Scene, face: u32, (u, v): (DVec3, DVec3)) -> Tile {
        let corners = scene.exact_corners(face).map(|p| DVec2::new(p.dot(u), p.dot(v)));
        let [a, b, c] = corners;
        Tile { face, corners, is_upright: (b - a).perp_dot(c - a) > 0.0, bounds: Bounds::of(corners) }
    }

    fn overlaps(&self, other: &Tile) -> bool {
        self.bounds.meets(&other.bounds) && overlap(&self.ring(), &other.ring())
    }

    /// Its corners counter-clockwise.
    fn ring(&self) -> [DVec2; 3] {
        let [a, b, c] = self.corners;
        if self.is_upright { [a, b, c] } else { [a, c, b] }
    }

    /// Points by the weights of its second and third corner, in the order of its own corners.
    fn weights(&self, polygon: &[DVec2]) -> Polygon {
        let [a, b, c] = self.corners;
        let (u, v) = (b - a, c - a);
        let weights = |&p: &DVec2| DVec2::new((p - a).perp_dot(v), u.perp_dot(p - a)) / u.perp_dot(v);
        let mut weights: Polygon = polygon.iter().map(weights).collect();
        if !self.is_upright {
            weights.reverse();
        }
        weights
    }
}

impl<'a> Layer<'a> {
    fn of(scene: &'a Scene, tiles: Vec<Tile>) -> Layer<'a> {
        let tree = TriangleTree::new(tiles.iter().map(Tile::ring).collect());
        let mut layer = Layer { scene, tiles, tree, remaining: FxHashMap::default() };
        for k in 0..layer.tiles.len() {
            let remaining = layer.remaining_of(k);
            if remaining.as_ref().is_none_or(|remaining| !remaining.pieces.is_empty()) {
                layer.tree.insert(k);
            }
            layer.remaining.extend(remaining.map(|remaining| (k, remaining)));
        }
        layer
    }

    /// What those before it leave of a tile; none where none lies over it.
    fn remaining_of(&self, k: usize) -> Option<Remaining> {
        let ring = self.tiles[k].ring();
        let found = self.tree.find(&ring, k, |_| true)?;
        let covering = |face: u32| {
            let leaves = self.scene.is_masked(face) && !are_the_same(self.scene, face, self.tiles[k].face);
            Some(if leaves { Covering::Masked(face) } else { Covering::Whole })
        };
        let pieces = self.cut(&ring, whole(&ring), k, covering);
        Some(Remaining { by: self.tiles[found].face, pieces })
    }

    /// Pieces of a polygon under the tiles before one, each with its covering, if it covers it.
    fn cut(
        &self,
        ring: &[DVec2],
        start: Vec<Piece>,
        before: usize,
        covering: impl Fn(u32) -> Option<Covering>,
    ) -> Vec<Piece> {
        let cover = |k: usize| covering(self.tiles[k].face).map(|covering| (self.tiles[k].ring(), covering));
        let is_new =
            |marks: &Marks, k: usize| covering(self.tiles[k].face).is_some_and(|covering| !marks.has(covering));
        let near = |(polygon, marks): &Piece| self.tree.find(polygon, before, |k| is_new(marks, k));
        divided(ring, start, |piece| near(piece).and_then(cover))
    }

    /// The faces of which not all is there as the file has them, next to those of the other way.
    fn covered(&self, other: &Layer) -> impl Iterator<Item = Covered> {
        (0..self.tiles.len()).filter_map(|k| self.covered_tile(k, other))
    }

    fn covered_tile(&self, k: usize, other: &Layer) -> Option<Covered> {
        let (tile, remaining) = (&self.tiles[k], self.remaining.get(&k));
        let ring = tile.ring();
        let is_backed = self.scene.material(tile.face).sides == Sides::Two && other.has_front(&ring);
        if remaining.is_none() && !is_backed {
            return None;
        }
        let mut pieces = remaining.map_or_else(|| whole(&ring), |remaining| remaining.pieces.clone());
        if is_backed {
            let covering = |face: u32| (!self.scene.is_masked(face)).then_some(Covering::Back);
            pieces = other.cut(&ring, pieces, other.tiles.len(), covering);
        }
        let is_as_before = pieces == whole(&ring);
        let weighted = pieces.into_iter().map(|(polygon, marks)| (tile.weights(&polygon), marks));
        let covered =
            Covered { face: tile.face, by: remaining.map(|remaining| remaining.by), pieces: weighted.collect() };
        (!is_as_before).then_some(covered)
    }

    /// Whether one that is whole lies over a polygon.
    fn has_front(&self, ring: &[DVec2]) -> bool {
        self.tree.find(ring, self.tiles.len(), |k| !self.scene.is_masked(self.tiles[k].face)).is_some()
    }
}

/// All of a polygon.
fn whole(ring: &[DVec2]) -> Vec<Piece> {
    vec![(ring.to_vec(), Marks::default())]
}

/// Whether two faces are what a file has twice: of one material, with the same textures and colours in each place.
fn are_the_same(scene: &Scene, a: u32, b: u32) -> bool {
    let same = |x: DVec2, y: DVec2| (x - y).abs().max_element() <= TWICE;
    let coordinates = || {
        let own = scene.coordinates.get(b as usize).copied().unwrap_or_default();
        let beyond = scene.exact_corners(b).map(|corner| scene.coordinates_beyond(a, corner));
        own.into_iter().zip(beyond).all(|(own, beyond)| same(own.as_dvec2(), beyond))
    };
    let has_images = scene.maps(a).is_some_and(|maps| maps.has_images());
    let goes_by_colours = scene.maps(a).is_some_and(|maps| maps.vertex_colours);
    scene.faces[a as usize].material == scene.faces[b as usize].material
        && !goes_by_colours
        && (!has_images || coordinates())
}
