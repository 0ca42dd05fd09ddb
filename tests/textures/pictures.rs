//! Reflectance and emission that differ from point to point: means on patches, light at points, pictures.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use halflight::Solver;
use halflight::gather::{GatherPass, GatherSampling};
use halflight::light::{Mode, Rgb, Transport};
use halflight::pictures::{Picture, Size, decode_srgb};
use halflight::rays::Rays;
use halflight::scene::textures::Filter;
use halflight::scene::{Camera, Material, PunctualForm, PunctualLight, Scene};
use halflight::solve::{Settings, neumann};
use halflight_reference::{TraceSettings, Tracer};

use crate::common::{Facing, Mesh, Silent, assemble_one, sampling, transport};
use crate::textures::{checker, place, room, texture, textured};

/// A floor from (0, 0) to (1, 1), y up, with a texture of 4 x 4 codes, under light from above of irradiance 2.
fn floor(filter: Filter) -> Scene {
    let p = |x: f64, z: f64| DVec3::new(x, 0.0, z);
    let mut mesh = Mesh::default();
    mesh.polygon(&[p(0., 1.), p(1., 1.), p(1., 0.), p(0., 0.)], 0);
    let codes = (0..16).map(|k| (k * 17) as u8).collect();
    let mut scene = mesh.scene(vec![textured(0.5, texture(4, codes, filter))]);
    // Image rows run along +z.
    place(&mut scene, DVec3::X, DVec3::NEG_Z);
    let form = PunctualForm::Directional { direction: DVec3::NEG_Y };
    scene.lights.push(PunctualLight { form, intensity: Vec3::splat(2.0), name: None });
    scene
}

#[test]
fn a_pixel_shows_the_reflectance_of_its_point() {
    for filter in [Filter::Linear, Filter::Nearest] {
        for (column, row) in [(0, 0), (3, 1), (2, 2), (1, 3)] {
            let mut scene = floor(filter);
            let at = DVec3::new((f64::from(column) + 0.5) / 4.0, 0.0, (f64::from(row) + 0.5) / 4.0);
            let eye = at + 2.0 * DVec3::Y;
            let view = Camera::look_at(eye, at, DVec3::Z, 0.01).expect("a view");
            scene.camera = Camera { position: scene.frame.to_unit(eye).as_vec3(), ..view };
            let code = 17 * (4 * row + column);
            let expected = 0.5 * f64::from(decode_srgb(code as f32 / 255.0)) * 2.0 / PI;
            let p = Solver::new(&scene).cut(9);
            let mode = assemble_one(&p, Mode::Global.transport(), &sampling(16, 0));
            let solution = neumann(&mode.operator, &Settings::default()).expect("ends");
            let shown = mode
                .picture(&solution, &GatherPass::new((1, 1), &GatherSampling::with_samples(16, 0)), &Silent)
                .total();
            let mut tracer = Tracer::new(
                &p.geometry.scene,
                &p.geometry.rays,
                &mode.lights.transports,
                (1, 1),
                &TraceSettings::default(),
            );
            tracer.pass(16);
            for found in [shown.pixels[0].x, tracer.picture().pixels[0].x] {
                // The pixel is 3.5e-4 wide: a thousandth of a texel.
                let apart = (f64::from(found) - expected).abs();
                assert!(apart < 2e-3 * expected.max(0.05), "{filter:?} {column} {row}: {found} {expected}");
            }
        }
    }
}

#[test]
fn patches_reflect_the_mean_of_what_lies_on_them() {
    // The left half black, the right half white, nearest: a patch's mean is its part to the right of the middle.
    let p = |x: f64, z: f64| DVec3::new(x, 0.0, z);
    let mut mesh = Mesh::default();
    mesh.polygon(&[p(0., 1.), p(1., 1.), p(1., 0.), p(0., 0.)], 0);
    let mut scene = mesh.scene(vec![textured(0.8, texture(2, vec![0, 255], Filter::Nearest))]);
    place(&mut scene, DVec3::X, DVec3::Z);
    for count in [1, 9, 50] {
        let p = Solver::new(&scene.clone()).cut(count);
        let mut sum = 0.0;
        for i in 0..p.patches.len() {
            let found = f64::from(p.patches.reflectance(&p.geometry.scene, i).x);
            let (mut white, mut area) = (0.0, 0.0);
            for (_, corners) in p.patches.pieces(i) {
                let own = 0.5 * f64::from((corners[1] - corners[0]).cross(corners[2] - corners[0]).length());
                white += own * f64::from(u8::from(corners.iter().map(|c| c.x).sum::<f32>() > 0.0));
                area += own;
            }
            // Only patches that the middle does not part have a mean that is read off.
            if p.patches.pieces(i).all(|(_, c)| c.iter().all(|c| c.x > -1e-6) || c.iter().all(|c| c.x < 1e-6)) {
                assert!((found - 0.8 * white / area).abs() < 1e-5, "{count}: {found} {}", white / area);
            }
            sum += found * p.patches.areas()[i];
        }
        let mean = sum / p.patches.areas().iter().sum::<f64>();
        assert!((mean - 0.4).abs() < 1e-6, "{count}: {mean}");
    }
}

/// A closed cube that emits 0.25 and reflects a checker of 0 and 1: under even light it is the furnace of rho 0.5.
#[test]
fn a_checker_furnace_glows_as_one_of_the_mean() {
    let mut mesh = Mesh::default();
    mesh.cuboid(DVec3::ZERO, DVec3::ONE, glam::DQuat::IDENTITY, Facing::In, 0);
    let walls = Material { emission: Rgb::splat(0.25), ..textured(1.0, texture(64, checker(64), Filter::Linear)) };
    let mut scene = mesh.scene(vec![walls]);
    place(&mut scene, DVec3::new(1.0, 0.5, 0.5), DVec3::new(0.25, 1.0, -0.5));
    let p = Solver::new(&scene).cut(150);
    let mode = assemble_one(&p, Mode::Global.transport(), &sampling(256, 0));
    let solution = neumann(&mode.operator, &Settings::default()).expect("converges");
    let light = solution.light.iter().zip(p.patches.areas());
    let (sum, area) = light.fold((0.0, 0.0), |(s, a), (l, own)| (s + own * f64::from(l.invisible.x), a + own));
    // Patches are no whole numbers of fields: their means differ by some thousandths from 0.5.
    assert!((sum / area - 0.5).abs() < 2e-3, "{}", sum / area);
    assert!(solution.radius.lower > 0.49 && solution.radius.upper < 0.51, "{:?}", solution.radius);
}

/// The largest distance of 4 x 4 blocks of two pictures in their standard errors, channels apart.
fn most_apart(picture: &Picture, paths: &Picture, error: &Picture, slack: f64) -> f64 {
    const SIDE: usize = 8;
    let Size { width, height } = picture.size();
    let mut most: f64 = 0.0;
    for y in (0..height).step_by(SIDE) {
        for x in (0..width).step_by(SIDE) {
            let (mut d, mut v, mut s) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
            for k in (0..SIDE * SIDE).map(|k| (y + k / SIDE) * width + x + k % SIDE) {
                d += (picture.pixels[k] - paths.pixels[k]).as_dvec3();
                v += error.pixels[k].as_dvec3().powf(2.0);
                s += paths.pixels[k].as_dvec3();
            }
            let sigma = (v + (slack * s).powf(2.0)).map(f64::sqrt);
            most = most.max((d / sigma.max(DVec3::splat(1e-9))).abs().max_element());
        }
    }
    most
}

#[test]
fn every_mode_agrees_with_the_path_tracer() {
    let scene = room();
    assert_eq!(scene.warnings, [""; 0]);
    let mut modes: Vec<Transport> = Mode::ALL.iter().map(|m| m.transport()).collect();
    modes.push(transport(0.5, 0.5));
    for mode in modes {
        let found = Solver::new(&scene).render(mode, (32, 32)).tolerance(0.01).expect("a picture");
        let rays = Rays::new(&scene);
        let settings = TraceSettings { seed: 3, ..TraceSettings::default() };
        let mut tracer = Tracer::new(&scene, &rays, &scene.transports(mode), (32, 32), &settings);
        tracer.pass(1024);
        let error = tracer.standard_error().expect("samples");
        let apart = most_apart(&found.picture, &tracer.picture(), &error, 0.5 * found.error.total);
        println!("{}: {apart:.2} standard errors, stated {:.3} %", mode.label(), 100.0 * found.error.total);
        // 48 numbers: 4 is passed by chance once in 300 runs.
        assert!(apart < 4.0, "{}: {apart}", mode.label());
    }
}
