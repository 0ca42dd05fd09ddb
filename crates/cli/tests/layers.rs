//! Pictures taken apart: layers add up to the picture, every lamp's layer is what path tracing shows of that lamp
//! alone, and dimming what was solved is the picture of the dimmed scene.

use std::fs;
use std::process::Command;

use glam::{DVec3, Vec3};
use halflight::Solver;
use halflight::light::{Mode, Rgb, Transport};
use halflight::pictures::{Picture, Shows, read_layers, read_picture, relative_rms};
use halflight::rays::Rays;
use halflight::render::{Apart, LayerKind, Rendered};
use halflight::scene::{Emitters, LoadOptions, Scene};
use halflight::solve::{Settings, solve_columns};
use halflight_reference::{TraceSettings, Tracer};

use crate::run::{halflight, place, program, report, succeed};

const SIZE: (usize, usize) = (24, 24);
const ALL: Apart = Apart { emitters: true, bounces: true };

/// A rectangle in a plane of constant y, its front up or down.
fn level(y: f64, [x0, x1, z0, z1]: [f64; 4], up: bool, first: &mut usize) -> String {
    let corners = [(x0, z1), (x1, z1), (x1, z0), (x0, z0)];
    let lines: String = corners.iter().map(|(x, z)| format!("v {x} {y} {z}\n")).collect();
    let k = *first;
    *first += 4;
    let face = if up { [k, k + 1, k + 2, k + 3] } else { [k + 3, k + 2, k + 1, k] };
    format!("{lines}f {} {} {} {}\n", face[0], face[1], face[2], face[3])
}

/// A room open towards the camera and the sky, with a desk lamp that shines down on a table, a panel of two colours
/// under the ceiling, a bulb without area, and `rows` rows of more lamps; all of them shine, or one alone.
fn files(rows: usize, only: Option<&str>) -> [(&'static str, String); 3] {
    let mut first = 9;
    let mut obj = "mtllib r.mtl\nv -1 -1 1\nv 1 -1 1\nv 1 -1 -1\nv -1 -1 -1\nv -1 1 1\nv 1 1 1\nv 1 1 -1\nv -1 1 -1\n"
        .to_string();
    obj += "o room\nusemtl white\nf 1 2 3 4\nf 4 3 7 8\nf 8 7 6 5\nusemtl red\nf 1 4 8 5\nusemtl green\nf 2 6 7 3\n";
    obj += &format!("o table\nusemtl white\n{}", level(-0.5, [-0.8, 0.1, -0.6, 0.2], true, &mut first));
    obj += &format!("o desk\nusemtl glow\n{}", level(-0.2, [-0.6, -0.3, -0.4, -0.1], false, &mut first));
    obj += &format!("o panel\nusemtl warm\n{}", level(0.95, [-0.5, 0.0, -0.5, 0.0], false, &mut first));
    obj += &format!("usemtl cold\n{}", level(0.95, [0.1, 0.6, -0.5, 0.0], false, &mut first));
    for (side, x) in [("left", -0.9), ("right", 0.7)] {
        obj += &format!("o {side}\nusemtl {side}\n").repeat(usize::from(rows > 0));
        for row in 0..rows {
            let z = -0.9 + 0.1 * row as f64;
            obj += &level(0.6, [x, x + 0.15, z, z + 0.05], false, &mut first);
        }
    }
    let shines = |name: &str| only.is_none_or(|only| only == name);
    let mut mtl = "newmtl white\nKd .7 .7 .7\nnewmtl red\nKd .7 .2 .1\nnewmtl green\nKd .1 .6 .2\n".to_string();
    let lamps = [
        ("glow", "desk", "4 4 4"),
        ("warm", "panel warm", "3 2 1"),
        ("cold", "panel cold", "1 2 3"),
        ("left", "left", "4 1 1"),
        ("right", "right", "1 1 4"),
    ];
    for (material, name, radiance) in lamps {
        mtl += &format!("newmtl {material}\nKd 0 0 0\nKe {}\n", if shines(name) { radiance } else { "0 0 0" });
    }
    let mut toml =
        "obj = \"r.obj\"\n[camera]\nposition = [0, 0, 3.4]\ntarget = [0, 0, 0]\nvertical_fov = 40\n".to_string();
    if shines("sky") {
        toml += "[sky]\nupper = [0.2, 0.3, 0.5]\nlower = [0.1, 0.1, 0.1]\n";
    }
    if shines("bulb") {
        toml += "[[lights]]\ntype = \"point\"\nname = \"bulb\"\nposition = [0.6, -0.3, -0.4]\n";
        toml += "intensity = [0.3, 0.3, 0.2]\n";
    }
    [("r.obj", obj), ("r.mtl", mtl), ("r.toml", toml)]
}

fn scene(rows: usize, only: Option<&str>) -> Scene {
    let [(_, obj), (_, mtl), (_, toml)] = files(rows, only);
    Scene::from_toml_text("r", &toml, &obj, &mtl, LoadOptions::default()).expect("a scene")
}

fn rendered(scene: &Scene, mode: Transport, tolerance: f64, apart: Apart) -> Rendered {
    let solver = Solver::new(scene).seed(2).memory(f64::INFINITY).apart(apart);
    solver.render(mode, SIZE).tolerance(tolerance).expect("converges")
}

/// Sum of the layers of a kind less the picture, RMS over that of the picture.
fn off(found: &Rendered, kind: impl Fn(&LayerKind) -> bool) -> f64 {
    let mut sum = Picture::new(SIZE.0, SIZE.1);
    for layer in found.layers.iter().filter(|layer| kind(&layer.kind)) {
        sum.pixels.iter_mut().zip(&layer.light.picture.pixels).for_each(|(s, p)| *s += *p);
    }
    let squares =
        |of: &dyn Fn(usize) -> Rgb| (0..sum.pixels.len()).map(|k| of(k).as_dvec3().length_squared()).sum::<f64>();
    (squares(&|k| sum.pixels[k] - found.picture.pixels[k]) / squares(&|k| found.picture.pixels[k])).sqrt()
}

fn is_lamp(kind: &LayerKind) -> bool {
    matches!(kind, LayerKind::Emitter(_))
}

/// The layers add up to the picture, which is the one without them.
fn adds_up(scene: &Scene, mode: Transport, tolerance: f64) -> Rendered {
    let whole = rendered(scene, mode, tolerance, Apart::default());
    let apart = rendered(scene, mode, tolerance, ALL);
    assert!(off(&apart, is_lamp) < 1e-6, "{}", off(&apart, is_lamp));
    assert!(off(&apart, |kind| !is_lamp(kind)) < 1e-6, "{}", off(&apart, |kind| !is_lamp(kind)));
    // Light cuts of each lamp draw other points than those of all: both errors are as stated.
    assert!((apart.error.total / whole.error.total - 1.0).abs() < 0.3, "{:?} {:?}", apart.error, whole.error);
    let differ = relative_rms(&apart.picture, &whole.picture, None, None).expect("pictures of one size");
    assert!(differ < apart.error.total.hypot(whole.error.total), "{differ} {:?} {:?}", apart.error, whole.error);
    apart
}

#[test]
fn layers_add_up_to_the_picture_that_there_is_without_them() {
    for mode in [Transport { alpha: 1.0, tau: 0.0 }, Transport { alpha: 0.7, tau: 0.3 }, Mode::Local.transport()] {
        let found = adds_up(&scene(0, None), mode, 0.04);
        let names: Vec<String> = found.layers.iter().map(|layer| layer.kind.name()).collect();
        let lamps =
            ["lamp.desk", "lamp.panel warm", "lamp.panel cold", "lamp.sky", "lamp.bulb", "bounce.0", "bounce.1"];
        assert_eq!(names[..7], lamps, "{names:?}");
    }
    adds_up(&scene(12, None), Mode::Global.transport(), 0.04);
    for built_in in ["furnished-room", "two-rooms"] {
        adds_up(&Scene::open(built_in).expect("a scene"), Mode::Global.transport(), 0.08);
    }
}

#[test]
fn the_layer_of_every_lamp_is_what_path_tracing_shows_of_it_alone() {
    for rows in [0, 10] {
        let whole_scene = scene(rows, None);
        let names = Emitters::of(&whole_scene).names().to_vec();
        let mode = Mode::Global.transport();
        let found = rendered(&whole_scene, mode, 0.01, Apart { emitters: true, bounces: false });
        let whole = rms(&found.picture);
        for (e, layer) in found.layers.iter().enumerate() {
            let alone = scene(rows, Some(&names[e]));
            let (rays, transports) = (Rays::new(&alone), alone.transports(mode));
            let mut tracer = Tracer::new(&alone, &rays, &transports, SIZE, &TraceSettings::default());
            tracer.pass(2048);
            let (traced, noise) = (tracer.picture(), tracer.standard_error().expect("many samples"));
            let (mut squared, mut count) = (DVec3::ZERO, 0.0);
            let parts = traced.pixels.iter().zip(&noise.pixels).zip(&layer.light.picture.pixels);
            for ((traced, noise), own) in parts {
                squared += (*traced - *own).as_dvec3().powf(2.0) - noise.as_dvec3().powf(2.0);
                count += 3.0;
            }
            let apart = (squared.element_sum() / count).max(0.0).sqrt();
            assert!(apart < 1.2 * found.error.total * whole, "{rows} {}: {apart} {whole}", names[e]);
            let mean = |picture: &Picture| picture.pixels.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / (count / 3.0);
            let (value, error) = (DVec3::from(tracer.mean().value), DVec3::from(tracer.mean().error));
            let z = (mean(&layer.light.picture) - value) / error.max(DVec3::splat(1e-6 * whole));
            // The layer has an error of its own: half a percent of it is more than what it is stated to have in the
            // mean.
            let share = (mean(&layer.light.picture) / value - 1.0).abs();
            assert!(z.abs().max_element() < 4.0 || share.max_element() < 0.01, "{rows} {}: {z} {share}", names[e]);
        }
    }
}

/// RMS over pixels and channels.
fn rms(picture: &Picture) -> f64 {
    let sum: f64 = picture.pixels.iter().map(|p| p.as_dvec3().length_squared()).sum();
    (sum / (3 * picture.pixels.len()) as f64).sqrt()
}

#[test]
fn bounces_apart_are_those_of_the_path_tracer() {
    let (scene, mode) = (scene(0, None), Mode::Global.transport());
    let found = rendered(&scene, mode, 0.01, Apart { emitters: false, bounces: true });
    let (rays, transports) = (Rays::new(&scene), scene.transports(mode));
    let mut tracer = Tracer::new(&scene, &rays, &transports, SIZE, &TraceSettings::default());
    tracer.pass(1024);
    for layer in found.layers.iter().take(4) {
        let LayerKind::Bounce(n) = layer.kind else { panic!("a bounce") };
        let (traced, noise) = (tracer.bounce(n).expect("kept"), tracer.bounce_error(n).expect("kept"));
        let parts = traced.pixels.iter().zip(&noise.pixels).zip(&layer.light.picture.pixels);
        let squared: f64 = parts
            .map(|((t, noise), own)| (*t - *own).as_dvec3().length_squared() - noise.as_dvec3().length_squared())
            .sum();
        let apart = (squared / (3 * traced.pixels.len()) as f64).max(0.0).sqrt();
        assert!(apart < 1.5 * found.error.total * rms(&found.picture), "{n}: {apart}");
    }
}

#[test]
fn light_of_emitters_on_patches_is_that_of_columns() {
    let solver = Solver::new(&scene(0, None)).memory(f64::INFINITY).apart(ALL);
    let fineness = halflight::Fineness { patches: 400, rays: 128 };
    let mode = solver
        .assemble(&[Mode::Global.transport()], fineness, &halflight::render::Silent)
        .expect("fits")
        .modes
        .remove(0);
    let settings = Settings::default();
    let whole = halflight::solve::neumann(&mode.operator, &settings).expect("converges");
    let apart = solve_columns(&mode.operator, &mode.sources(), &settings).expect("converges");
    for i in 0..whole.light.len() {
        let sum: Vec3 = apart.light.iter().map(|light| light[i].visible).sum();
        let most = whole.light[i].visible.max(Vec3::splat(1e-3));
        // Both series are cut where 1e-4 is left, in the norm.
        assert!(((sum - whole.light[i].visible) / most).abs().max_element() < 2e-3, "{i}: {sum} {:?}", whole.light[i]);
    }
}

#[test]
fn what_was_solved_is_dimmed_without_a_ray() {
    let texts = files(0, None);
    let named: Vec<(&str, &str)> = texts.iter().map(|(name, text)| (*name, text.as_str())).collect();
    let place = place(&named);
    let options = "--mode global --size 24x24 --tolerance 0.05 --per luminaire --points grid:table@0.01,0.2 --lux";
    let kept = report(&place, &format!("render r.toml {options} -o r.exr"));
    assert!(kept["modes"][0]["layers"].as_array().expect("layers").iter().any(|name| name == "lamp.desk"));
    fs::write(place.path().join("kept.json"), kept.to_string()).expect("a file");
    let relit = report(&place, "relight kept.json --lamp desk=0.25 --lamp sky=0,0,0 --lamp bulb=2 -o relit.exr");
    let layers = read_layers(place.path().join("r.exr")).expect("layers");
    let picture = read_picture(place.path().join("relit.exr")).expect("a picture");
    let factor = |name: &str| match name {
        "lamp.desk" => 0.25,
        "lamp.sky" => 0.0,
        "lamp.bulb" => 2.0,
        _ => 1.0,
    };
    for (k, pixel) in picture.pixels.iter().enumerate() {
        let lamps = layers.iter().filter(|layer| layer.name.starts_with("lamp."));
        let sum: Vec3 = lamps.map(|layer| factor(&layer.name) * layer.picture.pixels[k]).sum();
        assert!((sum - *pixel).abs().max_element() < 1e-5, "{k}: {sum} {pixel}");
    }
    assert_eq!(relit["factors"]["sky"], serde_json::json!([0.0, 0.0, 0.0]));
    // Its error is that of the layers times their factors, over what they show.
    let names = kept["modes"][0]["layers"].as_array().expect("layers").iter();
    let errors = kept["modes"][0]["layer_errors"].as_array().expect("errors");
    let squares = names.zip(errors).fold([0.0; 2], |[error, rms], (name, own)| {
        let times = |key: &str| f64::from(factor(name.as_str().unwrap())) * own[key].as_f64().unwrap();
        [error + times("error").powi(2), rms + times("rms").powi(2)]
    });
    let stated = relit["error"].as_f64().expect("an error");
    assert!((stated - (squares[0] / squares[1]).sqrt()).abs() < 1e-9 && stated > 0.01 && stated < 0.3, "{stated}");
    // An EXR file alone has no errors.
    assert!(report(&place, "relight r.exr -o alone.exr").get("error").is_none());
    // What a lamp at half its strength gives is what is wanted: the factor is found.
    let aims: String = kept["modes"][0]["points"]
        .as_array()
        .expect("points")
        .iter()
        .map(|point| {
            let light = |name: &str| {
                let own = point["luminaires"][name].as_array().expect("a lamp");
                own.iter().zip([0.2126, 0.7152, 0.0722]).map(|(e, y)| 683.0 * y * e.as_f64().unwrap()).sum::<f64>()
            };
            let lux: f64 = 0.5 * light("desk") + light("panel warm");
            let [x, y, z] = [0, 1, 2].map(|d| point["position"][d].as_f64().unwrap());
            format!("{x},{y},{z},{lux}\n")
        })
        .collect();
    fs::write(place.path().join("aim.csv"), format!("x,y,z,lux\n{aims}")).expect("a file");
    let found = report(&place, "relight kept.json --lux aim.csv --lamp sky=0 --lamp bulb=0");
    let of = |name: &str| found["factors"][name][0].as_f64().expect("a factor");
    assert!((of("desk") - 0.5).abs() < 1e-3 && (of("panel warm") - 1.0).abs() < 0.02, "{}", found["factors"]);
    assert!(found["left_over"][0].as_f64().expect("left over") < 0.1);
}

/// A floor under lights whose names are long, alike for longer than a file can say, not of ASCII, or those of others'
/// errors.
#[test]
fn lamps_are_told_apart_whatever_they_are_called() {
    let long = |length: usize, end: &str| "a".repeat(length) + end;
    let names = [
        long(239, "1"),
        long(239, "2"),
        long(300, "1"),
        long(300, "2"),
        "désk".into(),
        "dësk".into(),
        "desk".into(),
        "desk.standard error".into(),
    ];
    let lights = names.iter().enumerate().map(|(k, name)| {
        let (x, i) = (-0.7 + 0.2 * k as f64, 1 + k);
        format!(
            "[[lights]]\ntype = \"point\"\nname = \"{name}\"\nposition = [{x}, 1, 0]\nintensity = [{i}, {i}, {i}]\n"
        )
    });
    let toml = "obj = \"f.obj\"\n[camera]\nposition = [0, 2, 3]\ntarget = [0, 0, 0]\n".to_owned()
        + &lights.collect::<String>();
    let obj = "mtllib f.mtl\nusemtl white\nv -2 0 2\nv 2 0 2\nv 2 0 -2\nv -2 0 -2\nf 1 2 3 4\n";
    let place = place(&[("f.obj", obj), ("f.mtl", "newmtl white\nKd .5 .5 .5\n"), ("f.toml", &toml)]);
    let options = "--mode local --size 8x6 --tolerance 0.1 --per luminaire --standard-error -o f.exr";
    let kept = report(&place, &format!("render f.toml {options}"));
    fs::write(place.path().join("kept.json"), kept.to_string()).expect("a file");
    let whole = read_picture(place.path().join("f.exr")).expect("a picture");
    for (k, name) in names.iter().enumerate() {
        let layers = read_layers(place.path().join("f.exr")).expect("layers");
        let own = layers.iter().find(|layer| layer.name == format!("lamp.{name}") && layer.shows == Shows::Light);
        let own = &own.expect("its layer").picture;
        for file in ["f.exr", "kept.json"] {
            let out = Command::new(program())
                .args(["relight", file, "--lamp", &format!("{name}=0"), "-o", "dark.exr"])
                .current_dir(place.path())
                .output()
                .expect("runs");
            assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
            let found = read_picture(place.path().join("dark.exr")).expect("a picture");
            for ((found, whole), own) in found.pixels.iter().zip(&whole.pixels).zip(&own.pixels) {
                assert!((*whole - *own - *found).abs().max_element() <= 1e-5 * whole.max_element(), "{file} {k}");
            }
        }
    }
}

#[test]
fn what_cannot_be_dimmed_is_refused() {
    let texts = files(0, None);
    let named: Vec<(&str, &str)> = texts.iter().map(|(name, text)| (*name, text.as_str())).collect();
    let place = place(&named);
    let kept = report(&place, "render r.toml --mode local --size 8x8 --tolerance 0.2 --layers luminaires -o r.exr");
    fs::write(place.path().join("kept.json"), kept.to_string()).expect("a file");
    fs::write(place.path().join("bad.json"), "{\"modes\": [{\"luminaires\": 3}]}").expect("a file");
    fs::write(place.path().join("none.json"), "{\"modes\": [{}]}").expect("a file");
    fs::write(place.path().join("two.json"), "{\"modes\": [{}, {}]}").expect("a file");
    fs::write(place.path().join("aim.csv"), "x,y,z,lux\n0,0,0,100\n").expect("a file");
    succeed(&place, "relight r.exr --lamp desk=2 -o a.png");
    for (arguments, code, what) in [
        ("relight kept.json --lamp dusk=2", 2, "its lamps: desk"),
        ("relight kept.json --lamp desk=-1", 2, "factors of 0 or more"),
        ("relight kept.json --lamp desk", 2, "NAME=F"),
        ("relight kept.json --lux aim.csv", 3, "has no points"),
        ("relight bad.json", 3, "is no report"),
        ("relight none.json", 3, "no light of single lamps"),
        ("relight two.json", 3, "a report of 2 modes"),
        ("relight gone.json", 3, "cannot be read"),
        ("relight r.obj.exr", 3, "cannot read"),
    ] {
        let ran = halflight(&place, arguments);
        assert_eq!(ran.code, Some(code), "{arguments}: {}", ran.err);
        assert!(ran.err.contains(what), "{arguments}: {}", ran.err);
    }
}
