//! The gather pass alone: one solution, looked at with the same rays for every pixel, and to two errors.
//!
//! The Cornell box, the furnished room and the textured room of the tests, global mode, 96 by 96 pixels, 4000 patches.
//! F and the solution are made once, before the clock runs. `picture` is all of the pass; `direct` is the same with
//! patches that send nothing, so that only camera rays and light as emitted are left: the difference is what
//! hemisphere rays, irradiance points and their fit cost. `direct` asks its error of direct light alone and `picture`
//! shares it among all parts, so the two compare exactly only with the same rays for every pixel. Ratios count,
//! between two builds or two lines, not the absolute numbers. `residual` is what comes before the pass: paths that
//! measure the light on patches.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use halflight::Solver;
use halflight::error::ImportancePaths;
use halflight::form_factors::Sampling;
use halflight::gather::{GatherPass, GatherSampling, Gathering, Limit, Told, gather};
use halflight::light::{Mode, Rgb};
use halflight::pictures::Size;
use halflight::reading::{Fields, View};
use halflight::render::{Assembled, Discretization, Silent};
use halflight::scene::Scene;
use halflight::solve::{Settings, Solution, neumann};

/// Pixels across and down.
const SIZE: Size = Size { width: 96, height: 96 };
const PATCHES: usize = 4000;
/// A room with images on its surfaces, of some texels a pixel.
const TEXTURED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/textured/room.toml");
/// Errors of the gather pass asked for, as shares of the picture.
const ERRORS: [f64; 2] = [0.02, 0.01];

/// A scene and its solution.
struct Solved {
    prepared: Discretization,
    mode: Assembled,
    solution: Solution,
}

fn solve(name: &str) -> Solved {
    let scene = Scene::open(name).expect("it is built in, or with the tests");
    let prepared = Solver::new(&scene).cut(PATCHES);
    let transports = [Mode::Global.transport()];
    let (mut modes, _) = prepared.assemble(&transports, &Sampling::default(), &Silent);
    let mode = modes.remove(0);
    let solution = neumann(&mode.operator, &Settings::default()).expect("it converges");
    Solved { prepared, mode, solution }
}

/// What is timed, with its name: 128 hemisphere rays a pixel, and each error.
fn gatherings() -> Vec<(String, Gathering)> {
    let uniform = Gathering::Uniform(GatherSampling::with_samples(128, 0));
    let within = |error: f64| {
        let name = format!("within {} %", 100.0 * error);
        (name, Gathering::Within { error, camera: 0.25, seed: 0, limit: Limit::NONE })
    };
    let uniform = std::iter::once(("uniform".to_string(), uniform));
    uniform.chain(ERRORS.map(within)).collect()
}

impl Solved {
    fn view(&self) -> View<'_> {
        View::new(&self.mode.lights, SIZE)
    }
}

fn pass(c: &mut Criterion) {
    for name in ["cornell-box", "furnished-room", TEXTURED] {
        let solved = solve(name);
        let (p, mode, solution) = (&solved.prepared, &solved.mode, &solved.solution);
        let dark = Fields::new(&[vec![Rgb::ZERO; p.patches.len()]]);
        let mut group = c.benchmark_group(if name == TEXTURED { "textured room" } else { name });
        group.sample_size(10);
        for (how, gathering) in gatherings() {
            group.bench_function(BenchmarkId::new("picture", &how), |b| {
                b.iter(|| black_box(mode.picture(solution, &GatherPass::new(SIZE, gathering), &Silent)))
            });
            group.bench_function(BenchmarkId::new("direct", &how), |b| {
                b.iter(|| black_box(gather(&solved.view(), &dark, &gathering, &Told::NOBODY)))
            });
        }
        group.finish();
    }
}

/// F, solution and picture to an error, small: most of it goes to patches.
fn patches(c: &mut Criterion) {
    let mut group = c.benchmark_group("furnished-room to 1 %");
    group.sample_size(10);
    let scene = Scene::open("furnished-room").expect("it is built in");
    group.bench_function("to the tolerance", |b| {
        b.iter(|| {
            let found = Solver::new(&scene).render(Mode::Global, (32, 32)).tolerance(0.01);
            black_box(found.expect("it converges").patches)
        })
    });
    let rays = Sampling { rays: 256, ..Sampling::default() };
    group.bench_function("11500 of one size", |b| {
        b.iter(|| {
            let p = Solver::new(&scene).cut(11_500);
            let (modes, _) = p.assemble(&[Mode::Global.transport()], &rays, &Silent);
            black_box(neumann(&modes[0].operator, &Settings::default()).is_ok())
        })
    });
    group.finish();
}

/// A picture of the textured room, whose screen is a textured luminaire, to errors: nodes of its closed form are as
/// near as the error asks.
fn textured(c: &mut Criterion) {
    let mut group = c.benchmark_group("textured room to an error");
    group.sample_size(10);
    for tolerance in ERRORS {
        group.bench_function(BenchmarkId::from_parameter(tolerance), |b| {
            let solver = Solver::new(&Scene::open(TEXTURED).expect("it is with the tests"));
            b.iter(|| {
                let found = solver.render(Mode::Global, SIZE).tolerance(tolerance);
                black_box(found.expect("it converges").rays)
            })
        });
    }
    group.finish();
}

/// Paths that measure the residual of light on patches, 16 of every pixel.
fn residual(c: &mut Criterion) {
    let mut group = c.benchmark_group("residual");
    group.sample_size(10);
    for name in ["cornell-box", "furnished-room", "two-rooms"] {
        let solved = solve(name);
        let mut view = solved.view();
        (view.width, view.height) = (64, 64);
        let pixels = view.width * view.height;
        let traced = || {
            let mut paths = ImportancePaths::new(&view, vec![1.0; pixels], 7);
            paths.extend(&view, 16);
            paths
        };
        group.bench_function(BenchmarkId::from_parameter(name), |b| b.iter(|| black_box(traced().rays)));
    }
    group.finish();
}

criterion_group!(benches, pass, patches, textured, residual);
criterion_main!(benches);
