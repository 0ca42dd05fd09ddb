//! Form factors between objects: squares face to face, a wedge, polygons of many corners, and an occluded pair at three
//! tolerances.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use glam::DVec3;
use halflight::form_factors::{Bodies, Tolerance};
use halflight::scene::{Material, Scene};

/// More than any of these needs.
const WORK: usize = 10_000_000;

/// Polygons, each an object.
fn scene(polygons: &[Vec<DVec3>]) -> Scene {
    let faces = polygons.iter().scan(0, |first, polygon| {
        let n = polygon.len() as u32;
        *first += n;
        Some(((*first - n..*first).collect(), 0))
    });
    let grey = Material::new("grey", glam::Vec3::splat(0.5), glam::Vec3::ZERO);
    let faces: Vec<(Vec<u32>, u32)> = faces.collect();
    let mut scene = Scene::from_faces("bench", &polygons.concat(), &faces, vec![grey]).expect("a correct scene");
    scene.objects = (0..polygons.len()).map(|k| k.to_string()).collect();
    let triangles = polygons.iter().enumerate();
    let owners = triangles.flat_map(|(k, p)| std::iter::repeat_n(k as u32, p.len() - 2));
    for (face, object) in scene.faces.iter_mut().zip(owners) {
        face.object = object;
    }
    scene
}

fn square(low: f64, high: f64, z: f64) -> Vec<DVec3> {
    let p = |x: f64, y: f64| DVec3::new(x, y, z);
    vec![p(low, low), p(high, low), p(high, high), p(low, high)]
}

fn disc(corners: usize, radius: f64, z: f64) -> Vec<DVec3> {
    let at = |k: usize| std::f64::consts::TAU * k as f64 / corners as f64;
    let corner = |k: usize| DVec3::new(radius * at(k).cos(), radius * at(k).sin(), z);
    (0..corners).map(corner).collect()
}

fn turned(mut polygon: Vec<DVec3>) -> Vec<DVec3> {
    polygon.reverse();
    polygon
}

fn pairs(c: &mut Criterion) {
    let floor = square(0.0, 1.0, 0.0);
    let wedge = vec![DVec3::ZERO, DVec3::Y, DVec3::new(0.9, 1.0, 0.1), DVec3::new(0.9, 0.0, 0.1)];
    let plate = square(0.25, 0.75, 0.5);
    let cases = [
        ("squares", vec![floor.clone(), turned(square(0.0, 1.0, 1.0))], 1e-4),
        ("squares, gap 1e-6", vec![floor.clone(), turned(square(0.0, 1.0, 1e-6))], 1e-4),
        ("wedge", vec![floor.clone(), wedge], 1e-4),
        ("64-gons", vec![disc(64, 1.0, 0.0), turned(disc(64, 0.5, 1.0))], 1e-4),
        ("occluded, 1e-2", vec![floor.clone(), turned(square(0.0, 1.0, 1.0)), plate.clone()], 1e-2),
        ("occluded, 1e-3", vec![floor.clone(), turned(square(0.0, 1.0, 1.0)), plate.clone()], 1e-3),
        ("occluded, 1e-4", vec![floor, turned(square(0.0, 1.0, 1.0)), plate], 1e-4),
    ];
    let mut group = c.benchmark_group("factors");
    group.sample_size(10);
    for (name, polygons, relative) in cases {
        let bodies = Bodies::new(&scene(&polygons), &[0.0]);
        let tolerance = Tolerance { relative, absolute: 1e-3 * relative };
        group.bench_function(name, |b| {
            b.iter(|| black_box(&bodies).factor(0, 1, &tolerance, WORK));
        });
    }
    group.finish();
}

criterion_group!(benches, pairs);
criterion_main!(benches);
