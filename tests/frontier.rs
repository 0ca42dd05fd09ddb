//! What the methods do on both sides of the frontier: tails and their bounds, counts of terms, growth before decay,
//! formal solutions that are not light, shooting, and acceleration.

use glam::{DQuat, DVec3};
use halflight::Solver;
use halflight::light::{Light, Rgb, Transport};
use halflight::operator::{LinearOperator, Operator, operator_norm, spectrum};
use halflight::render::{Assembled, Discretization};
use halflight::scene::Scene;
use halflight::solve::{
    RaySettings, Settings, Shooting, ShootingSettings, Verdict, direct, explore, extrapolated, neumann, norm, verdict,
};

use crate::common::{Facing, Mesh, assemble_one, grey, random, sampling, transport};

const RAYS: u32 = 256;

/// Nested spheres facing out in a sphere facing in; the outer has reflectance `wall` and emits, the others `shell`.
fn shells(wall: f32, shell: f32, count: usize) -> Scene {
    let mut mesh = Mesh::default();
    mesh.sphere(1.0, 2, Facing::In, 0);
    for k in 0..count {
        mesh.sphere(0.9 - 0.1 * k as f64, 2, Facing::Out, 1);
    }
    let mut outer = grey("wall", wall);
    outer.emission = Rgb::ONE;
    mesh.scene(vec![outer, grey("shell", shell)])
}

/// K of the shells with alpha at this share of the frontier, tau = 1.
fn near_frontier(share: f64) -> (Discretization, Assembled) {
    let scene = shells(0.8, 0.8, 2);
    let p = Solver::new(&scene).cut(300);
    let radius = spectrum(&assemble_one(&p, transport(1.0, 1.0), &sampling(RAYS, 1)).operator).worst();
    let alpha = share * 2.0 / (radius.lower + radius.upper);
    let mode = assemble_one(&p, transport(alpha as f32, 1.0), &sampling(RAYS, 1));
    (p, mode)
}

/// The smallest number of a light.
fn least(light: &[Light]) -> f32 {
    light.iter().map(|l| l.invisible.min_element().min(l.visible.min_element())).fold(f32::INFINITY, f32::min)
}

fn difference(a: &[Light], b: &[Light]) -> Vec<Light> {
    let pairs = a.iter().zip(b);
    pairs.map(|(a, b)| Light { invisible: a.invisible - b.invisible, visible: a.visible - b.visible }).collect()
}

#[test]
fn the_bound_holds_the_true_tail_and_closes_in_on_it() {
    for share in [0.5, 0.9, 0.99] {
        let (_, mode) = near_frontier(share);
        let k = &mode.operator;
        let exact = direct(k).expect("not singular");
        let solution = neumann(k, &Settings::default()).expect("inside the frontier");
        let mut sum = vec![Light::default(); k.len()];
        let whole = norm(k.areas(), &exact);
        let mut last = 0.0;
        for (term, bounce) in solution.terms.iter().zip(&solution.bounces) {
            for (s, t) in sum.iter_mut().zip(term) {
                s.invisible += t.invisible;
                s.visible += t.visible;
            }
            let tail = norm(k.areas(), &difference(&exact, &sum));
            let bound = bounce.tail_bound.expect("inside the frontier");
            // Sums in f32 leave 1e-6 of the whole.
            assert!(tail <= bound + 1e-6 * whole, "share {share}, term {}: {tail} {bound}", bounce.n);
            last = bound / tail;
        }
        // Late terms lie along the eigenvector: what is left is the gap of the bounds, at most a quarter of 1 - radius,
        // and what f32 leaves of the tail.
        assert!(last < 1.25 + 0.1, "share {share}: {last}");
    }
}

/// In a furnace every term is (alpha rho)^n E, so the count of terms is known: the first n with
/// `lambda^(n+1) <= tolerance (1 - lambda^(n+1))`.
#[test]
fn the_count_of_terms_is_that_of_a_geometric_series() {
    let mut mesh = Mesh::default();
    mesh.cuboid(DVec3::ZERO, DVec3::ONE, DQuat::IDENTITY, Facing::In, 0);
    let mut wall = grey("wall", 1.0);
    wall.emission = Rgb::ONE;
    let p = Solver::new(&mesh.scene(vec![wall])).cut(54);
    let settings = Settings { max_terms: 20_000, ..Settings::default() };
    for lambda in [0.9f32, 0.99, 0.999] {
        let mode = assemble_one(&p, transport(lambda, 0.0), &sampling(64, 1));
        let solution = neumann(&mode.operator, &settings).expect("below 1");
        let found = solution.terms.len() - 1;
        let l = f64::from(lambda);
        let exact = ((1e-4f64 / 1.0001).ln() / l.ln()).ceil() - 1.0;
        // The proved upper bound lies above lambda by the rounding of sums (5e-6), which counts over 1 - lambda, and so
        // does the rounding of the rows' sums; the visible half is rho, not alpha rho, times what came before.
        let excess = 1e-5 / (1.0 - l);
        let more = (1.0 + excess + (1.0 - l)).ln() / -l.ln() + 1.0;
        assert!((found as f64 - exact).abs() <= more, "{lambda}: {found}, {exact} ± {more}");
    }
}

/// A dark wall lights eight bright shells: one bounce enlarges the light though the radius is below 1.
#[test]
fn terms_may_grow_before_they_decay() {
    let p = Solver::new(&shells(0.05, 0.95, 8)).cut(600);
    let mode = assemble_one(&p, transport(1.0, 1.0), &sampling(RAYS, 1));
    let k = &mode.operator;
    let radius = spectrum(k).worst();
    assert!(radius.upper < 1.0, "{radius:?}");
    let of_k = operator_norm(k, 64);
    assert!(of_k > 1.0);
    let solution = neumann(k, &Settings::default()).expect("the radius is below 1");
    let norms: Vec<f64> = solution.bounces.iter().map(|b| b.norm).collect();
    assert!(norms[1] > norms[0], "{norms:?}");
    // No bounce enlarges by more than the norm, which is a lower bound but for its last digits.
    assert!(norms.windows(2).all(|w| w[1] <= 1.001 * of_k * w[0]));
    assert!(norms.last() < norms.first());
    let exact = direct(k).expect("not singular");
    let error = norm(k.areas(), &difference(&exact, &solution.light));
    assert!(error <= solution.rest() + 1e-6 * norm(k.areas(), &exact));
}

/// Every wall emits 1 and every shell sees walls all round, so KE is rho on the shells and the walls' 0.01 on the
/// walls, in both halves.
#[test]
fn the_drawn_hump_is_as_high_as_areas_say() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/hump/hump.toml");
    let p = Solver::new(&Scene::open(file).unwrap()).cut(600);
    let transport = p.geometry.scene.transport.unwrap();
    let mode = assemble_one(&p, transport, &sampling(256, 1));
    let k = &mode.operator;
    let area = |material: u32| -> f64 {
        let faces = (0..p.geometry.scene.faces.len() as u32).zip(&p.geometry.scene.faces);
        let own = faces.filter(|(_, f)| f.material == material);
        own.map(|(i, _)| p.geometry.scene.area(i)).sum()
    };
    let (walls, shells) = (area(0), area(1));
    let solution = neumann(k, &Settings::default()).expect("the radius is below 1");
    let norms: Vec<f64> = solution.bounces.iter().map(|b| b.norm).collect();
    let exact = (0.7f64.powi(2) * shells / walls + 0.01f64.powi(2)).sqrt();
    assert!((norms[1] / norms[0] - exact).abs() < 1e-3 * exact, "{norms:?} {exact}");
    assert!(operator_norm(k, 64) >= exact * 0.999 && spectrum(k).worst().upper < 1.0);
    assert!(norms[2] > norms[0] && norms[12] < 0.5 * norms[0]);
}

#[test]
fn beyond_the_frontier_the_formal_solution_is_negative_somewhere() {
    for share in [1.02, 1.1, 1.5] {
        let (_, mode) = near_frontier(share);
        let k = &mode.operator;
        assert_eq!(neumann(k, &Settings::default()).unwrap_err().verdict, Verdict::Diverges);
        assert_eq!(extrapolated(k, &Settings::default()).unwrap_err().verdict, Verdict::Diverges);
        let found = direct(k).expect("not singular");
        assert!(least(&found) < 0.0, "share {share}");
        // It solves the equation all the same: what K makes of its reflected part, and KE, are that part.
        let reflected = difference(&found, k.emission());
        let mut again = k.apply(&reflected);
        for (a, first) in again.iter_mut().zip(k.first_bounce()) {
            a.invisible += first.invisible;
            a.visible += first.visible;
        }
        let residual = norm(k.areas(), &difference(&again, &reflected));
        assert!(residual < 1e-5 * norm(k.areas(), &found), "{residual}");
    }
    let (_, inside) = near_frontier(0.9);
    assert!(least(&direct(&inside.operator).expect("not singular")) >= 0.0);
}

#[test]
fn shooting_empties_inside_and_is_refused_beyond() {
    for (share, wanted) in [(0.8, Verdict::Converges), (1.2, Verdict::Diverges)] {
        let (p, mode) = near_frontier(share);
        let rays = RaySettings { rays: 1 << 16, ..RaySettings::default() };
        let shooter = p.ray_shooter(mode.transport, rays);
        let mut shooting = Shooting::new(&shooter, ShootingSettings::default()).expect("not known beforehand");
        let mut shares = vec![1.0];
        let ended = shooting.run(|s| shares.push(s.progress().share));
        let found = ended.map_or_else(|refused| refused.verdict, |_| Verdict::Converges);
        assert_eq!(found, wanted, "share {share}");
        match wanted {
            Verdict::Converges => assert!(shares.last() <= Some(&1e-3)),
            _ => assert!(shares.last() > Some(&1.0), "{:?}", shares.last()),
        }
    }
}

#[test]
fn the_extrapolated_solve_is_the_same_light_in_fewer_products() {
    for share in [0.5, 0.9, 0.99, 0.999] {
        let (_, mode) = near_frontier(share);
        let k = &mode.operator;
        let exact = direct(k).expect("not singular");
        let settings = Settings { max_terms: 20_000, ..Settings::default() };
        let found = extrapolated(k, &settings).expect("inside the frontier");
        let error = norm(k.areas(), &difference(&exact, &found.light));
        let whole = norm(k.areas(), &exact);
        assert!(found.rest <= 1e-4 * whole * 1.001);
        // 1/(1 - radius) magnifies the rounding of f32.
        let rounding = 1e-6 / (1.0 - share);
        assert!(error <= found.rest + rounding * whole, "share {share}: {error} {}", found.rest);
        if share >= 0.99 {
            let terms = neumann(k, &settings).expect("inside").terms.len();
            assert!(4 * found.products < terms, "{} {terms}", found.products);
        }
    }
}

/// Boxes in a room, random in number, place, size, reflectance; lit by a glowing wall.
fn random_room(number: u32) -> (Discretization, Transport) {
    let at = |purpose: u32| random(number, purpose);
    let mut mesh = Mesh::default();
    mesh.cuboid(DVec3::ZERO, DVec3::ONE, DQuat::IDENTITY, Facing::In, 0);
    let boxes = (25.0 * at(1)) as u32;
    for b in 0..boxes {
        let own = |k: u32| at(100 + 10 * b + k);
        let half = DVec3::new(own(0), own(1), own(2)) * 0.25 + 0.05;
        let place = DVec3::new(own(3), own(4), own(5)) * 1.2 - 0.6;
        let turn = DQuat::from_rotation_y(own(6)) * DQuat::from_rotation_x(own(7));
        mesh.cuboid(place, half, turn, Facing::Out, 1);
    }
    let mut wall = grey("wall", 0.8 + 0.2 * at(2) as f32);
    wall.emission = Rgb::ONE;
    let things = grey("things", 0.8 + 0.2 * at(3) as f32);
    let tau = [at(4), 1.0][usize::from(at(5) < 0.7)];
    let transport = transport(0.7 + 0.3 * at(6) as f32, tau as f32);
    (Solver::new(&mesh.scene(vec![wall, things])).cut(100), transport)
}

/// Whether the terms of the series fall in the long run; None where they neither fall nor grow by a thousandth over
/// 100.
fn terms_fall(k: &Operator) -> Option<bool> {
    let bounces = explore(k, 200).bounces;
    let norms: Vec<f64> = bounces.iter().map(|b| b.norm).collect();
    let Some(late) = norms.get(200).filter(|n| n.is_finite()) else {
        // Either it grew beyond the numbers or it fell to exactly 0.
        return Some(norms.last() == Some(&0.0));
    };
    let change = late / norms[100];
    ((change - 1.0).abs() > 1e-3).then_some(change < 1.0)
}

fn shot(p: &Discretization, transport: Transport, seed: u32) -> Verdict {
    let rays = RaySettings { rays: 1 << 15, seed, ..RaySettings::default() };
    let shooter = p.ray_shooter(transport, rays);
    let settings = ShootingSettings { shots_per_patch: 300, ..ShootingSettings::default() };
    let ended = Shooting::new(&shooter, settings).and_then(|mut s| s.run(|_| ()));
    ended.map_or_else(|refused| refused.verdict, |_| Verdict::Converges)
}

/// Over the same K, the terms and the sign of the formal solution follow the bounds. Shooting with rays of its own
/// samples another F: its radius differs by the noise of both, so it is held to the bounds outside of four of its
/// standard errors.
#[test]
fn every_method_agrees_with_the_bounds_in_random_scenes() {
    const PATCH_RAYS: u32 = 128;
    let scenes: u32 = std::env::var("HALFLIGHT_SCENES").map_or(60, |count| count.parse().expect("a count"));
    let (mut diverging, mut undecided, mut close) = (0, 0, 0u32);
    for number in 0..scenes {
        let (p, transport) = random_room(number);
        let mode = assemble_one(&p, transport, &sampling(PATCH_RAYS, number));
        let k = &mode.operator;
        let radius = spectrum(k).worst();
        let (found, _) = verdict(k);
        let shown = format!("scene {number}, {transport:?}, {radius:?}");
        if found == Verdict::Undecided {
            undecided += 1;
            assert!(radius.lower <= 1.0 && radius.upper >= 1.0, "{shown}");
            continue;
        }
        let converges = found == Verdict::Converges;
        diverging += u32::from(!converges);
        if let Some(fall) = terms_fall(k) {
            assert_eq!(fall, converges, "terms: {shown}");
        }
        let formal = direct(k).expect("not singular");
        assert_eq!(least(&formal) >= 0.0, converges, "formal solution: {shown}");
        // The number of crossings of a ray varies by about their mean; the eigenvalue averages over all rays.
        let noise = 1.0 / (k.len() as f64 * f64::from(PATCH_RAYS)).sqrt();
        if (radius.lower - 1.0).abs().min((radius.upper - 1.0).abs()) < 4.0 * noise {
            close += 1;
            continue;
        }
        assert_eq!(shot(&p, transport, number), found, "shooting: {shown}");
    }
    println!("{diverging} diverge, {close} too close to compare shooting");
    // Both sides of the frontier were seen, and few scenes lie too close to it to compare shooting.
    assert!((scenes / 6..scenes * 5 / 6).contains(&diverging), "{diverging} diverge");
    assert_eq!(undecided, 0);
    assert!(close < scenes / 4, "{close} close to the frontier");
}
