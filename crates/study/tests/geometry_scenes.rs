//! Scenes that are awkward as a whole: cracks, cameras in the wrong place, open sky, extreme sizes and places, one
//! patch and a hundred thousand, and a soup with faces of no area.

use glam::{DQuat, DVec3, Vec3};
use halflight::Solver;
use halflight::form_factors::row_sums;
use halflight::gather::{GatherPass, GatherSampling};
use halflight::light::{Light, Mode, Rgb};
use halflight::pictures::Picture;
use halflight::scene::{Material, Scene};
use halflight::solve::{Settings, neumann};
use halflight_study::{FactorSettings, factors};

use crate::common::rows::objects;
use crate::common::{Facing, Mesh, Silent, all_of_f, assemble_one, builtin, grey, random, sampling};

fn p(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

fn room() -> Mesh {
    let mut mesh = Mesh::default();
    mesh.cuboid(DVec3::ZERO, DVec3::ONE, DQuat::IDENTITY, Facing::In, 0);
    mesh
}

#[test]
fn light_slips_through_no_t_junction() {
    // A unit cube whose lid is cut where its neighbours are not, at places that f32 cannot hold.
    let mut mesh = Mesh::default();
    let (a, b, c, d) = (p(0., 0., 0.), p(1., 0., 0.), p(1., 1., 0.), p(0., 1., 0.));
    mesh.polygon(&[a, b, c, d], 0);
    for (q, r) in [(a, b), (b, c), (c, d), (d, a)] {
        mesh.polygon(&[r, q, q + DVec3::Z, r + DVec3::Z], 0);
    }
    let up = |x: f64, y: f64| p(x, y, 1.0);
    let cuts = [0.0, 0.1, 1.0 / 3.0, 0.7, 1.0];
    for w in cuts.windows(2) {
        mesh.polygon(&[up(w[0], 0.), up(w[0], 1. / 3.), up(w[1], 1. / 3.), up(w[1], 0.)], 0);
    }
    mesh.polygon(&[up(0., 1. / 3.), up(0., 1.), up(0.6, 1.), up(0.6, 1. / 3.)], 0);
    mesh.polygon(&[up(0.6, 1. / 3.), up(0.6, 1.), up(1., 1.), up(1., 1. / 3.)], 0);
    let prepared = Solver::new(&mesh.scene(vec![grey("wall", 0.5)])).cut(100);
    let f = all_of_f(&prepared, 0.0, &sampling(16_384, 0));
    let sums = row_sums(&f, prepared.patches.areas()).expect("rays were cast");
    // A crack of a rounding, 6e-8 wide and a few units long, takes 1e-7 of the rays.
    assert!(sums.mean >= 1.0 - 1e-6 && sums.max <= 1.0, "{sums:?}");
}

/// The picture of a scene from a point, looking along +x.
fn seen_from(mut scene: Scene, eye: DVec3) -> Picture {
    scene.camera.position = scene.frame.to_unit(eye).as_vec3();
    scene.camera.forward = Vec3::X;
    scene.camera.right = Vec3::NEG_Y;
    scene.camera.up = Vec3::Z;
    let prepared = Solver::new(&scene).cut(300);
    let mode = assemble_one(&prepared, Mode::Global.transport(), &sampling(64, 0));
    let solution = neumann(&mode.operator, &Settings::default()).expect("converges");
    let gathering = GatherSampling::with_samples(16, 0);
    mode.picture(&solution, &GatherPass::new((16, 16), &gathering), &Silent).total()
}

/// A room whose ceiling glows faintly, with a closed crate in it.
fn room_with_crate() -> Scene {
    let mut mesh = room();
    mesh.cuboid(p(0.3, 0.0, -0.8), DVec3::splat(0.2), DQuat::IDENTITY, Facing::Out, 1);
    let down = [p(-0.5, -0.5, 0.99), p(-0.5, 0.5, 0.99), p(0.5, 0.5, 0.99), p(0.5, -0.5, 0.99)];
    mesh.polygon(&down, 2);
    let lamp = Material::new("lamp", Rgb::ZERO, Rgb::ONE);
    mesh.scene(vec![grey("wall", 0.5), grey("crate", 0.5), lamp])
}

#[test]
fn a_camera_inside_an_object_or_on_a_wall() {
    // Inside the crate there are only black backs.
    let inside = seen_from(room_with_crate(), p(0.3, 0.0, -0.8));
    assert!(inside.pixels.iter().all(|c| *c == Rgb::ZERO));
    // On the floor half of the view is in the room, in its corner a quarter; on the wall behind the camera, and in the
    // lamp's plane, all of it.
    for (eye, within) in
        [(p(-0.5, 0.0, -1.0), 128), (p(-1.0, -1.0, -1.0), 64), (p(-1.0, 0.0, 0.0), 256), (p(-0.9, 0.0, 0.99), 256)]
    {
        let picture = seen_from(room_with_crate(), eye);
        let right = |c: &Rgb| c.is_finite() && c.min_element() >= 0.0;
        assert!(picture.pixels.iter().all(right), "{eye}");
        let lit = picture.pixels.iter().filter(|c| c.x > 0.0).count();
        assert!(lit >= within, "{eye}: {lit} pixels of 256");
    }
    // On the far wall, looking out of the room, there is nothing but sky.
    let out = seen_from(room_with_crate(), p(1.0, 0.5, 0.5));
    assert!(out.pixels.iter().all(|c| c.is_finite()));
}

#[test]
fn a_scene_open_to_the_sky() {
    // A cube without its lid: of the floor's rays 0.19982 leave, of the walls' 0.20004.
    let mut mesh = Mesh::default();
    let (a, b, c, d) = (p(0., 0., 0.), p(1., 0., 0.), p(1., 1., 0.), p(0., 1., 0.));
    mesh.polygon(&[a, b, c, d], 0);
    for (q, r) in [(a, b), (b, c), (c, d), (d, a)] {
        mesh.polygon(&[r, q, q + DVec3::Z, r + DVec3::Z], 1);
    }
    let prepared = Solver::new(&mesh.scene(vec![grey("floor", 0.5), grey("wall", 0.5)])).cut(200);
    let open = |seed: u32, material: u32| {
        let f = all_of_f(&prepared, 0.0, &sampling(1024, seed));
        let (mut sum, mut area) = (0.0, 0.0);
        for (i, a) in prepared.patches.areas().iter().enumerate() {
            if prepared.patches.materials()[i] == material {
                sum += a * (1.0 - f64::from(f.row_sums[i].expect("rays were cast")));
                area += a;
            }
        }
        sum / area
    };
    for (material, truth) in [(0, 0.199_824_895_7), (1, 0.200_043_776_1)] {
        let samples: Vec<f64> = (0..8).map(|seed| open(seed, material)).collect();
        let (mean, error) = crate::common::mean_and_error(&samples);
        assert!((mean - truth).abs() <= 4.0 * error, "{mean} +- {error}, exactly {truth}");
    }
}

#[test]
fn size_and_place_leave_form_factors_as_they_are() {
    let (sx, sy, sz) = (DVec3::X, DVec3::Y, DVec3::Z);
    let walls = [
        (DVec3::ZERO, sx, sy),
        (DVec3::ZERO, sy, sz),
        (DVec3::ZERO, sz, sx),
        (DVec3::ONE, -sy, -sx),
        (DVec3::ONE, -sz, -sy),
        (DVec3::ONE, -sx, -sz),
    ];
    let far = 1e5 * p(1.0, -0.7, 0.3);
    for (scale, shift) in [(1e-6, DVec3::ZERO), (1e6, DVec3::ZERO), (1.0, far), (1e6, far)] {
        let place = |q: DVec3| scale * (q + shift);
        let polygon = |&(o, u, v): &(DVec3, DVec3, DVec3)| [o, o + u, o + u + v, o + v].map(place).to_vec();
        let scene = objects(&walls.iter().map(polygon).collect::<Vec<_>>());
        let settings = FactorSettings { tolerance: 1e-6, seed: 0 };
        let table = factors(&scene, &[0.0], &settings, &Silent);
        for f in &table.factors {
            let truth = match (f.from, f.to) {
                (i, j) if i == j => 0.0,
                (i, j) if i % 3 == j % 3 => 0.199_824_895_698_387_4,
                _ => 0.200_043_776_075_403_15,
            };
            // Coordinates at 1e5 sizes are rounded to 1e-11 of the size.
            assert!((f.share.value - truth).abs() < 1e-9, "{scale} {shift}: {f:?}");
        }
    }
}

#[test]
fn one_patch_two_and_a_hundred_thousand() {
    let glow = || Material::new("glow", Rgb::splat(0.5), Rgb::ONE);
    let triangle = |z: f64| [p(0., 0., z), p(1., 0., z), p(0., 1., z)];
    let mut one = Mesh::default();
    one.polygon(&triangle(0.0), 0);
    let alone = Solver::new(&one.scene(vec![glow()])).cut(1);
    let k = assemble_one(&alone, Mode::Global.transport(), &sampling(64, 0)).operator;
    let solution = neumann(&k, &Settings::default()).expect("ends");
    assert_eq!(alone.patches.len(), 1);
    assert!(solution.light.iter().all(|l| l.visible == Rgb::ONE));
    // Two triangles face to face by hand: light as emitted goes by its closed form r, all that is reflected by the rows
    // x and y.
    let mut two = Mesh::default();
    two.polygon(&triangle(0.0), 0);
    let mut other = triangle(0.5);
    other.reverse();
    two.polygon(&other, 0);
    let pair = Solver::new(&two.scene(vec![glow()])).cut(1);
    assert_eq!(pair.patches.len(), 2);
    let f = all_of_f(&pair, 0.0, &sampling(4096, 0)).rows;
    let k = assemble_one(&pair, Mode::Global.transport(), &sampling(4096, 0)).operator;
    let solution = neumann(&k, &Settings::default()).expect("converges");
    let (x, y) = (f64::from(f.get(0, 1)), f64::from(f.get(1, 0)));
    let [r, q] = [0, 1].map(|i| f64::from(k.received()[i].x));
    let exact = 1.0 + (0.5 * r + 0.25 * x * q) / (1.0 - 0.25 * x * y);
    let found = f64::from(solution.light[0].visible.x);
    // Rays that hit or miss have a standard error of at most this.
    let error = (r * (1.0 - r) / 4096.0).sqrt();
    assert!((x - r).abs() < 4.0 * error && (y - q).abs() < 4.0 * error, "{x} {r} {y} {q}");
    assert!((found / exact - 1.0).abs() < 2e-4, "{found} {exact}");
    // A furnace of a hundred thousand patches: L = E / (1 - rho), terms to 1e-4 of the sum.
    let mut scene = builtin("furnace");
    scene.materials[0].rho = Rgb::splat(0.5);
    scene.materials[0].emission = Rgb::ONE;
    let many = Solver::new(&scene).cut(100_000);
    assert!(many.patches.len() > 80_000, "{}", many.patches.len());
    let k = assemble_one(&many, Mode::Global.transport(), &sampling(16, 0)).operator;
    let solution = neumann(&k, &Settings::default()).expect("converges");
    let right = |l: &Light| (l.visible - Rgb::splat(2.0)).abs().max_element() < 1e-3;
    assert!(solution.light.iter().all(right));
}

#[test]
fn a_soup_with_one_face_in_twenty_of_no_area() {
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    for k in 0..2000 {
        let r = |purpose: u32| random(k, purpose) - 0.5;
        let corner = p(r(0), r(1), r(2));
        let (u, v) = (0.1 * p(r(3), r(4), r(5)), 0.1 * p(r(6), r(7), r(8)));
        let first = vertices.len() as u32;
        let third = match k % 60 {
            0 => corner + 2.0 * u,       // on a line
            20 => corner,                // twice the same corner
            40 => corner + 1e-9 * v + u, // thinner than f32
            _ => corner + v,
        };
        vertices.extend([corner, corner + u, third]);
        faces.push((vec![first, first + 1, first + 2], 0));
    }
    let glow = Material::new("glow", Rgb::splat(0.7), Rgb::ONE);
    let scene = Scene::from_faces("soup", &vertices, &faces, vec![glow]).expect("some faces have area");
    assert_eq!(scene.faces.len(), 1900);
    assert!(scene.warnings.iter().any(|w| w.contains("100 faces")), "{:?}", scene.warnings);
    let prepared = Solver::new(&scene).cut(500);
    for tau in [0.0, 1.0] {
        let f = all_of_f(&prepared, tau, &sampling(128, 0));
        let sums = f.row_sums.iter().map(|s| s.expect("rays were cast"));
        assert!(sums.clone().all(|s| s.is_finite() && s >= 0.0));
        assert!(tau == 1.0 || sums.clone().all(|s| s <= 1.0));
    }
    let k = assemble_one(&prepared, Mode::Global.transport(), &sampling(128, 0)).operator;
    let solution = neumann(&k, &Settings::default()).expect("rho < 1 converges");
    // Between E and the furnace's E / (1 - rho).
    let limit = 1.0 / 0.3 + 1e-3;
    assert!(solution.light.iter().all(|l| (1.0..=limit).contains(&l.visible.x)));
}
