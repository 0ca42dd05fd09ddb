//! The stability map against closed forms: layer-resolved form factors, both frontiers of concentric spheres, materials
//! with numbers of their own, and the files of `halflight map`.
//!
//! Concentric spheres as in tests/spheres.rs: F12 = 1, F21 = q, F22 = 1 - q + q tau². For the squared weights of paths
//! a ray that meets the inner sphere has S = a (1 + tau²), any other S = a, so with `G = 1 - q + q tau² (1 + tau²)`
//!
//! ```text
//! M12 = a²,  M21 = a² q (1 + tau²),  M22 = a² G,     radius = a²/2 (G + sqrt(G² + 4 q (1 + tau²)))
//! ```

use glam::{DQuat, DVec3};
use halflight::Solver;
use halflight::form_factors::{Rows, Variant, cast_layers};
use halflight::light::{Rgb, Transport};
use halflight::operator::spectrum;
use halflight::render::Discretization;
use halflight::scene::Scene;
use halflight_study::map::{GridPoint, Map, at, map};

use crate::common::{Facing, Mesh, Silent, all_of_f, assemble_one, grey, sampling, transport};
use crate::run::{fields, files, halflight, place, report};

const RHO: f32 = 0.9;
const RAYS: u32 = 4096;

fn spheres() -> Discretization {
    let mut mesh = Mesh::default();
    mesh.sphere(1.0, 4, Facing::In, 0);
    mesh.sphere(0.6, 3, Facing::Out, 1);
    Solver::new(&mesh.scene(vec![grey("outer", RHO), grey("inner", RHO)])).cut(600)
}

fn area(p: &Discretization, material: u32) -> f64 {
    let pairs = p.patches.materials().iter().zip(p.patches.areas());
    pairs.filter(|(m, _)| **m == material).map(|(_, a)| a).sum()
}

/// alpha rho at which the mean diverges.
fn mean_frontier(q: f64, tau: f64) -> f64 {
    let f22 = 1.0 - q + q * tau * tau;
    2.0 / (f22 + (f22 * f22 + 4.0 * q).sqrt())
}

/// alpha rho at which the second moment does.
fn variance_frontier(q: f64, tau: f64) -> f64 {
    let s = 1.0 + tau * tau;
    let g = 1.0 - q + q * tau * tau * s;
    (2.0 / (g + (g * g + 4.0 * q * s).sqrt())).sqrt()
}

/// Allowed relative error of alpha: tests/spheres.rs derives it for the radius. The squared weights vary twice as much
/// with the share of rays that meet the inner sphere, and alpha is the root of their radius.
fn tolerance(p: &Discretization, q: f64) -> f64 {
    let outer = p.patches.materials().iter().filter(|&&m| m == 0).count() as f64;
    let noise = (q * (1.0 - q) / (outer * f64::from(RAYS))).sqrt();
    4.0 * 2.0 * noise + (0.25 * area(p, 0) / outer).powi(2)
}

#[test]
fn both_frontiers_of_concentric_spheres_are_the_closed_forms() {
    let p = spheres();
    let q = area(&p, 1) / area(&p, 0);
    let allowed = tolerance(&p, q);
    assert!(allowed < 0.005, "more than half a percent: {allowed}");
    let found = map(&p, 11, &sampling(RAYS, 1), &Silent);
    assert!(found.grey);
    assert_eq!(found.columns.len(), 11);
    for (mean, variance) in found.frontier().iter().zip(found.variance_frontier()) {
        let rho = f64::from(RHO);
        let forms = [(mean, mean_frontier(q, mean.tau)), (&variance, variance_frontier(q, variance.tau))];
        for (point, exact) in forms {
            let shown = format!("{point:?}, exactly {}", exact / rho);
            assert!(rho * point.lower <= exact * (1.0 + allowed), "{shown}");
            assert!(rho * point.upper >= exact * (1.0 - allowed), "{shown}");
            assert!((rho * point.alpha / exact - 1.0).abs() < 0.005, "{shown}");
            assert!(point.upper <= 1.001 * point.lower + 1e-5, "{shown}");
        }
        // A finite variance needs a finite mean: the frontiers meet where nothing shines through.
        assert!(variance.lower <= mean.upper * (1.0 + 1e-5));
    }
}

#[test]
fn the_frontier_reads_the_same_both_ways() {
    let p = spheres();
    let found = map(&p, 9, &sampling(256, 1), &Silent);
    assert!(!found.tau_frontier.is_empty());
    for point in &found.tau_frontier {
        // The bounds there enclose 1, or miss it by no more than their gap.
        let gap = 1e-3 * point.radius.upper;
        assert!(point.radius.lower <= 1.0 + gap && point.radius.upper >= 1.0 - gap, "{point:?}");
        let right = found.columns.partition_point(|c| c.tau < point.tau);
        let [a, b] = [&found.columns[right - 1], &found.columns[right]];
        assert!(point.alpha * a.radius.lower < 1.0 && point.alpha * b.radius.upper > 1.0);
    }
}

/// A room with two boxes in it.
fn room(materials: Vec<halflight::scene::Material>) -> Scene {
    let mut mesh = Mesh::default();
    let turn = DQuat::from_rotation_y(0.4);
    mesh.cuboid(DVec3::ZERO, DVec3::ONE, DQuat::IDENTITY, Facing::In, 0);
    mesh.cuboid(DVec3::new(0.4, -0.6, 0.2), DVec3::splat(0.35), turn, Facing::Out, 1);
    mesh.cuboid(DVec3::new(-0.4, -0.5, -0.3), DVec3::splat(0.3), turn, Facing::Out, 2);
    mesh.scene(materials)
}

fn plain() -> Scene {
    room(["a", "b", "c"].map(|name| grey(name, 0.8)).to_vec())
}

/// Entry by entry, up to the rounding of powers of tau.
fn assert_same(a: &Rows, b: &Rows) {
    for i in 0..a.len() {
        let (columns, values) = a.row(i);
        let kept: Vec<_> = columns.iter().zip(values).filter(|(_, v)| **v > 0.0).collect();
        assert_eq!(kept.len(), b.row(i).0.len(), "row {i}");
        for (&j, &value) in kept {
            let other = b.get(i, j);
            assert!((value - other).abs() <= 1e-5 * value, "({i}, {j}): {value}, {other}");
        }
    }
}

#[test]
fn layers_give_the_form_factors_of_every_tau() {
    let p = Solver::new(&plain()).cut(200);
    let all = vec![true; p.patches.len()];
    let own = [1.0; 3];
    let variant = Variant { tau: own.into(), rows: all.clone(), columns: all.clone() };
    let (layers, rays) = cast_layers(&p.geometry.rays, &p.patches, &variant, &sampling(64, 3), &|_| ());
    assert_eq!(rays, 64 * p.patches.len() as u64);
    assert!(layers.deepest() >= 4);
    for tau in [0.0, 0.3, 1.0] {
        let once = all_of_f(&p, tau, &sampling(64, 3));
        assert_same(&once.rows, &layers.form_factors(tau));
    }
    // The first moment is F times what is passed on, the second at least its square: rays with two crossings count
    // more.
    let passed = vec![0.5; p.patches.len()];
    let [f, first, second] =
        [layers.form_factors(1.0), layers.moment(1.0, &passed, 1.0), layers.moment(1.0, &passed, 2.0)];
    let sum = |m: &Rows, i: usize| -> f64 { m.row(i).1.iter().map(|&v| f64::from(v)).sum() };
    for i in 0..f.len() {
        assert!((sum(&first, i) - 0.5 * sum(&f, i)).abs() < 1e-5);
        assert!(sum(&second, i) >= sum(&first, i).powi(2) * (1.0 - 1e-5));
    }
}

#[test]
fn materials_with_their_own_numbers_are_scaled() {
    let mut materials = ["wall", "half", "glass"].map(|name| grey(name, 0.9)).to_vec();
    (materials[1].alpha, materials[1].tau) = (Some(0.5), Some(0.25));
    materials[2].tau = Some(0.75);
    let scene = room(materials);
    let p = Solver::new(&scene.clone()).cut(200);
    let found = map(&p, 5, &sampling(128, 2), &Silent);
    for GridPoint { alpha, tau, radius: bounds } in found.grid() {
        let scaled = Solver::new(&at(&scene, alpha, tau)).cut(200);
        // Every material has its own numbers now: the default does not count.
        let k = assemble_one(&scaled, Transport::default(), &sampling(128, 2));
        let once = spectrum(&k.operator).worst();
        let shown = format!("alpha {alpha} tau {tau}: {bounds:?} {once:?}");
        assert!(bounds.lower <= once.upper * 1.00001 && once.lower <= bounds.upper * 1.00001, "{shown}");
    }
}

/// Entries of F^tau are sums of powers of tau, so log radius is a convex function of log tau (Kingman), and rises.
#[test]
fn the_radius_rises_and_is_log_convex_in_tau() {
    let p = Solver::new(&plain()).cut(200);
    let found: Map = map(&p, 9, &sampling(128, 2), &Silent);
    let c = &found.columns;
    assert!(c.windows(2).all(|w| w[1].radius.upper >= w[0].radius.lower));
    for (low, middle, high) in [(1, 2, 4), (2, 4, 8)] {
        let bound = (c[low].radius.upper * c[high].radius.upper).sqrt();
        assert!(c[middle].radius.lower <= bound);
    }
}

/// One channel is not the largest everywhere: the second moment is bounded from above only, and said to be.
#[test]
fn colours_make_the_variance_frontier_a_bound() {
    let mut materials = ["a", "b", "c"].map(|name| grey(name, 0.8)).to_vec();
    materials[0].rho = Rgb::new(0.8, 0.2, 0.2);
    materials[1].rho = Rgb::new(0.2, 0.8, 0.2);
    let found = map(&Solver::new(&room(materials)).cut(100), 3, &sampling(64, 2), &Silent);
    assert!(!found.grey);
    let dark =
        map(&Solver::new(&room(["a", "b", "c"].map(|n| grey(n, 0.0)).to_vec())).cut(100), 3, &sampling(64, 2), &Silent);
    assert!(dark.frontier().is_empty() && dark.tau_frontier.is_empty());
}

#[test]
fn map_writes_charts_tables_and_a_report_that_agree_with_bounces() {
    let place = place(&[]);
    let small = "--patches 300 --rays 64";
    let found = report(&place, &format!("map furnished-room --grid 5 {small}"));
    let names = ["-alpha-c.csv", "-tau-c.csv", ".csv", ".png", ".svg"];
    let wanted = names.map(|end| format!("out/furnished-room-map{end}"));
    assert_eq!(files(&place), wanted);
    let grid = found["grid"].as_array().unwrap();
    assert_eq!(grid.len(), 25);
    assert_eq!(fields(&grid[0]), ["alpha", "lower", "tau", "upper"]);
    for name in ["frontier", "variance_frontier"] {
        let points = found[name].as_array().unwrap();
        assert_eq!(points.len(), 5);
        assert!(points.iter().all(|p| p["alpha_lower"].as_f64() <= p["alpha_upper"].as_f64()));
    }
    let solved = report(&place, &format!("bounces furnished-room {small} --size 8x8 --samples 1"));
    for (mode, corner) in [(0, 20), (1, 24)] {
        let other = &solved["modes"][mode]["spectral_radius"];
        let corner = &grid[corner];
        let within = |a: &serde_json::Value, b: &serde_json::Value| {
            a["lower"].as_f64().unwrap() <= b["upper"].as_f64().unwrap() * 1.00001
        };
        assert!(within(corner, other) && within(other, corner), "{corner} {other}");
    }
    let svg = std::fs::read_to_string(place.path().join("out/furnished-room-map.svg")).unwrap();
    for text in ["shadowless", "one-bounce", "spectral radius of K", "alpha: interreflection"] {
        assert!(svg.contains(text), "{text}");
    }
    assert_eq!(halflight(&place, "map furnished-room --grid 1").code, Some(2));
}

#[test]
fn the_map_does_not_depend_on_threads() {
    let place = place(&[]);
    let arguments = "map cornell-box --grid 4 --patches 200 --rays 32";
    let one = halflight(&place, &format!("{arguments} --threads 1 --out one"));
    let two = halflight(&place, &format!("{arguments} --threads 2 --out two"));
    assert_eq!((one.code, two.code), (Some(0), Some(0)));
    let read = |out: &str| std::fs::read(place.path().join(out).join("cornell-box-map.csv")).unwrap();
    assert_eq!(read("one"), read("two"));
}

#[test]
fn transports_of_the_square_reach_its_corners() {
    let scene = at(&plain(), 0.5, 0.25);
    let all = scene.transports(transport(1.0, 1.0));
    assert!(all.iter().all(|t| *t == transport(0.5, 0.25)));
}
