//! A sky, against closed forms, against the path tracer in every mode, and against a room that glows as the sky does.
//!
//! Not tested here: figures and tables of the commands.

use std::f64::consts::PI;

use glam::{DQuat, DVec3};
use halflight::Solver;
use halflight::light::{Light, Mode, Rgb, Transport};
use halflight::pictures::Picture;
use halflight::rays::Rays;
use halflight::render::{Discretization, Fineness};
use halflight::scene::{
    AddedLight, Camera, LoadOptions, Material, Scene, SceneError, Sides, Sky, SkyLight, SkyPatches,
};
use halflight::solve::{Emitted, RaySettings, Settings, Shooting, ShootingSettings, neumann};
use halflight_reference::{Mean, NextEvent, TraceSettings, Tracer};
use halflight_study::{FactorSettings, factors};

use crate::common::{Facing, Mesh, Silent, assemble_one, grey, sampling, transport};

/// Howell's catalogue C-14: unit squares that share an edge at a right angle, and C-11: opposite faces of a cube.
const ADJACENT: f64 = 0.200_043_776_1;
const OPPOSITE: f64 = 0.199_824_895_7;

const UP: DVec3 = DVec3::Y;

fn uniform(radiance: f32) -> SkyLight {
    SkyLight { upper: Rgb::splat(radiance), lower: Rgb::splat(radiance) }
}

fn under(mut scene: Scene, sky: SkyLight) -> Scene {
    scene.set_sky(sky, UP);
    scene
}

/// A square of side 2 about the origin, its front towards `normal`.
fn square(mesh: &mut Mesh, normal: DVec3, material: u32) {
    let (u, v) = normal.any_orthonormal_pair();
    let (u, v) = if u.cross(v).dot(normal) > 0.0 { (u, v) } else { (v, u) };
    mesh.polygon(&[-u - v, u - v, u + v, -u + v], material);
}

/// The unit cube without its lid; the floor is material 0, the walls 1; they look inwards.
fn open_box(floor: Material, walls: Material) -> Scene {
    let p = DVec3::new;
    let mut mesh = Mesh::default();
    mesh.polygon(&[p(0., 0., 0.), p(0., 0., 1.), p(1., 0., 1.), p(1., 0., 0.)], 0);
    mesh.polygon(&[p(0., 0., 0.), p(0., 1., 0.), p(0., 1., 1.), p(0., 0., 1.)], 1);
    mesh.polygon(&[p(1., 0., 0.), p(1., 0., 1.), p(1., 1., 1.), p(1., 1., 0.)], 1);
    mesh.polygon(&[p(0., 0., 0.), p(1., 0., 0.), p(1., 1., 0.), p(0., 1., 0.)], 1);
    mesh.polygon(&[p(0., 0., 1.), p(0., 1., 1.), p(1., 1., 1.), p(1., 0., 1.)], 1);
    mesh.scene(vec![floor, walls])
}

/// A table on a floor and a wall behind it.
fn bare_yard() -> Mesh {
    let p = DVec3::new;
    let mut mesh = Mesh::default();
    mesh.polygon(&[p(-2., 0., 2.), p(2., 0., 2.), p(2., 0., -2.), p(-2., 0., -2.)], 0);
    mesh.polygon(&[p(-2., 0., -2.), p(2., 0., -2.), p(2., 2., -2.), p(-2., 2., -2.)], 1);
    mesh.cuboid(p(0.2, 0.8, 0.1), p(0.8, 0.1, 0.5), DQuat::from_rotation_y(0.3), Facing::Out, 2);
    mesh
}

/// The bare yard with a lamp that hangs in it.
fn yard() -> Mesh {
    let p = DVec3::new;
    let mut mesh = bare_yard();
    mesh.polygon(&[p(-1.5, 1.2, -1.0), p(-1.0, 1.2, -1.0), p(-1.0, 1.2, -0.5), p(-1.5, 1.2, -0.5)], 3);
    mesh
}

fn yard_materials() -> Vec<Material> {
    let coloured = |name, rho| Material { rho, ..grey(name, 0.0) };
    let lamp = Material { emission: Rgb::new(3.0, 2.0, 1.0), ..grey("lamp", 0.0) };
    let wall = coloured("wall", Rgb::new(0.7, 0.3, 0.2));
    vec![grey("floor", 0.6), wall, coloured("table", Rgb::new(0.3, 0.5, 0.6)), lamp]
}

const TWO_COLOURS: SkyLight = SkyLight { upper: Rgb::new(0.6, 0.8, 1.2), lower: Rgb::new(0.3, 0.2, 0.1) };

/// Light of the patches of a material, area-weighted mean, red.
fn mean_light(p: &Discretization, light: &[Light], material: u32) -> f64 {
    let own = (0..light.len()).filter(|&i| p.patches.materials()[i] == material);
    let (sum, area) = own.fold((0.0, 0.0), |(sum, area), i| {
        let a = p.patches.areas()[i];
        (sum + a * f64::from(light[i].visible.x), area + a)
    });
    sum / area
}

fn solved(p: &Discretization, mode: Transport, rays: u32) -> Vec<Light> {
    let k = assemble_one(p, mode, &sampling(rays, 1));
    neumann(&k.operator, &Settings::default()).expect("converges").light
}

fn traced(scene: &Scene, mode: Transport, size: usize, samples: u32) -> (Picture, Picture, Mean) {
    let rays = Rays::new(scene);
    let settings = TraceSettings { next_event: NextEvent::On, seed: 3, ..TraceSettings::default() };
    let mut tracer = Tracer::new(scene, &rays, &scene.transports(mode), (size, size), &settings);
    tracer.pass(samples);
    (tracer.picture(), tracer.standard_error().expect("several samples"), tracer.mean())
}

/// Every ray of a plane that nothing stands on sees the sky: radiosity rho pi L, exactly, whatever the mode.
#[test]
fn a_plane_reflects_what_its_half_of_the_sky_sends() {
    let sky = SkyLight { upper: Rgb::new(2.0, 1.0, 0.5), lower: Rgb::new(0.25, 0.75, 4.0) };
    let half = 0.5 * (sky.upper + sky.lower);
    for (normal, received) in [(DVec3::Y, sky.upper), (DVec3::NEG_Y, sky.lower), (DVec3::X, half)] {
        let mut mesh = Mesh::default();
        square(&mut mesh, normal, 0);
        let p = Solver::new(&under(mesh.scene(vec![grey("plane", 0.5)]), sky)).cut(16);
        for mode in Mode::ALL {
            let light = solved(&p, mode.transport(), 1024);
            let expected = 0.5 * received;
            let plane = (0..light.len()).filter(|&i| p.patches.materials()[i] == 0);
            for l in plane.map(|i| light[i]) {
                // Sobol points lie on both sides of the horizon in equal numbers, to one in a thousand.
                let allowed = if normal == DVec3::X { 4e-3 } else { 1e-6 };
                assert!((l.visible - expected).abs().max_element() < allowed, "{normal} {mode}: {l:?} {expected}");
            }
        }
    }
}

#[test]
fn the_picture_of_a_plane_is_exact_within_its_error() {
    let mut mesh = Mesh::default();
    square(&mut mesh, DVec3::new(0.0, 1.0, 0.0), 0);
    let scene = under(mesh.scene(vec![grey("plane", 0.5)]), uniform(1.0));
    for mode in Mode::ALL {
        let found = Solver::new(&scene).render(mode, (24, 24)).tolerance(0.01).expect("a picture");
        assert!(found.error.total < 0.01);
        // All of a pixel is sky, plane or black back, or an edge between them.
        let (mut plane, mut background) = (0, 0);
        for p in &found.picture.pixels {
            plane += usize::from((p.x - 0.5).abs() < 0.005);
            background += usize::from(p.x == 1.0);
        }
        assert!(background > 50 && plane > 50, "{mode}: {plane} {background}");
    }
}

/// Two squares that share an edge at a right angle see each other by Howell's C-14, and the sky by the rest.
#[test]
fn a_corner_sees_the_sky_by_the_rest_of_its_form_factor() {
    let p = DVec3::new;
    let mut mesh = Mesh::default();
    mesh.polygon(&[p(0., 0., 0.), p(0., 0., 1.), p(1., 0., 1.), p(1., 0., 0.)], 0);
    mesh.polygon(&[p(0., 0., 0.), p(0., 1., 0.), p(0., 1., 1.), p(0., 0., 1.)], 1);
    let scene = under(mesh.scene(vec![grey("floor", 0.5), grey("wall", 0.25)]), uniform(1.0));
    let prepared = Solver::new(&scene.clone()).cut(200);
    let light = solved(&prepared, Mode::OneBounce.transport(), 4096);
    for (material, rho) in [(0, 0.5), (1, 0.25)] {
        let found = mean_light(&prepared, &light, material);
        assert!((found - rho * (1.0 - ADJACENT)).abs() < 1e-3 * rho, "{material}: {found}");
    }
    let k = assemble_one(&prepared, Mode::Global.transport(), &sampling(256, 0));
    let row_sums = k.row_sums.expect("rays were cast");
    assert!((row_sums.min - 1.0).abs() < 1e-5 && (row_sums.max - 1.0).abs() < 1e-5, "{row_sums:?}");
}

#[test]
fn a_room_sees_the_sky_through_its_opening() {
    let scene = under(open_box(grey("floor", 1.0), grey("walls", 1.0)), uniform(1.0));
    let p = Solver::new(&scene.clone()).cut(300);
    let light = solved(&p, Mode::OneBounce.transport(), 4096);
    for (material, expected) in [(0, OPPOSITE), (1, ADJACENT)] {
        let found = mean_light(&p, &light, material);
        assert!((found / expected - 1.0).abs() < 3e-3, "{material}: {found} {expected}");
    }
    // The table of form factors has the sky as a column, and rows that sum to 1.
    let tau = vec![0.0; scene.materials.len()];
    let table = factors(&scene, &tau, &FactorSettings { tolerance: 1e-3, seed: 0 }, &Silent);
    assert_eq!(table.columns.last().map(String::as_str), Some("sky"));
    assert_eq!(table.rows.len() + 1, table.columns.len());
    for row in &table.rows {
        assert!((row.sum.value - 1.0).abs() < 4.0 * row.sum.error + 1e-6, "{row:?}");
    }
    let exact = (OPPOSITE + 4.0 * ADJACENT) / 5.0;
    let sky = table.factors.last().expect("a sky").share;
    assert!((sky.value - exact).abs() < 4.0 * sky.error, "{sky:?} {exact}");
}

/// Where everything emits (1 - rho) L on both sides and the sky is L, all light is L: on patches, in pictures and in
/// paths, by shooting.
#[test]
fn a_furnace_may_be_open_to_the_sky() {
    const L: f64 = 0.5;
    let glowing = |name, rho: f32| Material {
        emission: Rgb::splat((1.0 - rho) * L as f32),
        sides: Sides::Two,
        ..grey(name, rho)
    };
    let materials = vec![glowing("floor", 0.8), glowing("wall", 0.5), glowing("table", 0.3)];
    let scene = under(bare_yard().scene(materials), uniform(L as f32));
    let p = Solver::new(&scene.clone()).cut(400);
    // Small emitters are asked for by closed form and visibility rays, whose errors differ from patch to patch.
    let check = |light: &[Light], what: &str| {
        for material in 0..3 {
            let mean = mean_light(&p, light, material);
            println!("{what} {material}: {mean}");
            assert!((mean / L - 1.0).abs() < 0.01, "{what} {material}: {mean}");
        }
    };
    check(&solved(&p, Mode::Global.transport(), 256), "rows");
    for emitted in [Emitted::ClosedForm, Emitted::Rays] {
        let settings = RaySettings { rays: 1 << 19, emitted, ..RaySettings::default() };
        let shooter = p.ray_shooter(Mode::Global.transport(), settings);
        let settings = ShootingSettings { unshot: 1e-4, ..ShootingSettings::default() };
        let mut shooting = Shooting::new(&shooter, settings).expect("converges");
        shooting.run(|_| ()).expect("converges");
        check(&shooting.light(), "shooting");
    }
    let found = Solver::new(&scene).render(Mode::Global, (24, 24)).tolerance(0.01).expect("a picture");
    let (paths, _, mean) = traced(&scene, Mode::Global.transport(), 24, 64);
    let squares = found.picture.pixels.iter().map(|p| (f64::from(p.x) / L - 1.0).powi(2));
    let rms = (squares.sum::<f64>() / paths.pixels.len() as f64).sqrt();
    println!("picture {rms}, stated {}; paths {mean:?}", found.error.total);
    assert!(rms < 0.015, "{rms}");
    assert!((mean.value[0] - L).abs() < 4.0 * mean.error[0] + 1e-6, "{mean:?}");
}

/// By how many standard errors two pictures differ in the mean of each of 4 x 4 blocks, the largest; `slack` is allowed
/// beside them, as a share of the picture.
fn most_apart(a: &Picture, b: &Picture, error: &Picture, slack: f64) -> f64 {
    let n = a.width / 4;
    let mut most: f64 = 0.0;
    for block in 0..16 {
        let (x0, y0) = (n * (block % 4), n * (block / 4));
        let (mut d, mut v, mut s) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
        for k in (0..n * n).map(|k| (y0 + k / n) * a.width + x0 + k % n) {
            d += (a.pixels[k] - b.pixels[k]).as_dvec3();
            s += b.pixels[k].as_dvec3();
            v += error.pixels[k].as_dvec3().powf(2.0);
        }
        let sigma = (v + (slack * s).powf(2.0)).map(f64::sqrt);
        most = most.max((d / sigma.max(DVec3::splat(1e-9))).abs().max_element());
    }
    most
}

#[test]
fn every_mode_agrees_with_the_path_tracer() {
    let scene = under(yard().scene(yard_materials()), TWO_COLOURS);
    let mut modes: Vec<Transport> = Mode::ALL.iter().map(|m| m.transport()).collect();
    modes.push(transport(0.5, 0.5));
    for mode in modes {
        let found = Solver::new(&scene).render(mode, (32, 32)).tolerance(0.005).expect("a picture");
        let (paths, error, _) = traced(&scene, mode, 32, 1024);
        let apart = most_apart(&found.picture, &paths, &error, 0.5 * found.error.total);
        println!("{}: {apart:.2} standard errors, stated {:.3} %", mode.label(), 100.0 * found.error.total);
        // 48 numbers: 4 is passed by chance once in 300 runs.
        assert!(apart < 4.0, "{}: {apart}", mode.label());
    }
}

/// The yard in the middle of a glowing room, a hundred times as large: what the sky stands for.
#[test]
fn a_glowing_room_around_everything_gives_the_same_picture() {
    let camera = |mut scene: Scene| {
        let eye = DVec3::new(1.5, 2.0, 5.0);
        let view = Camera::look_at(eye, DVec3::new(0.0, 0.5, 0.0), UP, 40.0).expect("a view");
        scene.camera = Camera { position: scene.frame.to_unit(eye).as_vec3(), ..view };
        scene
    };
    let sky = camera(under(yard().scene(yard_materials()), uniform(0.7)));
    let mut mesh = yard();
    mesh.cuboid(DVec3::ZERO, DVec3::splat(200.0), DQuat::IDENTITY, Facing::In, 4);
    let mut materials = yard_materials();
    materials.push(Material { emission: Rgb::splat(0.7), tau: Some(0.0), ..grey("room", 0.0) });
    let room = camera(mesh.scene(materials));
    for mode in [Mode::Global.transport(), Mode::OneBounce.transport(), transport(0.5, 0.5)] {
        let (a, e, _) = traced(&sky, mode, 32, 512);
        let (b, f, _) = traced(&room, mode, 32, 512);
        let pairs = e.pixels.iter().zip(&f.pixels);
        let error = Picture { pixels: pairs.map(|(e, f)| (*e * *e + *f * *f).map(f32::sqrt)).collect(), ..e.clone() };
        let apart = most_apart(&a, &b, &error, 0.0);
        println!("{}: traced {apart:.2}", mode.label());
        assert!(apart < 4.0, "{}: {apart}", mode.label());
        let found = Solver::new(&sky).render(mode, (32, 32)).tolerance(0.01).expect("a picture");
        let apart = most_apart(&found.picture, &b, &f, 0.5 * found.error.total);
        println!("{}: rendered {apart:.2}", mode.label());
        assert!(apart < 4.0, "{}: {apart}", mode.label());
    }
}

/// A room of 4 by 2.5 by 3 m with a window of 2 by 1 m in the wall at z = 0, looked at from the side of the window.
fn room_with_a_window() -> Scene {
    let p = DVec3::new;
    let mut mesh = Mesh::default();
    mesh.polygon(&[p(0., 0., 0.), p(0., 0., 3.), p(4., 0., 3.), p(4., 0., 0.)], 0);
    mesh.polygon(&[p(0., 2.5, 0.), p(4., 2.5, 0.), p(4., 2.5, 3.), p(0., 2.5, 3.)], 1);
    mesh.polygon(&[p(0., 0., 0.), p(0., 2.5, 0.), p(0., 2.5, 3.), p(0., 0., 3.)], 1);
    mesh.polygon(&[p(4., 0., 0.), p(4., 0., 3.), p(4., 2.5, 3.), p(4., 2.5, 0.)], 1);
    mesh.polygon(&[p(0., 0., 3.), p(0., 2.5, 3.), p(4., 2.5, 3.), p(4., 0., 3.)], 1);
    for [x, y, right, top] in [[0., 0., 4., 1.], [0., 2., 4., 2.5], [0., 1., 1., 2.], [3., 1., 4., 2.]] {
        mesh.polygon(&[p(x, y, 0.), p(right, y, 0.), p(right, top, 0.), p(x, top, 0.)], 1);
    }
    let mut scene = mesh.scene(vec![grey("floor", 0.2), grey("walls", 0.5)]);
    let eye = p(0.6, 1.8, 0.1);
    let view = Camera::look_at(eye, p(2.6, 0.4, 3.0), UP, 60.0).expect("a view");
    scene.camera = Camera { position: scene.frame.to_unit(eye).as_vec3(), ..view };
    scene
}

/// One patch 100 times as bright as all others shines through a window: what a picture states is at least what it is
/// off by, of two seeds together.
#[test]
fn the_error_of_a_room_below_one_bright_patch_is_what_is_stated() {
    let mut radiances = vec![Rgb::ONE; 146];
    // North is -z; the patch about it in the fourth row, at 42°, shines in.
    radiances[1 + 30 + 30 + 24] = Rgb::splat(100.0);
    let mut scene = room_with_a_window();
    scene.set_patched_sky(&SkyPatches::new(radiances).expect("patches"), UP, Sky::usual_north(UP));
    let (paths, error, _) = traced(&scene, Mode::Global.transport(), 24, 4096);
    let sum = |of: &dyn Fn(usize) -> f64| (0..paths.pixels.len()).map(of).sum::<f64>();
    let signal = sum(&|k| f64::from(paths.pixels[k].x).powi(2));
    let noise = sum(&|k| f64::from(error.pixels[k].x).powi(2)) / signal;
    let (mut squares, mut stated) = (0.0, 0.0);
    for seed in [1, 2] {
        let found = Solver::new(&scene).seed(seed).render(Mode::Global, (24, 24)).tolerance(0.04).expect("a picture");
        let off = sum(&|k| f64::from(found.picture.pixels[k].x - paths.pixels[k].x).powi(2)) / signal;
        println!("{seed}: {:.4} off, of which paths {:.4}; stated {:.4}", off.sqrt(), noise.sqrt(), found.error.total);
        squares += off - noise;
        stated += found.error.total.powi(2);
    }
    // The noise of the paths is known to a few percent of itself.
    assert!(squares < stated + 0.1 * noise, "{squares} {stated} {noise}");
}

/// Rays that reach the sky tell nothing of how near things are: below a sheet over a floor the irradiance changes
/// within the sheet's height, though most of the floor's hemisphere is open.
#[test]
fn shade_below_a_sheet_is_no_brighter_where_effort_is_fixed() {
    let p = DVec3::new;
    let mut mesh = Mesh::default();
    square(&mut mesh, DVec3::Y, 0);
    mesh.polygon(&[p(-0.5, 0.2, 0.5), p(0.5, 0.2, 0.5), p(0.5, 0.2, -0.5), p(-0.5, 0.2, -0.5)], 1);
    let sheet = Material { sides: Sides::Two, ..grey("sheet", 0.5) };
    let half = SkyLight { upper: Rgb::ONE, lower: Rgb::splat(0.3) };
    let mut scene = under(mesh.scene(vec![grey("floor", 0.5), sheet]), half);
    let eye = DVec3::new(0.0, 0.5, 3.0);
    let view = Camera::look_at(eye, DVec3::new(0.0, 0.05, 0.0), UP, 20.0).expect("a view");
    scene.camera = Camera { position: scene.frame.to_unit(eye).as_vec3(), ..view };
    let found = Solver::new(&scene).render(Mode::OneBounce, (48, 48)).fineness(Fineness::default(), 16).expect("light");
    let (paths, error, _) = traced(&scene, Mode::OneBounce.transport(), 48, 2048);
    let sum = |picture: &Picture| picture.pixels.iter().map(|p| f64::from(p.x)).sum::<f64>();
    let noise = error.pixels.iter().map(|e| f64::from(e.x).powi(2)).sum::<f64>().sqrt();
    let apart = (sum(&found.picture) - sum(&paths)).abs() / sum(&paths);
    // 0.37 % with the sky at infinity.
    assert!(apart < 0.002 + 4.0 * noise / sum(&paths), "{apart}");
}

/// Of a floor alone the power of KE is pi A rho L; walks from the sphere around the scene tell it too.
#[test]
fn powers_of_the_terms_are_those_of_the_sky() {
    let mut mesh = Mesh::default();
    square(&mut mesh, DVec3::Y, 0);
    let solver = Solver::new(&under(mesh.scene(vec![grey("plane", 0.5)]), uniform(2.0)));
    let found = solver.bounces(Mode::Global, 2).tolerance(0.01);
    let [emitted, reflected] = [0, 1].map(|n| found.solution.bounces[n].power[0]);
    // The sphere around a square of side 2 has the radius sqrt 2.
    assert!((emitted / (4.0 * PI * 2.0 * PI * 2.0) - 1.0).abs() < 1e-5, "{emitted}");
    // Walks are taken where patches differ from them by more than they state; these state nothing. Walks stop at 0.25
    // %.
    assert!((reflected / (PI * 4.0 * 0.5 * 2.0) - 1.0).abs() < 4.0 * 0.0025, "{reflected}");
    assert!(found.errors.iter().all(|&error| error <= 0.01), "{:?}", found.errors);
}

const FLOOR: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";

fn read(sky: &str) -> Result<Scene, SceneError> {
    read_with(sky, "")
}

/// With the text of the file that `patches` names.
fn read_with(sky: &str, patches: &str) -> Result<Scene, SceneError> {
    let toml = format!(
        "obj = \"floor.obj\"\n[camera]\nposition = [0, 0, 5]\ntarget = [0, 1, 0]\nup = [0, 0, 1]\n[sky]\n{sky}\n"
    );
    Scene::from_toml_text("floor", &toml, FLOOR, patches, LoadOptions::default())
}

#[test]
fn a_scene_file_has_a_sky() {
    let scene = read("upper = [1, 2, 3]").expect("a correct scene");
    scene.require_emission().expect("light");
    assert_eq!(scene.sky.as_ref().expect("a sky").up, glam::Vec3::Z);
    let [upper, lower] = [1, 2].map(|k| scene.materials[k].emission);
    assert_eq!((upper, lower), (Rgb::new(1.0, 2.0, 3.0), Rgb::ZERO));
    assert_eq!((scene.solid_faces(), scene.faces.len()), (2, 4));
    assert!(matches!(read("radiance = [0, 0, 0]").expect("correct").require_emission(), Err(SceneError::Dark { .. })));
    for (text, message) in [
        (
            "radiance = [1, -2, 0]",
            "floor.toml, line 7: `radiance` of the sky is -2; it must be finite and not negative",
        ),
        ("upper = [1, 2, inf]", "floor.toml, line 7: `upper` of the sky is inf; it must be finite and not negative"),
        ("lower = [nan, 2, 0]", "floor.toml, line 7: `lower` of the sky is NaN; it must be finite and not negative"),
        (
            "lower = [1, 2, 0]\nradiance = [1, 1, 1]",
            "floor.toml, line 8: `radiance` and `upper` or `lower` of the sky are given together",
        ),
    ] {
        assert_eq!(read(text).expect_err(text).to_string(), message);
    }
}

#[test]
fn a_scene_file_has_a_sky_of_patches() {
    let rows = |count: usize| -> String { (0..count).map(|k| format!("{k} 1 2\n")).collect() };
    let scene = read_with("patches = \"sky.txt\"\nnorth = [1, 0, 1]", &rows(578)).expect("a correct scene");
    let sky = scene.sky.as_ref().expect("a sky");
    assert_eq!((sky.up, sky.north, sky.cells()), (glam::Vec3::Z, glam::Vec3::X, 578));
    assert_eq!(scene.material(sky.face(glam::Vec3::Z)).emission, Rgb::new(577.0, 1.0, 2.0));
    assert_eq!(scene.material(sky.face(glam::Vec3::NEG_Z)).emission, Rgb::new(0.0, 1.0, 2.0));
    // The first above the horizon lies to the north; east of +x with z up is -y.
    let low = |x: f32, y: f32| scene.material(sky.face(glam::Vec3::new(x, y, 0.01).normalize())).emission.x;
    assert_eq!([low(1.0, 0.0), low(0.0, -1.0), low(-1.0, 0.0), low(0.0, 1.0)], [1.0, 16.0, 31.0, 46.0]);
    let file = "patches = \"sky.txt\"";
    for (keys, text, message) in [
        (file, rows(145), "sky.txt, line 145: ends after 145 patches; a sky has 146, 578, 1298, 2306 or 2 + 144 n²"),
        (file, String::new(), "sky.txt, line 1: ends after 0 patches"),
        (file, rows(146).replace("\n7 1", "\n7 -1"), "sky.txt, line 8: the radiance -1 of a patch must be finite and"),
        (file, rows(146).replace("\n7 1", "\n7 nan"), "sky.txt, line 8: the radiance NaN of a patch must be finite"),
        (file, rows(146).replace("\n7 1", "\n7 x"), "sky.txt, line 8: `x` is no number"),
        (file, rows(146).replace("\n7 1", "\n7"), "sky.txt, line 8: has 2 numbers; a patch has three, R G B"),
        ("patches = \"sky.txt\"\ncolumn = 1", rows(146), "sky.txt, line 1: is no matrix of Radiance's"),
        (file, "#?RADIANCE\nNROWS=1\nNCOLS=1\n\n1 2".into(), "sky.txt, line 1: has 2 numbers"),
        (file, "#?RADIANCE\nNROWS=1\nNCOLS=2\n\n1 1 1 2 2 2".into(), "sky.txt, line 1: has 2 columns, each the sky"),
        (file, "#?RADIANCE\nNROWS=1\nNCOLS=1\n\n1 1 1".into(), "sky.txt, row 1: ends after 1 patches"),
        (
            "patches = \"sky.txt\"\nupper = [1, 1, 1]",
            rows(146),
            "floor.toml, line 7: `patches` and `radiance`, `upper`",
        ),
        ("column = 1", rows(146), "floor.toml, line 7: `column` of the sky is one of `patches`"),
        (
            "patches = \"sky.txt\"\nnorth = [0, 0, 2]",
            rows(146),
            "floor.toml, line 8: `north` of the sky is [0, 0, 2], zero or along",
        ),
        (
            "patches = \"sky.txt\"\nnorth = [0, 0, 0]",
            rows(146),
            "floor.toml, line 8: `north` of the sky is [0, 0, 0], zero or",
        ),
    ] {
        let error = read_with(keys, &text).expect_err(message).to_string();
        assert!(error.starts_with(message), "{error}");
    }
}

/// `--light sky`: radiance 1 around a scene whose file has no sky.
#[test]
fn a_sky_may_be_asked_for() {
    let options = LoadOptions { light: Some(AddedLight::Sky), ..LoadOptions::default() };
    let emitted = |toml: &str| {
        let scene = Scene::from_toml_text("floor", toml, FLOOR, "", options).expect("a correct scene");
        scene.require_emission().expect("light");
        [1, 2].map(|k| scene.materials[k].emission)
    };
    assert_eq!(emitted("obj = \"floor.obj\""), [Rgb::ONE; 2]);
    assert_eq!(emitted("obj = \"floor.obj\"\n[sky]\nlower = [2, 2, 2]"), [Rgb::ZERO, Rgb::splat(2.0)]);
}

/// Putting another sky in the place of one leaves nothing of the first.
#[test]
fn a_sky_may_be_replaced() {
    let scene = read("radiance = [1, 1, 1]").expect("a correct scene");
    let mut other = read("upper = [5, 0, 0]").expect("a correct scene");
    other.set_sky(uniform(1.0), DVec3::Z);
    assert_eq!(scene.faces, other.faces);
    assert_eq!(scene.materials, other.materials);
    assert_eq!((scene.vertices, scene.objects, scene.sky), (other.vertices, other.objects, other.sky));
}
