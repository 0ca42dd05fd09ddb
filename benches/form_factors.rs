//! Rows of F per second: the Cornell box opaque (first hit only), with all crossings, and light as emitted.
//!
//! The default numbers of rays: hemisphere rays a row, and visibility rays a row and luminaire.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use halflight::Solver;
use halflight::direct::{Lights, Occlusion};
use halflight::form_factors::{Sampling, Variant, cast};
use halflight::light::Transport;
use halflight::render::Discretization;
use halflight::scene::{LoadOptions, Scene};

/// Patches, and so rows.
const PATCHES: usize = 1000;

fn cornell() -> Discretization {
    let scene = Scene::builtin("cornell-box", LoadOptions::default());
    let scene = scene.expect("a built-in name").expect("a correct scene");
    Solver::new(&scene).cut(PATCHES)
}

/// All rows and columns under these taus.
fn variants(p: &Discretization, taus: &[f32]) -> Vec<Variant> {
    let n = p.patches.len();
    let variant = |&tau: &f32| Variant {
        tau: vec![tau; p.geometry.scene.materials.len()],
        rows: vec![true; n],
        columns: vec![true; n],
    };
    taus.iter().map(variant).collect()
}

fn rows(c: &mut Criterion) {
    let p = cornell();
    let sampling = Sampling::default();
    let mut group = c.benchmark_group("form_factors");
    group.sample_size(10).throughput(Throughput::Elements(p.patches.len() as u64));
    for (name, taus) in
        [("opaque", &[0.0][..]), ("all crossings", &[1.0]), ("four taus at once", &[0.0, 0.25, 0.5, 1.0])]
    {
        let variants = variants(&p, taus);
        group.bench_function(name, |b| {
            b.iter(|| cast(&p.geometry.rays, &p.patches, black_box(&variants), &sampling, &|_| ()));
        });
    }
    let receives = vec![true; p.patches.len()];
    let opaque = p.geometry.scene.transports(Transport { alpha: 1.0, tau: 0.0 });
    let by_rays = |occlusion| {
        let lights = Lights::by_rays(&p.geometry, &p.patches, &p.luminaires, opaque.clone());
        lights.occluded_by(occlusion)
    };
    for (name, lights) in [
        ("emitted, shadows by rays", by_rays(Occlusion::Opaque)),
        ("emitted, shadows cut out", Lights::new(&p.geometry, &p.patches, &p.luminaires, opaque.clone(), 5e-4)),
        ("emitted, nothing occludes", by_rays(Occlusion::Nothing)),
    ] {
        group.bench_function(name, |b| {
            b.iter(|| black_box(&lights).receive_emitted(&receives, &sampling, &|_| ()));
        });
    }
    group.finish();
}

criterion_group!(benches, rows);
criterion_main!(benches);
