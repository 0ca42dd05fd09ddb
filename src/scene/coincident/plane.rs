//! What is there of the faces of one plane.
//!
//! Faces are taken in the order of the file, those of either way by themselves. What earlier ones cover of a face is
//! cut out of it; under a masked one a piece stays that is there where the mask is not. Where the front of a face of
//! the other way lies on the back of one with two sides, a piece stays that has no back.
//!
//! Not handled: masked fronts on backs. Rays see the back through the mask; where it emits, closed forms count all.

use glam::{DVec2, DVec3};
use smallvec::SmallVec;

use crate::scene::coincident::division::{Cover, Covering, Marks, Piece, divided};
use crate::scene::coincident::kept::{FEW, Kept};
use crate::scene::coincident::polygons::{Polygon, overlap};
use crate::scene::planes::Plane;
use crate::scene::{Scene, Sides};

/// A face of which not all is there as the file has it.
pub(super) struct Covered {
    pub face: u32,
    /// The first of the faces that cover some of it; none where only its back is behind others.
    pub by: Option<u32>,
    /// What is there. Corners are told by the weights of the face's second and third corner, in the order of its own.
    pub pieces: Vec<Piece>,
}

/// A face in its plane.
#[derive(Clone, Copy)]
struct Tile {
    face: u32,
    corners: [DVec2; 3],
    /// Whether its corners run counter-clockwise there.
    is_upright: bool,
}

/// The faces of one way that are there, some of them only in part.
#[derive(Default)]
struct Layer {
    kept: Kept,
    tiles: Vec<Tile>,
    /// What lies over each tile.
    covers: Vec<Vec<(u32, Cover)>>,
    /// The faces that are nowhere there.
    gone: Vec<Covered>,
}

/// Those faces of a plane of which not all is there, in no order; `faces` are in the order of the file.
pub(super) fn covered(scene: &Scene, plane: &Plane, faces: &[u32]) -> Vec<Covered> {
    let axes = plane.normal.any_orthonormal_pair();
    let tiles: SmallVec<[Tile; FEW]> = faces.iter().map(|&face| Tile::new(scene, face, axes)).collect();
    if tiles.len() <= FEW && !any_overlap(&tiles) {
        return Vec::new();
    }
    let (upright, turned): (Vec<Tile>, Vec<Tile>) = tiles.into_iter().partition(|tile| tile.is_upright);
    let layers = [upright, turned].map(|tiles| Layer::of(scene, tiles));
    let pairs = [(&layers[0], &layers[1]), (&layers[1], &layers[0])];
    let mut found: Vec<Covered> = pairs.iter().flat_map(|(own, other)| own.partly_there(scene, other)).collect();
    found.extend(layers.into_iter().flat_map(|layer| layer.gone));
    found
}

fn any_overlap(tiles: &[Tile]) -> bool {
    (1..tiles.len()).any(|k| tiles[..k].iter().any(|other| overlap(&other.ring(), &tiles[k].ring())))
}

impl Tile {
    fn new(scene: &Scene, face: u32, (u, v): (DVec3, DVec3)) -> Tile {
        let corners = scene.exact_corners(face).map(|p| DVec2::new(p.dot(u), p.dot(v)));
        let [a, b, c] = corners;
        Tile { face, corners, is_upright: (b - a).perp_dot(c - a) > 0.0 }
    }

    /// Its corners counter-clockwise.
    fn ring(&self) -> [DVec2; 3] {
        let [a, b, c] = self.corners;
        if self.is_upright { [a, b, c] } else { [a, c, b] }
    }

    /// As it covers others.
    fn cover(&self, covering: Covering) -> Cover {
        Cover { polygon: self.ring().to_vec(), covering }
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

    /// What is there of it; none where that is all.
    fn pieces(&self, covers: &[Cover]) -> Option<Vec<Piece>> {
        let ring = self.ring();
        let pieces = divided(&ring, covers);
        let is_whole = matches!(&pieces[..], [(polygon, marks)] if polygon[..] == ring && *marks == Marks::default());
        let weighted = pieces.into_iter().map(|(polygon, marks)| (self.weights(&polygon), marks));
        (!is_whole).then(|| weighted.collect())
    }
}

impl Layer {
    fn of(scene: &Scene, tiles: Vec<Tile>) -> Layer {
        let mut layer = Layer::default();
        for tile in tiles {
            let over: Vec<(u32, Cover)> = layer.over(&tile).map(|other| (other.face, same_way(scene, other))).collect();
            let covers: Vec<Cover> = over.iter().map(|(_, cover)| cover.clone()).collect();
            if !covers.is_empty() && tile.pieces(&covers).is_some_and(|pieces| pieces.is_empty()) {
                layer.gone.push(Covered { face: tile.face, by: Some(over[0].0), pieces: Vec::new() });
                continue;
            }
            layer.kept.add(tile.ring());
            layer.tiles.push(tile);
            layer.covers.push(over);
        }
        layer
    }

    /// The tiles that overlap another.
    fn over(&self, tile: &Tile) -> impl Iterator<Item = &Tile> {
        self.kept.over(&tile.ring()).into_iter().map(|k| &self.tiles[k])
    }

    /// The faces of which some is there and some is not, beside those of the other way.
    fn partly_there(&self, scene: &Scene, other: &Layer) -> Vec<Covered> {
        let one = |(tile, over): (&Tile, &Vec<(u32, Cover)>)| {
            let mut covers: Vec<Cover> = over.iter().map(|(_, cover)| cover.clone()).collect();
            if scene.material(tile.face).sides == Sides::Two {
                let fronts = other.over(tile).filter(|front| !is_masked(scene, front.face));
                covers.extend(fronts.map(|front| front.cover(Covering::Back)));
            }
            let pieces = if covers.is_empty() { None } else { tile.pieces(&covers) };
            Some(Covered { face: tile.face, by: over.first().map(|(face, _)| *face), pieces: pieces? })
        };
        self.tiles.iter().zip(&self.covers).filter_map(one).collect()
    }
}

/// A face as it covers those of its way.
fn same_way(scene: &Scene, tile: &Tile) -> Cover {
    let masked = is_masked(scene, tile.face);
    tile.cover(if masked { Covering::Masked(tile.face) } else { Covering::Whole })
}

fn is_masked(scene: &Scene, face: u32) -> bool {
    scene.maps(face).is_some_and(|maps| maps.mask.is_some())
}
