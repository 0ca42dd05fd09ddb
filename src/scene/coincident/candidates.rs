//! Faces of a plane that may lie in one place with others of it.
//!
//! Faces whose boxes meet are looked at pair by pair; where that would take long, all faces of the plane are
//! candidates.
//!
//! Not handled: what lies under what ([`crate::scene::coincident::plane`]).

use glam::{DVec2, DVec3};
use smallvec::{SmallVec, smallvec};

use crate::scene::coincident::division::overlap;
use crate::scene::coincident::planes::Plane;
use crate::scene::model::{Scene, Sides};

/// Pairs looked at for each face of a plane in the mean, at most.
const MOST: usize = 256;

/// Faces of a plane up to which all pairs are looked at.
const FEW: usize = 8;

/// A face in its plane.
struct Tile {
    face: u32,
    /// Counter-clockwise.
    corners: [DVec2; 3],
    low: DVec2,
    high: DVec2,
    /// Whether it faces the other way than the plane.
    is_turned: bool,
}

/// Of the faces of a plane those that may not be there as the file has them, and those that they lie over or under, in
/// their order.
pub(super) fn candidates(scene: &Scene, plane: &Plane, faces: &[u32]) -> Vec<u32> {
    let (u, v) = plane.normal.any_orthonormal_pair();
    let flat = |p: DVec3| DVec2::new(p.dot(u), p.dot(v));
    let tile = |&face: &u32| Tile::of(face, scene.exact_corners(face).map(flat));
    let tiles: SmallVec<[Tile; FEW]> = faces.iter().map(tile).collect();
    let mut found: SmallVec<[bool; FEW]> = smallvec![false; tiles.len()];
    let are_all_tested = pairs(&tiles, |j, k| {
        let is_known = found[j] && found[k];
        if !is_known && tiles[j].overlaps(&tiles[k]) && may_meet(scene, &tiles[j], &tiles[k]) {
            (found[j], found[k]) = (true, true);
        }
    });
    let found = faces.iter().zip(found).filter(|(_, found)| *found || !are_all_tested);
    found.map(|(face, _)| *face).collect()
}

/// Calls `visit` with pairs of tiles, of which others do not overlap; whether with all of them.
fn pairs(tiles: &[Tile], mut visit: impl FnMut(usize, usize)) -> bool {
    let n = tiles.len();
    if n <= FEW {
        (1..n).for_each(|k| (0..k).for_each(|j| visit(j, k)));
        return true;
    }
    let extent = tiles.iter().fold(DVec2::ZERO, |extent, own| extent.max((own.low - tiles[0].low).abs()));
    let axis = extent.max_position();
    let mut order: Vec<(f64, usize)> = tiles.iter().map(|tile| tile.low[axis]).zip(0..).collect();
    order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut remaining = MOST * n;
    for (place, &(_, k)) in order.iter().enumerate() {
        for &(_, j) in order[place + 1..].iter().take_while(|(low, _)| *low < tiles[k].high[axis]) {
            if remaining == 0 {
                return false;
            }
            remaining -= 1;
            visit(j, k);
        }
    }
    true
}

impl Tile {
    fn of(face: u32, [a, b, c]: [DVec2; 3]) -> Tile {
        let is_turned = (b - a).perp_dot(c - a) <= 0.0;
        let corners = if is_turned { [a, c, b] } else { [a, b, c] };
        Tile { face, corners, low: a.min(b).min(c), high: a.max(b).max(c), is_turned }
    }

    fn overlaps(&self, other: &Tile) -> bool {
        let boxes_meet = self.low.cmplt(other.high).all() && other.low.cmplt(self.high).all();
        boxes_meet && overlap(&self.corners, &other.corners)
    }
}

/// Whether two faces face the same way or have a back that counts, and are not neighbours.
fn may_meet(scene: &Scene, a: &Tile, b: &Tile) -> bool {
    let opposite = a.is_turned != b.is_turned;
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
