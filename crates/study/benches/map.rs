//! The stability map against the bounce series: their ratio is what counts, not the absolute numbers.
//!
//! `map` is 21 by 21 points of the furnished room; `bounces` is what `halflight bounces` does there: four modes, eight
//! terms each, and their pictures of 160 by 160 pixels.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use halflight::Solver;
use halflight::form_factors::Sampling;
use halflight::gather::{GatherPass, GatherSampling};
use halflight::light::Mode;
use halflight::render::Silent;
use halflight::scene::Scene;
use halflight::solve::explore;
use halflight::study::map::map;
use halflight::study::{bounce_fields, bounce_pictures};

const PATCHES: usize = 4000;

fn scene() -> Scene {
    Scene::open("furnished-room").expect("it is built in")
}

fn compare(c: &mut Criterion) {
    let mut group = c.benchmark_group("furnished-room");
    group.sample_size(10);
    group.bench_function("map 21x21", |b| {
        b.iter(|| {
            let prepared = Solver::new(&scene()).cut(PATCHES);
            black_box(map(&prepared, 21, &Sampling::default(), &Silent))
        })
    });
    group.bench_function("bounces", |b| b.iter(bounces));
    group.finish();
}

fn bounces() {
    let prepared = Solver::new(&scene()).cut(PATCHES);
    let transports = Mode::ALL.map(Mode::transport);
    let (modes, _) = prepared.assemble(&transports, &Sampling::default(), &Silent);
    let sampling = GatherSampling::with_samples(128, 0);
    for mode in &modes {
        let solution = explore(&mode.operator, 8);
        black_box(bounce_pictures(
            &mode.lights,
            &bounce_fields(&mode.lights, &solution, 8),
            &GatherPass::new((160, 160), &sampling),
            &Silent,
        ));
    }
}

criterion_group!(benches, compare);
criterion_main!(benches);
