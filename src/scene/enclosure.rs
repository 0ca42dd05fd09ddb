//! Whether a scene is a room that is looked at from inside, by its geometry, the sides that reflect, and where light
//! is.
//!
//! It is decided by rays from places within the bounding box. A scene is closed where few of them escape, whichever way
//! walls are wound. Of a closed one the inside is looked at if light is in there and none outside, or if it shows more
//! sides that reflect than the outside does. Where both show alike, as with two-sided walls, it is if light is inside,
//! or comes in through openings of a scene that fills its box, as rooms do and bodies seldom do.
//!
//! Surfaces with masks count as open. Not handled: rooms of which less than half of the box's middle is inside.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::scene::bounds::Bounds;
use crate::scene::punctual::PunctualLight;
use crate::scene::{Scene, Sides};

/// Directions from each place.
const DIRECTIONS: usize = 24;
/// Share of a place's rays that escape from a closed scene at most: furniture without bottoms and windows leave some
/// hundredths, a cube that lacks a side has a sixth.
const CLOSED: f64 = 0.1;
/// Share of an emitter's rays that escape at most if it is in a closed room; half of them end at the emitter.
const EMITTER_INSIDE: f64 = 0.1;
/// Places within a scene that fills its box, of all twelve: rooms with a corner cut off have nine, a ball has eight.
const FILLED: usize = 9;
/// By how much the shares of sides that reflect must differ inside and outside to decide.
const DIFFERENT: f64 = 0.1;
/// Emitting faces that are looked at, at most.
const EMITTERS: usize = 4;
/// By how much weights may be off where rays meet edges, so that none slips between two faces.
const EDGE: f32 = 1e-5;
/// Distance from an emitter that its rays start at, unit coordinates.
const BEFORE: f32 = 1e-4;

/// Faces that are passed over together by rays that miss their box. Those that follow each other in a file are mostly
/// near each other.
const GROUP: usize = 32;
/// By how much a box is larger than its faces, of its size and in unit coordinates: ten times what [`EDGE`] and
/// rounding add to faces.
const LARGER: [f32; 2] = [1e-4, 1e-5];

/// The faces of a scene that rays meet.
pub(crate) struct Walls {
    list: Vec<Wall>,
    /// Around each [`GROUP`].
    boxes: Vec<Bounds<Vec3>>,
    /// Around the scene.
    pub bounds: Bounds<DVec3>,
}

struct Wall {
    corner: Vec3,
    edges: [Vec3; 2],
    sides: Sides,
}

/// Origin and direction.
pub(crate) type Line = (Vec3, Vec3);

/// Where a ray ends.
#[derive(Clone, Copy)]
pub(crate) struct Met {
    pub distance: f32,
    /// Whether the side met reflects.
    pub is_live: bool,
}

impl Walls {
    /// Some faces of a scene.
    pub(super) fn new(scene: &Scene, faces: impl Iterator<Item = u32> + Clone) -> Walls {
        let corners = faces.clone().flat_map(|face| scene.corners(face)).map(|corner| corner.as_dvec3());
        let mut walls = Walls { list: Vec::new(), boxes: Vec::new(), bounds: Bounds::of(corners) };
        for face in faces {
            let [a, b, c] = scene.corners(face);
            let material = scene.material(face);
            if !material.is_masked() {
                walls.list.push(Wall { corner: a, edges: [b - a, c - a], sides: material.sides });
            }
        }
        walls.boxes = walls.list.chunks(GROUP).map(box_of).collect();
        walls
    }

    /// Where each of some rays ends.
    pub(super) fn nearest(&self, rays: &[Line]) -> Vec<Option<Met>> {
        rays.par_chunks(DIRECTIONS).flat_map_iter(|rays| self.of_some(rays)).collect()
    }

    fn of_some(&self, rays: &[Line]) -> Vec<Option<Met>> {
        let mut nearest: Vec<Option<Met>> = vec![None; rays.len()];
        let slopes: Vec<Vec3> = rays.iter().map(slopes).collect();
        for (walls, bounds) in self.list.chunks(GROUP).zip(&self.boxes) {
            for ((ray, slopes), nearest) in rays.iter().zip(&slopes).zip(&mut nearest) {
                if !passes(bounds, ray.0, *slopes) {
                    continue;
                }
                for met in walls.iter().filter_map(|wall| wall.meet(ray)) {
                    if nearest.is_none_or(|n| met.distance < n.distance) {
                        *nearest = Some(met);
                    }
                }
            }
        }
        nearest
    }

    /// Places within the bounding box, towards its edges and near its middle.
    pub(super) fn places(&self) -> impl Iterator<Item = DVec3> {
        let (middle, half) = (self.bounds.middle(), 0.5 * self.bounds.size());
        let signs = [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)];
        [0.85, 0.5, 0.15]
            .into_iter()
            .flat_map(move |share| signs.map(|(x, z)| middle + half * DVec3::new(share * x, 0.3 * share, share * z)))
    }

    /// Rays all around from each place, and where they end.
    fn around(&self, places: impl Iterator<Item = Vec3>) -> Vec<Ends> {
        let lines = |(turn, place): (usize, Vec3)| directions(turn).map(move |way| (place, way));
        let rays: Vec<Line> = places.enumerate().flat_map(lines).collect();
        self.nearest(&rays).chunks(DIRECTIONS).map(Ends::of).collect()
    }

    /// Where rays all around from one place end, ten times as many as from each of several.
    pub(super) fn ends_around(&self, place: Vec3) -> Vec<Option<Met>> {
        let rays: Vec<Line> = (0..10).flat_map(directions).map(|way| (place, way)).collect();
        self.nearest(&rays)
    }

    /// Whether next to no rays from most places within escape.
    pub(super) fn are_closed(&self) -> bool {
        self.closed().is_some()
    }

    /// What rays from places within find, those from which fewest escape first; none where they are not closed.
    fn closed(&self) -> Option<Vec<Ends>> {
        let mut ends = self.around(self.places().map(|place| place.as_vec3()));
        ends.sort_by_key(|ends| ends.escaped);
        (ends[ends.len() / 2].escaped_share() <= CLOSED).then_some(ends)
    }

    /// Whether a scene of these walls is a room that is looked at from inside.
    pub(super) fn are_of_a_room(&self, scene: &Scene) -> bool {
        let Some(ends) = self.closed() else { return false };
        let inside: Vec<&Ends> = ends.iter().filter(|ends| ends.escaped_share() <= CLOSED).collect();
        let [in_there, outside] = self.lights(scene);
        if in_there && !outside {
            return true;
        }
        let more = live_share(&inside) - live_share(&[&self.seen_from_outside()]);
        let is_open = inside.iter().any(|ends| ends.escaped > 0);
        more > DIFFERENT || (more >= -DIFFERENT && (in_there || (is_open && inside.len() >= FILLED)))
    }

    /// Rays from all around towards the middle.
    fn seen_from_outside(&self) -> Ends {
        let (middle, far) = (self.bounds.middle(), 2.0 * self.bounds.size().length());
        let rays: Vec<Line> = directions(0).map(|way| (middle.as_vec3() - far as f32 * way, way)).collect();
        Ends::of(&self.nearest(&rays))
    }

    /// Whether light is inside of the scene, and whether it is outside.
    fn lights(&self, scene: &Scene) -> [bool; 2] {
        let emitters = self.around(emitters(scene).into_iter()).into_iter();
        let emitters = emitters.map(|ends| ends.escaped_share() <= EMITTER_INSIDE);
        let place = |light: &PunctualLight| light.form.place().map(|place| place.position.as_vec3());
        let lights: Vec<_> = scene.lights.iter().filter(|light| light.shines()).map(place).collect();
        let points = self.around(lights.iter().filter_map(|place| *place)).into_iter();
        let points = points.map(|ends| ends.escaped_share() <= CLOSED);
        let far = lights.iter().any(Option::is_none) || scene.sky.is_some();
        let mut found = [false, far];
        emitters.chain(points).for_each(|is_inside| found[usize::from(!is_inside)] = true);
        found
    }
}

/// Points before the emitting sides of some of a scene's faces.
fn emitters(scene: &Scene) -> Vec<Vec3> {
    let emits = |&face: &u32| scene.material(face).emits();
    let all: Vec<u32> = (0..scene.solid_faces()).filter(emits).collect();
    let before = |&face: &u32| {
        let [a, b, c] = scene.corners(face);
        let out = BEFORE * (b - a).cross(c - a).normalize_or_zero();
        let middle = (a + b + c) / 3.0;
        let back = (scene.material(face).sides == Sides::Two).then_some(middle - out);
        std::iter::once(middle + out).chain(back)
    };
    all.iter().step_by(all.len().div_ceil(EMITTERS).max(1)).flat_map(before).collect()
}

/// Ends of rays from one place.
struct Ends {
    escaped: usize,
    live: usize,
    all: usize,
}

impl Ends {
    fn of(met: &[Option<Met>]) -> Ends {
        let count = |wanted: fn(&Option<Met>) -> bool| met.iter().filter(|met| wanted(met)).count();
        let live = count(|met| met.is_some_and(|met| met.is_live));
        Ends { escaped: count(Option::is_none), live, all: met.len() }
    }

    fn escaped_share(&self) -> f64 {
        self.escaped as f64 / self.all as f64
    }
}

/// Share of sides that reflect among those met.
fn live_share(ends: &[&Ends]) -> f64 {
    let sum = |count: fn(&Ends) -> usize| ends.iter().map(|ends| count(ends)).sum::<usize>();
    sum(|ends| ends.live) as f64 / sum(|ends| ends.all - ends.escaped).max(1) as f64
}

impl Wall {
    /// Where a ray meets it (Möller and Trumbore).
    fn meet(&self, (origin, way): &Line) -> Option<Met> {
        let [u, v] = self.edges;
        let across = way.cross(v);
        let determinant = u.dot(across);
        let offset = *origin - self.corner;
        let first = offset.dot(across) / determinant;
        let along = offset.cross(u);
        let second = way.dot(along) / determinant;
        let distance = v.dot(along) / determinant;
        let is_met = first >= -EDGE && second >= -EDGE && first + second <= 1.0 + EDGE && distance > 0.0;
        is_met.then_some(Met { distance, is_live: determinant > 0.0 || self.sides == Sides::Two })
    }
}

/// A box around walls.
fn box_of(walls: &[Wall]) -> Bounds<Vec3> {
    let corners = |wall: &Wall| [wall.corner, wall.corner + wall.edges[0], wall.corner + wall.edges[1]];
    let bounds = Bounds::of(walls.iter().flat_map(corners));
    let larger = LARGER[0] * bounds.size().length() + LARGER[1];
    Bounds { low: bounds.low - larger, high: bounds.high + larger }
}

/// One over each part of a ray's direction, finite where that is 0.
fn slopes((_, way): &Line) -> Vec3 {
    Vec3::from_array(way.to_array().map(|part| 1.0 / if part == 0.0 { f32::MIN_POSITIVE } else { part }))
}

/// Whether a ray passes through a box.
fn passes(bounds: &Bounds<Vec3>, origin: Vec3, slopes: Vec3) -> bool {
    let [a, b] = [bounds.low, bounds.high].map(|corner| (corner - origin) * slopes);
    a.min(b).max_element().max(0.0) <= a.max(b).min_element()
}

/// Directions spread evenly over the sphere (golden spiral), none along an axis, turned about y from number to number.
fn directions(number: usize) -> impl Iterator<Item = Vec3> {
    let start = 0.1 + number as f64;
    let turn = PI * (3.0 - 5f64.sqrt());
    (0..DIRECTIONS).map(move |k| {
        let y = 1.0 - (2 * k + 1) as f64 / DIRECTIONS as f64;
        let (sin, cos) = (turn * k as f64 + start).sin_cos();
        let radius = (1.0 - y * y).sqrt();
        DVec3::new(radius * cos, y, radius * sin).as_vec3()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::LoadOptions;
    use crate::scene::builtin;

    #[test]
    fn boxes_hide_no_wall() {
        for name in builtin::names() {
            let scene = Scene::builtin(name, LoadOptions::default()).unwrap().unwrap();
            let walls = Walls::new(&scene, 0..scene.solid_faces());
            let all_around = |(turn, place): (usize, DVec3)| directions(turn).map(move |way| (place.as_vec3(), way));
            let axes = [Vec3::X, Vec3::NEG_Y, Vec3::Z].map(|way| (walls.bounds.low.as_vec3(), way));
            let rays: Vec<Line> = walls.places().enumerate().flat_map(all_around).chain(axes).collect();
            for (ray, found) in rays.iter().zip(walls.nearest(&rays)) {
                let all = walls.list.iter().filter_map(|wall| wall.meet(ray)).map(|met| met.distance);
                assert_eq!(found.map(|met| met.distance), all.reduce(f32::min), "{name}: {ray:?}");
            }
        }
    }
}
