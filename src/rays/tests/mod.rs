//! Scenes built by hand, and the tests of the module.

mod blocks;
mod deep;
mod ends;
mod lattice;
mod soup;
mod watertight;

use std::collections::HashMap;

use glam::{DVec3, Quat, Vec2, Vec3};

use crate::light::Rgb;
use crate::rays::*;
use crate::scene::{Camera, Face, Material, Scene, UnitFrame};

/// A scene of the triangles given, corners of equal coordinates shared; face i has material `materials[i]`.
pub(crate) fn scene_of(triangles: &[[Vec3; 3]], materials: &[u32]) -> Scene {
    let mut vertices = Vec::new();
    let mut known = HashMap::new();
    let mut index = |v: Vec3| {
        *known.entry(v.to_array().map(f32::to_bits)).or_insert_with(|| {
            vertices.push(v);
            vertices.len() as u32 - 1
        })
    };
    let faces = triangles.iter().zip(materials).map(|(corners, &material)| Face {
        vertices: corners.map(&mut index),
        material,
        object: 0,
    });
    let faces = faces.collect();
    let count = materials.iter().max().map_or(0, |m| m + 1);
    Scene {
        name: "test".into(),
        faces,
        exact: Vec::new(),
        coordinates: Vec::new(),
        colours: Vec::new(),
        vertices,
        materials: vec![grey(); count as usize],
        objects: vec!["all".into()],
        lights: Vec::new(),
        sky: None,
        camera: camera(),
        cameras: Vec::new(),
        frame: UnitFrame { center: DVec3::ZERO, scale: 1.0, metres: 1.0 },
        transport: None,
        warnings: Vec::new(),
    }
}

fn grey() -> Material {
    Material::new("grey", Rgb::splat(0.5), Rgb::ZERO)
}

fn camera() -> Camera {
    Camera { position: Vec3::ZERO, forward: Vec3::NEG_Z, right: Vec3::X, up: Vec3::Y, vertical_fov: 60.0 }
}

/// A scene whose faces are all of one material.
pub(crate) fn plain(triangles: &[[Vec3; 3]]) -> Scene {
    scene_of(triangles, &vec![0; triangles.len()])
}

/// The box `center` ± `half`, each side cut into `cells` × `cells` squares of two triangles, facing inwards.
pub(crate) fn room(center: Vec3, half: Vec3, cells: u32, turn: Quat) -> Vec<[Vec3; 3]> {
    let mut triangles = Vec::new();
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            // Corners come from integer steps: sides that share an edge share its vertices to the bit.
            let corner = |i: u32, j: u32| {
                let step = |k: u32| 2.0 * k as f32 / cells as f32 - 1.0;
                let mut p = Vec3::ZERO;
                p[axis] = sign;
                p[(axis + 1) % 3] = step(i);
                p[(axis + 2) % 3] = step(j);
                center + turn * (p * half)
            };
            for (i, j) in (0..cells).flat_map(|i| (0..cells).map(move |j| (i, j))) {
                let square = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
                triangles.extend(halves(square).map(|t| if sign > 0.0 { flipped(t) } else { t }));
            }
        }
    }
    triangles
}

/// A box facing outwards.
pub(crate) fn body(center: Vec3, half: Vec3, turn: Quat) -> Vec<[Vec3; 3]> {
    room(center, half, 1, turn).into_iter().map(flipped).collect()
}

pub(crate) fn halves([a, b, c, d]: [Vec3; 4]) -> [[Vec3; 3]; 2] {
    [[a, b, c], [a, c, d]]
}

pub(crate) fn flipped([a, b, c]: [Vec3; 3]) -> [Vec3; 3] {
    [a, c, b]
}

/// A turn that leaves no axis where it was.
pub(crate) fn oblique() -> Quat {
    Quat::from_axis_angle(Vec3::new(0.3, -0.5, 0.8).normalize(), 0.77)
}

/// The unit normal of the front.
pub(crate) fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a).normalize()
}

/// Pseudo-random numbers in [0, 1), by counter.
pub(crate) struct Random(pub u32);

impl Random {
    pub(crate) fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(1);
        (sobol::hash(self.0, 17) >> 8) as f32 / 16_777_216.0
    }

    pub(crate) fn pair(&mut self) -> Vec2 {
        Vec2::new(self.next(), self.next())
    }

    /// A point of the cube of half edge 1.
    pub(crate) fn point(&mut self) -> Vec3 {
        2.0 * Vec3::new(self.next(), self.next(), self.next()) - 1.0
    }

    /// A uniform unit vector.
    pub(crate) fn direction(&mut self) -> Vec3 {
        loop {
            let p = self.point();
            if (1e-4..=1.0).contains(&p.length_squared()) {
                return p.normalize();
            }
        }
    }
}
