//! Scenes whose radiance is known: furnaces, spheres, Lambert's polygon, and series cut short.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3};
use halflight::light::{Mode, Rgb, Transport};
use halflight::rays::Rays;
use halflight::scene::{Camera, Material, Scene};
use halflight_reference::{KEPT, Mean, TraceSettings};

use crate::reference::spheres::concentric_spheres;
use crate::reference::{BOTH, load, settings, traced};

/// Whether a mean is the expected value within 4 standard errors and the rounding of f32 sums.
fn assert_mean(mean: &Mean, expected: f64, what: &str) {
    for c in 0..3 {
        let (value, error) = (mean.value[c], mean.error[c]);
        let allowed = 4.0 * error + 1e-5 * expected;
        assert!(
            (value - expected).abs() <= allowed,
            "{what}, channel {c}: {value} instead of {expected}, error {error}"
        );
    }
}

/// `E rho^n` in every order and `E / (1 - rho)` together, in a closed scene whose surfaces are all alike.
fn assert_furnace(scene: &Scene, transport: Transport, rho: f64, emission: f64) {
    let rays = Rays::new(scene);
    for next_event in BOTH {
        let tracer = traced(scene, &rays, transport, (16, 256), &settings(next_event));
        let what = format!("{} {next_event:?}", scene.name);
        assert_mean(&tracer.mean(), emission / (1.0 - rho), &what);
        for (n, mean) in tracer.means().iter().take(KEPT).enumerate() {
            assert_mean(mean, emission * rho.powi(n as i32), &format!("{what} n = {n}"));
        }
    }
}

#[test]
fn the_furnace_glows_evenly() {
    let furnace = load("furnace");
    let own = &furnace.materials[0];
    let (rho, emission) = (f64::from(own.rho.x), f64::from(own.emission.x));
    assert_furnace(&furnace, Mode::Global.transport(), rho, emission);
    // A convex room has one crossing a ray: tau changes nothing.
    assert_furnace(&furnace, Mode::Shadowless.transport(), rho, emission);
}

#[test]
fn concentric_spheres_that_all_emit_are_a_furnace() {
    let mut scene = load("concentric-spheres");
    for material in &mut scene.materials {
        (material.rho, material.emission) = (Rgb::splat(0.7), Rgb::ONE);
    }
    assert_furnace(&scene, Mode::Global.transport(), 0.7, 1.0);
}

/// Radiance of the visible half of (inner, outer) for each order, from the two-patch system.
fn two_patches(q: f64, t: Transport, rho: f64, emission: [f64; 2]) -> Vec<[f64; 2]> {
    let (alpha, tau) = (f64::from(t.alpha), f64::from(t.tau));
    let through = 1.0 - q + q * tau * tau;
    let mut invisible = emission;
    let mut orders = vec![emission];
    for _ in 0..200 {
        let visible = [rho * invisible[1], rho * (q * invisible[0] + through * invisible[1])];
        orders.push(visible);
        invisible = visible.map(|l| alpha * l);
    }
    orders
}

#[test]
fn light_passes_through_concentric_spheres() {
    let emission = [1.0, 0.25];
    let (mut scene, q) = concentric_spheres(0.5, 0.75, emission);
    let rays = Rays::new(&scene);
    let transport = Transport { alpha: 0.5, tau: 0.5 };
    let expected = two_patches(q, transport, 0.75, emission);
    for (patch, target) in [(0, DVec3::ZERO), (1, DVec3::Z)] {
        let eye = DVec3::new(0.0, 0.0, 0.8);
        // The picture's corners lie 33.4 degrees off the axis, the inner sphere's rim asin(0.5 / 0.8) = 38.7.
        let camera = Camera::look_at(eye, target, DVec3::Y, 50.0);
        scene.camera = camera.unwrap();
        let total = expected.iter().map(|order| order[patch]).sum();
        for next_event in BOTH {
            let tracer = traced(&scene, &rays, transport, (16, 1024), &settings(next_event));
            let what = format!("sphere {patch} {next_event:?}");
            assert_mean(&tracer.mean(), total, &what);
            for (n, mean) in tracer.means().iter().take(KEPT).enumerate() {
                assert_mean(mean, expected[n][patch], &format!("{what} n = {n}"));
            }
        }
    }
}

/// Irradiance over pi at `p` with normal `n` from a polygon of radiance 1 above the horizon (Lambert 1760).
fn lambert(p: DVec3, n: DVec3, polygon: &[DVec3]) -> f64 {
    let edges = (0..polygon.len()).map(|i| {
        let a = (polygon[i] - p).normalize();
        let b = (polygon[(i + 1) % polygon.len()] - p).normalize();
        a.dot(b).acos() * a.cross(b).normalize().dot(n)
    });
    (edges.sum::<f64>() / TAU).abs()
}

/// A floor, a rectangle that shines down on it, and a board between them; in unit coordinates at once.
fn lamp_over_floor() -> (Scene, [DVec3; 4]) {
    let lamp = [(-0.3, -0.2), (-0.3, 0.2), (0.3, 0.2), (0.3, -0.2)];
    let quad = |corners: [(f64, f64); 4], z: f64| corners.map(|(x, y)| DVec3::new(x, y, z));
    let floor = quad([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)], -0.25);
    let board = quad([(-0.2, -0.5), (0.4, -0.5), (0.4, 0.5), (-0.2, 0.5)], 0.1);
    let lamp = quad(lamp, 0.25);
    let vertices = [floor, lamp, board].concat();
    let faces = [0, 4, 8].map(|k| (vec![k, k + 1, k + 2, k + 3], k / 4));
    let materials = vec![
        Material::new("floor", Rgb::new(0.6, 0.3, 0.9), Rgb::ZERO),
        Material::new("lamp", Rgb::ZERO, Rgb::splat(3.0)),
        Material::new("board", Rgb::splat(0.5), Rgb::ZERO),
    ];
    let mut scene = Scene::from_faces("lamp", &vertices, &faces, materials).unwrap();
    let (eye, target) = (DVec3::new(0.0, -0.95, 0.05), DVec3::new(0.1, -0.2, -0.25));
    scene.camera = Camera::look_at(eye, target, DVec3::Z, 20.0).unwrap();
    (scene, lamp)
}

/// The exact picture of the floor in local mode: the closed form averaged over 8 by 8 points of each pixel's box.
fn exact_floor(scene: &Scene, lamp: &[DVec3; 4], size: usize) -> Vec<f64> {
    let fine = 8 * size;
    let mut pixels = vec![0.0; size * size];
    for i in 0..fine * fine {
        let (x, y) = (i % fine, i / fine);
        let share = |k: usize| (k as f32 + 0.5) / fine as f32;
        let (origin, way) = scene.camera.ray(share(x), share(y), 1.0);
        let (origin, way) = (origin.as_dvec3(), way.as_dvec3());
        let point = origin + way * ((-0.25 - origin.z) / way.z);
        assert!(way.z < 0.0 && point.abs().max_element() < 1.0);
        pixels[(y / 8) * size + x / 8] += 3.0 * lambert(point, DVec3::Z, lamp) / 64.0;
    }
    pixels
}

#[test]
fn local_mode_is_lamberts_polygon() {
    let (scene, lamp) = lamp_over_floor();
    let rays = Rays::new(&scene);
    let size = 24;
    let exact = exact_floor(&scene, &lamp, size);
    let rho = Vec3::new(0.6, 0.3, 0.9);
    for next_event in BOTH {
        let transport = Mode::Local.transport();
        let tracer = traced(&scene, &rays, transport, (size, 512), &settings(next_event));
        let (mean, count) = (tracer.mean(), exact.len() as f64);
        let expected = exact.iter().sum::<f64>() / count;
        for c in 0..3 {
            let apart = mean.value[c] - expected * f64::from(rho[c]);
            assert!(apart.abs() < 4.0 * mean.error[c], "{next_event:?} {c}: {apart} {mean:?}");
        }
        // Pixel by pixel: the mean of z² is 1 with variance 2/N.
        let (picture, error) = (tracer.picture(), tracer.standard_error().unwrap());
        let z2 = (0..exact.len()).map(|i| {
            let apart = f64::from(picture.pixels[i].x) - exact[i] * f64::from(rho.x);
            (apart / f64::from(error.pixels[i].x)).powi(2)
        });
        let z2 = z2.sum::<f64>() / count;
        assert!((z2 - 1.0).abs() < 4.0 * (2.0 / count).sqrt(), "{next_event:?}: {z2}");
    }
}

/// Surfaces that reflect everything: every order is E, and `max_bounces` cuts every path.
#[test]
fn cut_series_are_the_sum_up_to_the_cut() {
    let mut scene = load("furnace");
    scene.materials[0].rho = Rgb::ONE;
    let emission = f64::from(scene.materials[0].emission.x);
    let rays = Rays::new(&scene);
    for next_event in BOTH {
        let settings = TraceSettings { max_bounces: 12, ..settings(next_event) };
        let tracer = traced(&scene, &rays, Mode::Global.transport(), (8, 64), &settings);
        assert_mean(&tracer.mean(), 13.0 * emission, "total");
        assert_mean(&tracer.means()[KEPT], 4.0 * emission, "orders 9 to 12");
        assert_eq!((tracer.counts().cut, tracer.check()), (64 * 64, Ok(())));
    }
}

/// At rho = 1 and tau = 1 the spectral radius is above 1.2: 1.2^1000 is beyond f32.
#[test]
fn light_that_overflows_is_an_error() {
    let (scene, _) = concentric_spheres(0.5, 1.0, [1.0, 1.0]);
    let rays = Rays::new(&scene);
    let settings = TraceSettings { max_bounces: 1000, ..TraceSettings::default() };
    let tracer = traced(&scene, &rays, Mode::Shadowless.transport(), (4, 4), &settings);
    assert!(tracer.check().is_err());
}
