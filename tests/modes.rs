//! The modes: what ends ends exactly, and materials with modes of their own.

use glam::{DQuat, DVec3};
use halflight::Solver;
use halflight::direct::Occlusion;
use halflight::form_factors::Sampling;
use halflight::light::{Light, Mode, Rgb};
use halflight::operator::LinearOperator;
use halflight::render::{Assembled, Discretization};
use halflight::scene::Scene;
use halflight::solve::{Settings, Solution, Verdict, explore, neumann};

use crate::common::{Facing, Mesh, Silent, assemble_one, builtin, grey, lights_behind, mean_and_error, sampling};

fn solve(mode: &Assembled) -> Solution {
    neumann(&mode.operator, &Settings::default()).expect("converges")
}

/// A closed room: floor (0), walls (1), a slab that hangs over the floor (2) and a lamp over it (3).
fn room(slab: bool) -> Scene {
    let mut mesh = Mesh::default();
    let p = DVec3::new;
    mesh.cuboid(DVec3::ZERO, DVec3::ONE, DQuat::IDENTITY, Facing::In, 1);
    mesh.polygon(&[p(-0.9, -0.99, 0.9), p(0.9, -0.99, 0.9), p(0.9, -0.99, -0.9), p(-0.9, -0.99, -0.9)], 0);
    if slab {
        mesh.cuboid(p(0.1, 0.0, 0.0), p(0.4, 0.05, 0.4), DQuat::IDENTITY, Facing::Out, 2);
    }
    mesh.polygon(&[p(-0.3, 0.95, -0.3), p(0.3, 0.95, -0.3), p(0.3, 0.95, 0.3), p(-0.3, 0.95, 0.3)], 3);
    let mut lamp = grey("lamp", 0.0);
    lamp.emission = Rgb::splat(5.0);
    mesh.scene(vec![grey("floor", 0.6), grey("wall", 0.5), grey("slab", 0.7), lamp])
}

/// Visible light of the patches of a material, area-weighted mean, red.
fn mean_light(p: &Discretization, light: &[Light], material: u32) -> f64 {
    let (mut sum, mut area) = (0.0, 0.0);
    for (i, l) in light.iter().enumerate() {
        if p.patches.materials()[i] == material {
            sum += p.patches.areas()[i] * f64::from(l.visible.x);
            area += p.patches.areas()[i];
        }
    }
    sum / area
}

#[test]
fn without_interreflection_the_second_bounce_is_exactly_nothing() {
    for name in ["cornell-box", "furnished-room", "two-rooms"] {
        let p = Solver::new(&builtin(name)).cut(400);
        for mode in [Mode::Local, Mode::OneBounce] {
            let (mut assembled, rays) = p.assemble(&[mode.transport()], &sampling(256, 0), &Silent);
            let k = assembled.remove(0);
            // Only light as emitted is asked for: in local mode without a ray, else the shadows of so few faces are cut
            // out, and rays are left to a patch or two whose view is too ragged, 64 or so a luminaire each.
            let most = if mode == Mode::Local { 0 } else { 64 * 20 };
            assert!(rays <= most, "{name} {mode}: {rays}");
            assert!(k.row_sums.is_none());
            assert_eq!(k.operator.form_factors().entries(), 0);
            let first = k.operator.first_bounce();
            assert!(first.iter().any(|l| l.visible != Rgb::ZERO));
            assert!(first.iter().all(|l| l.invisible == Rgb::ZERO));
            let nothing = vec![Light::default(); k.operator.len()];
            assert_eq!(k.operator.apply(&first), nothing);
            let solution = solve(&k);
            assert_eq!((solution.verdict, solution.terms.len()), (Verdict::Ends, 2));
            assert_eq!(solution.rest(), 0.0);
            let further = explore(&k.operator, 10).terms;
            assert!(further.iter().skip(2).all(|t| *t == nothing));
        }
    }
}

#[test]
fn glowing_rooms_end_too() {
    // The furnace's light goes through the rows of F, which are cast, but it ends after one bounce all the same.
    let p = Solver::new(&builtin("furnace")).cut(100);
    let k = assemble_one(&p, Mode::OneBounce.transport(), &sampling(64, 0));
    assert!(k.operator.form_factors().entries() > 0);
    let nothing = vec![Light::default(); k.operator.len()];
    assert_eq!(k.operator.apply(&k.operator.first_bounce()), nothing);
    assert_eq!(solve(&k).terms.len(), 2);
}

#[test]
fn a_transmitting_thing_in_a_global_scene_casts_no_shadow() {
    let mut scene = room(true);
    scene.materials[2].tau = Some(1.0);
    let (with, without, shaded) =
        (Solver::new(&scene).cut(500), Solver::new(&room(false)).cut(430), Solver::new(&room(true)).cut(500));
    let direct = |p: &Discretization| {
        let k = assemble_one(p, Mode::OneBounce.transport(), &Sampling { emitter_rays: 256, ..sampling(64, 0) });
        mean_light(p, &solve(&k).light, 0)
    };
    // Every ray from lamp to floor arrives, so the ratio that holds the noise is exactly 1; what differs is how the
    // floor is sampled: its patches may be cut another way.
    let (found, bare, dark) = (direct(&with), direct(&without), direct(&shaded));
    assert!((found / bare - 1.0).abs() < 1e-4, "{found} {bare}");
    assert!(dark < 0.8 * bare, "an opaque slab shades the floor: {dark} {bare}");
}

#[test]
fn a_transmitting_thing_leaves_the_same_direct_light_patch_by_patch() {
    let mut scene = room(true);
    scene.materials[2].tau = Some(1.0);
    let p = Solver::new(&scene).cut(500);
    let receive = |occlusion: &Occlusion| {
        let receives = vec![true; p.patches.len()];
        let sampling = Sampling { emitter_rays: 16, ..sampling(1, 0) };
        let lights = lights_behind(&p, occlusion);
        lights.receive_emitted(&receives, &sampling, &|_| ()).0
    };
    let (partial, bare) = (Occlusion::Partial(vec![0.0, 0.0, 1.0, 0.0]), Occlusion::Nothing);
    for (i, (a, b)) in receive(&partial).into_iter().zip(receive(&bare)).enumerate() {
        if p.patches.materials()[i] == 0 {
            assert_eq!(a, b, "patch {i}");
            assert!(a.x > 0.0);
        }
    }
}

#[test]
fn a_transmitting_thing_reflects_all_the_same() {
    // tau = 1 and alpha = 0: local shading for one thing in a global scene. It neither shades nor lights the rest.
    let mut ghost = room(true);
    (ghost.materials[2].tau, ghost.materials[2].alpha) = (Some(1.0), Some(0.0));
    let mut glass = room(true);
    glass.materials[2].tau = Some(1.0);
    let [ghost, glass, bare] = [ghost, glass, room(false)].map(|scene| Solver::new(&scene).cut(500));
    let global = Mode::Global.transport();
    let floor = |p: &Discretization| {
        let of = |seed: u32| mean_light(p, &solve(&assemble_one(p, global, &sampling(256, seed))).light, 0);
        mean_and_error(&[0, 1, 2, 3].map(of))
    };
    let ((a, ea), (b, eb), (c, _)) = (floor(&ghost), floor(&bare), floor(&glass));
    // Patches differ, whose size moves the mean by far less than a thousandth.
    assert!((a - b).abs() < 4.0 * ea.hypot(eb) + 1e-3 * b, "{a} +- {ea}, {b} +- {eb}");
    // With alpha = 1 what it reflects arrives on top of what passes through it.
    assert!(c > 1.01 * b, "{c} {b}");
    for p in [&ghost, &glass] {
        let k = assemble_one(p, global, &sampling(256, 0));
        assert!(mean_light(p, &solve(&k).light, 2) > 0.05);
        let sent = |i: usize| k.operator.passed_on(i).x > 0.0;
        let slab = (0..p.patches.len()).filter(|&i| p.patches.materials()[i] == 2);
        assert!(slab.into_iter().all(|i| sent(i) == std::ptr::eq(p, &glass)));
    }
}
