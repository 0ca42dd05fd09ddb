//! Light at points against closed forms: a furnace, a sky, Lambert's rectangle, a measured cosine; and how often stated
//! errors hold.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use halflight::Solver;
use halflight::light::Mode;
use halflight::render::{Apart, Sensor, SensorLight};
use halflight::scene::{AddedLight, Beam, LoadOptions, Material, PunctualForm, PunctualLight, PunctualPlace, Scene};

use crate::common::{Mesh, grey, random};

fn sensor(position: DVec3, normal: DVec3) -> Sensor {
    Sensor { position, normal }
}

/// Light at points of a mode to a tolerance.
fn measure(scene: &Scene, mode: Mode, sensors: &[Sensor], tolerance: f64, seed: u32) -> Vec<SensorLight> {
    let solver = Solver::new(scene).seed(seed).memory(f64::INFINITY);
    solver.points(mode, sensors).tolerance(tolerance).expect("converges").points
}

/// Whether a channel is within so many times its stated error of what it should be, or rounding of it.
fn is_near(light: &SensorLight, expected: f64, times: f64) -> bool {
    let off = (light.irradiance[0] - expected).abs();
    off <= times * light.error[0] + 1e-4 * expected
}

/// Points all over a box, looking anywhere.
fn anywhere(count: u32) -> Vec<Sensor> {
    let vector = |k: u32, what: u32| DVec3::from([0, 1, 2].map(|axis| 2.0 * random(k, 10 * what + axis) - 1.0));
    (0..count).map(|k| sensor(0.9 * vector(k, 1), vector(k, 2))).collect()
}

#[test]
fn a_furnace_sends_the_same_light_everywhere() {
    let scene = Scene::open("furnace").expect("a scene");
    let material = &scene.materials[0];
    let radiance = f64::from(material.emission.x) / (1.0 - f64::from(material.rho.x));
    let middle = scene.frame.to_file(DVec3::ZERO);
    let sensors: Vec<Sensor> =
        anywhere(40).into_iter().map(|s| sensor(middle + scene.frame.scale * 0.9 * s.position, s.normal)).collect();
    let found = measure(&scene, Mode::Global, &sensors, 0.01, 1);
    for light in &found {
        // The series is cut, by no more than what is stated.
        assert!(is_near(light, PI * radiance, 2.5), "{light:?} {}", PI * radiance);
        let sum: f64 = light.bounces.iter().map(|b| b[0]).sum();
        assert!((sum / light.irradiance[0] - 1.0).abs() < 1e-6);
        // Half of it comes with every bounce.
        let expected = f64::from(material.emission.x) * PI;
        assert!((light.bounces[0][0] / expected - 1.0).abs() < 0.02, "{light:?}");
    }
}

#[test]
fn a_sky_over_a_plane_is_all_that_is_seen() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("a file");
    write("p.obj", "mtllib p.mtl\nusemtl floor\nv -9 0 9\nv 9 0 9\nv 9 0 -9\nv -9 0 -9\nf 1 2 3 4\n");
    write("p.mtl", "newmtl floor\nKd 0.5 0.5 0.5\n");
    let options = LoadOptions { light: Some(AddedLight::Sky), ..LoadOptions::default() };
    let scene = Scene::load(&folder.path().join("p.obj"), options).expect("a scene");
    let up = |x: f64| sensor(DVec3::new(x, 1.0, 0.5 * x), DVec3::Y);
    let sensors: Vec<Sensor> = (0..10).map(|k| up(f64::from(k) - 5.0)).collect();
    for light in measure(&scene, Mode::Global, &sensors, 0.01, 2) {
        assert!(is_near(&light, PI, 2.5), "{light:?}");
    }
}

/// Irradiance of a square luminaire of half width a at a point d below its middle that looks up: four corners of
/// Lambert's rectangle.
fn below_square(a: f64, d: f64) -> f64 {
    let (x, y) = (a / d, a / d);
    let one = |x: f64, y: f64| {
        let (p, q) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
        (x / p * (y / p).atan() + y / q * (x / q).atan()) / (2.0 * PI)
    };
    4.0 * PI * one(x, y)
}

#[test]
fn a_square_lamp_has_lamberts_closed_form_and_a_measured_cosine_its_own() {
    let square = |a: f64, y: f64| [(-a, -a), (a, -a), (a, a), (-a, a)].map(|(x, z)| DVec3::new(x, y, z));
    let with = |emission: Vec3| {
        let mut mesh = Mesh::default();
        mesh.polygon(&square(0.5, 2.0), 0);
        let mut floor = square(3.0, -1.0);
        floor.reverse();
        mesh.polygon(&floor, 1);
        mesh.scene(vec![Material { emission, ..grey("lamp", 0.0) }, grey("floor", 0.0)])
    };
    let scene = with(Vec3::ONE);
    for (height, direct) in [(1.0, below_square(0.5, 1.0)), (-1.0, below_square(0.5, 3.0))] {
        let found = measure(&scene, Mode::Global, &[sensor(DVec3::Y * height, DVec3::Y)], 0.01, 3);
        assert!((found[0].irradiance[0] / direct - 1.0).abs() < 1e-4, "{found:?} {direct}");
        assert_eq!(found[0].bounces.iter().skip(1).map(|b| b[0]).sum::<f64>(), 0.0);
    }
    let mut dark = with(Vec3::ZERO);
    let place = PunctualPlace::new(dark.frame.to_unit(DVec3::Y), PunctualLight::PHYSICAL, dark.frame.scale);
    let beam = Beam::Spot { direction: DVec3::NEG_Y, exponent: 1.0, cutoff: 0.0 };
    dark.lights.push(PunctualLight {
        form: PunctualForm::Point { place, beam },
        intensity: Vec3::splat(5.0),
        name: None,
    });
    let off_axis = DVec3::new(1.5, -1.0, 0.0);
    let found = measure(&dark, Mode::Global, &[sensor(off_axis, DVec3::Y)], 0.01, 4);
    let d2 = 4.0 + 2.25;
    assert!((found[0].irradiance[0] / (5.0 * 4.0 / d2 / d2) - 1.0).abs() < 1e-4, "{found:?}");
}

/// A grid over the floor of the Cornell box, looking up.
fn over_floor(spacing: f64) -> Vec<Sensor> {
    let along = |length: f64| (0..).map(move |k| spacing * (f64::from(k) + 0.5)).take_while(move |x| *x < length);
    along(552.8).flat_map(|x| along(559.2).map(move |z| sensor(DVec3::new(x, 80.0, z), DVec3::Y))).collect()
}

/// A cornell box with a bulb besides its lamp.
fn with_bulb() -> Scene {
    let mut scene = Scene::open("cornell-box").expect("a scene");
    let place = DVec3::new(100.0, 400.0, 400.0);
    let place = PunctualPlace::new(scene.frame.to_unit(place), PunctualLight::PHYSICAL, scene.frame.scale);
    scene.lights.push(PunctualLight {
        form: PunctualForm::Point { place, beam: Beam::Even },
        intensity: Vec3::splat(2e4),
        name: Some("bulb".into()),
    });
    scene
}

#[test]
fn luminaires_and_bounces_add_up_and_each_is_what_it_is_alone() {
    let (both, lamp) = (with_bulb(), Scene::open("cornell-box").expect("a scene"));
    let sensors = over_floor(110.0);
    let solver = Solver::new(&both).seed(1).apart(Apart { emitters: true, bounces: false });
    let found = solver.points(Mode::Global, &sensors).tolerance(0.02).expect("converges").points;
    let whole = measure(&both, Mode::Global, &sensors, 0.02, 1);
    let alone = measure(&lamp, Mode::Global, &sensors, 0.02, 2);
    for ((light, whole), alone) in found.iter().zip(&whole).zip(&alone) {
        assert_eq!((light.irradiance, light.error), (whole.irradiance, whole.error));
        assert!(whole.luminaires.is_empty());
        if light.is_inside {
            continue;
        }
        let all = light.irradiance[0];
        let names: Vec<&str> = light.luminaires.keys().map(String::as_str).collect();
        assert_eq!(names, ["bulb", "light"]);
        let sums = [light.luminaires.values().map(|l| l[0]).sum::<f64>(), light.bounces.iter().map(|b| b[0]).sum()];
        assert!(sums.iter().all(|sum| (sum / all - 1.0).abs() < 1e-9), "{sums:?} {all}");
        let off = light.luminaires["light"][0] - alone.irradiance[0];
        assert!(off.abs() <= 0.06 * all, "{light:?} {alone:?}");
    }
}

#[test]
fn points_inside_of_solids_are_told() {
    let scene = Scene::open("cornell-box").expect("a scene");
    let found = measure(&scene, Mode::Global, &over_floor(50.0), 0.05, 1);
    // Two blocks of 165 by 165 on a floor of some 553 by 559.
    let share = found.iter().filter(|light| light.is_inside).count() as f64 / found.len() as f64;
    assert!((share - 2.0 * 165.0 * 165.0 / (553.0 * 559.0)).abs() < 0.06, "{share}");
    assert!(found.iter().all(|light| light.is_inside || light.irradiance[0] > 0.0));
}

/// Of points in a furnished room 95 of 100 are within twice their stated error of a solution by other rays and more
/// patches, whose own error counts.
#[test]
fn stated_errors_hold_at_most_points() {
    let scene = Scene::open("furnished-room").expect("a scene");
    let sensors: Vec<Sensor> =
        anywhere(60).into_iter().map(|s| sensor(scene.frame.to_file(0.8 * s.position), s.normal)).collect();
    let (mut count, mut held) = (0, 0);
    for seed in [5, 7, 9] {
        let [found, truth] =
            [(0.03, seed), (0.01, seed + 1)].map(|(t, s)| measure(&scene, Mode::Global, &sensors, t, s));
        let lit = found.iter().zip(&truth).filter(|(_, t)| t.irradiance[0] > 0.0);
        let within = |(a, b): &(&SensorLight, &SensorLight)| {
            (a.irradiance[0] - b.irradiance[0]).abs() <= 2.0 * a.error[0].hypot(b.error[0])
        };
        count += lit.clone().count();
        held += lit.filter(within).count();
    }
    // With a chance of 0.95 each, 3.1 standard deviations below the mean: in 999 of 1,000 cases.
    let n = count as f64;
    assert!(count > 120 && held as f64 >= 0.95 * n - 3.1 * (0.95 * 0.05 * n).sqrt(), "{held} of {count}");
}
