//! The path tracer against closed forms, against another program's Cornell box, and against itself.
//!
//! Every comparison of means allows 4 standard errors, as the tracer reports them; the seeds are fixed. That the reported
//! errors are right is tested by their spread over seeds.

use std::f64::consts::TAU;
use std::path::Path;

use glam::{DVec3, Vec3};
use halflight::image::{Picture, read_picture};
use halflight::light::{Mode, Rgb, Transport, Visibility};
use halflight::rays::Rays;
use halflight::reference::{KEPT, Mean, NextEvent, TraceSettings, Tracer};
use halflight::scene::{Camera, LoadOptions, Material, Scene, Sides};

mod spheres;
use spheres::concentric_spheres;

const BOTH: [NextEvent; 2] = [NextEvent::On, NextEvent::Off];

fn load(name: &str) -> Scene {
    Scene::builtin(name, LoadOptions::default())
        .expect("a built-in name")
        .expect("a correct scene")
}

fn settings(next_event: NextEvent) -> TraceSettings {
    TraceSettings {
        next_event,
        ..TraceSettings::default()
    }
}

fn traced<'a>(
    scene: &Scene,
    rays: &'a Rays,
    transport: Transport,
    (size, samples): (usize, u32),
    settings: &TraceSettings,
) -> Tracer<'a> {
    let transports = scene.transports(transport);
    let mut tracer = Tracer::new(scene, rays, &transports, (size, size), settings);
    tracer.pass(samples);
    tracer
}

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

fn assert_same(a: &Mean, b: &Mean, what: &str) {
    for c in 0..3 {
        let error = a.error[c].hypot(b.error[c]);
        let apart = (a.value[c] - b.value[c]).abs();
        assert!(
            apart <= 4.0 * error + 1e-6 * a.value[c],
            "{what}, channel {c}: {a:?} {b:?}"
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
            assert_mean(
                mean,
                emission * rho.powi(n as i32),
                &format!("{what} n = {n}"),
            );
        }
    }
}

#[test]
fn the_furnace_glows_evenly() {
    let furnace = load("furnace");
    assert_furnace(&furnace, Mode::Global.transport(), 0.5, 0.5);
    // A convex room has one crossing a ray: tau changes nothing.
    assert_furnace(&furnace, Mode::Shadowless.transport(), 0.5, 0.5);
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
        let visible = [
            rho * invisible[1],
            rho * (q * invisible[0] + through * invisible[1]),
        ];
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
    let transport = Transport {
        alpha: 0.5,
        tau: 0.5,
    };
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
            assert!(
                apart.abs() < 4.0 * mean.error[c],
                "{next_event:?} {c}: {apart} {mean:?}"
            );
        }
        // Pixel by pixel: the mean of z² is 1 with variance 2/N.
        let (picture, error) = (tracer.picture(), tracer.standard_error().unwrap());
        let z2 = (0..exact.len()).map(|i| {
            let apart = f64::from(picture.pixels[i].x) - exact[i] * f64::from(rho.x);
            (apart / f64::from(error.pixels[i].x)).powi(2)
        });
        let z2 = z2.sum::<f64>() / count;
        assert!(
            (z2 - 1.0).abs() < 4.0 * (2.0 / count).sqrt(),
            "{next_event:?}: {z2}"
        );
    }
}

#[test]
fn without_interreflection_the_series_ends_exactly() {
    let scene = load("cornell-box");
    let rays = Rays::new(&scene);
    for mode in [Mode::OneBounce, Mode::Local] {
        for next_event in BOTH {
            let tracer = traced(
                &scene,
                &rays,
                mode.transport(),
                (16, 32),
                &settings(next_event),
            );
            assert!(tracer.mean().value[0] > 0.0);
            for n in 2..=KEPT {
                let bounce = tracer.bounce(n).unwrap();
                assert!(
                    bounce.pixels.iter().all(|&p| p == Rgb::ZERO),
                    "{mode} n = {n}"
                );
            }
            assert_eq!(tracer.counts().cut, 0);
        }
    }
}

/// Lets light through the blocks, hides the lamp, and hangs an emitting board with two sides into the box.
fn hybrid_box() -> Scene {
    let mut scene = load("cornell-box");
    let first = scene.vertices.len() as u32;
    let lamp = Material {
        sides: Sides::Two,
        tau: Some(0.5),
        ..Material::new("board", Rgb::splat(0.4), Rgb::new(1.0, 2.0, 3.0))
    };
    let corners = [(-0.4, 0.2), (0.1, 0.2), (0.1, 0.6), (-0.4, 0.6)];
    scene
        .vertices
        .extend(corners.map(|(x, z)| Vec3::new(x, 0.3 + 0.2 * x, z)));
    for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
        scene.faces.push(halflight::scene::Face {
            vertices: [first + a, first + b, first + c],
            material: scene.materials.len() as u32,
            object: 0,
        });
    }
    for material in &mut scene.materials {
        match material.name.as_str() {
            "light" => material.visibility = Visibility::Hidden,
            "red" => (material.alpha, material.tau) = (Some(0.2), Some(1.0)),
            _ => {}
        }
    }
    scene.materials.push(lamp);
    scene
}

#[test]
fn with_and_without_next_event_estimation_every_bounce_agrees() {
    let half = Transport {
        alpha: 0.5,
        tau: 0.5,
    };
    let cases = [
        (load("cornell-box"), Mode::Global.transport()),
        (load("cornell-box"), Mode::Shadowless.transport()),
        (load("cornell-box"), half),
        (hybrid_box(), Mode::Global.transport()),
        (hybrid_box(), half),
    ];
    for (scene, transport) in cases {
        let rays = Rays::new(&scene);
        let [on, off] =
            [(NextEvent::On, 256), (NextEvent::Off, 1024)].map(|(next_event, samples)| {
                let tracer = traced(
                    &scene,
                    &rays,
                    transport,
                    (24, samples),
                    &settings(next_event),
                );
                (tracer.mean(), tracer.means())
            });
        assert_same(&on.0, &off.0, &transport.label());
        for (n, (a, b)) in on.1.iter().zip(&off.1).enumerate() {
            assert_same(a, b, &format!("{} n = {n}", transport.label()));
        }
    }
}

/// Over 24 seeds of 256 pixels a ratio of variances is known to a few percent, heavy tails included.
#[test]
fn standard_errors_are_the_spread_over_seeds() {
    let scene = load("cornell-box");
    let rays = Rays::new(&scene);
    for (next_event, samples) in [(NextEvent::On, 32), (NextEvent::Off, 256)] {
        let runs: Vec<(Picture, Picture)> = (0..24)
            .map(|seed| {
                let settings = TraceSettings {
                    seed,
                    ..settings(next_event)
                };
                let mode = Mode::Global.transport();
                let mut tracer = traced(&scene, &rays, mode, (16, samples / 2), &settings);
                tracer.pass(samples / 2);
                (tracer.picture(), tracer.standard_error().unwrap())
            })
            .collect();
        let count = runs.len() as f64;
        let (mut spread, mut reported) = (0.0, 0.0);
        for i in 0..256 {
            let values = || runs.iter().map(|(p, _)| p.pixels[i].as_dvec3());
            let mean = values().sum::<DVec3>() / count;
            spread += values().map(|v| (v - mean).length_squared()).sum::<f64>() / (count - 1.0);
            let errors = runs
                .iter()
                .map(|(_, se)| se.pixels[i].as_dvec3().length_squared());
            reported += errors.sum::<f64>() / count;
        }
        let ratio = (spread / reported).sqrt();
        assert!((ratio - 1.0).abs() < 0.3, "{next_event:?}: {ratio}");
    }
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let scene = hybrid_box();
    let rays = Rays::new(&scene);
    let pictures = [1, 2].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let mut tracer = traced(
                &scene,
                &rays,
                Mode::Global.transport(),
                (16, 8),
                &settings(NextEvent::On),
            );
            tracer.pass(8);
            (
                tracer.picture(),
                tracer.standard_error(),
                tracer.bounce(3),
                tracer.counts(),
            )
        })
    });
    assert_eq!(pictures[0], pictures[1]);
    assert_eq!(pictures[0].3.paths, 16 * 16 * 16);
}

/// Surfaces that reflect everything: every order is E, and `max_bounces` cuts every path.
#[test]
fn cut_series_are_the_sum_up_to_the_cut() {
    let mut scene = load("furnace");
    scene.materials[0].rho = Rgb::ONE;
    let rays = Rays::new(&scene);
    for next_event in BOTH {
        let settings = TraceSettings {
            max_bounces: 12,
            ..settings(next_event)
        };
        let tracer = traced(&scene, &rays, Mode::Global.transport(), (8, 64), &settings);
        assert_mean(&tracer.mean(), 13.0 * 0.5, "total");
        assert_mean(&tracer.means()[KEPT], 4.0 * 0.5, "orders 9 to 12");
        assert_eq!((tracer.counts().cut, tracer.check()), (64 * 64, Ok(())));
    }
}

/// At rho = 1 and tau = 1 the spectral radius is above 1.2: 1.2^1000 is beyond f32.
#[test]
fn light_that_overflows_is_an_error() {
    let (scene, _) = concentric_spheres(0.5, 1.0, [1.0, 1.0]);
    let rays = Rays::new(&scene);
    let settings = TraceSettings {
        max_bounces: 1000,
        ..TraceSettings::default()
    };
    let tracer = traced(
        &scene,
        &rays,
        Mode::Shadowless.transport(),
        (4, 4),
        &settings,
    );
    assert!(tracer.check().is_err());
}

/// Sum over the mask over its size; the standard error where `picture` holds standard errors.
fn masked(picture: &Picture, mask: &Picture, squared: bool) -> DVec3 {
    let counted: Vec<DVec3> = (0..mask.pixels.len())
        .filter(|&i| mask.pixels[i].x >= 0.5)
        .map(|i| picture.pixels[i].as_dvec3())
        .collect();
    let n = counted.len() as f64;
    match squared {
        true => {
            counted
                .iter()
                .map(|se| se * se)
                .sum::<DVec3>()
                .map(f64::sqrt)
                / n
        }
        false => counted.iter().sum::<DVec3>() / n,
    }
}

#[test]
fn the_cornell_box_is_that_of_another_program() {
    let scene = load("cornell-box");
    let rays = Rays::new(&scene);
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/cornell");
    let read = |name: &str| read_picture(&data.join(format!("{name}.exr"))).unwrap();
    let mask = read("mask");
    let tracer = traced(
        &scene,
        &rays,
        Mode::Global.transport(),
        (64, 256),
        &settings(NextEvent::On),
    );
    let own = |n: usize| (tracer.bounce(n).unwrap(), tracer.bounce_error(n).unwrap());
    let total = (tracer.picture(), tracer.standard_error().unwrap());
    let bounces = (1..=4).map(|n| (format!("bounce{n}"), own(n)));
    for (name, (picture, error)) in bounces.chain([("reference".to_owned(), total)]) {
        let apart = masked(&picture, &mask, false) - masked(&read(&name), &mask, false);
        let noise = masked(&error, &mask, true);
        let reference = masked(&read(&format!("{name}_se")), &mask, true);
        for c in 0..3 {
            let error = noise[c].hypot(reference[c]);
            assert!(
                apart[c].abs() < 4.0 * error,
                "{name} {c}: {} {error}",
                apart[c]
            );
        }
    }
}
