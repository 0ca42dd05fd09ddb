//! Files as people have them: what they say is what is shown.

use std::path::PathBuf;

use glam::{DVec3, Vec3};
use halflight::Solver;
use halflight::light::Mode;
use halflight::render::Sensor;
use halflight::scene::{LengthUnit, LoadOptions, Scene, SceneError};

/// Lumens of a watt.
const EFFICACY: f64 = 683.0;

fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/files").join(name)
}

fn load(name: &str) -> Scene {
    load_with(name, LoadOptions::default())
}

fn load_with(name: &str, options: LoadOptions) -> Scene {
    Scene::load(&path(name), options).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Illuminance at points of a scene, lx: by its lights alone.
fn direct(scene: &Scene, sensors: &[Sensor]) -> Vec<f64> {
    let found = Solver::new(scene).points(Mode::Local, sensors).tolerance(0.02).expect("points");
    found.points.iter().map(|point| EFFICACY * point.irradiance[1]).collect()
}

fn sensor(x: f64, y: f64, z: f64, normal: DVec3) -> Sensor {
    Sensor { position: DVec3::new(x, y, z), normal: normal.normalize() }
}

/// Two metres below the luminaire, and aside.
fn below() -> [Sensor; 2] {
    [sensor(0.0, -2.0, 0.0, DVec3::Y), sensor(1.5, -2.0, 0.0, DVec3::new(-0.6, 0.8, 0.0))]
}

/// 1000 cd cos(gamma): I/d² below; aside d² = 6.25, cos(gamma) = 0.8 and the cosine at the receiver is 1.
#[test]
fn a_luminaire_is_read_whatever_its_header_and_ends_are() {
    for name in ["plain", "blank-first-2019", "crlf-ctrl-z", "cr-only"] {
        let found = direct(&load(&format!("photometry/{name}.toml")), &below());
        // Chords of the cosine over five degrees are off by (5 degrees)²/8 at most.
        for (found, expected) in found.iter().zip([250.0, 128.0]) {
            assert!((found / expected - 1.0).abs() < 1e-3, "{name}: {found} {expected}");
        }
    }
}

/// 1000 cd, two metres over a point; `both` has as much again by LM-63.
#[test]
fn candela_of_gltf_are_candela() {
    for (name, expected) in [("point", 250.0), ("both", 500.0)] {
        let scene = load(&format!("gltf-lights/{name}.toml"));
        let found = direct(&scene, &[sensor(0.0, 0.0, 0.0, DVec3::Y)])[0];
        assert!((found / expected - 1.0).abs() < 1e-3, "{name}: {found}");
    }
}

#[test]
fn luminaires_hang_along_the_scene_s_up() {
    let floor = [sensor(0.0, 0.0, -2.0, DVec3::Z)];
    for name in ["plain-z", "plain-z-no-direction", "tilt-z"] {
        let found = direct(&load(&format!("photometry-z-up/{name}.toml")), &floor)[0];
        assert!((found / 250.0 - 1.0).abs() < 1e-3, "{name}: {found}");
    }
    let found = direct(&load("photometry-z-up/tilt-y.toml"), &below()[..1])[0];
    assert!((found / 250.0 - 1.0).abs() < 1e-3, "{found}");
}

const PLATE: &str = "mtllib m.mtl\nusemtl a\nv 0 0 0\nv 0 0 1\nv 1 0 1\nv 1 0 0\nf 1 2 3 4\n";

fn scene_file(toml: &str) -> Result<Scene, SceneError> {
    let toml = format!("obj = \"s.obj\"\n{toml}");
    Scene::from_toml_text("s", &toml, PLATE, "newmtl a\nKd .5 .5 .5\n", LoadOptions::default())
}

#[test]
fn the_sky_follows_the_scene_s_up_and_not_the_camera_s() {
    let view = "[camera]\nposition = [0.5, 3, 0.5]\ntarget = [0.5, 0, 0.5]\n";
    let sky = "[sky]\nupper = [1, 1, 1]\n";
    let up = |head: &str, camera_up: &str| {
        let scene = scene_file(&format!("{head}{view}{camera_up}{sky}")).expect("a scene");
        (scene.sky.expect("a sky").up, scene.camera.up, scene.warnings)
    };
    let plan = "up = [0, 0, -1]\n";
    let (sky, camera, warnings) = up("up = [0, 1, 0]\n", plan);
    assert_eq!((sky, camera), (Vec3::Y, Vec3::NEG_Z));
    assert!(warnings.is_empty(), "{warnings:?}");
    // With one of the two it counts for both, which is said where it is none that scenes are built along.
    let (sky, camera, warnings) = up("", plan);
    assert_eq!((sky, camera), (Vec3::NEG_Z, Vec3::NEG_Z));
    assert!(warnings.len() == 1 && warnings[0].contains("the camera's up (0.000, 0.000, -1.000)"), "{warnings:?}");
    let (sky, camera, warnings) = up("up = [0, 0, 2]\n", "");
    assert_eq!((sky, camera), (Vec3::Z, Vec3::Z));
    assert!(warnings.is_empty(), "{warnings:?}");
    for (up, message) in [("up = [0, 0, 0]\n", "`up` is zero"), ("up = [0, inf, 0]\n", "`inf` in `up` is not finite")] {
        let error = scene_file(up).expect_err("no direction").to_string();
        assert!(error.starts_with("s.toml, line 2: ") && error.contains(message), "{error}");
    }
}

#[test]
fn a_unit_makes_an_office_in_millimetres_that_in_metres() {
    let points = |scale: f64| {
        let at = |x: f64, z: f64| sensor(scale * x, scale * 0.8, scale * z, DVec3::Y);
        [at(1.0, 1.0), at(3.0, 4.0), at(5.0, 7.0)]
    };
    let metres = direct(&load("units/m.toml"), &points(1.0));
    let millimetres = LoadOptions { unit: Some(LengthUnit::Millimetre), ..LoadOptions::default() };
    let found = direct(&load_with("units/mm.toml", millimetres), &points(1e3));
    for (a, b) in metres.iter().zip(&found) {
        assert!(*a > 100.0 && (a / b - 1.0).abs() < 1e-5, "{a} {b}");
    }
    // Without a unit metres are unlikely, and that is said.
    let warnings = load("units/mm.toml").warnings;
    assert!(warnings.iter().any(|warning| warning.contains("--unit mm")), "{warnings:?}");
    assert!(!load("units/m.toml").warnings.iter().any(|warning| warning.contains("--unit")));
}

#[test]
fn every_unit_is_as_long_as_it_says() {
    let light = "[[lights]]\ntype = \"point\"\nposition = [0.5, 1, 0.5]\nintensity = [1, 1, 1]\n";
    for (symbol, unit) in LengthUnit::ALL {
        let scene = scene_file(&format!("unit = \"{symbol}\"\n{light}")).expect("a scene");
        let found = direct(&scene, &[sensor(0.5, 0.0, 0.5, DVec3::Y)])[0];
        let expected = EFFICACY / unit.metres().powi(2);
        assert!((found / expected - 1.0).abs() < 1e-5, "{symbol}: {found} {expected}");
        // An attenuation that is given counts in the file's unit, as OpenGL's does.
        let own = scene_file(&format!("unit = \"{symbol}\"\n{light}attenuation = [0, 0, 1]\n")).expect("a scene");
        let found = direct(&own, &[sensor(0.5, 0.0, 0.5, DVec3::Y)])[0];
        assert!((found / EFFICACY - 1.0).abs() < 1e-5, "{symbol}: {found}");
    }
    let error = scene_file("unit = \"yard\"\n").expect_err("no unit").to_string();
    assert!(error.starts_with("s.toml, line 2: ") && error.contains("yard"), "{error}");
}

/// Power goes by square metres: of surfaces that emit as of lights without area.
#[test]
fn power_is_that_of_metres() {
    for (symbol, unit) in LengthUnit::ALL {
        let scene =
            scene_file(&format!("unit = \"{symbol}\"\n[materials.a]\nemission = [1, 1, 1]\n")).expect("a scene");
        let p = Solver::new(&scene).cut(4);
        let area: f64 = p.patches.file_areas(&scene).iter().sum();
        assert!((area / unit.metres().powi(2) - 1.0).abs() < 1e-6, "{symbol}: {area}");
    }
}

/// Linear .5, written as its sRGB code over 255 in OBJ and as it is in glTF.
#[test]
fn colours_behind_vertices_are_srgb_codes() {
    for name in ["blender-half.toml", "blender-half-gltf.toml"] {
        let scene = load(&format!("vertex-colours-srgb/{name}"));
        let rho = scene.means_of_face(0).rho;
        assert!((rho - 0.5).abs().max_element() < 1e-4, "{name}: {rho}");
    }
}

#[test]
fn a_factor_says_nothing_of_a_texture_that_is_not_there() {
    for name in ["kd-1", "kd-08"] {
        let scene = load(&format!("missing-texture/{name}.obj"));
        let wall = scene.materials.iter().find(|material| material.name == "wall").expect("a wall");
        assert_eq!(wall.rho, Vec3::splat(0.8), "{name}");
        let warnings = scene.warnings.join("\n");
        assert!(warnings.contains("plaster.bmp"), "{warnings}");
        assert!(
            warnings.contains("1 missing map_Kd of material `wall`") && warnings.contains("0.8 of it where it is 1")
        );
    }
}

/// Nearly white, white in one channel, and none at all beside a texture that is not there.
#[test]
fn a_factor_that_is_nearly_all_is_no_reflectance() {
    for (kd, expected) in [
        ("Kd 1 1 1\n", [0.8, 0.8, 0.8]),
        ("Kd .999 .999 .999\n", [0.7992, 0.7992, 0.7992]),
        ("Kd 1 .5 .2\n", [0.8, 0.4, 0.16]),
        ("Kd 0 0 0\n", [0.8, 0.8, 0.8]),
        ("", [0.8, 0.8, 0.8]),
        ("Kd .8 .8 .8\n", [0.8, 0.8, 0.8]),
        ("Kd .5 .5 .5\n", [0.5, 0.5, 0.5]),
    ] {
        let place = tempfile::tempdir().expect("a folder");
        let at = |name: &str| place.path().join(name);
        std::fs::write(at("s.obj"), PLATE).expect("a file");
        std::fs::write(at("m.mtl"), format!("newmtl a\n{kd}map_Kd gone.png\n")).expect("a file");
        let scene = Scene::load(&at("s.obj"), LoadOptions::default()).expect("a scene");
        assert!(
            (scene.materials[0].rho - Vec3::from(expected)).abs().max_element() < 1e-6,
            "{kd}: {:?}",
            scene.materials[0]
        );
        assert!(scene.warnings.join("\n").contains("gone.png"), "{kd}");
    }
}

/// White behind `v` and nothing in the library: what is white stands for what is not said, as in glTF.
#[test]
fn white_vertices_define_nothing() {
    let obj = "mtllib m.mtl\nusemtl a\nv 0 0 0 1 1 1\nv 0 0 1 1 1 1\nv 1 0 1 1 1 1\nf 1 2 3\n";
    let scene = Scene::from_obj_text("s", obj, "newmtl a\n").expect("a scene");
    assert!((scene.means_of_face(0).rho - 0.8).abs().max_element() < 1e-6);
}

/// The lamp comes after the ceiling that it lies in, or before.
#[test]
fn of_faces_in_one_place_the_one_that_emits_is_there() {
    let ceiling = "usemtl a\nv 0 3 0\nv 3 3 0\nv 3 3 3\nv 0 3 3\nf -4 -3 -2 -1\n";
    let lamp = "usemtl lamp\nv 1 3 1\nv 2 3 1\nv 2 3 2\nv 1 3 2\nf -4 -3 -2 -1\n";
    let mtl = "newmtl a\nKd .5 .5 .5\nnewmtl lamp\nKd 0 0 0\nKe 2 2 2\n";
    for parts in [[ceiling, lamp], [lamp, ceiling]] {
        let scene = Scene::from_obj_text("s", &format!("mtllib m.mtl\n{}", parts.concat()), mtl).expect("a scene");
        scene.require_emission().expect("the lamp");
        let area = |emits: bool| -> f64 {
            let own = (0..scene.faces.len() as u32).filter(|&face| scene.material(face).emits() == emits);
            own.map(|face| scene.area(face)).sum::<f64>() * scene.frame.scale.powi(2)
        };
        assert!((area(true) - 1.0).abs() < 1e-5 && (area(false) - 8.0).abs() < 1e-5, "{} {}", area(true), area(false));
        assert!(scene.warnings.iter().any(|warning| warning.contains("one that emits is there")));
    }
}

#[test]
fn files_of_other_kinds_are_told_for_what_they_are() {
    for (text, message) in [
        ("ply\nformat ascii 1.0\n", "a PLY"),
        ("solid a\nfacet normal 0 0 1\n", "an STL"),
        ("<!DOCTYPE html>\n<html></html>", "a page of HTML"),
        ("version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 1\n", "a pointer of Git LFS"),
    ] {
        let error = Scene::from_obj_text("s", text, "").expect_err(message);
        assert_eq!(error.to_string(), format!("s.obj is {message}, not what its name says"));
        let error = Scene::from_gltf_bytes("s", text.as_bytes()).expect_err(message);
        assert_eq!(error.to_string(), format!("s.gltf is {message}, not what its name says"));
    }
    for (text, message) in
        [("glTF\u{2}", "a glTF of the binary kind"), ("{\"asset\": {}}", "a text of JSON, as glTF is")]
    {
        let error = Scene::from_obj_text("s", text, "").expect_err(message);
        assert_eq!(error.to_string(), format!("s.obj is {message}, not what its name says"));
    }
    // What stands in for a library is no library.
    let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 1\n";
    let scene = Scene::from_obj_text("s", PLATE, pointer).expect("a scene without its library");
    assert!(scene.warnings[0].contains("git lfs pull"), "{:?}", scene.warnings);
}
