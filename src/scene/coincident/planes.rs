//! Plane ids: faces whose planes agree within rounding share one, whatever way they face.
//!
//! A ray that starts on a face can never meet that face's plane again, so every face of the plane is skipped, by
//! id and not by a distance along the ray. Faces are taken in order of falling area; each joins the first plane
//! already known that its three corners lie within [`TOLERANCE`] of, or founds a new one. It is compared with the
//! founder alone, never with a neighbour, so ids do not drift along a finely tessellated curved surface.
//!
//! Not handled: a plane may fall into several ids where it is cut so finely that rounding tilts the founder
//! (faces of 1e-3 that are not parallel to an axis). Rays start a little above their face, so this costs no accuracy.

use glam::{BVec4, DVec3, DVec4, I64Vec4};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::scene::model::Scene;

/// Largest distance of a face's corner from the plane it joins, unit coordinates.
pub(crate) const TOLERANCE: f64 = 2e-6;

/// Edge of a hash cell of (normal, offset).
const CELL: f64 = 1.0 / 4096.0;

/// A plane this close to a cell's border is looked for beyond it too; more than rounding tilts a face of 0.01.
const BORDER: f64 = CELL / 8.0;

/// A direction that planes people draw are rarely parallel to; about a unit vector.
const GENERIC: DVec3 = DVec3::new(0.537, 0.623, 0.568);

/// Planes whose normals have a larger part along [`GENERIC`] are entered under one orientation only: those looked at
/// have normals within a cell and its border in each coordinate, `sqrt(3)` times that altogether.
const EITHER: f64 = 2.0 * (CELL + BORDER);

/// Planes looked at in one cell, so that gently curved surfaces with thousands in a cell stay near-linear.
const PROBES: usize = 32;

/// `normal . x = offset`, normal of length 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Plane {
    pub normal: DVec3,
    pub offset: f64,
}

/// The planes of a scene.
pub(crate) struct Planes {
    /// The plane of every face.
    pub of_face: Vec<u32>,
    /// The founders' planes, by falling area of the founder.
    pub planes: Vec<Plane>,
}

impl Plane {
    /// Signed distance of a point.
    pub(crate) fn distance(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }

    /// The plane seen from the other side.
    fn flipped(self) -> Plane {
        Plane { normal: -self.normal, offset: -self.offset }
    }

    fn coordinates(self) -> DVec4 {
        self.normal.extend(self.offset)
    }
}

impl Planes {
    /// Groups the faces of a scene, in about linear time.
    pub(crate) fn new(scene: &Scene) -> Self {
        let mut finder = Finder::default();
        let mut of_face = vec![0; scene.faces.len()];
        for (face, plane) in by_falling_area(scene) {
            let corners = scene.corners(face).map(|c| c.as_dvec3());
            of_face[face as usize] = finder.find(plane, &corners);
        }
        Planes { of_face, planes: finder.planes }
    }
}

/// Faces plane by plane, in order, and where each plane's begin; `of_face` has the plane of each.
pub(crate) fn by_plane(of_face: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let planes = of_face.iter().map(|&plane| plane + 1).max().unwrap_or(0) as usize;
    let mut starts = vec![0; planes + 1];
    of_face.iter().for_each(|&plane| starts[plane as usize + 1] += 1);
    for plane in 0..planes {
        starts[plane + 1] += starts[plane];
    }
    let (mut next, mut faces) = (starts.clone(), vec![0; of_face.len()]);
    for (face, &plane) in (0..).zip(of_face) {
        let at = &mut next[plane as usize];
        faces[*at as usize] = face;
        *at += 1;
    }
    (faces, starts)
}

/// Faces with their planes, largest first, ties by number.
fn by_falling_area(scene: &Scene) -> Vec<(u32, Plane)> {
    let corners = |face: u32| scene.corners(face).map(|c| c.as_dvec3());
    let measured = (0..scene.faces.len() as u32).into_par_iter().map(|face| {
        let [a, b, c] = corners(face);
        // The bits of numbers that are not negative are in their order.
        (!(b - a).cross(c - a).length().to_bits(), face)
    });
    let mut order: Vec<(u64, u32)> = measured.collect();
    order.par_sort_unstable();
    order.into_par_iter().map(|(_, face)| (face, plane_of(&corners(face)))).collect()
}

/// The plane of a face.
fn plane_of(&[a, b, c]: &[DVec3; 3]) -> Plane {
    let normal = (b - a).cross(c - a).normalize_or_zero();
    Plane { normal, offset: normal.dot(a + b + c) / 3.0 }
}

/// Planes in a hash grid over (normal, offset).
#[derive(Default)]
struct Finder {
    planes: Vec<Plane>,
    /// The plane entered into the same cell before this one.
    earlier: Vec<Option<u32>>,
    /// The plane last entered into a cell.
    cells: FxHashMap<u64, u32>,
}

impl Finder {
    /// The plane that all corners lie in, entered if it is new.
    fn find(&mut self, plane: Plane, corners: &[DVec3; 3]) -> u32 {
        let plane = upright(plane);
        let flipped = || {
            let either = plane.normal.dot(GENERIC) < EITHER;
            either.then(|| self.search(plane.flipped(), corners)).flatten()
        };
        let known = self.search(plane, corners).or_else(flipped);
        known.unwrap_or_else(|| self.enter(plane))
    }

    /// Looks in the plane's own cell and in those across a border close by.
    fn search(&self, plane: Plane, corners: &[DVec3; 3]) -> Option<u32> {
        let [low, high] = [-BORDER, BORDER].map(|border| cell(plane.coordinates() + border));
        across(low, high).find_map(|cell| self.search_cell(number(cell), corners))
    }

    fn search_cell(&self, key: u64, corners: &[DVec3; 3]) -> Option<u32> {
        let newest = self.cells.get(&key).copied();
        std::iter::successors(newest, |&p| self.earlier[p as usize]).take(PROBES).find(|&p| {
            let plane = &self.planes[p as usize];
            corners.iter().all(|&c| plane.distance(c).abs() <= TOLERANCE)
        })
    }

    fn enter(&mut self, plane: Plane) -> u32 {
        let id = self.planes.len() as u32;
        let key = number(cell(plane.coordinates()));
        self.planes.push(plane);
        let earlier = self.cells.insert(key, id);
        self.earlier.push(earlier);
        id
    }
}

/// The orientation under which a plane is entered. Planes on the border between the two orientations are found under
/// either, as `find` looks for both.
fn upright(plane: Plane) -> Plane {
    if plane.normal.dot(GENERIC) < 0.0 { plane.flipped() } else { plane }
}

/// The cell of a plane.
fn cell(coordinates: DVec4) -> I64Vec4 {
    let places = coordinates / CELL;
    // Towards zero, which costs less than the floor.
    let whole = places.as_i64vec4();
    I64Vec4::select(whole.as_dvec4().cmpgt(places), whole - 1, whole)
}

/// A cell as one number, of 16 bits for each coordinate.
fn number(cell: I64Vec4) -> u64 {
    cell.to_array().iter().fold(0, |all, &n| all << 16 | n as u64 & 0xffff)
}

/// The cells between two that differ by one at most in each coordinate, these included.
#[inline]
fn across(low: I64Vec4, high: I64Vec4) -> impl Iterator<Item = I64Vec4> {
    let borders = low.cmpne(high).bitmask();
    (0..=borders).filter(move |beyond| beyond & !borders == 0).map(move |beyond| {
        let beyond = BVec4::new(beyond & 1 > 0, beyond & 2 > 0, beyond & 4 > 0, beyond & 8 > 0);
        I64Vec4::select(beyond, high, low)
    })
}
