//! The camera: from a position and a target, and the one that frames a scene that brings none.
//!
//! A closed room ([`crate::scene::enclosure`]) is looked at from inside, near a corner. Anything else is framed from
//! outside, the whole bounding box in view of a picture at least as wide as high; something open to the front (a box
//! without its front wall) is looked at from its open side. y counts as up.
//!
//! Not handled: what furniture hides. The corner is chosen by a few rays against all faces.

use glam::DVec3;

use crate::scene::enclosure::{Line, Walls};
use crate::scene::error::ViewError;
use crate::scene::model::{Camera, DEFAULT_FOV, Scene};

/// Vertical field of view inside a room, degrees.
const INSIDE_FOV: f64 = 70.0;

/// Below this share of the area, the vector area counts as that of a closed surface, where it is 0. Furniture without
/// bottoms leaves a few hundredths; a cube that lacks a side has a fifth.
const CLOSED: f64 = 0.1;

/// By how much the longer of two views must be longer to count as such: more than rounding makes of corners that are
/// listed in another order.
const LONGER: f32 = 1.0001;

impl Camera {
    /// The camera at `position` looking at `target`, all in one frame (unit coordinates for a [`Scene`]'s camera).
    ///
    /// # Errors
    /// A view without direction, up along the view, a field of view outside (0, 180), or numbers not finite.
    pub fn look_at(position: DVec3, target: DVec3, up: DVec3, vertical_fov: f64) -> Result<Camera, ViewError> {
        if !(position.is_finite() && target.is_finite() && up.is_finite() && vertical_fov.is_finite()) {
            return Err(ViewError::NotFinite);
        }
        let fov = vertical_fov as f32;
        if !(fov > 0.0 && fov < 180.0) {
            return Err(ViewError::Fov(vertical_fov));
        }
        let forward = direction(target - position).ok_or(ViewError::NoDirection)?;
        let up = direction(up).ok_or(ViewError::UpAlongView)?;
        let across = forward.cross(up);
        // Below 1e-6 the sideways direction is rounding.
        if across.length() < 1e-6 {
            return Err(ViewError::UpAlongView);
        }
        let right = across.normalize();
        let up = right.cross(forward);
        Ok(Camera {
            position: position.as_vec3(),
            forward: forward.as_vec3(),
            right: right.as_vec3(),
            up: up.as_vec3(),
            vertical_fov: fov,
        })
    }

    /// A camera that frames the scene's faces; the scene's own camera is not looked at.
    pub fn framing(scene: &Scene) -> Camera {
        Camera::framing_first(scene, scene.solid_faces())
    }

    /// A camera that frames the first of the scene's faces, so many; all of them may shine.
    pub(crate) fn framing_first(scene: &Scene, faces: u32) -> Camera {
        let walls = Walls::new(scene, 0..faces);
        if walls.are_of_a_room(scene) {
            from_corner(scene, &walls)
        } else {
            from_outside(scene, &walls, towards_camera(scene, faces))
        }
    }
}

/// The unit vector along `vector` without overflow; none for zero.
fn direction(vector: DVec3) -> Option<DVec3> {
    let largest = vector.abs().max_element();
    (largest > 0.0 && largest.is_finite()).then(|| (vector / largest).normalize())
}

/// The way to a camera outside: where the open side is, else the usual view from above, right and front.
fn towards_camera(scene: &Scene, faces: u32) -> DVec3 {
    let (mut vector_area, mut area) = (DVec3::ZERO, 0.0);
    for face in 0..faces {
        let [a, b, c] = scene.corners(face).map(|v| v.as_dvec3());
        let normal = 0.5 * (b - a).cross(c - a);
        vector_area += normal;
        area += normal.length();
    }
    let three_quarter = DVec3::new(0.6, 0.5, 1.0).normalize();
    if vector_area.length() < CLOSED * area {
        return three_quarter;
    }
    let open = vector_area.normalize();
    match open.y {
        y if y > 0.8 => three_quarter,
        y if y < -0.8 => three_quarter * DVec3::new(1.0, -1.0, 1.0),
        _ => open,
    }
}

/// The nearest camera along a way that has all corners of the bounding box within 95 % of its picture.
fn from_outside(scene: &Scene, walls: &Walls, to_camera: DVec3) -> Camera {
    let middle = walls.bounds.middle();
    let view = |distance: f64| look(middle + distance * to_camera, middle, DEFAULT_FOV, scene);
    let (right, up) = (view(1.0).right.as_dvec3(), view(1.0).up.as_dvec3());
    let slope = 0.95 * (0.5 * DEFAULT_FOV).to_radians().tan();
    let needed = (0..8).map(|i| {
        let pick = |axis: usize| if i & (1 << axis) == 0 { walls.bounds.low[axis] } else { walls.bounds.high[axis] };
        let offset = DVec3::new(pick(0), pick(1), pick(2)) - middle;
        let across = offset.dot(right).abs().max(offset.dot(up).abs());
        across / slope + offset.dot(to_camera)
    });
    view(needed.fold(f64::MIN_POSITIVE, f64::max))
}

/// Of the places near the room's upper corners, the one that sees the most sides that reflect, and then the farthest.
fn from_corner(scene: &Scene, walls: &Walls) -> Camera {
    let (middle, half) = (walls.bounds.middle(), 0.5 * walls.bounds.size());
    let target = middle - half * DVec3::new(0.0, 0.2, 0.0);
    let cameras = walls.places().map(|place| look(place, target, INSIDE_FOV, scene));
    let scored = cameras.map(|camera| (sight(walls, &camera), camera));
    let is_better =
        |next: (usize, f32), best: (usize, f32)| next.0 > best.0 || (next.0 == best.0 && next.1 > LONGER * best.1);
    let best = scored.reduce(|best, next| if is_better(next.0, best.0) { next } else { best });
    best.map_or(scene.camera, |(_, camera)| camera)
}

fn look(position: DVec3, target: DVec3, fov: f64, scene: &Scene) -> Camera {
    let (up, other) = (DVec3::Y, DVec3::NEG_Z);
    let camera = Camera::look_at(position, target, up, fov);
    let camera = camera.or_else(|_| Camera::look_at(position, target, other, fov));
    camera.unwrap_or(scene.camera)
}

/// Rays of a 3 by 3 grid that meet a side that reflects first, and the sum of their distances.
fn sight(walls: &Walls, camera: &Camera) -> (usize, f32) {
    let grid = [1.0 / 6.0, 0.5, 5.0 / 6.0];
    let rays: Vec<Line> = grid.into_iter().flat_map(|y| grid.map(|x| camera.ray(x, y, 1.0))).collect();
    let seen = walls.nearest(&rays).into_iter().flatten().filter(|met| met.is_live);
    seen.fold((0, 0.0), |(count, sum), met| (count + 1, sum + met.distance))
}
