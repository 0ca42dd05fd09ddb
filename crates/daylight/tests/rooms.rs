//! Rooms made of quadrilaterals, and what is asked of them.

use std::f64::consts::PI;
use std::fmt::Write as _;

use glam::{DQuat, DVec3};
use halflight::Scene;
use halflight::light::Mode;
use halflight::render::{Sensor, Silent};
use halflight_daylight::{Coefficients, Compass, DaylightGoal, Division, coefficients};

/// Four corners, the front facing the middle of what is passed to [`scene`].
pub type Quad = [DVec3; 4];

pub fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// A rectangle by its lowest corner and two sides, whose front faces along their cross product.
pub fn rectangle(corner: DVec3, a: DVec3, b: DVec3) -> Quad {
    [corner, corner + a, corner + a + b, corner + b]
}

/// Form factor from a point to a polygon that it sees all of (J. H. Lambert).
pub fn lambert(x: DVec3, n: DVec3, corners: &[DVec3]) -> f64 {
    let to = |k: usize| (corners[k % corners.len()] - x).normalize();
    let edge = |k: usize| {
        let (a, b) = (to(k), to(k + 1));
        a.cross(b).normalize().dot(n) * a.dot(b).clamp(-1.0, 1.0).acos()
    };
    ((0..corners.len()).map(edge).sum::<f64>() / (2.0 * PI)).abs()
}

/// A scene of quadrilaterals with reflectances.
pub fn scene(quads: &[(Quad, f64)]) -> Scene {
    let folder = tempfile::tempdir().expect("a folder");
    let (mut obj, mut mtl) = ("mtllib room.mtl\n".to_owned(), String::new());
    for (k, (corners, rho)) in quads.iter().enumerate() {
        let _ = writeln!(mtl, "newmtl m{k}\nKd {rho} {rho} {rho}");
        let _ = writeln!(obj, "o o{k}\nusemtl m{k}");
        corners.iter().for_each(|p| {
            let _ = writeln!(obj, "v {} {} {}", p.x, p.y, p.z);
        });
        let first = 4 * k;
        let _ = writeln!(obj, "f {} {} {} {}", first + 1, first + 2, first + 3, first + 4);
    }
    std::fs::write(folder.path().join("room.obj"), obj).expect("a file");
    std::fs::write(folder.path().join("room.mtl"), mtl).expect("a file");
    Scene::open(folder.path().join("room.obj").to_str().expect("a path")).expect("a scene")
}

/// A room of 4 by 3 by 2.5 m (z up) with a hole of a wall or the roof, of one reflectance: the hole from (1, 1) to
/// (3, 2) of the roof, or of the wall at y = 0 from 1 to 3 m across and from 1 to 2 m up.
pub fn room(rho: f64, in_roof: bool, turn: DQuat) -> Scene {
    let (x, y, z) = (v(4.0, 0.0, 0.0), v(0.0, 3.0, 0.0), v(0.0, 0.0, 2.5));
    let mut quads = vec![
        rectangle(v(0.0, 0.0, 0.0), x, y),
        rectangle(v(0.0, 0.0, 0.0), y, z),
        rectangle(x, z, y),
        rectangle(y, x, z),
    ];
    let around = |low: DVec3, across: DVec3, up: DVec3, hole: [f64; 4]| {
        let part =
            |a: f64, b: f64, c: f64, d: f64| rectangle(low + a * across + c * up, (b - a) * across, (d - c) * up);
        let [a, b, c, d] = hole;
        [part(0.0, 1.0, 0.0, c), part(0.0, 1.0, d, 1.0), part(0.0, a, c, d), part(b, 1.0, c, d)]
    };
    let (roof, wall) = (v(0.0, 0.0, 2.5), v(0.0, 0.0, 0.0));
    if in_roof {
        quads.extend(around(roof, y, x, [1.0 / 3.0, 2.0 / 3.0, 0.25, 0.75]));
        quads.push(rectangle(wall, z, x));
    } else {
        quads.push(rectangle(roof, y, x));
        quads.extend(around(wall, z, x, [0.4, 0.8, 0.25, 0.75]));
    }
    scene(&quads.into_iter().map(|quad| (quad.map(|p| turn * p), rho)).collect::<Vec<_>>())
}

pub fn sensor(position: DVec3, normal: DVec3) -> Sensor {
    Sensor { position, normal }
}

/// D with z up and north along y.
pub fn daylight(
    scene: &Scene,
    sensors: &[Sensor],
    mf: usize,
    (bounces, tolerance, seed): (Option<usize>, f64, u32),
) -> Coefficients {
    let compass = Compass::new(DVec3::Z, DVec3::Y).expect("a compass");
    seen_by(scene, sensors, &[], mf, (bounces, tolerance, seed), compass)
}

pub fn seen_by(
    scene: &Scene,
    sensors: &[Sensor],
    suns: &[DVec3],
    mf: usize,
    (bounces, tolerance, seed): (Option<usize>, f64, u32),
    compass: Compass,
) -> Coefficients {
    let goal = DaylightGoal {
        transport: Mode::Global.transport(),
        division: Division::new(mf).expect("a division"),
        compass,
        suns,
        bounces,
        tolerance,
        seed,
        memory: 1e9,
        watch: &Silent,
    };
    coefficients(scene, sensors, &goal).expect("coefficients")
}
