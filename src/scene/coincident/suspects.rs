//! Faces that may lie in one place with others: found by all threads in less time than all planes of a scene take.
//!
//! Faces are sorted by the cell of (normal, distance from the origin) that their plane lies in, whatever way they face,
//! and by those across a border close by, so that what lies in one plane meets in some cell. Where a pair in a cell may
//! lie in one place, all faces of the cell are told.
//!
//! Not handled: faces so small that rounding tilts them out of the cells beside that of their plane; planes do not find
//! those either.

use glam::{BVec4, DVec2, DVec3, I64Vec4};
use rayon::prelude::*;
use smallvec::SmallVec;

use crate::scene::coincident::kept::{FEW, Kept};
use crate::scene::coincident::polygons::overlap;
use crate::scene::planes::{GENERIC, Plane, TOLERANCE, plane_of, upright};
use crate::scene::{Scene, Sides};

/// Edge of a cell.
const CELL: f64 = 1.0 / 512.0;

/// Where cells begin: what planes often have, as 0 and 1, lies in the middle of one.
const SHIFT: f64 = 2.0 + 0.5 * CELL;

/// A plane this close to a cell's border is put beyond it too: more than rounding tilts a face of 0.01.
const BORDER: f64 = 1.0 / 32768.0;

/// Planes whose normals have a larger part along [`GENERIC`] have one orientation only.
const EITHER: f64 = 4.0 * BORDER;

/// Largest distance of a corner from the plane of another face, so that both may lie in the plane of a third.
const GAP: f64 = 4.0 * TOLERANCE;

/// Faces that may not be there as the file has them, and others close by, in order.
pub(super) fn suspects(scene: &Scene) -> Vec<u32> {
    let all = (0..scene.faces.len() as u32).into_par_iter().with_min_len(1024);
    let parts = all.fold(Vec::new, |mut entries, face| {
        tell_cells(plane_of(&scene.exact_corners(face)), |cell| entries.push((cell, face)));
        entries
    });
    let mut entries: Vec<(u64, u32)> = parts.collect::<Vec<_>>().concat();
    entries.par_sort_unstable();
    let cells = entries.par_chunk_by(|a, b| a.0 == b.0);
    let found = cells.filter(|own| own.len() > 1 && any_pair(scene, own));
    let mut found: Vec<u32> = found.flat_map_iter(|own| own.iter().map(|entry| entry.1)).collect();
    found.sort_unstable();
    found.dedup();
    found
}

/// Tells all cells that a face of a plane is looked for in.
fn tell_cells(plane: Plane, mut tell: impl FnMut(u64)) {
    let plane = upright(plane);
    tell_cells_of_one_way(plane, &mut tell);
    if plane.normal.dot(GENERIC) < EITHER {
        tell_cells_of_one_way(plane.flipped(), &mut tell);
    }
}

/// Tells the cell of a plane, and those across a border close by, each as one number.
fn tell_cells_of_one_way(plane: Plane, tell: &mut impl FnMut(u64)) {
    let place = plane.normal.extend(plane.offset) + SHIFT;
    let low = ((place - BORDER) / CELL).as_i64vec4();
    let high = ((place + BORDER) / CELL).as_i64vec4();
    // Coordinates lie between -2 and 2: 16 bits hold the number of a cell.
    let number = |cell: I64Vec4| cell.to_array().iter().fold(0, |all, &n| all << 16 | n as u64);
    let borders = low.cmpne(high).bitmask();
    for across in (0..16).filter(|across| across & !borders == 0) {
        let beyond = BVec4::new(across & 1 > 0, across & 2 > 0, across & 4 > 0, across & 8 > 0);
        tell(number(I64Vec4::select(beyond, high, low)));
    }
}

/// Whether two of the faces of one cell may lie in one place.
fn any_pair(scene: &Scene, own: &[(u64, u32)]) -> bool {
    let (u, v) = plane_of(&scene.exact_corners(own[0].1)).normal.any_orthonormal_pair();
    let place = |p: DVec3| DVec2::new(p.dot(u), p.dot(v));
    let flat = |&(_, face): &(u64, u32)| {
        let [a, b, c] = scene.exact_corners(face);
        ring([place(a), place(b), place(c)])
    };
    let meet = |a: usize, b: usize| may_meet(scene, own[a].1, own[b].1);
    if own.len() <= FEW {
        let tiles: SmallVec<[[DVec2; 3]; FEW]> = own.iter().map(flat).collect();
        return (1..own.len()).any(|k| (0..k).any(|j| overlap(&tiles[j], &tiles[k]) && meet(j, k)));
    }
    let tiles: Vec<[DVec2; 3]> = own.iter().map(flat).collect();
    let mut kept = Kept::new(tiles.clone());
    (0..own.len()).for_each(|k| kept.keep(k));
    (1..own.len()).any(|k| kept.find(&tiles[k], k, |j| meet(j, k)).is_some())
}

/// Corners counter-clockwise.
fn ring([a, b, c]: [DVec2; 3]) -> [DVec2; 3] {
    if (b - a).perp_dot(c - a) > 0.0 { [a, b, c] } else { [a, c, b] }
}

/// Whether two faces are near one plane, face the same way or have a back that counts, and are not neighbours.
fn may_meet(scene: &Scene, a: u32, b: u32) -> bool {
    let own = [scene.exact_corners(a), scene.exact_corners(b)];
    let [first, second] = [doubled(&own[0]), doubled(&own[1])];
    let opposite = first.dot(second) < 0.0;
    let two_sided = |face: u32| scene.material(face).sides == Sides::Two;
    if (opposite && !two_sided(a) && !two_sided(b)) || are_neighbours(scene, a, b, opposite) {
        return false;
    }
    let second_is_larger = first.length_squared() < second.length_squared();
    let [larger, smaller] = if second_is_larger { [1, 0] } else { [0, 1] };
    let plane = plane_of(&own[larger]);
    own[smaller].iter().all(|&corner| plane.distance(corner).abs() <= GAP)
}

/// The normal of a triangle, as long as twice its area.
fn doubled([a, b, c]: &[DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// Whether two faces lie on the two sides of an edge that they share.
fn are_neighbours(scene: &Scene, a: u32, b: u32, opposite: bool) -> bool {
    let [own, other] = [a, b].map(|face| scene.faces[face as usize].vertices);
    let other = if opposite { [other[0], other[2], other[1]] } else { other };
    let edges = |[a, b, c]: [u32; 3]| [(a, b), (b, c), (c, a)];
    let other = edges(other);
    edges(own).iter().any(|&(from, to)| other.contains(&(to, from)))
}
