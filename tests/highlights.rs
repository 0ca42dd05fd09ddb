//! Highlights: OpenGL's specular term of lights without area, of luminaires and of a sky, in pictures of the solver
//! and of the path tracer, which agree; and nothing of them where they are not asked for.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use halflight::Solver;
use halflight::gather::{GatherPass, GatherSampling};
use halflight::light::{Mode, Transport};
use halflight::pictures::{Picture, Size, relative_rms};
use halflight::rays::Rays;
use halflight::render::Discretization;
use halflight::scene::{LoadOptions, Scene};
use halflight::solve::{Settings, neumann};
use halflight_reference::{NextEvent, TraceSettings, Tracer};

use crate::common::{Silent, assemble_one, rendered, sampling, transport};

/// A floor that looks up, a slab over a part of it, a panel that emits where one is asked for, and the rest of a scene
/// file.
fn scene(panel: bool, rest: &str, highlights: bool) -> Scene {
    let mut obj = String::from(
        "mtllib m.mtl\nusemtl floor\nv -10 0 10\nv 10 0 10\nv 10 0 -10\nv -10 0 -10\nf 1 2 3 4\n\
         usemtl slab\nv 1 2 1\nv 1 2 -1\nv 3 2 -1\nv 3 2 1\nf 5 6 7 8\n",
    );
    if panel {
        obj += "usemtl panel\nv -2 6 -3\nv 1 6 -3\nv 1 6 -1\nv -2 6 -1\nf 9 10 11 12\n";
    }
    let mtl = "newmtl floor\nKd 0.5 0.4 0.3\nKs 0.5 0.25 1\nNs 20\nnewmtl slab\nKd 0.3 0.3 0.3\nKs 1 1 1\n\
               newmtl panel\nKd 0 0 0\nKe 3 3 2\n";
    let toml = format!("obj = \"s.obj\"\n{rest}");
    let options = LoadOptions { highlights, ..LoadOptions::default() };
    Scene::from_toml_text("s", &toml, &obj, mtl, options).expect("a scene")
}

const LIGHT: &str = "[[lights]]\nintensity = [10, 20, 30]\n";

fn camera(target: DVec3, fov: f64) -> String {
    let DVec3 { x, y, z } = target;
    format!("[camera]\nposition = [-4, 9, 3]\ntarget = [{x}, {y}, {z}]\nvertical_fov = {fov}\n")
}

fn picture(p: &Discretization, mode: Transport, size: impl Into<Size>, camera: u32) -> Picture {
    let assembled = assemble_one(p, mode, &sampling(64, 0));
    let solution = neumann(&assembled.operator, &Settings::default()).expect("converges");
    let sampling = GatherSampling { camera, luminaire: 1, hemisphere: 16, seed: 0 };
    assembled.picture(&solution, &GatherPass::new(size, &sampling), &Silent).total()
}

#[test]
fn lights_without_area_have_opengls_closed_form() {
    // One side of the slab is not in the way of any of these.
    let x = DVec3::new(-3.0, 0.0, -1.0);
    let eye = DVec3::new(-4.0, 9.0, 3.0);
    let cases: [(&str, DVec3, f64); 3] = [
        ("type = \"point\"\nposition = [-3, 5, -4]", DVec3::new(0.0, 5.0, -3.0), 1.0 / 34.0),
        (
            "type = \"spot\"\nposition = [-3, 5, -4]\ndirection = [0, -1, 0]\nexponent = 3\ncutoff = 80\n\
             attenuation = [1, 0.5, 0]",
            DVec3::new(0.0, 5.0, -3.0),
            (5.0 / 34f64.sqrt()).powi(3) / (1.0 + 0.5 * 34f64.sqrt()),
        ),
        ("type = \"directional\"\ndirection = [0, -5, 3]", DVec3::new(0.0, 5.0, -3.0), 1.0),
    ];
    for (light, to_light, falling) in cases {
        let (l, v) = (to_light.normalize(), (eye - x).normalize());
        let term = (l + v).normalize().y.powi(20);
        let (kd, ks) = (DVec3::new(0.5, 0.4, 0.3), DVec3::new(0.5, 0.25, 1.0));
        let expected = (kd * l.y + ks * term) * DVec3::new(10.0, 20.0, 30.0) * (falling / PI);
        for highlights in [false, true] {
            let scene = scene(false, &format!("{}{LIGHT}{light}\n", camera(x, 0.01)), highlights);
            assert_eq!(scene.warnings.iter().any(|w| w.contains("--highlights")), !highlights);
            let p = Solver::new(&scene).cut(50);
            let expected = if highlights { expected } else { kd * l.y * DVec3::new(10.0, 20.0, 30.0) * (falling / PI) };
            for mode in [Mode::Local, Mode::OneBounce] {
                let found = picture(&p, mode.transport(), (1, 1), 16).pixels[0].as_dvec3();
                assert!(((found - expected) / expected).abs().max_element() < 2e-4, "{light} {found} {expected}");
            }
            let transports = p.geometry.scene.transports(Mode::OneBounce.transport());
            for next_event in [NextEvent::On, NextEvent::Off] {
                let settings = TraceSettings { next_event, ..TraceSettings::default() };
                let mut tracer = Tracer::new(&p.geometry.scene, &p.geometry.rays, &transports, (1, 1), &settings);
                tracer.pass(16);
                let found = tracer.bounce(1).expect("a bounce").pixels[0].as_dvec3();
                assert!(((found - expected) / expected).abs().max_element() < 2e-4, "{light} {found} {expected}");
            }
        }
    }
}

/// The mean square of the differences of two pictures in standard errors of the traced one, which has the picture's
/// noise too.
fn agrees(scene: &Scene, transport: Transport, what: &str) {
    let size = Size { width: 24, height: 24 };
    let found = rendered(scene, transport, size, 0.02, 3);
    let (rays, transports) = (Rays::new(scene), scene.transports(transport));
    let mut tracer = Tracer::new(scene, &rays, &transports, size, &TraceSettings::default());
    tracer.pass(3072);
    let (truth, noise) = (tracer.picture(), tracer.standard_error().expect("samples"));
    let error = relative_rms(&found.picture, &truth, None, Some(&noise)).expect("pictures");
    let unsure = 0.3 * tracer.relative_error().expect("samples");
    eprintln!("{what}: error {error:.4}, stated {:.4}, unsure {unsure:.4}", found.error.total);
    assert!(found.error.total < 0.022, "{what}: {}", found.error.total);
    assert!(error <= (1.5 * found.error.total).hypot(unsure), "{what}: {error}");
    let traced = tracer.mean();
    for c in 0..3 {
        let count = found.picture.pixels.len() as f64;
        let mean = found.picture.pixels.iter().map(|p| f64::from(p[c])).sum::<f64>() / count;
        let allowed = (4.0 * traced.error[c]).hypot(0.5 * found.error.total * traced.value[c]);
        assert!((mean - traced.value[c]).abs() <= allowed, "{what}: {mean} {}", traced.value[c]);
    }
}

#[test]
fn pictures_agree_with_the_path_tracer_in_every_mode() {
    let view = camera(DVec3::new(0.0, 0.0, -1.0), 70.0);
    let lit = format!("{view}{LIGHT}type = \"point\"\nposition = [3, 5, -2]\n");
    let sky = format!("{view}[sky]\nupper = [0.3, 0.5, 1]\nlower = [0.2, 0.1, 0]\n");
    let scenes =
        [("panel", scene(true, &view, true)), ("light", scene(true, &lit, true)), ("sky", scene(true, &sky, true))];
    for (name, scene) in &scenes {
        for mode in [transport(1.0, 0.0), transport(0.0, 1.0), transport(0.5, 0.5)] {
            agrees(scene, mode, &format!("{name} {}", mode.label()));
        }
    }
}

#[test]
fn next_event_estimation_changes_no_mean() {
    let rest = format!("{}[sky]\nradiance = [0.2, 0.2, 0.2]\n", camera(DVec3::new(0.0, 0.0, -1.0), 40.0));
    let scene = scene(true, &rest, true);
    let p = Solver::new(&scene).cut(1);
    let transports = p.geometry.scene.transports(Mode::OneBounce.transport());
    let mean = |next_event| {
        let settings = TraceSettings { next_event, ..TraceSettings::default() };
        let mut tracer = Tracer::new(&p.geometry.scene, &p.geometry.rays, &transports, (16, 16), &settings);
        tracer.pass(2048);
        tracer.mean()
    };
    let [on, off] = [NextEvent::On, NextEvent::Off].map(mean);
    for c in 0..3 {
        let apart = (on.value[c] - off.value[c]) / on.error[c].hypot(off.error[c]);
        assert!(apart.abs() < 4.0, "{apart}: {on:?} {off:?}");
    }
}

#[test]
fn a_black_mirror_of_the_sky_shows_its_closed_form() {
    // With exponent 0 the lobe is 1 over the hemisphere: H = Ks/pi 2 pi L.
    let obj = "mtllib m.mtl\nusemtl floor\nv -10 0 10\nv 10 0 10\nv 10 0 -10\nv -10 0 -10\nf 1 2 3 4\n";
    let mtl = "newmtl floor\nKd 0 0 0\nKs 0.25 0.5 1\n";
    let toml = format!("obj = \"s.obj\"\n{}[sky]\nradiance = [1, 2, 3]\n", camera(DVec3::ZERO, 1.0));
    let options = LoadOptions { highlights: true, ..LoadOptions::default() };
    let scene = Scene::from_toml_text("s", &toml, obj, mtl, options).expect("a scene");
    let found = picture(&Solver::new(&scene).cut(10), Mode::Local.transport(), (1, 1), 1 << 14).pixels[0];
    let expected = 2.0 * Vec3::new(0.25, 1.0, 3.0);
    assert!(((found - expected) / expected).abs().max_element() < 1e-2, "{found} {expected}");
}
