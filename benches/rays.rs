//! Rays per second: closest hit, visibility and all crossings, in a small room and among half a million triangles.
//!
//! `crossover` casts the same closest hits with all faces in blocks and through the hierarchy, by number of faces.
//! `directions` makes cosine-distributed directions of Sobol points, one by one and side by side.
//! Rays are incoherent: each starts at a random point of a random face and leaves by the cosine law.
//! Ratios count, not the absolute numbers. Compare with `RUSTFLAGS='-C target-cpu=native' cargo bench --bench rays`.

use std::f32::consts::TAU;
use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{DVec3, Quat, Vec3};
use halflight::light::{Rgb, Visibility};
use halflight::rays::cosine::{cosine_direction, triangle_point};
use halflight::rays::sequence::{Sobol, hash};
use halflight::rays::{End, FAN, Fan, Ray, Rays};
use halflight::scene::{Camera, Face, Material, Scene, Sides, UnitFrame};

type Corners = [Vec3; 3];

/// Rays cast in one iteration.
const BATCH: u32 = 20_000;

/// The twelve triangles of a box, facing outwards for `sign` 1 and inwards for -1.
fn cuboid(center: Vec3, half: Vec3, turn: Quat, sign: f32) -> Vec<Corners> {
    let mut triangles = Vec::new();
    for (axis, side) in [
        (0, -1.0),
        (0, 1.0),
        (1, -1.0),
        (1, 1.0),
        (2, -1.0),
        (2, 1.0),
    ] {
        let corner = |i: f32, j: f32| {
            let mut p = Vec3::ZERO;
            p[axis] = side;
            p[(axis + 1) % 3] = i;
            p[(axis + 2) % 3] = j * side * sign;
            center + turn * (p * half)
        };
        let [a, b, c, d] = [
            corner(-1., -1.),
            corner(1., -1.),
            corner(1., 1.),
            corner(-1., 1.),
        ];
        triangles.extend([[a, b, c], [a, c, d]]);
    }
    triangles
}

/// A room with two boxes and a lamp: 38 triangles in the proportions of the Cornell box.
fn cornell() -> Vec<Corners> {
    let about = |angle| Quat::from_rotation_y(angle);
    let lamp = [(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)];
    let [a, b, c, d] = lamp.map(|(x, z)| Vec3::new(x, 0.999, z));
    [
        cuboid(Vec3::ZERO, Vec3::ONE, Quat::IDENTITY, -1.0),
        cuboid(
            Vec3::new(0.33, -0.7, 0.38),
            Vec3::splat(0.3),
            about(-0.3),
            1.0,
        ),
        cuboid(
            Vec3::new(-0.33, -0.4, -0.28),
            Vec3::new(0.3, 0.6, 0.3),
            about(0.3),
            1.0,
        ),
        vec![[a, b, c], [a, c, d]],
    ]
    .concat()
}

/// A point of a sphere with ripples; `i` around, `j` from pole to pole.
fn ripple(i: u32, j: u32, n: u32) -> Vec3 {
    let (phi, theta) = (
        TAU * (i % (2 * n)) as f32 / (2 * n) as f32,
        0.5 * TAU * j as f32 / n as f32,
    );
    let radius = 0.6 + 0.03 * (9.0 * phi).sin() * (7.0 * theta).sin() * theta.sin();
    let rim = if j == 0 || j == n { 0.0 } else { theta.sin() };
    radius * Vec3::new(rim * phi.cos(), rim * phi.sin(), theta.cos())
}

/// A rippled sphere of about 500,000 triangles in a room.
fn half_a_million() -> Vec<Corners> {
    let n = 354;
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

fn scene_of(triangles: &[Corners]) -> Scene {
    let faces = (0..triangles.len() as u32).map(|f| Face {
        vertices: [3 * f, 3 * f + 1, 3 * f + 2],
        material: 0,
        object: 0,
    });
    let grey = Material {
        name: "grey".into(),
        rho: Rgb::splat(0.5),
        emission: Rgb::ZERO,
        visibility: Visibility::Seen,
        alpha: None,
        tau: None,
        sides: Sides::One,
    };
    Scene {
        name: "bench".into(),
        vertices: triangles.concat(),
        faces: faces.collect(),
        exact: Vec::new(),
        materials: vec![grey],
        objects: vec!["all".into()],
        camera: Camera {
            position: Vec3::ZERO,
            forward: Vec3::NEG_Z,
            right: Vec3::X,
            up: Vec3::Y,
            vertical_fov: 60.0,
        },
        frame: UnitFrame {
            center: DVec3::ZERO,
            scale: 1.0,
        },
        transport: None,
        warnings: Vec::new(),
    }
}

fn random(index: u32, use_of: u32) -> f32 {
    (hash(index, use_of) >> 8) as f32 / 16_777_216.0
}

/// A random point of a random face; half of them on the first 38 faces, the room's.
fn end(triangles: &[Corners], index: u32, use_of: u32) -> End {
    let among = if index.is_multiple_of(2) {
        triangles.len().min(38)
    } else {
        triangles.len()
    };
    let face = (random(index, use_of) * among as f32) as usize;
    let [u1, u2] = [1, 2].map(|k| random(index, use_of + k));
    (triangle_point(triangles[face], u1, u2), Some(face as u32))
}

fn ray(triangles: &[Corners], index: u32) -> Ray {
    let (origin, source) = end(triangles, index, 0);
    let [a, b, c] = triangles[source.map_or(0, |f| f as usize)];
    let normal = (b - a).cross(c - a).normalize();
    Ray {
        origin,
        direction: cosine_direction(normal, random(index, 8), random(index, 9)),
        source,
    }
}

/// A room full of small boxes, at most `count` triangles.
fn crowded(count: usize) -> Vec<Corners> {
    let boxes = (0..(count / 12 - 1) as u32).flat_map(|i| {
        let at = |k: u32| 1.6 * random(i, k) - 0.8;
        let center = Vec3::new(at(20), at(21), at(22));
        let turn = Quat::from_rotation_y(TAU * random(i, 23));
        cuboid(center, Vec3::splat(0.1 + 0.1 * random(i, 24)), turn, 1.0)
    });
    let mut triangles = cuboid(Vec3::ZERO, Vec3::ONE, Quat::IDENTITY, -1.0);
    triangles.extend(boxes);
    triangles
}

fn crossover(c: &mut Criterion) {
    let mut group = c.benchmark_group("crossover");
    group
        .sample_size(20)
        .throughput(Throughput::Elements(u64::from(BATCH)));
    for count in [24, 48, 96, 192, 288, 384] {
        let triangles = crowded(count);
        let scene = scene_of(&triangles);
        let batch: Vec<Ray> = (0..BATCH).map(|i| ray(&triangles, i)).collect();
        for (name, many) in [("blocks", usize::MAX), ("hierarchy", 0)] {
            let rays = Rays::with_blocks(&scene, many);
            group.bench_function(BenchmarkId::new(name, count), |b| {
                b.iter(|| {
                    batch
                        .iter()
                        .filter_map(|r| rays.closest(black_box(r)))
                        .map(|h| h.t)
                        .sum::<f32>()
                });
            });
        }
    }
    group.finish();
}

/// Directions one by one, and a fan at a time.
fn directions(c: &mut Criterion) {
    let mut group = c.benchmark_group("directions");
    group.throughput(Throughput::Elements(u64::from(BATCH)));
    let sobol = Sobol::new(BATCH as usize + FAN, 3);
    let normal = Vec3::new(0.36, -0.48, 0.8);
    group.bench_function("one by one", |b| {
        let one = |k: u32| {
            let [u, v, w] = [0, 1, 2].map(|d| sobol.point(k, d, 7));
            cosine_direction(black_box(normal), u, v) * w
        };
        b.iter(|| (0..BATCH).map(one).sum::<Vec3>());
    });
    group.bench_function("fans", |b| {
        let fan = |k: usize| {
            let fan = Fan::new(&sobol, k as u32, 7);
            let each = (0..FAN).map(|l| fan.direction(l, black_box(normal)) * fan.third(l));
            each.sum::<Vec3>()
        };
        b.iter(|| (0..BATCH as usize).step_by(FAN).map(fan).sum::<Vec3>());
    });
    group.finish();
}

fn cast_in_a_small_room(c: &mut Criterion) {
    cast(c, "cornell", &cornell());
}

fn cast_at_half_a_million(c: &mut Criterion) {
    cast(c, "500k", &half_a_million());
}

fn cast(c: &mut Criterion, name: &str, triangles: &[Corners]) {
    let scene = scene_of(triangles);
    let rays = Rays::new(&scene);
    let batch: Vec<Ray> = (0..BATCH).map(|i| ray(triangles, i)).collect();
    let pairs: Vec<(End, End)> = (0..BATCH)
        .map(|i| (end(triangles, i, 0), end(triangles, i + BATCH, 4)))
        .collect();
    let mut group = c.benchmark_group("rays");
    group
        .sample_size(30)
        .throughput(Throughput::Elements(u64::from(BATCH)));
    group.bench_function(BenchmarkId::new("closest", name), |b| {
        b.iter(|| {
            batch
                .iter()
                .filter_map(|r| rays.closest(black_box(r)))
                .map(|h| h.t)
                .sum::<f32>()
        });
    });
    group.bench_function(BenchmarkId::new("visible", name), |b| {
        b.iter(|| {
            pairs
                .iter()
                .filter(|&&(from, to)| rays.visible(from, to))
                .count()
        });
    });
    group.bench_function(BenchmarkId::new("crossings", name), |b| {
        let mut hits = Vec::new();
        b.iter(|| {
            let count = |r| {
                rays.crossings(black_box(r), &mut hits);
                hits.len()
            };
            batch.iter().map(count).sum::<usize>()
        });
    });
    group.finish();
}

fn build(c: &mut Criterion) {
    let mut group = c.benchmark_group("build");
    group.sample_size(10);
    for (name, triangles) in [("cornell", cornell()), ("500k", half_a_million())] {
        let scene = scene_of(&triangles);
        group.bench_function(name, |b| b.iter(|| Rays::new(black_box(&scene))));
    }
    group.finish();
}

criterion_group!(
    benches,
    cast_in_a_small_room,
    crossover,
    directions,
    cast_at_half_a_million,
    build
);
criterion_main!(benches);
