//! The modes: what ends ends exactly, materials with modes of their own, and shortcuts against the general path.

mod common;

use common::{
    Facing, Mesh, Silent, all_of_f, assemble_one, builtin, grey, mean_and_error, sampling,
    transport,
};
use glam::{DQuat, DVec3, Vec3};
use halflight::form_factors::{FormFactors, Occlusion, Sampling, Variant, cast, receive_emitted};
use halflight::image::GatherSampling;
use halflight::light::{Light, Mode, Rgb, Transport, Visibility};
use halflight::operator::{Operator, PatchMaterials};
use halflight::scene::{Scene, Sides};
use halflight::solve::{Settings, Solution, Verdict, explore, neumann};
use halflight::study::{Assembled, Prepared, assemble, prepare, render};

fn solve(mode: &Assembled) -> Solution {
    neumann(&mode.operator, &Settings::default()).expect("converges")
}

/// A closed room: floor (0), walls (1), a slab that hangs over the floor (2) and a lamp over it (3).
fn room(slab: bool) -> Scene {
    let mut mesh = Mesh::default();
    let p = DVec3::new;
    mesh.cuboid(DVec3::ZERO, DVec3::ONE, DQuat::IDENTITY, Facing::In, 1);
    mesh.polygon(
        &[
            p(-0.9, -0.99, 0.9),
            p(0.9, -0.99, 0.9),
            p(0.9, -0.99, -0.9),
            p(-0.9, -0.99, -0.9),
        ],
        0,
    );
    if slab {
        mesh.cuboid(
            p(0.1, 0.0, 0.0),
            p(0.4, 0.05, 0.4),
            DQuat::IDENTITY,
            Facing::Out,
            2,
        );
    }
    mesh.polygon(
        &[
            p(-0.3, 0.95, -0.3),
            p(0.3, 0.95, -0.3),
            p(0.3, 0.95, 0.3),
            p(-0.3, 0.95, 0.3),
        ],
        3,
    );
    let mut lamp = grey("lamp", 0.0);
    lamp.emission = Rgb::splat(5.0);
    mesh.scene(vec![
        grey("floor", 0.6),
        grey("wall", 0.5),
        grey("slab", 0.7),
        lamp,
    ])
}

/// Visible light of the patches of a material, area-weighted mean, red.
fn mean_light(p: &Prepared, light: &[Light], material: u32) -> f64 {
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
        let p = prepare(builtin(name), 400);
        for mode in [Mode::Local, Mode::OneBounce] {
            let (mut assembled, rays) =
                assemble(&p, &[mode.transport()], &sampling(256, 0), &Silent);
            let k = assembled.remove(0);
            // Only light as emitted is asked for: hidden by nothing in local mode, else by visibility rays.
            let receivers =
                PatchMaterials::new(&p.scene, &p.patches, &p.luminaires, &k.transports).receives();
            let receivers = receivers.iter().filter(|&&r| r).count() as u64;
            let visibility = receivers * p.luminaires.list.len() as u64 * 64;
            let expected = if mode == Mode::Local { 0 } else { visibility };
            assert_eq!(rays, expected, "{name} {mode}");
            assert!(k.closure.is_none());
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
    let p = prepare(builtin("furnace"), 100);
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
    let (with, without, shaded) = (
        prepare(scene, 500),
        prepare(room(false), 430),
        prepare(room(true), 500),
    );
    let direct = |p: &Prepared| {
        let k = assemble_one(
            p,
            Mode::OneBounce.transport(),
            &Sampling {
                emitter_rays: 256,
                ..sampling(64, 0)
            },
        );
        mean_light(p, &solve(&k).light, 0)
    };
    // Every ray from lamp to floor arrives, so the ratio that holds the noise is exactly 1; what differs is how the
    // floor is sampled: its patches may be cut another way.
    let (found, bare, dark) = (direct(&with), direct(&without), direct(&shaded));
    assert!((found / bare - 1.0).abs() < 1e-4, "{found} {bare}");
    assert!(
        dark < 0.8 * bare,
        "an opaque slab shades the floor: {dark} {bare}"
    );
}

#[test]
fn a_transmitting_thing_leaves_the_same_direct_light_patch_by_patch() {
    let mut scene = room(true);
    scene.materials[2].tau = Some(1.0);
    let p = prepare(scene, 500);
    let receive = |occlusion: &Occlusion| {
        let receives = vec![true; p.patches.len()];
        let sampling = Sampling {
            emitter_rays: 16,
            ..sampling(1, 0)
        };
        let path = (&p.rays, &p.patches);
        receive_emitted(
            path,
            &p.luminaires,
            occlusion,
            &receives,
            &sampling,
            &|_| (),
        )
        .0
    };
    let (partial, bare) = (
        Occlusion::Partial(vec![0.0, 0.0, 1.0, 0.0]),
        Occlusion::Nothing,
    );
    for (i, (a, b)) in receive(&partial)
        .into_iter()
        .zip(receive(&bare))
        .enumerate()
    {
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
    let [ghost, glass, bare] = [ghost, glass, room(false)].map(|scene| prepare(scene, 500));
    let global = Mode::Global.transport();
    let floor = |p: &Prepared| {
        let of = |seed: u32| {
            mean_light(
                p,
                &solve(&assemble_one(p, global, &sampling(256, seed))).light,
                0,
            )
        };
        mean_and_error(&[0, 1, 2, 3].map(of))
    };
    let ((a, ea), (b, eb), (c, _)) = (floor(&ghost), floor(&bare), floor(&glass));
    // Patches differ, whose size moves the mean by far less than a thousandth.
    assert!(
        (a - b).abs() < 4.0 * ea.hypot(eb) + 1e-3 * b,
        "{a} +- {ea}, {b} +- {eb}"
    );
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

#[test]
fn one_cast_for_several_modes_gives_what_each_alone_gives() {
    let p = prepare(builtin("cornell-box"), 400);
    let mut modes = Mode::ALL.map(Mode::transport).to_vec();
    modes.extend([transport(0.5, 0.5), transport(0.0, 0.25)]);
    let (together, _) = assemble(&p, &modes, &sampling(256, 7), &Silent);
    for (all, &mode) in together.iter().zip(&modes) {
        let alone = assemble_one(&p, mode, &sampling(256, 7));
        let label = mode.label();
        assert!(
            all.operator.form_factors() == alone.operator.form_factors(),
            "{label}"
        );
        assert_eq!(
            all.operator.first_bounce(),
            alone.operator.first_bounce(),
            "{label}"
        );
        assert_eq!(all.closure, alone.closure, "{label}");
    }
}

#[test]
fn occlusion_shortcuts_agree_with_the_general_case() {
    let p = prepare(builtin("cornell-box"), 300);
    let receive = |occlusion: &Occlusion| {
        let receives = vec![true; p.patches.len()];
        let sampling = Sampling {
            emitter_rays: 16,
            ..sampling(1, 0)
        };
        let path = (&p.rays, &p.patches);
        receive_emitted(
            path,
            &p.luminaires,
            occlusion,
            &receives,
            &sampling,
            &|_| (),
        )
        .0
    };
    let tau = |t: f32| Occlusion::Partial(vec![t; p.scene.materials.len()]);
    // sum/sum is 1 exactly where every ray arrives: only patches whose drawn points all see nothing may differ, and
    // those have nothing to see.
    for (a, b) in receive(&Occlusion::Nothing).iter().zip(receive(&tau(1.0))) {
        assert!(
            (*a - b).abs().max_element() <= 1e-5 * a.max_element(),
            "{a} {b}"
        );
    }
    assert_eq!(receive(&Occlusion::Opaque), receive(&tau(0.0)));
}

#[test]
fn alpha_zero_without_rows_is_alpha_zero_with_rows() {
    let p = prepare(builtin("cornell-box"), 300);
    for mode in [Mode::Local, Mode::OneBounce] {
        let transports: Vec<Transport> = p.scene.transports(mode.transport());
        let short = assemble_one(&p, mode.transport(), &sampling(128, 0));
        let materials = PatchMaterials::new(&p.scene, &p.patches, &p.luminaires, &transports);
        let f: FormFactors = all_of_f(&p, mode.transport().tau, &sampling(128, 0));
        let occlusion = Occlusion::new(&p.rays, &transports);
        let path = (&p.rays, &p.patches);
        let receives = materials.receives();
        let (received, _) = receive_emitted(
            path,
            &p.luminaires,
            &occlusion,
            &receives,
            &sampling(128, 0),
            &|_| (),
        );
        let long = Operator::new(f, materials, short.operator.areas().to_vec(), received);
        let found = neumann(&long, &Settings::default()).expect("ends");
        assert_eq!(found.light, solve(&short).light, "{mode}");
        let further = explore(&long, 5).terms;
        assert!(
            further[2..]
                .iter()
                .flatten()
                .all(|l| *l == Light::default())
        );
    }
}

#[test]
fn opaque_rows_by_the_first_hit_are_those_by_all_crossings() {
    let p = prepare(builtin("furnished-room"), 300);
    let n = p.patches.len();
    let variant = |tau: f32| Variant {
        tau: vec![tau; p.scene.materials.len()],
        rows: vec![true; n],
        columns: vec![true; n],
    };
    let both = |variants: &[Variant]| {
        cast(
            &p.scene,
            (&p.rays, &p.patches),
            variants,
            &sampling(512, 0),
            &|_| (),
        )
        .0
    };
    let first = both(&[variant(0.0)]).remove(0);
    let all = both(&[variant(0.0), variant(1.0)]).remove(0);
    assert!(first.rows == all.rows);
    assert_eq!(first.row_sums, all.row_sums);
}

#[test]
fn a_hidden_luminaire_lights_the_scene_and_is_black_itself() {
    let seen = builtin("cornell-box");
    let mut hidden = seen.clone();
    let lamp = hidden
        .materials
        .iter_mut()
        .find(|m| m.emits())
        .expect("a lamp");
    lamp.visibility = Visibility::Hidden;
    let picture = |scene: Scene| {
        let p = prepare(scene, 300);
        let k = assemble_one(&p, Mode::Global.transport(), &sampling(128, 0));
        // A fixed number of terms: the seen lamp counts in the norm that the series is measured by.
        let solution = explore(&k.operator, 12);
        let gathering = GatherSampling::with_samples(16, 0);
        (
            render(&p, &k, &solution, (32, 32), &gathering, &Silent),
            solution,
        )
    };
    let ((bright, a), (dark, b)) = (picture(seen), picture(hidden));
    for (a, b) in a.light.iter().zip(&b.light) {
        assert_eq!(a.invisible, b.invisible);
    }
    assert!(
        bright
            .emission
            .pixels
            .iter()
            .any(|p| *p == Rgb::new(17.0, 12.0, 4.0))
    );
    assert!(dark.emission.pixels.iter().all(|p| *p == Rgb::ZERO));
    assert_eq!(bright.direct, dark.direct);
    assert_eq!(bright.indirect, dark.indirect);
}

/// A room with a sheet in its middle: one two-sided polygon, or two one-sided ones back to back.
fn sheet(two_sided: bool) -> Prepared {
    let mut mesh = Mesh::default();
    let corners =
        [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(x, z)| DVec3::new(x, 0.1, z));
    mesh.cuboid(DVec3::ZERO, DVec3::ONE, DQuat::IDENTITY, Facing::In, 0);
    mesh.polygon(&corners, 1);
    if !two_sided {
        let mut back = corners;
        back.reverse();
        mesh.polygon(&back, 1);
    }
    let mut lamp = grey("lamp", 0.0);
    lamp.emission = Rgb::splat(5.0);
    mesh.polygon(
        &[(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3)].map(|(x, z)| DVec3::new(x, 0.95, z)),
        2,
    );
    let mut sheet = grey("sheet", 0.7);
    sheet.sides = if two_sided { Sides::Two } else { Sides::One };
    prepare(mesh.scene(vec![grey("wall", 0.5), sheet, lamp]), 400)
}

/// Mean light of the sheet's patches that look up or down, and of the walls.
fn of_sheet(p: &Prepared, seed: u32, mode: Transport) -> [f64; 3] {
    let k = assemble_one(p, mode, &sampling(256, seed));
    let solution = neumann(&k.operator, &Settings::default()).expect("converges");
    let (mut sums, mut areas) = ([0.0; 3], [0.0; 3]);
    for (i, l) in solution.light.iter().enumerate() {
        let up = p.patches.point(i, 0.5, 0.5).normal.dot(Vec3::Y) > 0.0;
        let place = match p.patches.materials()[i] {
            1 if up => 0,
            1 => 1,
            _ => 2,
        };
        if p.patches.materials()[i] != 2 {
            sums[place] += p.patches.areas()[i] * f64::from(l.visible.x);
            areas[place] += p.patches.areas()[i];
        }
    }
    [0, 1, 2].map(|k| sums[k] / areas[k])
}

#[test]
fn a_two_sided_sheet_is_two_sheets_back_to_back() {
    // With tau between 0 and 1 two sheets would pass tau² where one passes tau.
    for mode in [transport(1.0, 0.0), transport(0.5, 1.0)] {
        let (one, two) = (sheet(true), sheet(false));
        let found = [0, 1, 2, 3].map(|seed| of_sheet(&one, seed, mode));
        let exact = [0, 1, 2, 3].map(|seed| of_sheet(&two, seed, mode));
        for place in 0..3 {
            let (a, ea) = mean_and_error(&found.map(|f| f[place]));
            let (b, eb) = mean_and_error(&exact.map(|f| f[place]));
            assert!(a > 0.01, "both sides reflect");
            assert!(
                (a - b).abs() < 5.0 * ea.hypot(eb) + 1e-3 * b,
                "{a} +- {ea}, {b} +- {eb}"
            );
        }
    }
}
