//! Shared by the tests: scenes made in code, and the short way from a scene to K.

#![allow(dead_code, reason = "other programs of tests use parts of it")]

pub mod rows;

use std::f64::consts::PI;

use glam::{DQuat, DVec3};
use halflight::Solver;
use halflight::direct::{Lights, Luminaire, Occlusion};
use halflight::form_factors::{FormFactors, Sampling, Variant, cast};
use halflight::light::{Rgb, Transport};
use halflight::pictures::Size;
use halflight::rays::Hit;
use halflight::rays::sobol::{Stream, hash};
use halflight::render::{Assembled, Discretization, Rendered, Watch};
use halflight::scene::{LoadOptions, Material, Scene};
use halflight::surfaces::SurfacePoint;

/// Watches nothing.
pub struct Silent;

impl Watch for Silent {
    fn begin(&self, _: &str, _: u64) {}
    fn tick(&self, _: u64) {}
}

/// A built-in scene.
pub fn builtin(name: &str) -> Scene {
    Scene::builtin(name, LoadOptions::default()).expect("a built-in name").expect("a correct scene")
}

/// So many hemisphere rays under a seed, all else as by default.
pub fn sampling(rays: u32, seed: u32) -> Sampling {
    Sampling { rays, seed, ..Sampling::default() }
}

/// K of one choice of (alpha, tau).
pub fn assemble_one(p: &Discretization, transport: Transport, sampling: &Sampling) -> Assembled {
    p.assemble(&[transport], sampling, &Silent).0.remove(0)
}

/// (alpha, tau).
pub fn transport(alpha: f32, tau: f32) -> Transport {
    Transport { alpha, tau }
}

/// All of F for one tau.
pub fn all_of_f(p: &Discretization, tau: f32, sampling: &Sampling) -> FormFactors {
    let n = p.patches.len();
    let variant =
        Variant { tau: vec![tau; p.geometry.scene.materials.len()], rows: vec![true; n], columns: vec![true; n] };
    let (mut found, _) = cast(&p.geometry.rays, &p.patches, &[variant], sampling, &|_| ());
    found.remove(0)
}

/// What lights the patches in a mode.
pub fn lights(p: &Discretization, transport: Transport) -> Lights {
    Lights::new(&p.geometry, &p.patches, &p.luminaires, p.transports(transport), 5e-4)
}

/// What lights the patches where nothing is known of any pair, with `occlusion` between any two points.
pub fn lights_behind(p: &Discretization, occlusion: &Occlusion) -> Lights {
    let transports = p.transports(Transport::default());
    Lights::by_rays(&p.geometry, &p.patches, &p.luminaires, transports).occluded_by(occlusion.clone())
}

/// `sum of F_l E_l` at a receiver: the mean of `A k T E` over points drawn uniformly in area on each luminaire. Neither
/// cuts nor closed forms have a part in it.
pub fn light_by_area(lights: &Lights, receiver: &SurfacePoint, random: &mut Stream, hits: &mut Vec<Hit>) -> DVec3 {
    let rays = &lights.geometry.rays;
    let occlusion = Occlusion::new(rays, &lights.transports);
    let one = |luminaire: &Luminaire| {
        let y = luminaire.point(random.uniform(), random.uniform());
        let (x, n) = (receiver.position.as_dvec3(), receiver.normal.as_dvec3());
        let across = y.position.as_dvec3() - x;
        let cosines = n.dot(across).max(0.0) * (-y.normal.dot(across)).max(0.0);
        if cosines == 0.0 {
            return DVec3::ZERO;
        }
        let kernel = luminaire.area * cosines / (PI * across.length_squared().powi(2));
        let arrived = occlusion.transmittance(rays, (receiver.position, Some(receiver.face)), y.end(), hits);
        luminaire.radiance.as_dvec3() * y.share * (kernel * f64::from(arrived))
    };
    lights.luminaires.list.iter().map(one).sum()
}

/// The picture of a mode to a tolerance.
pub fn rendered(scene: &Scene, transport: Transport, size: Size, tolerance: f64, seed: u32) -> Rendered {
    let solver = Solver::new(scene).seed(seed).memory(f64::INFINITY);
    solver.render(transport, size).tolerance(tolerance).expect("converges")
}

/// A grey material that reflects only.
pub fn grey(name: &str, rho: f32) -> Material {
    Material::new(name, Rgb::splat(rho), Rgb::ZERO)
}

/// A number in [0, 1) for every index and use.
pub fn random(index: u32, purpose: u32) -> f64 {
    f64::from(hash(index, purpose)) / 4_294_967_296.0
}

/// Polygons gathered into a scene.
#[derive(Default)]
pub struct Mesh {
    vertices: Vec<DVec3>,
    faces: Vec<(Vec<u32>, u32)>,
}

/// Which way the faces of a closed body look.
#[derive(Clone, Copy, PartialEq)]
pub enum Facing {
    /// As of a thing.
    Out,
    /// As of a room.
    In,
}

impl Mesh {
    /// Adds a convex polygon, counter-clockwise seen from the front.
    pub fn polygon(&mut self, corners: &[DVec3], material: u32) {
        let first = self.vertices.len() as u32;
        self.vertices.extend(corners);
        let indices = (first..first + corners.len() as u32).collect();
        self.faces.push((indices, material));
    }

    /// Adds a box.
    pub fn cuboid(&mut self, center: DVec3, half: DVec3, turn: DQuat, facing: Facing, material: u32) {
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                let corner = |(i, j): (f64, f64)| {
                    let mut p = DVec3::ZERO;
                    p[axis] = side;
                    p[(axis + 1) % 3] = i;
                    p[(axis + 2) % 3] = j * side;
                    center + turn * (p * half)
                };
                let mut corners = [(-1., -1.), (1., -1.), (1., 1.), (-1., 1.)].map(corner);
                if facing == Facing::In {
                    corners.reverse();
                }
                self.polygon(&corners, material);
            }
        }
    }

    /// Adds an icosahedron with every face cut into four `levels` times, its vertices on the sphere.
    pub fn sphere(&mut self, radius: f64, levels: usize, facing: Facing, material: u32) {
        for [a, b, c] in icosphere(levels) {
            let mut corners = [radius * a, radius * b, radius * c];
            if facing == Facing::In {
                corners.reverse();
            }
            self.polygon(&corners, material);
        }
    }

    /// The scene of these polygons.
    pub fn scene(self, materials: Vec<Material>) -> Scene {
        Scene::from_faces("test", &self.vertices, &self.faces, materials).expect("a correct scene")
    }
}

fn icosphere(levels: usize) -> Vec<[DVec3; 3]> {
    let g = 0.5 * (1.0 + 5f64.sqrt());
    let mut vertices: Vec<DVec3> = Vec::new();
    for (a, b) in [(-1.0, -g), (-1.0, g), (1.0, -g), (1.0, g)] {
        vertices.extend([DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)]);
    }
    let near = |p: DVec3, q: DVec3| (p - q).length_squared() < 4.1;
    let mut faces = Vec::new();
    for (i, &a) in vertices.iter().enumerate() {
        for (j, &b) in vertices.iter().enumerate().skip(i + 1) {
            for &c in vertices.iter().skip(j + 1) {
                if near(a, b) && near(b, c) && near(c, a) {
                    let outward = (b - a).cross(c - a).dot(a) > 0.0;
                    let face = if outward { [a, b, c] } else { [a, c, b] };
                    faces.push(face.map(|p| p.normalize()));
                }
            }
        }
    }
    for _ in 0..levels {
        faces = faces.into_iter().flat_map(quartered).collect();
    }
    faces
}

fn quartered([a, b, c]: [DVec3; 3]) -> [[DVec3; 3]; 4] {
    let [d, e, f] = [a + b, b + c, c + a].map(|p| p.normalize());
    [[a, d, f], [d, b, e], [f, e, c], [d, e, f]]
}

/// Mean and standard error of the mean.
pub fn mean_and_error(samples: &[f64]) -> (f64, f64) {
    let n = samples.len() as f64;
    let mean = samples.iter().sum::<f64>() / n;
    let spread: f64 = samples.iter().map(|s| (s - mean).powi(2)).sum();
    (mean, (spread / (n - 1.0) / n).sqrt())
}
