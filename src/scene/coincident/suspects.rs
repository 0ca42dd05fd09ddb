//! Whether any faces of a scene may lie in one place: told by all threads in less time than the scene's planes take.
//!
//! Faces are sorted by the cell of (normal, distance from the origin) that their plane lies in, and by those across a
//! border close by, so that what lies in one plane meets in some cell. There each pair is looked at.
//!
//! Not handled: faces so small that rounding tilts them out of the cells beside that of their plane; planes do not find
//! those either.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::scene::coincident::kept::{FEW, Kept};
use crate::scene::coincident::polygons::overlap;
use crate::scene::planes::{Plane, TOLERANCE, plane_of};
use crate::scene::{Scene, Sides};

/// Edge of a cell.
const CELL: f64 = 1.0 / 512.0;

/// A plane this close to a cell's border is put beyond it too: more than rounding tilts a face of 0.01.
const BORDER: f64 = 1.0 / 32768.0;

/// Largest distance of a corner from the plane of another face, so that both may lie in the plane of a third.
const GAP: f64 = 4.0 * TOLERANCE;

/// A cell, and a face in it.
type Entry = (u64, Seen);

/// A face as it is seen from one of its sides.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Seen {
    face: u32,
    from_behind: bool,
}

/// Whether some face may not be there as the file has it.
pub(super) fn any(scene: &Scene) -> bool {
    let all = (0..scene.faces.len() as u32).into_par_iter().with_min_len(1024);
    let mut entries: Vec<Entry> = all.flat_map_iter(|face| entries(scene, face)).collect();
    entries.par_sort_unstable();
    entries.par_chunk_by(|a, b| a.0 == b.0).any(|own| own.len() > 1 && any_pair(scene, own))
}

/// A face in all cells that it is looked for in, from both sides where it has two.
fn entries(scene: &Scene, face: u32) -> impl Iterator<Item = Entry> + use<> {
    let plane = plane_of(&scene.exact_corners(face));
    let behind = (scene.material(face).sides == Sides::Two).then(|| plane.flipped());
    let front = cells(plane).map(move |cell| (cell, Seen { face, from_behind: false }));
    let back = behind.into_iter().flat_map(cells).map(move |cell| (cell, Seen { face, from_behind: true }));
    front.chain(back)
}

/// The cell of a plane, and those across a border close by, each as one number.
fn cells(plane: Plane) -> impl Iterator<Item = u64> {
    let place = plane.normal.extend(plane.offset).to_array();
    let low = place.map(|x| ((x - BORDER) / CELL).floor() as i64);
    let high = place.map(|x| ((x + BORDER) / CELL).floor() as i64);
    let borders = (0..4).fold(0u32, |all, axis| all | u32::from(low[axis] != high[axis]) << axis);
    (0..16u32).filter(move |corner| corner & !borders == 0).map(move |corner| {
        let number = |axis: usize| if corner >> axis & 1 == 1 { high[axis] } else { low[axis] };
        // Coordinates lie between -2 and 2: 16 bits hold the number of a cell.
        (0..4).fold(0, |all, axis| all << 16 | (number(axis) as u64 & 0xffff))
    })
}

/// Whether two of the faces of one cell may lie in one place.
fn any_pair(scene: &Scene, own: &[Entry]) -> bool {
    let first = plane_of(&scene.exact_corners(own[0].1.face));
    let (u, v) = first.normal.any_orthonormal_pair();
    let ring = |seen: Seen| {
        let [a, b, c] = scene.exact_corners(seen.face).map(|p| DVec2::new(p.dot(u), p.dot(v)));
        if (b - a).perp_dot(c - a) > 0.0 { [a, b, c] } else { [a, c, b] }
    };
    if own.len() <= FEW {
        let earlier = |k: usize| own[..k].iter().map(|entry| entry.1);
        return (1..own.len()).any(|k| {
            let seen = own[k].1;
            earlier(k).any(|other| may_meet(scene, seen, other) && overlap(&ring(seen), &ring(other)))
        });
    }
    let mut kept = Kept::default();
    own.iter().any(|&(_, seen)| {
        let tile = ring(seen);
        let found = kept.over(&tile).into_iter().any(|k| may_meet(scene, seen, own[k].1));
        kept.add(tile);
        found
    })
}

/// Whether two faces are near one plane, one of them at least seen from its front, and not neighbours.
fn may_meet(scene: &Scene, a: Seen, b: Seen) -> bool {
    if (a.from_behind && b.from_behind) || a.face == b.face || are_neighbours(scene, a, b) {
        return false;
    }
    let [first, second] = [a.face, b.face].map(|face| scene.exact_corners(face));
    let area = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).length_squared();
    let (larger, smaller) = if area(first) < area(second) { (second, first) } else { (first, second) };
    let plane = plane_of(&larger);
    smaller.iter().all(|&corner| plane.distance(corner).abs() <= GAP)
}

/// Whether two faces seen from the same way lie on the two sides of an edge that they share.
fn are_neighbours(scene: &Scene, a: Seen, b: Seen) -> bool {
    let ring = |seen: Seen| {
        let [a, b, c] = scene.faces[seen.face as usize].vertices;
        if seen.from_behind { [a, c, b] } else { [a, b, c] }
    };
    let edges = |[a, b, c]: [u32; 3]| [(a, b), (b, c), (c, a)];
    let other = edges(ring(b));
    edges(ring(a)).iter().any(|&(from, to)| other.contains(&(to, from)))
}
