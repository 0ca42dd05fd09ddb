//! Seconds before the first ray: the hierarchy, planes and hull; the patches and lamps; what lies between them.
//!
//! A rippled sphere in a room, of 10³ to 10⁶ triangles. Threads are those of the machine; set `RAYON_NUM_THREADS` for
//! fewer.

mod common;

use std::hint::black_box;

use common::{scene_of, tessellated};
use criterion::{BatchSize, BenchmarkId, Criterion, criterion_group, criterion_main};
use halflight::Solver;
use halflight::rays::Rays;

/// Segments of the sphere from pole to pole: 1,000, 10,000, 100,000, 250,000 and 1,000,000 triangles.
const SIZES: [u32; 5] = [16, 50, 158, 250, 500];

/// Patches asked for.
const PATCHES: usize = 4000;

fn ready(c: &mut Criterion) {
    let mut group = c.benchmark_group("ready");
    group.sample_size(10);
    for n in SIZES {
        let scene = scene_of(&tessellated(n));
        let faces = scene.faces.len();
        group.bench_function(BenchmarkId::new("rays", faces), |b| {
            b.iter(|| Rays::new(black_box(&scene)));
        });
        group.bench_function(BenchmarkId::new("prepare", faces), |b| {
            let own = || scene_of(&tessellated(n));
            b.iter_batched(own, |scene| Solver::new(&scene).cut(PATCHES), BatchSize::PerIteration);
        });
    }
    group.finish();
}

criterion_group!(benches, ready);
criterion_main!(benches);
