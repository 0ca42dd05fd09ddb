//! Kinds of surface: luminaires the camera does not see, and sheets with two sides.

use glam::{DQuat, DVec3, Vec3};
use halflight::Solver;
use halflight::gather::{GatherPass, GatherSampling};
use halflight::light::{Mode, Rgb, Transport, Visibility};
use halflight::render::Discretization;
use halflight::scene::{Scene, Sides};
use halflight::solve::{Settings, explore, neumann};

use crate::common::{Facing, Mesh, Silent, assemble_one, builtin, grey, mean_and_error, sampling, transport};

#[test]
fn a_hidden_luminaire_lights_the_scene_and_is_black_itself() {
    let seen = builtin("cornell-box");
    let mut hidden = seen.clone();
    let lamp = hidden.materials.iter_mut().find(|m| m.emits()).expect("a lamp");
    lamp.visibility = Visibility::Hidden;
    let picture = |scene: Scene| {
        let p = Solver::new(&scene).cut(300);
        let k = assemble_one(&p, Mode::Global.transport(), &sampling(128, 0));
        // A fixed number of terms: the seen lamp counts in the norm that the series is measured by.
        let solution = explore(&k.operator, 12);
        let gathering = GatherSampling::with_samples(16, 0);
        (k.picture(&solution, &GatherPass::new((32, 32), &gathering), &Silent), solution)
    };
    let ((bright, a), (dark, b)) = (picture(seen), picture(hidden));
    for (a, b) in a.light.iter().zip(&b.light) {
        assert_eq!(a.invisible, b.invisible);
    }
    assert!(bright.emission.pixels.iter().any(|p| *p == Rgb::new(17.0, 12.0, 4.0)));
    assert!(dark.emission.pixels.iter().all(|p| *p == Rgb::ZERO));
    assert_eq!(bright.direct, dark.direct);
    assert_eq!(bright.indirect, dark.indirect);
}

/// A room with a sheet in its middle: one two-sided polygon, or two one-sided ones back to back.
fn sheet(two_sided: bool) -> Discretization {
    let mut mesh = Mesh::default();
    let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(x, z)| DVec3::new(x, 0.1, z));
    mesh.cuboid(DVec3::ZERO, DVec3::ONE, DQuat::IDENTITY, Facing::In, 0);
    mesh.polygon(&corners, 1);
    if !two_sided {
        let mut back = corners;
        back.reverse();
        mesh.polygon(&back, 1);
    }
    let mut lamp = grey("lamp", 0.0);
    lamp.emission = Rgb::splat(5.0);
    mesh.polygon(&[(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3)].map(|(x, z)| DVec3::new(x, 0.95, z)), 2);
    let mut sheet = grey("sheet", 0.7);
    sheet.sides = if two_sided { Sides::Two } else { Sides::One };
    Solver::new(&mesh.scene(vec![grey("wall", 0.5), sheet, lamp])).cut(400)
}

/// Mean light of the sheet's patches that look up or down, and of the walls.
fn of_sheet(p: &Discretization, seed: u32, mode: Transport) -> [f64; 3] {
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
            assert!((a - b).abs() < 5.0 * ea.hypot(eb) + 1e-3 * b, "{a} +- {ea}, {b} +- {eb}");
        }
    }
}
