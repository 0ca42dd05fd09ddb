//! Rays per second: closest hit, visibility and all crossings, in a small room and among half a million triangles.
//!
//! `crossover` casts the same closest hits with all faces in blocks and through the hierarchy, by number of faces.
//! `directions` makes cosine-distributed directions of Sobol points, one by one and side by side.
//! Rays are incoherent: each starts at a random point of a random face and leaves by the cosine law.
//! Ratios count, not the absolute numbers. Compare with `RUSTFLAGS='-C target-cpu=native' cargo bench --bench rays`.

mod common;

use std::f32::consts::TAU;
use std::hint::black_box;

use common::{Corners, cornell, cuboid, end, random, ray, scene_of, tessellated};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{Quat, Vec3};
use halflight::rays::sobol::Sobol;
use halflight::rays::warp::cosine_direction;
use halflight::rays::{End, FAN, Fan, Ray, Rays};

/// Rays cast in one iteration.
const BATCH: u32 = 20_000;

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
    group.sample_size(20).throughput(Throughput::Elements(u64::from(BATCH)));
    for count in [24, 48, 96, 192, 288, 384] {
        let triangles = crowded(count);
        let scene = scene_of(&triangles);
        let batch: Vec<Ray> = (0..BATCH).map(|i| ray(&triangles, i)).collect();
        for (name, many) in [("blocks", usize::MAX), ("hierarchy", 0)] {
            let rays = Rays::with_blocks(&scene, many);
            group.bench_function(BenchmarkId::new(name, count), |b| {
                b.iter(|| batch.iter().filter_map(|r| rays.closest(black_box(r))).map(|h| h.t).sum::<f32>());
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
    cast(c, "500k", &tessellated(354));
}

fn cast(c: &mut Criterion, name: &str, triangles: &[Corners]) {
    let scene = scene_of(triangles);
    let rays = Rays::new(&scene);
    let batch: Vec<Ray> = (0..BATCH).map(|i| ray(triangles, i)).collect();
    let pairs: Vec<(End, End)> = (0..BATCH).map(|i| (end(triangles, i, 0), end(triangles, i + BATCH, 4))).collect();
    let mut group = c.benchmark_group("rays");
    group.sample_size(30).throughput(Throughput::Elements(u64::from(BATCH)));
    group.bench_function(BenchmarkId::new("closest", name), |b| {
        b.iter(|| batch.iter().filter_map(|r| rays.closest(black_box(r))).map(|h| h.t).sum::<f32>());
    });
    group.bench_function(BenchmarkId::new("visible", name), |b| {
        b.iter(|| pairs.iter().filter(|&&(from, to)| rays.visible(from, to)).count());
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
    for (name, triangles) in [("cornell", cornell()), ("500k", tessellated(354))] {
        let scene = scene_of(&triangles);
        group.bench_function(name, |b| b.iter(|| Rays::new(black_box(&scene))));
    }
    group.finish();
}

criterion_group!(benches, cast_in_a_small_room, crossover, directions, cast_at_half_a_million, build);
criterion_main!(benches);
