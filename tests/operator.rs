//! K as applied against K written out, its series against dense LU, its bounds against dense eigenvalues.

use glam::{DQuat, DVec3, EulerRot};
use halflight::Solver;
use halflight::light::{Light, Mode, Rgb, Transport};
use halflight::operator::{LinearOperator, Operator, spectrum};
use halflight::scene::{Material, Sides};
use halflight::solve::{Settings, Verdict, direct, explore, extrapolated, neumann, norm, verdict};
use nalgebra::DMatrix;
use proptest::prelude::*;
use sprs::CsMat;

use crate::common::{Facing, Mesh, assemble_one, builtin, grey, random, sampling, transport};

/// A room of coloured walls with turned boxes in it, grey and black, and a lamp under the ceiling.
fn room(boxes: u32, seed: u32) -> Mesh {
    let mut mesh = Mesh::default();
    let half = DVec3::new(1.0, 0.9, 0.8);
    mesh.cuboid(DVec3::ZERO, half, DQuat::IDENTITY, Facing::In, 0);
    for k in 0..boxes {
        let r = |purpose: u32| random(k, 100 * seed + purpose);
        let place = 1.1 * (DVec3::new(r(0), r(1), r(2)) - 0.5);
        let turn = DQuat::from_euler(EulerRot::XYZ, 6.0 * r(3), 6.0 * r(4), 6.0 * r(5));
        mesh.cuboid(place, 0.2 * half, turn, Facing::Out, 1 + k % 2);
    }
    let lamp = [(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)];
    mesh.polygon(&lamp.map(|(x, z)| DVec3::new(x, 0.85, z)), 3);
    mesh
}

fn materials(rho: f32) -> Vec<Material> {
    let coloured = Material::new("wall", rho * Rgb::new(1.0, 0.7, 0.4), Rgb::ZERO);
    let mut lamp = grey("lamp", 0.2);
    lamp.emission = Rgb::new(17.0, 12.0, 4.0);
    vec![coloured, grey("box", rho), grey("black", 0.0), lamp]
}

/// K of such a room.
fn operator(boxes: u32, patches: usize, rho: f32, seed: u32, transport: Transport) -> Operator {
    let p = Solver::new(&room(boxes, seed).scene(materials(rho))).cut(patches);
    assemble_one(&p, transport, &sampling(256, seed)).operator
}

fn random_light(n: usize, seed: u32) -> Vec<Light> {
    let one = |i: usize, k: u32| random(i as u32, 10 * seed + k) as f32;
    let rgb = |i: usize, k: u32| Rgb::new(one(i, k), one(i, k + 1), one(i, k + 2));
    let light = |i: usize| Light { invisible: rgb(i, 0), visible: rgb(i, 3) };
    (0..n).map(light).collect()
}

/// One channel as a vector (invisible, visible) patch by patch.
fn channel(x: &[Light], c: usize) -> Vec<f64> {
    x.iter().flat_map(|l| [l.invisible[c], l.visible[c]]).map(f64::from).collect()
}

/// Product of a sparse matrix of 2×2 blocks, the plain way.
fn block_product(k: &CsMat<nalgebra::Matrix2<f32>>, x: &[f64]) -> Vec<f64> {
    let mut y = vec![0.0; x.len()];
    for (block, (i, j)) in k.iter() {
        for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            y[2 * i + a] += f64::from(block[(a, b)]) * x[2 * j + b];
        }
    }
    y
}

fn dot(x: &[Light], y: &[Light]) -> f64 {
    let of = |c: usize| {
        let pairs = channel(x, c).into_iter().zip(channel(y, c));
        pairs.map(|(a, b)| a * b).sum::<f64>()
    };
    of(0) + of(1) + of(2)
}

/// All terms are positive: relative errors stay at a few roundings of f32.
const ROUNDING: f64 = 1e-5;

fn assert_close(found: &[f64], exact: &[f64]) {
    for (a, b) in found.iter().zip(exact) {
        assert!((a - b).abs() <= ROUNDING * b.abs(), "{a} {b}");
    }
}

fn norm_of(k: &Operator, a: &[Light], b: &[Light]) -> f64 {
    let apart: Vec<Light> = a
        .iter()
        .zip(b)
        .map(|(a, b)| Light { invisible: a.invisible - b.invisible, visible: a.visible - b.visible })
        .collect();
    norm(k.areas(), &apart)
}

#[test]
fn applying_k_is_the_product_with_its_blocks() {
    let k = operator(4, 150, 0.8, 1, transport(0.7, 0.3));
    let x = random_light(k.len(), 5);
    let y = k.apply(&x);
    for c in 0..3 {
        let exact = block_product(&k.blocks(c), &channel(&x, c));
        assert_close(&channel(&y, c), &exact);
        let dense = k.dense(c) * DMatrix::from_column_slice(2 * k.len(), 1, &channel(&x, c));
        assert_close(&channel(&y, c), dense.as_slice());
    }
}

#[test]
fn the_transpose_moves_to_the_other_side_of_a_product() {
    let k = operator(4, 300, 0.8, 2, transport(0.7, 0.3));
    for seed in 0..5 {
        let (x, y) = (random_light(k.len(), seed), random_light(k.len(), 100 + seed));
        let (left, right) = (dot(&k.apply(&x), &y), dot(&x, &k.apply_transposed(&y)));
        assert!((left - right).abs() <= ROUNDING * left, "{left} {right}");
    }
}

#[test]
fn the_series_is_the_solution_of_the_dense_system() {
    let mut modes = Mode::ALL.map(Mode::transport).to_vec();
    modes.push(transport(0.5, 0.5));
    for mode in modes {
        let k = operator(3, 100, 0.55, 3, mode);
        let settings = Settings { tolerance: 1e-9, ..Settings::default() };
        let solution = neumann(&k, &settings).expect("the radius is below 1");
        let exact = direct(&k).expect("regular");
        let apart = norm_of(&k, &solution.light, &exact) / norm(k.areas(), &exact);
        assert!(apart < 1e-6, "{}: {apart}", mode.label());
        for (found, exact) in solution.light.iter().zip(&exact) {
            let [found, exact] = [found, exact].map(|l| l.components());
            for (a, b) in found.iter().zip(exact) {
                assert!((a - b).abs() <= 1e-5 * b, "{}: {a} {b}", mode.label());
            }
        }
    }
}

#[test]
fn tail_bounds_hold_and_are_not_idle() {
    for (rho, mode) in [
        (0.3, transport(1.0, 0.0)),
        (0.9, transport(1.0, 0.0)),
        (0.55, transport(1.0, 1.0)),
        (0.7, transport(0.5, 0.5)),
        (0.7, transport(0.0, 0.0)),
    ] {
        let k = operator(3, 120, rho, 4, mode);
        let solution = explore(&k, 12);
        let left = left_after(&k, &explore(&k, 2000).terms);
        let left: Vec<f64> = left.iter().map(|l| norm(k.areas(), l)).collect();
        for b in &solution.bounces {
            let bound = b.tail_bound.expect("the series is proved to converge");
            let left = left[b.n];
            // The sum itself is rounded to f32.
            assert!(bound * 1.000_001 >= left, "rho {rho}, {}: term {}: {bound} < {left}", mode.label(), b.n);
            // From the second bounce on light is spread out, and the bound follows it.
            assert!(b.n < 2 || bound <= 1e3 * left, "rho {rho}, {}: term {}: {bound} >> {left}", mode.label(), b.n);
        }
    }
}

/// What is left after each term, from a series summed until nothing changes.
fn left_after(k: &Operator, terms: &[Vec<Light>]) -> Vec<Vec<Light>> {
    let mut rest = vec![Light::default(); k.len()];
    let mut left = vec![rest.clone(); terms.len()];
    for (n, term) in terms.iter().enumerate().rev() {
        left[n].clone_from(&rest);
        for (sum, t) in rest.iter_mut().zip(term) {
            sum.invisible += t.invisible;
            sum.visible += t.visible;
        }
    }
    left
}

/// Terms that are not kept are in L, in the figures, in the bound on the rest, and in the sum of later ones.
#[test]
fn terms_that_are_not_kept_change_nothing_else() {
    let k = operator(3, 120, 0.7, 4, transport(1.0, 0.0));
    let settings = Settings::default();
    let whole = neumann(&k, &settings).expect("it converges");
    let few = neumann(&k, &Settings { keep: 3, ..settings }).expect("it converges");
    assert!(few.terms == whole.terms[..3] && whole.terms.len() > 10 && whole.later.is_empty());
    assert!(few.light == whole.light && few.bounces == whole.bounces && few.left == whole.left);
    let later = left_after(&k, &whole.terms)[2].iter().map(|l| l.visible.element_sum()).sum::<f32>();
    let summed = few.later.iter().map(|l| l.visible.element_sum()).sum::<f32>();
    assert!((summed - later).abs() < 1e-5 * later, "{summed} {later}");
}

/// The backs of the walls receive nothing that travels, and the vector that proves the radius is next to nothing there.
#[test]
fn bounds_say_something_where_some_patches_see_almost_nothing() {
    let mut scene = builtin("cornell-box");
    for material in &mut scene.materials {
        if material.name == "red" {
            material.sides = Sides::Two;
        }
    }
    assert!(scene.materials.iter().any(|m| m.sides == Sides::Two));
    let p = Solver::new(&scene).cut(600);
    for mode in [Mode::Global, Mode::Shadowless].map(Mode::transport) {
        let k = assemble_one(&p, mode, &sampling(256, 0)).operator;
        let solution = explore(&k, 8);
        let left = left_after(&k, &explore(&k, 200).terms);
        for b in &solution.bounces[1..] {
            let (bound, left) = (b.tail_bound.expect("converges"), norm(k.areas(), &left[b.n]));
            let tight = left <= bound * 1.000_001 && bound <= 10.0 * left;
            assert!(tight, "{}, term {}: {bound} {left}", mode.label(), b.n);
        }
    }
}

/// A lamp a thousandth as wide as its room is all of the norm of L, and none of the light that is looked at.
#[test]
fn a_small_bright_lamp_does_not_end_the_series_early() {
    let mut mesh = Mesh::default();
    mesh.cuboid(DVec3::ZERO, DVec3::ONE, DQuat::IDENTITY, Facing::In, 0);
    let lamp = [(-0.001, -0.001), (0.001, -0.001), (0.001, 0.001), (-0.001, 0.001)];
    mesh.polygon(&lamp.map(|(x, z)| DVec3::new(x, 0.9, z)), 1);
    let mut glow = grey("lamp", 0.0);
    glow.emission = 1e6 * Rgb::ONE;
    let p = Solver::new(&mesh.scene(vec![grey("wall", 0.8), glow])).cut(150);
    let k = assemble_one(&p, Mode::Global.transport(), &sampling(256, 0)).operator;
    let settings = Settings { tolerance: 0.01, ..Settings::default() };
    let exact = direct(&k).expect("regular");
    let reflected = |light: &[Light]| -> Vec<Light> {
        let pairs = light.iter().zip(k.emission());
        let less = pairs.map(|(l, e)| Light { invisible: l.invisible - e.invisible, visible: l.visible - e.visible });
        less.collect()
    };
    let exact = reflected(&exact);
    let whole = norm(k.areas(), &exact);
    let found = neumann(&k, &settings).expect("converges");
    assert!(norm_of(&k, &reflected(&found.light), &exact) <= 0.01 * whole);
    let strokes = extrapolated(&k, &settings).expect("converges").light;
    assert!(norm_of(&k, &reflected(&strokes), &exact) <= 0.01 * whole);
    // The field bounds what is missing on every patch, and is not idle: lambda/(1 - lambda) of the last term or so.
    let missing = &left_after(&k, &explore(&k, 400).terms)[found.terms.len() - 1];
    for (bound, missing) in found.left.iter().zip(missing) {
        for (b, m) in bound.components().iter().zip(missing.components()) {
            assert!(b * 1.000_01 >= m && *b <= 10.0 * m + 1e-12, "{b} {m}");
        }
    }
}

/// The largest eigenvalue of a channel's K by magnitude.
fn largest_eigenvalue(k: &Operator, c: usize) -> f64 {
    let n = k.len();
    // Eigenvalues of K are those of its invisible part, and 0.
    let invisible = k.dense(c).select_rows(&evens(n)).select_columns(&evens(n));
    let eigenvalues = invisible.complex_eigenvalues();
    eigenvalues.iter().map(|z| z.norm()).fold(0.0, f64::max)
}

fn evens(n: usize) -> Vec<usize> {
    (0..n).map(|i| 2 * i).collect()
}

fn assert_enclosed(k: &Operator) {
    for (c, bounds) in spectrum(k).channels.iter().enumerate() {
        let radius = largest_eigenvalue(k, c);
        // The eigenvalues of a dense f64 matrix of this size are good to far better than this.
        let slack = 1e-9 * radius;
        assert!(bounds.lower <= radius + slack, "{bounds:?} {radius}");
        assert!(bounds.upper >= radius - slack, "{bounds:?} {radius}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]
    #[test]
    fn bounds_enclose_the_largest_eigenvalue(
        boxes in 0u32..5, seed in 0u32..1000, rho in 0.1f32..1.0, alpha in 0.0f32..=1.0, tau in 0.0f32..=1.0,
    ) {
        let k = operator(boxes, 60, rho, seed, transport(alpha, tau));
        assert_enclosed(&k);
    }
}

#[test]
fn two_facing_plates_do_not_oscillate() {
    let mut mesh = Mesh::default();
    let square = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    mesh.polygon(&square.map(|(x, y)| DVec3::new(x, y, 0.0)), 0);
    let mut down = square.map(|(x, y)| DVec3::new(x, y, 0.5));
    down.reverse();
    mesh.polygon(&down, 1);
    let mut lamp = grey("lamp", 0.9);
    lamp.emission = Rgb::ONE;
    let p = Solver::new(&mesh.scene(vec![grey("plate", 0.9), lamp])).cut(80);
    let k = assemble_one(&p, Mode::Global.transport(), &sampling(256, 0)).operator;
    // All light goes to and fro: K is bipartite, its eigenvalues come in pairs +-lambda.
    let bounds = spectrum(&k).worst();
    assert!(bounds.upper - bounds.lower <= 0.005 * bounds.upper * 1.01, "{bounds:?}");
    assert_enclosed(&k);
    assert_eq!(verdict(&k).0, Verdict::Converges);
}

#[test]
fn rooms_that_do_not_see_each_other() {
    let mut mesh = Mesh::default();
    let apart = DVec3::new(3.0, 0.0, 0.0);
    mesh.cuboid(-apart, DVec3::ONE, DQuat::IDENTITY, Facing::In, 0);
    mesh.cuboid(apart, DVec3::ONE, DQuat::IDENTITY, Facing::In, 1);
    let mut dim = grey("dim", 0.3);
    dim.emission = Rgb::ONE;
    let p = Solver::new(&mesh.scene(vec![dim, grey("bright", 0.8)])).cut(100);
    let k = assemble_one(&p, Mode::Global.transport(), &sampling(256, 0)).operator;
    // Rows sum to 1: the radius is the larger rho exactly, of the room without a light.
    let bounds = spectrum(&k).worst();
    assert!(bounds.lower <= 0.8 && bounds.upper >= 0.8 - 1e-6, "{bounds:?}");
    assert!(bounds.upper - bounds.lower < 0.01, "{bounds:?}");
    assert_enclosed(&k);
    let solution = neumann(&k, &Settings::default()).expect("converges");
    for (l, &m) in solution.light.iter().zip(p.patches.materials()) {
        let exact = if m == 0 { 1.0 / 0.7 } else { 0.0 };
        assert!((l.visible.x - exact).abs() <= 1e-3 * exact, "{l:?}");
    }
}

#[test]
fn where_nothing_reflects_the_series_ends_with_the_emission() {
    let mut black = materials(0.0);
    black[3].rho = Rgb::ZERO;
    let p = Solver::new(&room(2, 1).scene(black)).cut(80);
    let k = assemble_one(&p, Mode::Global.transport(), &sampling(64, 0)).operator;
    assert_eq!(verdict(&k).0, Verdict::Ends);
    let solution = neumann(&k, &Settings::default()).expect("ends");
    assert_eq!(solution.light, k.emission());
    assert_eq!(solution.rest(), 0.0);
}
