//! The local picture of the Cornell box against the integral it stands for, evaluated another way in double precision.
//!
//! Emission plus direct light without shadows: `rho/pi * integral over the lamp of E cos cos / r²` at the first surface
//! seen, mean over the pixel. Here the integral runs over the lamp by Gauss-Legendre points, after the lamp is clipped
//! to the horizon; the program sums Lambert's closed form over the edges. Nothing of the program's geometry is used but
//! the corners of the faces.

use std::f64::consts::PI;

use glam::DVec3;
use halflight::Solver;
use halflight::gather::{GatherPass, GatherSampling};
use halflight::light::Mode;
use halflight::scene::Scene;
use halflight::solve::{Settings, neumann};

use crate::common::{Silent, assemble_one, builtin, sampling};

/// Pixels across and down.
const SIZE: usize = 48;

/// A face in f64: corners, unit normal, index.
struct Flat {
    corners: [DVec3; 3],
    normal: DVec3,
    face: u32,
}

fn faces(scene: &Scene) -> Vec<Flat> {
    let flat = |face: u32| {
        let corners = scene.corners(face).map(|p| p.as_dvec3());
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize();
        Flat { corners, normal, face }
    };
    (0..scene.faces.len() as u32).map(flat).collect()
}

/// The first face under the point (x, y) of the picture, and the point on it.
fn seen<'a>(scene: &Scene, faces: &'a [Flat], x: f64, y: f64) -> Option<(&'a Flat, DVec3)> {
    let camera = &scene.camera;
    let half = (0.5 * f64::from(camera.vertical_fov).to_radians()).tan();
    let across = (2.0 * x - 1.0) * half * camera.right.as_dvec3();
    let above = (1.0 - 2.0 * y) * half * camera.up.as_dvec3();
    let way = camera.forward.as_dvec3() + across + above;
    let eye = camera.position.as_dvec3();
    let hit = |f: &'a Flat| {
        let t = (f.corners[0] - eye).dot(f.normal) / way.dot(f.normal);
        let p = eye + t * way;
        let within = (0..3).all(|k| {
            let (a, b) = (f.corners[k], f.corners[(k + 1) % 3]);
            (b - a).cross(p - a).dot(f.normal) >= 0.0
        });
        (t > 0.0 && within).then_some((t, f, p))
    };
    let nearest = faces.iter().filter_map(hit).min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some((nearest.1, nearest.2))
}

/// Points and weights of Gauss-Legendre rules on [0, 1] (Abramowitz and Stegun, table 25.4), 3 and 8 points.
const THREE: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// Half of the symmetric rule of 8 points on [-1, 1].
const EIGHT: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_5),
    (0.960_289_856_497_536_2, 0.101_228_536_290_376_26),
];

fn eight() -> Vec<(f64, f64)> {
    let both = |(x, w): (f64, f64)| [(0.5 - 0.5 * x, 0.5 * w), (0.5 + 0.5 * x, 0.5 * w)];
    EIGHT.into_iter().flat_map(both).collect()
}

/// The part of a convex polygon above the horizon of a point.
fn above_horizon(polygon: &[DVec3], x: DVec3, n: DVec3) -> Vec<DVec3> {
    let mut kept = Vec::new();
    for (k, &a) in polygon.iter().enumerate() {
        let b = polygon[(k + 1) % polygon.len()];
        let (h, g) = ((a - x).dot(n), (b - x).dot(n));
        if h >= 0.0 {
            kept.push(a);
        }
        if h * g < 0.0 {
            kept.push(a.lerp(b, h / (h - g)));
        }
    }
    kept
}

/// `integral cos cos / (pi r²)` over a triangle by the rule of 8×8 points, on `4^cuts` parts of it.
fn over_triangle([a, b, c]: [DVec3; 3], x: DVec3, n: DVec3, cuts: usize) -> f64 {
    if cuts > 0 {
        let [d, e, f] = [(a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0];
        let parts = [[a, d, f], [d, b, e], [f, e, c], [d, e, f]];
        return parts.into_iter().map(|t| over_triangle(t, x, n, cuts - 1)).sum();
    }
    let across = (b - a).cross(c - a);
    let normal = across.normalize_or_zero();
    let rule = eight();
    let mut sum = 0.0;
    for &(u, wu) in &rule {
        for &(v, wv) in &rule {
            let d = a + u * (b - a).lerp(c - a, v) - x;
            let cosines = d.dot(n).max(0.0) * (-d.dot(normal)).max(0.0);
            sum += wu * wv * u * cosines / d.length_squared().powi(2);
        }
    }
    sum * across.length() / PI
}

/// Form factor from a point to the lamp.
fn form_factor(lamp: &[[DVec3; 3]], x: DVec3, n: DVec3, cuts: usize) -> f64 {
    let mut sum = 0.0;
    for triangle in lamp {
        let visible = above_horizon(triangle, x, n);
        for k in 2..visible.len() {
            sum += over_triangle([visible[0], visible[k - 1], visible[k]], x, n, cuts);
        }
    }
    sum
}

/// The face that fills a pixel and what its light is, if all of the pixel sees the one face's plane from its front.
fn pixel(scene: &Scene, faces: &[Flat], lamp: &[[DVec3; 3]], x: usize, y: usize) -> Option<(u32, f64)> {
    let at = |u: f64, v: f64| {
        let size = SIZE as f64;
        seen(scene, faces, (x as f64 + u) / size, (y as f64 + v) / size)
    };
    let first = at(0.5, 0.5)?.0;
    let plane = |f: &Flat| {
        let same = f.normal.dot(first.normal) > 1.0 - 1e-9;
        same && (f.corners[0] - first.corners[0]).dot(first.normal).abs() < 1e-6
    };
    let material = |f: &Flat| scene.faces[f.face as usize].material;
    // Look at a lattice over the pixel and a little beyond: everything in this scene is larger than its gaps.
    for i in -1..=9 {
        for j in -1..=9 {
            let (found, _) = at(f64::from(i) / 8.0, f64::from(j) / 8.0)?;
            if !plane(found) || material(found) != material(first) {
                return None;
            }
        }
    }
    let mut mean = 0.0;
    for (u, wu) in THREE {
        for (v, wv) in THREE {
            let (_, p) = at(u, v)?;
            mean += wu * wv * form_factor(lamp, p, first.normal, 0);
        }
    }
    Some((first.face, mean))
}

#[test]
fn the_rules_have_converged() {
    let scene = builtin("cornell-box");
    let faces = faces(&scene);
    let lamp = lamp(&scene, &faces);
    for k in 0..40 {
        let (x, y) = (0.1 + 0.02 * f64::from(k), 0.2 + 0.015 * f64::from((k * 17) % 40));
        let (f, p) = seen(&scene, &faces, x, y).expect("the box fills the picture");
        let [coarse, fine] = [0, 2].map(|cuts| form_factor(&lamp, p, f.normal, cuts));
        assert!((coarse - fine).abs() <= 1e-6 * fine, "{coarse} {fine}");
    }
}

fn lamp(scene: &Scene, faces: &[Flat]) -> Vec<[DVec3; 3]> {
    let own = faces.iter().filter(|f| scene.material(f.face).emits());
    own.map(|f| f.corners).collect()
}

#[test]
fn every_pixel_of_one_plane_shows_the_integral() {
    let scene = builtin("cornell-box");
    let faces = faces(&scene);
    let lamp = lamp(&scene, &faces);
    let p = Solver::new(&scene.clone()).cut(100);
    let mode = assemble_one(&p, Mode::Local.transport(), &sampling(1, 0));
    let solution = neumann(&mode.operator, &Settings::default()).expect("ends");
    // Scrambled Sobol points average a smooth function over the pixel to about N^-3/2 of its change over the pixel.
    let gathering = GatherSampling { camera: 1024, ..GatherSampling::with_samples(1, 0) };
    let gathered = mode.picture(&solution, &GatherPass::new((SIZE, SIZE), &gathering), &Silent);
    assert!(gathered.indirect.iter().flat_map(|i| &i.pixels).all(|p| *p == glam::Vec3::ZERO));
    let picture = gathered.total();
    let (mut counted, mut lit) = (0, 0);
    for y in 0..SIZE {
        for x in 0..SIZE {
            let Some((face, form)) = pixel(&scene, &faces, &lamp, x, y) else {
                continue;
            };
            let material = scene.material(face);
            let light = scene.materials.iter().find(|m| m.emits()).expect("a lamp");
            let reflected = form * light.emission.as_dvec3() * material.rho.as_dvec3();
            let exact = material.emission.as_dvec3() + reflected;
            let found = picture.pixels[y * SIZE + x].as_dvec3();
            let near = (found - exact).abs().cmple(1e-4 * exact).all();
            assert!(near, "({x}, {y}): {found} {exact}");
            counted += 1;
            lit += usize::from(form > 0.0);
        }
    }
    println!("{counted} pixels compared, {lit} lit");
    assert!(counted > SIZE * SIZE / 2 && lit > SIZE * SIZE / 3, "{counted} {lit}");
}
