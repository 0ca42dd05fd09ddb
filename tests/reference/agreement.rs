//! The tracer against another program's Cornell box, and against itself: other seeds, threads, and ways to find light.

use std::path::Path;

use glam::{DVec3, Vec3};
use halflight::light::{Mode, Rgb, Transport, Visibility};
use halflight::pictures::{Picture, read_picture};
use halflight::rays::Rays;
use halflight::scene::{Face, Material, Scene, Sides};
use halflight_reference::{KEPT, Mean, NextEvent, TraceSettings};

use crate::reference::{BOTH, load, settings, traced};

fn assert_same(a: &Mean, b: &Mean, what: &str) {
    for c in 0..3 {
        let error = a.error[c].hypot(b.error[c]);
        let apart = (a.value[c] - b.value[c]).abs();
        assert!(apart <= 4.0 * error + 1e-6 * a.value[c], "{what}, channel {c}: {a:?} {b:?}");
    }
}

#[test]
fn without_interreflection_the_series_ends_exactly() {
    let scene = load("cornell-box");
    let rays = Rays::new(&scene);
    for mode in [Mode::OneBounce, Mode::Local] {
        for next_event in BOTH {
            let tracer = traced(&scene, &rays, mode.transport(), (16, 32), &settings(next_event));
            assert!(tracer.mean().value[0] > 0.0);
            for n in 2..=KEPT {
                let bounce = tracer.bounce(n).unwrap();
                assert!(bounce.pixels.iter().all(|&p| p == Rgb::ZERO), "{mode} n = {n}");
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
    scene.vertices.extend(corners.map(|(x, z)| Vec3::new(x, 0.3 + 0.2 * x, z)));
    for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
        scene.faces.push(Face {
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
    let half = Transport { alpha: 0.5, tau: 0.5 };
    let cases = [
        (load("cornell-box"), Mode::Global.transport()),
        (load("cornell-box"), Mode::Shadowless.transport()),
        (load("cornell-box"), half),
        (hybrid_box(), Mode::Global.transport()),
        (hybrid_box(), half),
    ];
    for (scene, transport) in cases {
        let rays = Rays::new(&scene);
        let [on, off] = [(NextEvent::On, 256), (NextEvent::Off, 1024)].map(|(next_event, samples)| {
            let tracer = traced(&scene, &rays, transport, (24, samples), &settings(next_event));
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
                let settings = TraceSettings { seed, ..settings(next_event) };
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
            let errors = runs.iter().map(|(_, se)| se.pixels[i].as_dvec3().length_squared());
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
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut tracer = traced(&scene, &rays, Mode::Global.transport(), (16, 8), &settings(NextEvent::On));
            tracer.pass(8);
            (tracer.picture(), tracer.standard_error(), tracer.bounce(3), tracer.counts())
        })
    });
    assert_eq!(pictures[0], pictures[1]);
    assert_eq!(pictures[0].3.paths, 16 * 16 * 16);
}

/// Sum over the mask over its size; the standard error where `picture` holds standard errors.
fn masked(picture: &Picture, mask: &Picture, squared: bool) -> DVec3 {
    let counted: Vec<DVec3> =
        (0..mask.pixels.len()).filter(|&i| mask.pixels[i].x >= 0.5).map(|i| picture.pixels[i].as_dvec3()).collect();
    let n = counted.len() as f64;
    match squared {
        true => counted.iter().map(|se| se * se).sum::<DVec3>().map(f64::sqrt) / n,
        false => counted.iter().sum::<DVec3>() / n,
    }
}

#[test]
fn the_cornell_box_is_that_of_another_program() {
    let scene = load("cornell-box");
    let rays = Rays::new(&scene);
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/cornell");
    let read = |name: &str| read_picture(data.join(format!("{name}.exr"))).unwrap();
    let mask = read("mask");
    let tracer = traced(&scene, &rays, Mode::Global.transport(), (64, 256), &settings(NextEvent::On));
    let own = |n: usize| (tracer.bounce(n).unwrap(), tracer.bounce_error(n).unwrap());
    let total = (tracer.picture(), tracer.standard_error().unwrap());
    let bounces = (1..=4).map(|n| (format!("bounce{n}"), own(n)));
    for (name, (picture, error)) in bounces.chain([("reference".to_owned(), total)]) {
        let apart = masked(&picture, &mask, false) - masked(&read(&name), &mask, false);
        let noise = masked(&error, &mask, true);
        let reference = masked(&read(&format!("{name}_se")), &mask, true);
        for c in 0..3 {
            let error = noise[c].hypot(reference[c]);
            assert!(apart[c].abs() < 4.0 * error, "{name} {c}: {} {error}", apart[c]);
        }
    }
}
