//! Lights without area: irradiance by closed form, shadows where geometry puts them, all modes against the path tracer,
//! stated errors, and many of them.

use std::f64::consts::PI;

use glam::{DQuat, DVec3, Vec3};
use halflight::Solver;
use halflight::direct::{Lights, Scratch};
use halflight::gather::{GatherPass, GatherSampling};
use halflight::light::{Mode, Transport};
use halflight::operator::LinearOperator as _;
use halflight::pictures::{Picture, Size, relative_rms};
use halflight::rays::Rays;
use halflight::render::{Discretization, End};
use halflight::scene::{Beam, LoadOptions, PunctualForm, PunctualLight, PunctualPlace, Scene};
use halflight::solve::{Emitted, RaySettings, Settings, Shooting, ShootingSettings, explore, neumann, norm};
use halflight::surfaces::SurfacePoint;
use halflight_reference::{NextEvent, TraceSettings, Tracer};

use crate::common::{Facing, Mesh, Silent, assemble_one, grey, lights, random, rendered, sampling, transport};

/// A floor of 20 by 20 units, and a disc of 32 corners and radius 1 half way up to (0, 5, 0) where one is asked for.
fn floor(disc: bool, rest: &str) -> Scene {
    let mut obj = "mtllib m.mtl\nusemtl floor\nv -10 0 10\nv 10 0 10\nv 10 0 -10\nv -10 0 -10\nf 1 2 3 4\n".to_string();
    if disc {
        for k in 0..32 {
            let (sin, cos) = (-f64::from(k) * PI / 16.0).sin_cos();
            obj += &format!("v {cos} 2.5 {sin}\n");
        }
        let corners: Vec<String> = (5..37).map(|k| k.to_string()).collect();
        obj += &format!("usemtl disc\nf {}\n", corners.join(" "));
    }
    let mtl = "newmtl floor\nKd 0.5 0.5 0.5\nnewmtl disc\nKd 0 0 0\n";
    let toml = format!("obj = \"s.obj\"\n{rest}");
    Scene::from_toml_text("s", &toml, &obj, mtl, LoadOptions::default()).expect("a scene")
}

/// A place to ask for light at, in the file's units, and everything that tells it.
struct Asked {
    p: Discretization,
    lights: Lights,
}

impl Asked {
    fn new(scene: Scene, mode: Transport) -> Asked {
        let p = Solver::new(&scene).cut(50);
        let lights = lights(&p, mode);
        Asked { p, lights }
    }

    /// Irradiance of the floor, W/m², and the rays cast.
    fn irradiance(&self, x: DVec3) -> (DVec3, u64) {
        let position = self.p.geometry.scene.frame.to_unit(x).as_vec3();
        let receiver = SurfacePoint { position, normal: Vec3::Y, face: 0 };
        let mut scratch = Scratch::default();
        let mut light = DVec3::ZERO;
        self.lights.gather_punctual(&receiver, &mut scratch, |_, own| light += own);
        (PI * light, scratch.cast)
    }
}

/// A light over the floor, and its irradiance there in parts of its intensity.
type Kind = (&'static str, fn(DVec3) -> f64);

/// Lights of every kind.
fn kinds() -> Vec<Kind> {
    fn over(x: DVec3) -> (f64, f64) {
        let d2 = 25.0 + x.length_squared();
        (d2, 5.0 / d2.sqrt())
    }
    vec![
        ("type = \"point\"\nposition = [0, 5, 0]", |x| over(x).1 / over(x).0),
        ("type = \"point\"\nposition = [0, 5, 0]\nattenuation = [1, 0, 0]", |x| over(x).1),
        ("type = \"point\"\nposition = [0, 5, 0]\nattenuation = [0, 1, 0]", |x| over(x).1 / over(x).0.sqrt()),
        ("type = \"point\"\nposition = [0, 5, 0]\nattenuation = [3, 2, 1]", |x| {
            over(x).1 / (3.0 + 2.0 * over(x).0.sqrt() + over(x).0)
        }),
        ("type = \"warn\"\nposition = [0, 5, 0]\ndirection = [0, -3, 0]\nexponent = 4", |x| {
            over(x).1.powi(5) / over(x).0
        }),
        ("type = \"spot\"\nposition = [0, 5, 0]\ndirection = [0, -1, 0]\nexponent = 2\ncutoff = 30", |x| {
            if over(x).1 >= 30f64.to_radians().cos() { over(x).1.powi(3) / over(x).0 } else { 0.0 }
        }),
        ("type = \"spot\"\nposition = [0, 5, 0]\ndirection = [1, 0, 0]\ncutoff = 90", |x| {
            if x.x > 0.0 { over(x).1 / over(x).0 } else { 0.0 }
        }),
        ("type = \"directional\"\ndirection = [3, -4, 0]", |_| 0.8),
        ("type = \"directional\"\ndirection = [3, 4, 0]", |_| 0.0),
    ]
}

fn table(light: &str) -> String {
    format!("[[lights]]\nintensity = [1, 2, 3]\n{light}\n")
}

const PLACES: [DVec3; 4] =
    [DVec3::ZERO, DVec3::new(2.0, 0.0, 1.0), DVec3::new(4.0, 0.0, -3.0), DVec3::new(-6.0, 0.0, 5.0)];

#[test]
fn irradiance_is_opengls_closed_form() {
    for (light, form) in kinds() {
        for mode in Mode::ALL {
            let asked = Asked::new(floor(false, &table(light)), mode.transport());
            for x in PLACES {
                let expected = form(x) * DVec3::new(1.0, 2.0, 3.0);
                let (found, rays) = asked.irradiance(x);
                let apart = (found - expected).abs().max_element();
                assert!(apart <= 2e-6 * expected.z.max(1e-3), "{light}\n{mode} {x}: {found} {expected}");
                // A floor hides nothing from a point above it; whether parallel light meets anything is asked.
                assert!(rays == 0 || light.contains("directional") && mode.transport().tau == 0.0);
            }
        }
    }
}

#[test]
fn pictures_and_path_tracer_show_opengls_diffuse_light() {
    for (light, form) in kinds() {
        // At the first place a pixel lies half in the light of the spot that shines along the floor.
        for x in &PLACES[1..] {
            let camera = format!(
                "[camera]\nposition = [{}, 9, {}]\ntarget = [{}, 0, {}]\nup = [0, 0, 1]\nvertical_fov = 0.02\n",
                x.x, x.z, x.x, x.z
            );
            let scene = floor(false, &(camera + &table(light)));
            let expected = form(*x) * 0.5 / PI;
            let p = Solver::new(&scene).cut(50);
            let mode = assemble_one(&p, Mode::Local.transport(), &sampling(16, 0));
            let solution = neumann(&mode.operator, &Settings::default()).expect("ends");
            let shown = mode
                .picture(&solution, &GatherPass::new((1, 1), &GatherSampling::with_samples(16, 0)), &Silent)
                .total();
            assert!((f64::from(shown.pixels[0].x) - expected).abs() <= 1e-3 * expected.max(1e-3), "{light} {x}");
            for next_event in [NextEvent::On, NextEvent::Off] {
                let settings = TraceSettings { next_event, ..TraceSettings::default() };
                let transports = p.geometry.scene.transports(Mode::Global.transport());
                let mut tracer = Tracer::new(&p.geometry.scene, &p.geometry.rays, &transports, (1, 1), &settings);
                tracer.pass(16);
                let traced = f64::from(tracer.picture().pixels[0].x);
                assert!((traced - expected).abs() <= 1e-3 * expected.max(1e-3), "{light} {x}: {traced} {expected}");
            }
        }
    }
}

#[test]
fn shadows_end_where_geometry_says() {
    // Seen from a light at height 5 the disc at 2.5 is twice as wide on the floor; parallel light keeps its width.
    let cases =
        [("type = \"point\"\nposition = [0, 5, 0]", 2.0), ("type = \"directional\"\ndirection = [0, -1, 0]", 1.0)];
    for (light, radius) in cases {
        let lit = |tau: f32, x: DVec3| {
            let asked = Asked::new(floor(true, &table(light)), transport(1.0, tau));
            let free = Asked::new(floor(false, &table(light)), transport(1.0, tau));
            asked.irradiance(x).0.x / free.irradiance(x).0.x
        };
        for tau in [0.0, 0.5, 1.0] {
            let inside = lit(tau, DVec3::new(0.999 * radius, 0.0, 0.0));
            let outside = lit(tau, DVec3::new(1.001 * radius, 0.0, 0.0));
            // The middle of an edge is nearer to the axis than the corners.
            let edge = DQuat::from_rotation_y(PI / 32.0) * DVec3::X * radius * (PI / 32.0).cos();
            let (near, far) = (lit(tau, 0.999 * edge), lit(tau, 1.001 * edge));
            assert_eq!([inside, outside, near, far].map(|l| l as f32), [tau, 1.0, tau, 1.0], "{light} {tau}");
        }
    }
}

/// A room without a ceiling or a front in which a slab hangs, or a closed one; lights of one kind.
fn room(open: bool, form: &PunctualForm, intensity: f32) -> Scene {
    let mut mesh = Mesh::default();
    let p = DVec3::new;
    if open {
        let wall = |a: DVec3, b: DVec3| [-a - b, a - b, a + b, b - a].map(|c| c - a.cross(b));
        mesh.polygon(&wall(DVec3::Z, DVec3::X), 0);
        mesh.polygon(&wall(DVec3::X, DVec3::Y), 1);
        mesh.polygon(&wall(DVec3::Y, DVec3::Z), 2);
        mesh.polygon(&wall(DVec3::Z, DVec3::Y), 1);
    } else {
        mesh.cuboid(DVec3::ZERO, DVec3::ONE, DQuat::IDENTITY, Facing::In, 1);
    }
    mesh.cuboid(p(0.2, -0.3, 0.1), p(0.4, 0.1, 0.3), DQuat::from_rotation_y(0.4), Facing::Out, 2);
    let mut scene = mesh.scene(vec![grey("floor", 0.6), grey("wall", 0.5), grey("slab", 0.7)]);
    scene.lights.push(PunctualLight {
        form: form.clone(),
        intensity: intensity * Vec3::new(1.0, 0.8, 0.6),
        name: None,
    });
    scene
}

fn place(attenuation: [f64; 3]) -> PunctualPlace {
    PunctualPlace { position: DVec3::new(-0.2, 0.7, 0.3), attenuation }
}

fn forms() -> [PunctualForm; 4] {
    let direction = DVec3::new(0.2, -1.0, -0.1).normalize();
    let spot = |exponent, cutoff| PunctualForm::Point {
        place: place([0.0, 0.0, 1.0]),
        beam: Beam::Spot { direction, exponent, cutoff },
    };
    [
        PunctualForm::even(place([0.1, 0.3, 1.0])),
        spot(1.0, 40f64.to_radians().cos()),
        spot(4.0, 0.0),
        PunctualForm::Directional { direction: DVec3::new(0.3, -1.0, -0.5).normalize() },
    ]
}

/// A picture to 2 % agrees with one by the path tracer, within so many times its stated error.
fn agrees(scene: &Scene, transport: Transport, samples: u32, times: f64, what: &str) {
    let size = Size { width: 24, height: 24 };
    let found = rendered(scene, transport, size, 0.02, 5);
    let rays = Rays::new(scene);
    let transports = scene.transports(transport);
    let mut tracer = Tracer::new(scene, &rays, &transports, size, &TraceSettings::default());
    tracer.pass(samples);
    let (truth, noise) = (tracer.picture(), tracer.standard_error().expect("samples"));
    let error = relative_rms(&found.picture, &truth, None, Some(&noise)).expect("pictures");
    let stated = found.error.total;
    let noise = tracer.relative_error().expect("samples");
    // What noise leaves uncertain of the error: the variance of few pixels, which is most of it, is known to some
    // tenths.
    let unsure = 0.3 * noise;
    eprintln!("{what}: error {error:.4}, stated {stated:.4}, noise of the reference {noise:.4}");
    assert!(stated <= 0.022, "{what}: {stated}");
    assert!(error <= (times * stated).hypot(unsure), "{what}: {error}, stated {stated}");
    let mean = |picture: &Picture, c: usize| {
        picture.pixels.iter().map(|p| f64::from(p[c])).sum::<f64>() / picture.pixels.len() as f64
    };
    let traced = tracer.mean();
    for c in 0..3 {
        // Errors of the picture are alike in neighbouring pixels: its mean is off by up to a half of them.
        let allowed = (4.0 * traced.error[c]).hypot(0.5 * stated * traced.value[c]);
        let apart = (mean(&found.picture, c) - traced.value[c]).abs();
        assert!(apart <= allowed, "{what}: {apart} > {allowed} of {}", traced.value[c]);
    }
}

#[test]
fn every_mode_agrees_with_the_path_tracer() {
    for form in forms() {
        for mode in Mode::ALL {
            agrees(&room(true, &form, 3.0), mode.transport(), 1024, 1.5, &format!("{mode} {form:?}"));
        }
        agrees(&room(true, &form, 3.0), transport(0.5, 0.5), 1024, 1.5, &format!("half {form:?}"));
    }
}

#[test]
fn the_error_stated_of_a_room_lit_by_one_light_is_true() {
    for form in &forms()[..2] {
        agrees(&room(false, form, 1.0), Mode::Global.transport(), 4096, 1.2, &format!("closed {form:?}"));
    }
}

#[test]
fn many_lights_are_drawn_without_bias() {
    let mut scene = room(true, &forms()[0], 0.0);
    scene.lights = (0..200)
        .map(|k| {
            let at = |axis| 1.6 * random(k, axis) - 0.8;
            let position = DVec3::new(at(0), at(1), at(2));
            let form = PunctualForm::even(PunctualPlace { position, attenuation: [0.0, 0.0, 1.0] });
            PunctualLight { form, intensity: Vec3::new(1.0, 0.5, random(k, 3) as f32), name: None }
        })
        .collect();
    let asked = Asked::new(scene.clone(), Mode::Global.transport());
    let places: Vec<DVec3> = (0..2000).map(|k| DVec3::new(random(k, 4) - 0.5, -1.0, random(k, 5) - 0.5)).collect();
    let mean = |asked: &Asked| {
        let each = places.iter().map(|&x| asked.irradiance(x));
        each.fold((DVec3::ZERO, 0), |sum, (light, rays)| (sum.0 + light, sum.1 + rays))
    };
    let (drawn, cast) = mean(&asked);
    let mut exact = DVec3::ZERO;
    for few in scene.lights.chunks(20) {
        let scene = Scene { lights: few.to_vec(), ..scene.clone() };
        exact += mean(&Asked::new(scene, Mode::Global.transport())).0;
    }
    assert!((drawn / exact - 1.0).abs().max_element() < 0.01, "{drawn} {exact}");
    assert!(cast <= 17 * places.len() as u64, "{cast}");
}

#[test]
fn shooting_and_bounces_know_them() {
    let half = transport(0.5, 0.5);
    for form in [1, 3].map(|k| forms()[k].clone()) {
        let p = Solver::new(&room(true, &form, 3.0)).cut(300);
        let mode = assemble_one(&p, half, &sampling(256, 0));
        let series = explore(&mode.operator, 20);
        let shooter = &mode.operator;
        let settings = ShootingSettings { unshot: 1e-5, ..ShootingSettings::default() };
        let mut shooting = Shooting::new(shooter, settings).expect("converges");
        shooting.run(|_| ()).expect("converges");
        let apart = difference(mode.operator.areas(), &shooting.light(), &series.light);
        assert!(apart < 1e-4, "{apart}");
        for emitted in [Emitted::ClosedForm, Emitted::Rays] {
            let rays = RaySettings { rays: 1 << 18, emitted, ..RaySettings::default() };
            let shooter = p.ray_shooter(half, rays);
            let mut shooting =
                Shooting::new(&shooter, ShootingSettings { unshot: 1e-3, ..settings }).expect("converges");
            shooting.run(|_| ()).expect("converges");
            let apart = difference(mode.operator.areas(), &shooting.light(), &series.light);
            assert!(apart < 0.02, "{emitted:?} {apart}");
        }
        // Powers of the bounces, patches and walks of light together.
        let found = Solver::new(&p.geometry.scene).bounces(half, 3).tolerance(0.02);
        assert_eq!(found.end, Some(End::Met));
        assert_eq!(found.solution.bounces[0].power, [0.0; 3]);
        for n in 1..=3 {
            let (a, b) = (found.solution.bounces[n].power[0], series.bounces[n].power[0]);
            assert!((a / b - 1.0).abs() < 0.06, "{n}: {a} {b}");
        }
    }
}

/// Relative difference of two light fields in the area-weighted norm.
fn difference(areas: &[f64], a: &[halflight::Light], b: &[halflight::Light]) -> f64 {
    let apart = |(a, b): (&halflight::Light, &halflight::Light)| halflight::Light {
        invisible: a.invisible - b.invisible,
        visible: a.visible - b.visible,
    };
    let apart: Vec<halflight::Light> = a.iter().zip(b).map(apart).collect();
    norm(areas, &apart) / norm(areas, b)
}

/// An IES file of a light whose intensity goes as the cosine to its axis, `down` W/sr at most, every half degree.
fn cosine_file(down: f64) -> String {
    let angles: Vec<f64> = (0..=180).map(|k| 0.5 * f64::from(k)).collect();
    let row = |of: &dyn Fn(f64) -> f64| angles.iter().map(|&a| format!("{} ", of(a))).collect::<String>();
    let candela = row(&|a| 683.0 * down * a.to_radians().cos());
    format!("IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 181 1 1 2 0 0 0\n1 1 0\n{}\n0\n{candela}\n", row(&|a| a))
}

/// A measured intensity of cosine is Warn's light of exponent 1, whoever computes its picture: gather pass, path tracer
/// with and without next-event estimation, and walks of light.
#[test]
fn a_measured_cosine_is_warns_light() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("a file");
    let manifest = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    for file in ["cornell-box.obj", "cornell-box.mtl"] {
        std::fs::copy(manifest.join("meshes").join(file), folder.path().join(file)).expect("a copy");
    }
    write("cosine.ies", &cosine_file(2e4));
    let head = "obj = \"cornell-box.obj\"\n[materials.light]\nemission = [0, 0, 0]\n[[lights]]\n";
    let place = "position = [300, 500, 250]\ndirection = [0.2, -1, 0.1]\n";
    write("ies.toml", &format!("{head}type = \"ies\"\nfile = \"cosine.ies\"\nintensity = [1, 0.5, 0.25]\n{place}"));
    write("warn.toml", &format!("{head}type = \"warn\"\nexponent = 1\nintensity = [2e4, 1e4, 5e3]\n{place}"));
    let scenes = ["ies.toml", "warn.toml"]
        .map(|name| Scene::load(&folder.path().join(name), LoadOptions::default()).expect("a scene"));
    let size = Size { width: 24, height: 24 };
    let off = |[a, b]: [Picture; 2]| relative_rms(&a, &b, None, None).expect("one size");
    // Chords of the cosine over half a degree are off by a hundred thousandth.
    let local = scenes.each_ref().map(|s| rendered(s, Mode::Local.transport(), size, 0.05, 0).picture);
    assert!(off(local) < 2e-5);
    let settings = TraceSettings::default();
    let traced = scenes.each_ref().map(|s| {
        let transports = s.transports(Mode::Global.transport());
        let rays = Rays::new(s);
        let mut tracer = Tracer::new(s, &rays, &transports, size, &settings);
        tracer.pass(16);
        tracer.picture()
    });
    assert!(off(traced) < 1e-4);
    let powers = scenes.each_ref().map(|s| {
        let series = Solver::new(s).bounces(Mode::Global, 3).tolerance(0.02);
        series.solution.bounces.iter().map(|b| b.power[0]).collect::<Vec<_>>()
    });
    for (a, b) in powers[0].iter().zip(&powers[1]).skip(1) {
        assert!((a / b - 1.0).abs() < 0.04, "{powers:?}");
    }
}
