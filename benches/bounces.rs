//! Powers of the terms of the bounce series to 1 %: of a series that converges, of one that diverges through all
//! surfaces, and of a room whose later terms lie in a closet that one walk in 100,000 enters.
//!
//! One iteration solves on patches and walks until every term is near enough, or there are as many walks as are ever
//! taken (the closet). A series that diverges should cost what one that converges does, but for the surfaces that its
//! rays cross.

use criterion::{Criterion, criterion_group, criterion_main};
use halflight::Solver;
use halflight::light::Mode;
use halflight::scene::Scene;

fn terms(c: &mut Criterion) {
    let closet = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/closet/closet.toml");
    let cases = [
        ("converging", "furnished-room", Mode::Global),
        ("diverging", "furnished-room", Mode::Shadowless),
        ("closet", closet, Mode::Global),
    ];
    let mut group = c.benchmark_group("bounces");
    group.sample_size(10);
    for (name, scene, mode) in cases {
        let scene = Scene::open(scene).expect("a correct scene");
        let solver = Solver::new(&scene);
        group.bench_function(name, |b| b.iter(|| solver.bounces(mode, 8).tolerance(0.01).errors.len()));
    }
    group.finish();
}

criterion_group!(benches, terms);
criterion_main!(benches);
