//! How the price of a scene grows with the number of its luminaires: 10, each asked, and 1,000, linked by a tree.
//!
//! An open room of 4 by 4 by 2.4 with a box on its floor, the lamps below its ceiling and of the same area together.
//! `links` finds what lies between patches and luminaires and puts K together with few hemisphere rays, `picture`
//! renders 48 by 48 pixels of one bounce. Ratios between the two scenes count, not the absolute numbers.
//!
//! `scraps`: such a picture to 1 % with one lamp and 15 scraps of paper (30 triangles) below it, whose shadows have
//! many pieces. `one object`: to 5 % with 100 lamps that are one object, as exporters write them, above the same
//! scraps. `closed form`: Lambert's sum at 1,000 points below a panel, and below a ball of 320 faces.

use std::f64::consts::{PI, TAU};
use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use glam::{DVec3, Vec3};
use halflight::Solver;
use halflight::direct::Luminaires;
use halflight::form_factors::Sampling;
use halflight::gather::{GatherPass, GatherSampling};
use halflight::light::{Mode, Rgb};
use halflight::rays::sobol::hash;
use halflight::render::{Discretization, Silent};
use halflight::scene::{Material, Scene};
use halflight::solve::explore;

/// Width and depth of the room, and its height.
const SIDE: f64 = 4.0;
const HEIGHT: f64 = 2.4;
/// Share of a cell's sides that its lamp takes.
const LAMP: f64 = 0.4;

/// A parallelogram: a corner and its two sides, counter-clockwise.
type Quad = [[f64; 3]; 3];

/// Floor, ceiling, two walls, and three faces of a box.
const ROOM: [Quad; 7] = [
    [[0.0; 3], [SIDE, 0.0, 0.0], [0.0, SIDE, 0.0]],
    [[0.0, 0.0, HEIGHT], [0.0, SIDE, 0.0], [SIDE, 0.0, 0.0]],
    [[0.0; 3], [0.0, SIDE, 0.0], [0.0, 0.0, HEIGHT]],
    [[SIDE, 0.0, 0.0], [0.0, 0.0, HEIGHT], [0.0, SIDE, 0.0]],
    [[1.2, 1.2, 1.1], [0.9, 0.0, 0.0], [0.0, 0.9, 0.0]],
    [[1.2, 1.2, 0.0], [0.9, 0.0, 0.0], [0.0, 0.0, 1.1]],
    [[1.2, 2.1, 0.0], [0.0, 0.0, 1.1], [0.9, 0.0, 0.0]],
];

/// The room with `columns` × `rows` lamps, each its own object.
fn room(columns: u32, rows: u32) -> Discretization {
    let prepared = Solver::new(&scene(columns, rows, &[])).cut(400);
    assert_eq!(prepared.luminaires.list.len(), (columns * rows) as usize);
    prepared
}

/// Quadrangles of paper below the middle of the ceiling, turned any way.
fn paper() -> Vec<Quad> {
    let signed = |k: u32, d: u32| 2.0 * f64::from(hash(k, d)) / f64::from(u32::MAX) - 1.0;
    let side = |k: u32, d: u32| [0, 1, 2].map(|axis| 0.3 * signed(k, d + axis));
    let corner = |k: u32| [2.0 + signed(k, 0), 2.0 + signed(k, 1), 1.7 + 0.4 * signed(k, 2)];
    (0..15).map(|k| [corner(k), side(k, 3), side(k, 6)]).collect()
}

fn scene(columns: u32, rows: u32, paper: &[Quad]) -> Scene {
    let white = Material::new("white", Rgb::splat(0.7), Rgb::ZERO);
    let glow = Material::new("glow", Rgb::splat(0.5), Rgb::new(10.0, 9.0, 7.0));
    let (a, b) = (SIDE / f64::from(columns), SIDE / f64::from(rows));
    let lamp = |k: u32| -> Quad {
        let (u, v) = (f64::from(k % columns) + 0.3, f64::from(k / columns) + 0.3);
        let corner = [a * u, b * v, HEIGHT - 0.02];
        [corner, [0.0, LAMP * b, 0.0], [LAMP * a, 0.0, 0.0]]
    };
    let quads = ROOM.iter().chain(paper).map(|&q| (q, 0));
    let (mut corners, mut faces) = (Vec::new(), Vec::new());
    for (quad, material) in quads.chain((0..columns * rows).map(|k| (lamp(k), 1))) {
        let [p, u, v] = quad.map(DVec3::from);
        let first = corners.len() as u32;
        corners.extend([p, p + u, p + u + v, p + v]);
        faces.push(((first..first + 4).collect::<Vec<u32>>(), material));
    }
    let scene = Scene::from_faces("lamps", &corners, &faces, vec![white, glow]);
    let mut scene = scene.expect("a correct scene");
    for (f, face) in scene.faces.iter_mut().enumerate() {
        face.object = f as u32 / 2;
    }
    scene
}

fn scraps(c: &mut Criterion) {
    let mut group = c.benchmark_group("lamps");
    group.sample_size(10);
    let solver = Solver::new(&scene(1, 1, &paper()));
    group.bench_function("scraps", |b| {
        b.iter(|| black_box(solver.render(Mode::OneBounce, (48, 48)).tolerance(0.01).expect("a picture")))
    });
    group.finish();
}

fn one_object(c: &mut Criterion) {
    let mut group = c.benchmark_group("lamps");
    group.sample_size(10);
    let mut scene = scene(10, 10, &paper());
    let first = scene.faces.len() - 200;
    scene.faces[first..].iter_mut().for_each(|face| face.object = first as u32);
    let solver = Solver::new(&scene);
    group.bench_function("one object", |b| {
        b.iter(|| black_box(solver.render(Mode::OneBounce, (48, 48)).tolerance(0.05).expect("a picture")))
    });
    group.finish();
}

fn lamps(c: &mut Criterion) {
    let mut group = c.benchmark_group("lamps");
    group.sample_size(10);
    let sampling = Sampling { rays: 16, ..Sampling::default() };
    for (columns, rows) in [(5, 2), (40, 25)] {
        let p = room(columns, rows);
        let mode = [Mode::OneBounce.transport()];
        let count = columns * rows;
        group.bench_function(BenchmarkId::new("links", count), |b| {
            b.iter(|| black_box(p.assemble(&mode, &sampling, &Silent)))
        });
        let (modes, _) = p.assemble(&mode, &sampling, &Silent);
        let solution = explore(&modes[0].operator, 1);
        let gather = GatherSampling::with_samples(16, 0);
        group.bench_function(BenchmarkId::new("picture", count), |b| {
            b.iter(|| black_box(modes[0].picture(&solution, &GatherPass::new((48, 48), &gather), &Silent)))
        });
    }
    group.finish();
}

/// A floor under a ball of 16 meridians and 11 parallels, all of it glowing: 320 triangles.
fn ball() -> Scene {
    let white = Material::new("white", Rgb::splat(0.7), Rgb::ZERO);
    let glow = Material::new("glow", Rgb::splat(0.5), Rgb::ONE);
    let corner = |k: u32, l: u32| {
        let (s, t) = (f64::from(k % 16) / 16.0 * TAU, f64::from(l) / 11.0 * PI);
        DVec3::new(0.2 * t.sin() * s.cos(), 0.2 * t.sin() * s.sin(), 2.0 + 0.2 * t.cos())
    };
    let [p, u, v] = ROOM[0].map(DVec3::from);
    let mut corners = vec![p, p + u, p + u + v, p + v];
    corners.extend((1..11).flat_map(|l| (0..16).map(move |k| corner(k, l))));
    corners.extend([corner(0, 0), corner(0, 11)]);
    let at = |k: u32, l: u32| 4 + 16 * (l - 1) + k % 16;
    let mut faces = vec![(vec![0, 1, 2, 3], 0)];
    for k in 0..16 {
        faces.extend((1..10).map(|l| (vec![at(k, l), at(k, l + 1), at(k + 1, l + 1), at(k + 1, l)], 1)));
        faces.push((vec![164, at(k, 1), at(k + 1, 1)], 1));
        faces.push((vec![165, at(k + 1, 10), at(k, 10)], 1));
    }
    Scene::from_faces("ball", &corners, &faces, vec![white, glow]).expect("a correct scene")
}

fn closed_form(c: &mut Criterion) {
    let mut group = c.benchmark_group("lamps");
    for (name, scene) in [("panel", scene(1, 1, &[])), ("ball", ball())] {
        let luminaires = Luminaires::new(&scene);
        let at = |k: u32, d: u32| (hash(k, d) >> 8) as f32 / (1 << 24) as f32 - 0.5;
        let points: Vec<Vec3> = (0..1000).map(|k| Vec3::new(at(k, 0), at(k, 1), -0.5)).collect();
        group.bench_function(BenchmarkId::new("closed form", name), |b| {
            b.iter(|| points.iter().filter_map(|&x| luminaires.list[0].closed_form(x, Vec3::Z)).sum::<f64>())
        });
    }
    group.finish();
}

criterion_group!(benches, closed_form, lamps, scraps, one_object);
criterion_main!(benches);
