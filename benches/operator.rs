//! K x in bytes of the matrix read per second, all six light components at once; its transpose; the bounds.
//!
//! The Cornell box in two finenesses. 256 rays a row leave the matrix about as sparse as larger scenes are.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use halflight::Solver;
use halflight::form_factors::Sampling;
use halflight::light::{Light, Mode, Rgb};
use halflight::operator::{LinearOperator, Operator, spectrum};
use halflight::render::Watch;
use halflight::scene::{LoadOptions, Scene};

struct Silent;

impl Watch for Silent {
    fn begin(&self, _: &str, _: u64) {}
    fn tick(&self, _: u64) {}
}

fn operator(patches: usize) -> Operator {
    let scene = Scene::builtin("cornell-box", LoadOptions::default());
    let scene = scene.expect("a built-in name").expect("a correct scene");
    let p = Solver::new(&scene).cut(patches);
    let sampling = Sampling { rays: 256, ..Sampling::default() };
    let modes = [Mode::Global.transport()];
    let (mut found, _) = p.assemble(&modes, &sampling, &Silent);
    found.remove(0).operator
}

fn products(c: &mut Criterion) {
    let mut group = c.benchmark_group("operator");
    group.sample_size(20);
    for patches in [4000, 16_000] {
        let k = operator(patches);
        let x = vec![Light { invisible: Rgb::ONE, visible: Rgb::ONE }; k.len()];
        group.throughput(Throughput::Bytes(k.form_factors().bytes() as u64));
        group.bench_function(BenchmarkId::new("apply", k.len()), |b| {
            b.iter(|| k.apply(black_box(&x)));
        });
        k.apply_transposed(&x);
        group.bench_function(BenchmarkId::new("apply_transposed", k.len()), |b| {
            b.iter(|| k.apply_transposed(black_box(&x)));
        });
    }
    group.finish();
}

fn bounds(c: &mut Criterion) {
    let mut group = c.benchmark_group("spectrum");
    group.sample_size(10);
    let k = operator(4000);
    group.bench_function(BenchmarkId::from_parameter(k.len()), |b| {
        b.iter(|| spectrum(black_box(&k)));
    });
    group.finish();
}

criterion_group!(benches, products, bounds);
criterion_main!(benches);
