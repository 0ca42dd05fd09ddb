//! Scenes made in code, and rays that suit them.

#![allow(dead_code)] // Every benchmark uses a part.

use std::f32::consts::TAU;

use glam::{DVec3, Quat, Vec3};
use halflight::light::Rgb;
use halflight::rays::sobol::hash;
use halflight::rays::warp::{cosine_direction, triangle_point};
use halflight::rays::{End, Ray};
use halflight::scene::{Camera, Face, Material, Scene, UnitFrame};

/// A triangle.
pub type Corners = [Vec3; 3];

/// The twelve triangles of a box, facing outwards for `sign` 1 and inwards for -1.
pub fn cuboid(center: Vec3, half: Vec3, turn: Quat, sign: f32) -> Vec<Corners> {
    let mut triangles = Vec::new();
    for (axis, side) in [(0, -1.0), (0, 1.0), (1, -1.0), (1, 1.0), (2, -1.0), (2, 1.0)] {
        let corner = |i: f32, j: f32| {
            let mut p = Vec3::ZERO;
            p[axis] = side;
            p[(axis + 1) % 3] = i;
            p[(axis + 2) % 3] = j * side * sign;
            center + turn * (p * half)
        };
        let [a, b, c, d] = [corner(-1., -1.), corner(1., -1.), corner(1., 1.), corner(-1., 1.)];
        triangles.extend([[a, b, c], [a, c, d]]);
    }
    triangles
}

/// A room with two boxes and a lamp: 38 triangles in the proportions of the Cornell box.
pub fn cornell() -> Vec<Corners> {
    let about = |angle| Quat::from_rotation_y(angle);
    let lamp = [(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)];
    let [a, b, c, d] = lamp.map(|(x, z)| Vec3::new(x, 0.999, z));
    [
        cuboid(Vec3::ZERO, Vec3::ONE, Quat::IDENTITY, -1.0),
        cuboid(Vec3::new(0.33, -0.7, 0.38), Vec3::splat(0.3), about(-0.3), 1.0),
        cuboid(Vec3::new(-0.33, -0.4, -0.28), Vec3::new(0.3, 0.6, 0.3), about(0.3), 1.0),
        vec![[a, b, c], [a, c, d]],
    ]
    .concat()
}

/// A point of a sphere with ripples; `i` around, `j` from pole to pole.
pub fn ripple(i: u32, j: u32, n: u32) -> Vec3 {
    let (phi, theta) = (TAU * (i % (2 * n)) as f32 / (2 * n) as f32, 0.5 * TAU * j as f32 / n as f32);
    let radius = 0.6 + 0.03 * (9.0 * phi).sin() * (7.0 * theta).sin() * theta.sin();
    let rim = if j == 0 || j == n { 0.0 } else { theta.sin() };
    radius * Vec3::new(rim * phi.cos(), rim * phi.sin(), theta.cos())
}

/// A rippled sphere in a room: `4 n (n - 1)` triangles and twelve.
pub fn tessellated(n: u32) -> Vec<Corners> {
    let mut triangles = cuboid(Vec3::ZERO, Vec3::ONE, Quat::IDENTITY, -1.0);
    for (i, j) in (0..2 * n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let [a, b] = [ripple(i, j, n), ripple(i, j + 1, n)];
        let [c, d] = [ripple(i + 1, j + 1, n), ripple(i + 1, j, n)];
        let pair = [[a, b, c], [a, c, d]];
        let thin = |t: &Corners| t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
        triangles.extend(pair.into_iter().filter(|t| !thin(t)));
    }
    triangles
}

pub fn scene_of(triangles: &[Corners]) -> Scene {
    let faces =
        (0..triangles.len() as u32).map(|f| Face { vertices: [3 * f, 3 * f + 1, 3 * f + 2], material: 0, object: 0 });
    let grey = Material::new("grey", Rgb::splat(0.5), Rgb::ZERO);
    Scene {
        name: "bench".into(),
        vertices: triangles.concat(),
        faces: faces.collect(),
        exact: Vec::new(),
        coordinates: Vec::new(),
        colours: Vec::new(),
        materials: vec![grey],
        objects: vec!["all".into()],
        lights: Vec::new(),
        sky: None,
        camera: Camera { position: Vec3::ZERO, forward: Vec3::NEG_Z, right: Vec3::X, up: Vec3::Y, vertical_fov: 60.0 },
        cameras: Vec::new(),
        frame: UnitFrame { center: DVec3::ZERO, scale: 1.0, metres: 1.0 },
        transport: None,
        warnings: Vec::new(),
    }
}

pub fn random(index: u32, use_of: u32) -> f32 {
    (hash(index, use_of) >> 8) as f32 / 16_777_216.0
}

/// A random point of a random face; half of them on the first 38 faces, the room's.
pub fn end(triangles: &[Corners], index: u32, use_of: u32) -> End {
    let among = if index.is_multiple_of(2) { triangles.len().min(38) } else { triangles.len() };
    let face = (random(index, use_of) * among as f32) as usize;
    let [u1, u2] = [1, 2].map(|k| random(index, use_of + k));
    (triangle_point(triangles[face], u1, u2), Some(face as u32))
}

pub fn ray(triangles: &[Corners], index: u32) -> Ray {
    let (origin, source) = end(triangles, index, 0);
    let [a, b, c] = triangles[source.map_or(0, |f| f as usize)];
    let normal = (b - a).cross(c - a).normalize();
    Ray { origin, direction: cosine_direction(normal, random(index, 8), random(index, 9)), source }
}
