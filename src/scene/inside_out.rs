//! Rooms wound outwards: closed shells that the camera is in and that show it their backs, which are black, are turned.
//!
//! Modelling programs show both sides of a face, so nobody who makes a room of a box sees that its fronts are outside.
//! Faces that share edges and are wound alike make a shell, whatever objects they are of. It is turned where
//!
//! * it is closed: of most places within its box next to no ray escapes it;
//! * the camera is in it, and sees its backs, not what stands before them;
//! * next to nothing of it is a front as seen from there.
//!
//! So a body seen from outside stays as it is, and walls with thickness, whose inner faces are fronts already, and
//! what is open: a sheet, a room that lacks a wall. Two-sided and masked faces are no part of a shell.
//!
//! Not handled: rooms of which some walls alone are wound outwards, and those whose walls do not share their corners.

use std::collections::BTreeSet;

use glam::Vec3;
use rustc_hash::{FxHashMap, FxHashSet};

use crate::scene::enclosure::{Met, Walls};
use crate::scene::error::{About, Effect};
use crate::scene::model::{Scene, Sides};
use crate::scene::soup::Soup;

/// Faces of a shell at least.
const FEWEST: usize = 4;
/// Shells looked at, at most: the ones with the most faces.
const MOST: usize = 8;
/// Share of rays from the camera that escape a shell which it is in, at most: through windows nearby.
const WINDOWS: f64 = 0.3;
/// Share of rays from the camera that see the backs of a shell before all else, at least: a shell behind another wall
/// shows nothing.
const SEEN: f64 = 0.1;
/// Share of fronts among what rays within meet of a shell, at most: roundings at edges.
const FRONTS: f64 = 0.02;

/// Whether the camera of a scene sees the backs of faces, so that such shells are worth looking for.
pub(super) fn sees_backs(scene: &Scene) -> bool {
    let seen = Walls::new(scene, 0..scene.solid_faces()).ends_around(scene.camera.position);
    share(&seen, |met| met.is_some_and(|met| !met.is_live)) >= SEEN
}

/// Turns the polygons of closed shells that show their backs to a camera; whether there were any. A warning names them.
/// `read` are all triangles as they were read, before what lies in one place is settled, which goes by winding, and
/// the numbers of their polygons; the camera is in their frame.
pub(super) fn turn_inside_out(soup: &mut Soup, (read, polygons): (&Scene, &[usize]), camera: Vec3) -> bool {
    let seen = Walls::new(read, 0..read.solid_faces()).ends_around(camera);
    let mut shells = shells(read);
    shells.retain(|faces| faces.len() >= FEWEST);
    shells.sort_by_key(|faces| std::cmp::Reverse(faces.len()));
    shells.truncate(MOST);
    shells.retain(|faces| shows_its_back(&Walls::new(read, faces.iter().copied()), camera, &seen));
    let turned: Vec<usize> = shells.into_iter().flatten().map(|face| face as usize).collect();
    let objects: BTreeSet<u32> = turned.iter().map(|&face| read.faces[face].object).collect();
    let Some(first) = objects.first() else { return false };
    let more = match objects.len() {
        1 => String::new(),
        count => format!(" (and {} more objects)", count - 1),
    };
    let name = &soup.objects[*first as usize];
    let text = format!(
        "`{name}`{more} was turned inside out: the camera is in it, and its faces look outward, where their backs are \
         black; --as-modelled keeps it"
    );
    soup.warnings.insert(0, About::Shape(Effect::Guessed).warning(text));
    soup.turn(&turned.into_iter().map(|face| polygons[face]).collect());
    true
}

/// Whether a shell is closed, holds the camera and shows it its back, of whose rays this is what they see of all.
fn shows_its_back(shell: &Walls, camera: Vec3, seen: &[Option<Met>]) -> bool {
    let bounds = &shell.bounds;
    if !(camera.as_dvec3().cmpgt(bounds.low) & camera.as_dvec3().cmplt(bounds.high)).all() {
        return false;
    }
    let own = shell.ends_around(camera);
    let is_first = |(own, all): &(&Option<Met>, &Option<Met>)| match (own, all) {
        (Some(own), Some(all)) => !own.is_live && own.distance <= all.distance,
        _ => false,
    };
    let first = own.iter().zip(seen).filter(is_first).count() as f64 / own.len() as f64;
    let fronts = share(&own, |met| met.is_some_and(|met| met.is_live));
    let escaped = share(&own, |met| met.is_none());
    first >= SEEN && fronts <= FRONTS && escaped <= WINDOWS && shell.are_closed()
}

/// The share of rays whose ends have some property.
fn share(ends: &[Option<Met>], has: impl Fn(&Option<Met>) -> bool) -> f64 {
    ends.iter().filter(|met| has(met)).count() as f64 / ends.len().max(1) as f64
}

/// The one-sided faces without masks, by shells: those that are joined by edges which they pass in opposite ways.
fn shells(scene: &Scene) -> Vec<Vec<u32>> {
    let faces: Vec<u32> = (0..scene.solid_faces()).filter(|&face| is_of_shell(scene, face)).collect();
    let edges = |face: u32| {
        let [a, b, c] = scene.faces[face as usize].vertices;
        [(a, b), (b, c), (c, a)]
    };
    let by_edge: FxHashMap<(u32, u32), u32> =
        faces.iter().flat_map(|&face| edges(face).map(|edge| (edge, face))).collect();
    let (mut found, mut shells) = (FxHashSet::default(), Vec::new());
    for &start in &faces {
        if !found.insert(start) {
            continue;
        }
        let (mut shell, mut next) = (Vec::new(), vec![start]);
        while let Some(face) = next.pop() {
            shell.push(face);
            let beside = edges(face).into_iter().filter_map(|(a, b)| by_edge.get(&(b, a)).copied());
            next.extend(beside.filter(|&other| found.insert(other)));
        }
        shells.push(shell);
    }
    shells
}

fn is_of_shell(scene: &Scene, face: u32) -> bool {
    let material = scene.material(face);
    material.sides == Sides::One && !material.is_masked()
}
