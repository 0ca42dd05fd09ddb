//! Faces that may lie in one place with others: found by all threads in less time than all planes of a scene take.
//!
//! Faces are sorted by the cell of (normal, distance from the origin) that their plane lies in, whatever way they face,
//! and by those across a border close by, so that what lies in one plane meets in some cell. Those of one cell whose
//! boxes meet are looked at pair by pair; where that would take long, all faces of the cell are told.
//!
//! Not handled: faces so small that rounding tilts them out of the cells beside that of their plane; planes do not find
//! those either.

use glam::{DVec2, DVec3, DVec4, Vec4Swizzles};
use rayon::prelude::*;
use smallvec::{SmallVec, smallvec};

use crate::scene::coincident::division::overlap;
use crate::scene::coincident::planes::{GENERIC, TOLERANCE, across, number, plane_of};
use crate::scene::{Scene, Sides};

/// Edge of a cell.
const CELL: f64 = 1.0 / 512.0;

/// A number this large leaves no place for fractions: added to others it rounds them.
const WHOLE: f64 = 1.5 * (1_u64 << 52) as f64;

/// A plane this close to a cell's border is put beyond it too: more than rounding tilts a face of 0.01.
const BORDER: f64 = 1.0 / 32768.0;

/// Planes whose normals have a larger part along [`GENERIC`] have one orientation only.
const EITHER: f64 = 4.0 * BORDER;

/// Largest distance of a corner from the plane of another face, so that both may lie in the plane of a third.
const GAP: f64 = 4.0 * TOLERANCE;

/// Pairs looked at for each face of a cell in the mean, at most.
const MOST: usize = 256;

/// Faces of a cell up to which all pairs are looked at.
const FEW: usize = 8;

/// A face of a cell, and whether it faces the other way than the cell's planes.
type Member = (u32, bool);

/// A face in the plane of its cell.
struct Tile {
    /// Counter-clockwise.
    corners: [DVec2; 3],
    low: DVec2,
    high: DVec2,
}

/// A face, or two that follow each other and make up a quadrilateral, in a cell.
///
/// From high bits to low: the cell, hashed; the face; whether it faces the other way than the cell's planes; whether
/// the next face belongs to it.
type Entry = u64;

/// Bits of an entry below its cell.
const BELOW: u32 = 33;

/// Faces that may not be there as the file has them, and those that they lie over or under, in order.
pub(super) fn suspects(scene: &Scene) -> Vec<u32> {
    let mut entries = entries(scene);
    entries.par_sort_unstable();
    let cells = entries.chunk_by(|a, b| a >> BELOW == b >> BELOW).filter(|own| own.len() > 1);
    // In the order of the file, so that what is looked at next lies next in memory.
    let mut cells: Vec<(u32, &[Entry])> = cells.map(|own| (own[0] as u32, own)).collect();
    cells.par_sort_unstable_by_key(|cell| cell.0);
    let mut found: Vec<u32> = cells.par_iter().flat_map_iter(|cell| overlapping(scene, cell.1)).collect();
    found.sort_unstable();
    found.dedup();
    found
}

/// All faces in their cells, but for most of those that lie in a cell alone.
fn entries(scene: &Scene) -> Vec<Entry> {
    let all = (0..scene.faces.len() as u32).into_par_iter().with_min_len(1024);
    let parts = all.fold(Vec::new, |mut entries, face| {
        enter(scene, face, &mut entries);
        entries
    });
    let mut entries: Vec<Entry> = parts.collect::<Vec<_>>().concat();
    let bits = (2 * entries.len()).next_power_of_two().ilog2();
    let mut counts = vec![0_u8; 1 << bits];
    let slot = |entry: Entry| (entry >> (64 - bits)) as usize;
    entries.iter().for_each(|&entry| counts[slot(entry)] = counts[slot(entry)].saturating_add(1));
    entries.retain(|&entry| counts[slot(entry)] > 1);
    entries
}

/// Adds a face to the entries of those before it.
fn enter(scene: &Scene, face: u32, entries: &mut Vec<Entry>) {
    let before = entries.len();
    let [a, b, c] = scene.exact_corners(face);
    let normal = (b - a).cross(c - a);
    // A plane told by its largest slope costs less than one by its unit normal.
    let normal = normal / normal.abs().max_element();
    tell_cells(normal.extend(normal.dot(a)), |cell, is_turned| {
        let hash = cell.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> BELOW << BELOW;
        entries.push(hash | u64::from(face) << 2 | u64::from(is_turned) << 1);
    });
    if let [.., last, own] = entries[..]
        && entries.len() == before + 1
        && own.wrapping_sub(last) == 4
        && are_neighbours(scene, face - 1, face, false)
    {
        entries.pop();
        entries[before - 1] |= 1;
    }
}

/// The faces of an entry, and whether each is turned.
fn members(entry: Entry) -> impl Iterator<Item = Member> {
    let face = (entry >> 2) as u32 & (u32::MAX >> 1);
    (face..=face + (entry & 1) as u32).map(move |face| (face, entry & 2 > 0))
}

/// Tells all cells that a face of a plane is looked for in, and whether it faces the other way there.
fn tell_cells(plane: DVec4, mut tell: impl FnMut(u64, bool)) {
    let along = plane.xyz().dot(GENERIC);
    let is_turned = along < 0.0;
    let plane = if is_turned { -plane } else { plane };
    tell_cells_of_one_way(plane, |cell| tell(cell, is_turned));
    if along.abs() < EITHER {
        tell_cells_of_one_way(-plane, |cell| tell(cell, !is_turned));
    }
}

/// Tells the cell of a plane, and those across a border close by, each as one number.
fn tell_cells_of_one_way(plane: DVec4, mut tell: impl FnMut(u64)) {
    // Of the bits of a number rounded so the last are those of the whole number.
    let cell = |place: DVec4| (place / CELL + WHOLE).to_array().map(|n| n.to_bits() as i64).into();
    across(cell(plane - BORDER), cell(plane + BORDER)).for_each(|cell| tell(number(cell)));
}

/// The faces of one cell that may lie in one place with another: all where they are too many to tell.
fn overlapping(scene: &Scene, own: &[Entry]) -> SmallVec<[u32; 4]> {
    let all: SmallVec<[Member; FEW]> = own.iter().flat_map(|&entry| members(entry)).collect();
    if all.len() == 2 && !may_meet(scene, all[0], all[1]) {
        return SmallVec::new();
    }
    let (u, v) = plane_of(&scene.exact_corners(all[0].0)).normal.any_orthonormal_pair();
    let flat = |p: DVec3| DVec2::new(p.dot(u), p.dot(v));
    let tiles: SmallVec<[Tile; FEW]> =
        all.iter().map(|&(face, _)| Tile::of(scene.exact_corners(face).map(flat))).collect();
    let mut found: SmallVec<[bool; FEW]> = smallvec![false; all.len()];
    let are_all_told = pairs(&tiles, |j, k| {
        let is_known = found[j] && found[k];
        if !is_known
            && tiles[j].overlaps(&tiles[k])
            && may_meet(scene, all[j], all[k])
            && are_near(scene, all[j].0, all[k].0)
        {
            (found[j], found[k]) = (true, true);
        }
    });
    let found = all.iter().zip(found).filter(|(_, found)| *found || !are_all_told);
    found.map(|(member, _)| member.0).collect()
}

/// Tells pairs of tiles, of which others do not overlap; whether all are told.
fn pairs(tiles: &[Tile], mut tell: impl FnMut(usize, usize)) -> bool {
    let n = tiles.len();
    if n <= FEW {
        (1..n).for_each(|k| (0..k).for_each(|j| tell(j, k)));
        return true;
    }
    let extent = tiles.iter().fold(DVec2::ZERO, |extent, own| extent.max((own.low - tiles[0].low).abs()));
    let axis = extent.max_position();
    let mut order: Vec<(f64, usize)> = tiles.iter().map(|tile| tile.low[axis]).zip(0..).collect();
    order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut left = MOST * n;
    for (place, &(_, k)) in order.iter().enumerate() {
        for &(_, j) in order[place + 1..].iter().take_while(|(low, _)| *low < tiles[k].high[axis]) {
            if left == 0 {
                return false;
            }
            left -= 1;
            tell(j, k);
        }
    }
    true
}

impl Tile {
    fn of([a, b, c]: [DVec2; 3]) -> Tile {
        let corners = if (b - a).perp_dot(c - a) > 0.0 { [a, b, c] } else { [a, c, b] };
        Tile { corners, low: a.min(b).min(c), high: a.max(b).max(c) }
    }

    fn overlaps(&self, other: &Tile) -> bool {
        let boxes_meet = self.low.cmplt(other.high).all() && other.low.cmplt(self.high).all();
        boxes_meet && overlap(&self.corners, &other.corners)
    }
}

/// Whether two faces face the same way or have a back that counts, and are not neighbours.
fn may_meet(scene: &Scene, (a, a_turned): Member, (b, b_turned): Member) -> bool {
    let opposite = a_turned != b_turned;
    let two_sided = |face: u32| scene.material(face).sides == Sides::Two;
    !are_neighbours(scene, a, b, opposite) && (!opposite || two_sided(a) || two_sided(b))
}

/// Whether one of two faces, the smaller, lies near the plane of the other.
fn are_near(scene: &Scene, a: u32, b: u32) -> bool {
    let own = [a, b].map(|face| scene.exact_corners(face));
    let area = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).length_squared();
    let [larger, smaller] = if area(own[0]) < area(own[1]) { [own[1], own[0]] } else { own };
    let plane = plane_of(&larger);
    smaller.iter().all(|&corner| plane.distance(corner).abs() <= GAP)
}

/// Whether two faces lie on the two sides of an edge that they share.
fn are_neighbours(scene: &Scene, a: u32, b: u32, opposite: bool) -> bool {
    let [own, other] = [a, b].map(|face| scene.faces[face as usize].vertices);
    let other = if opposite { [other[0], other[2], other[1]] } else { other };
    let edges = |[a, b, c]: [u32; 3]| [(a, b), (b, c), (c, a)];
    let other = edges(other);
    edges(own).iter().any(|&(from, to)| other.contains(&(to, from)))
}
