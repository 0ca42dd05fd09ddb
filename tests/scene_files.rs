//! Scene files: every error and warning, with its place; what may not change a scene; text that is not a scene.

use std::fs;

use glam::{DVec3, Vec3};
use halflight::light::{Mode, Rgb, Visibility};
use halflight::scene::{
    Beam, GivenFace, LoadOptions, Material, PunctualForm, PunctualLight, PunctualPlace, Scene, SceneError, Sides,
};
use miette::Diagnostic;
use proptest::prelude::*;

const SQUARE: &str = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl a\nf 1 2 3 4\n";
const GREY: &str = "newmtl a\nKd .5\nKe 1\n";

fn obj(text: &str) -> Result<Scene, SceneError> {
    Scene::from_obj_text("s", text, GREY)
}

fn toml(text: &str) -> Result<Scene, SceneError> {
    Scene::from_toml_text("s", &format!("obj = \"s.obj\"\n{text}"), SQUARE, GREY, LoadOptions::default())
}

/// The message of an error, which must also say what to do.
#[track_caller]
fn message(result: Result<Scene, SceneError>) -> String {
    let error = result.expect_err("a mistake must be found");
    assert!(error.help().is_some_and(|help| help.to_string().len() > 10));
    error.to_string()
}

#[track_caller]
fn refuses(result: Result<Scene, SceneError>, parts: &[&str]) {
    let message = message(result);
    for part in parts {
        assert!(message.contains(part), "`{part}` not in `{message}`");
    }
}

/// Materials and their images are beside the scene file, or else beside the OBJ.
#[test]
fn an_obj_in_another_folder_has_its_materials() {
    let place = tempfile::tempdir().expect("a folder");
    let at = |name: &str| place.path().join(name);
    fs::create_dir(at("m")).expect("a folder");
    fs::write(at("m/s.obj"), SQUARE).expect("it is written");
    fs::write(at("m/m.mtl"), GREY).expect("it is written");
    fs::write(at("s.toml"), "obj = \"m/s.obj\"\n").expect("it is written");
    let rho = || {
        let scene = Scene::load(&at("s.toml"), LoadOptions::default()).expect("a scene");
        assert_eq!(scene.warnings, [""; 0]);
        scene.material(0).rho
    };
    assert_eq!(rho(), Rgb::splat(0.5));
    fs::write(at("m.mtl"), GREY.replace("Kd .5", "Kd .25")).expect("it is written");
    assert_eq!(rho(), Rgb::splat(0.25));
}

#[test]
fn mistakes_in_an_obj_are_named_with_their_line() {
    let with = |line: &str| obj(&format!("{SQUARE}{line}\n"));
    refuses(with("v nan 0 0"), &["s.obj, line 8", "`nan`", "not finite"]);
    refuses(with("v 0 1e999 0"), &["line 8", "`1e999`"]);
    refuses(with("v 0 0"), &["line 8", "three coordinates", "found 2"]);
    refuses(with("v 0 1,5 0"), &["line 8", "`1,5`", "not a number"]);
    refuses(with("f 1 2 0"), &["line 8", "vertex 0", "4 vertices"]);
    refuses(with("f 1 2 5"), &["line 8", "vertex 5", "4 vertices"]);
    refuses(with("f 1 2 -5"), &["line 8", "vertex -5"]);
    refuses(with("f 1 2 x"), &["line 8", "`x`", "not a number"]);
    refuses(with("f 1 2 3/1/1/1"), &["line 8", "v/vt/vn"]);
    refuses(with("f 1 2 99999999999999999999"), &["line 8", "99999999999999999999"]);
    refuses(with(&format!("f{}", " 1".repeat(10_001))), &["line 8", "10001 corners", "10000"]);
    refuses(with("mtllib"), &["line 8", "a name"]);
    refuses(obj("v 0 0 0\n"), &["s.obj has no faces"]);
    refuses(obj("v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\nf 1 1 1\n"), &["no faces with area", "2 without"]);
}

#[test]
fn mistakes_in_an_mtl_are_named_with_their_line() {
    let with = |line: &str| Scene::from_obj_text("s", SQUARE, &format!("newmtl a\n{line}\n"));
    refuses(with("Kd 1.1 0 0"), &["m.mtl, line 2", "`a` reflects 1.1"]);
    refuses(with("Kd -0.1"), &["line 2", "-0.1"]);
    refuses(with("Ke 0 -2 0"), &["line 2", "emits -2"]);
    refuses(with("Ke 1e39"), &["line 2", "emits 1"]);
    refuses(with("Ke inf 0 0"), &["line 2", "not finite"]);
    refuses(with("Kd 0 0"), &["line 2", "one number or three", "found 2"]);
    refuses(with("Kd spectral x.rfl"), &["line 2", "spectral"]);
    refuses(with("Kd a b c"), &["line 2", "`a`"]);
    refuses(Scene::from_obj_text("s", SQUARE, "Kd 1\n"), &["m.mtl, line 1", "newmtl"]);
}

#[test]
fn mistakes_in_a_scene_file_are_named_with_their_line() {
    refuses(toml("mode = \n"), &["s.toml, line 2"]);
    refuses(toml("colour = 1\n"), &["s.toml, line 2", "unknown field `colour`"]);
    refuses(toml("mode = \"flat\"\n"), &["line 2", "no mode `flat`"]);
    refuses(toml("mode = \"local\"\ntau = 1.0\n"), &["line 2", "`mode` and `alpha` or `tau`"]);
    refuses(toml("tau = 1.5\n"), &["line 2", "tau = 1.5 is outside 0..1"]);
    refuses(toml("alpha = nan\n"), &["line 2", "alpha = NaN"]);
    refuses(toml("\n[materials.b]\n"), &["line 3", "no material `b`"]);
    refuses(toml("[materials.a]\nalpha = -1.0\n"), &["line 3", "alpha = -1"]);
    refuses(toml("[materials.a]\nemission = [1, 2, -3]\n"), &["line 3", "emits -3"]);
    refuses(toml("[materials.a]\nKd = 1\n"), &["line 3", "unknown field `Kd`"]);
    let camera = |rest: &str| toml(&format!("[camera]\nposition = [0, 0, 0]\n{rest}\n"));
    refuses(camera("target = [0, 0, 0]"), &["line 2", "no direction"]);
    refuses(camera("target = [0, 3, 0]"), &["line 2", "up vector"]);
    refuses(camera("target = [0, 0, 1]\nup = [0, 0, 0]"), &["line 2", "up vector"]);
    refuses(camera("target = [0, 0, 1]\nvertical_fov = 180"), &["line 5", "vertical_fov = 180"]);
    refuses(camera("target = [0, 0, inf]"), &["line 4", "`inf` in `target`", "not finite"]);
    refuses(camera(""), &["line 2", "target"]);
}

#[test]
fn the_help_lists_what_there_is() {
    let help = |error: SceneError| error.help().unwrap().to_string();
    assert!(help(toml("[materials.b]").unwrap_err()).contains("are: a"));
    let none = Scene::open("no-such-scene").unwrap_err();
    assert!(help(none).contains("cornell-box, furnace"));
}

#[test]
fn files_are_read_from_beside_each_other() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let load = |name: &str| Scene::load(&at(name), LoadOptions::default());
    refuses(load("a.obj"), &["cannot read", "a.obj"]);
    refuses(load("a.stl"), &["neither an OBJ nor a scene file"]);
    fs::write(at("bad.obj"), b"v 0 0 0\n\0\xff\xfe").unwrap();
    refuses(load("bad.obj"), &["bad.obj, line 2", "0xff"]);
    fs::write(at("a.obj"), SQUARE.replace("m.mtl", "my materials.mtl other.mtl")).unwrap();
    fs::write(at("other.mtl"), "newmtl b\nKd 1\n").unwrap();
    fs::write(at("my materials.mtl"), GREY).unwrap();
    let names: Vec<String> = load("a.obj").unwrap().materials.into_iter().map(|m| m.name).collect();
    assert_eq!(names, ["a", "b"]);
    fs::write(at("s.toml"), "obj = \"a.obj\"\n").unwrap();
    assert_eq!(load("s.toml").unwrap().name, "s");
    fs::write(at("t.toml"), "\nobj = \"missing.obj\"\n").unwrap();
    refuses(load("t.toml"), &["t.toml, line 2", "missing.obj"]);
    let path = at("s.toml");
    assert!(Scene::open(path.to_str().unwrap()).is_ok());
}

#[test]
fn what_a_scene_does_not_hold_is_warned_of_once() {
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nl 1 2\np 1\nf 1 2 3\nf 1 2 2\nf 1 1 1\nf 1 2\nf 3\n";
    let warnings = obj(text).unwrap().warnings;
    let has = |part: &str| assert_eq!(warnings.iter().filter(|w| w.contains(part)).count(), 1, "{warnings:?}");
    assert_eq!(warnings.len(), 4, "{warnings:?}");
    has("2 statements (first: s.obj, line 4)");
    has("3 faces (first: s.obj, line 6): no usemtl");
    has("2 faces of material `(none)` (first: s.obj, line 7): dropped");
    has("2 faces (first: s.obj, line 9): left out: with fewer than three corners");
    assert!(obj(SQUARE).unwrap().warnings.is_empty());
    let crossing = SQUARE.replace("f 1 2 3 4", "f 1 2 3 4\nv .5 2 0\nf 1 3 4 2 5");
    assert!(obj(&crossing).unwrap().warnings[0].contains("crosses itself"));
}

#[test]
fn a_scene_file_says_everything_the_design_lets_it() {
    let text = "alpha = 0.5\n[materials.a]\ntau = 0.25\ntwo_sided = true\nemission = [17, 12, 4]\nvisible_emission = false\n\
        [camera]\nposition = [0.5, 0.5, 2]\ntarget = [0.5, 0.5, 1]\nvertical_fov = 90";
    let scene = toml(text).unwrap();
    let a = &scene.materials[0];
    let transport = scene.transport.unwrap();
    assert_eq!((transport.alpha, transport.tau), (0.5, 0.0));
    assert_eq!((a.alpha, a.tau), (None, Some(0.25)));
    assert_eq!((a.sides, a.visibility), (Sides::Two, Visibility::Hidden));
    assert_eq!(a.emission, Vec3::new(17.0, 12.0, 4.0));
    // Half the largest extent is 0.5, the middle (0.5, 0.5, 0).
    assert_eq!(scene.camera.position, Vec3::new(0.0, 0.0, 4.0));
    assert_eq!(scene.camera.forward, Vec3::NEG_Z);
    let local = toml("mode = \"local\"\n[materials.a]\nmode = \"shadowless\"").unwrap();
    assert_eq!(local.transport, Some(Mode::Local.transport()));
    assert_eq!((local.materials[0].alpha, local.materials[0].tau), (Some(1.0), Some(1.0)));
}

#[test]
fn sides_asked_for_hold_where_the_file_says_nothing() {
    let options = LoadOptions { two_sided: Sides::Two, ..LoadOptions::default() };
    let load = |rest: &str| {
        let text = format!("obj = \"s.obj\"\n{rest}");
        Scene::from_toml_text("s", &text, SQUARE, GREY, options).unwrap().materials[0].sides
    };
    assert_eq!(load(""), Sides::Two);
    assert_eq!(load("[materials.a]\ntau = 1"), Sides::Two);
    assert_eq!(load("[materials.a]\ntwo_sided = false"), Sides::One);
}

#[test]
fn a_dark_scene_loads_and_only_a_renderer_refuses_it() {
    let dark = Scene::from_obj_text("s", SQUARE, "newmtl a\nKd 1\nnewmtl unused\nKd 1\nKe 1\n").unwrap();
    assert!(matches!(dark.require_emission(), Err(SceneError::Dark { .. })));
    obj(SQUARE).unwrap().require_emission().unwrap();
}

#[test]
fn every_way_to_write_a_face_means_the_same() {
    let plain = obj(SQUARE).unwrap();
    for text in [
        SQUARE.replace('\n', "\r\n"),
        SQUARE.replace("f 1 2 3 4", "f -4 -3 -2 -1"),
        SQUARE.replace("f 1 2 3 4", "vt 0 0\nvn 0 0 1\nf 1/1/1 2//1 3/1 4 # front"),
        SQUARE.replace("f 1 2 3 4", "f 1 2 \\\n 3 4"),
        SQUARE.replace("f 1 2 3 4", "f\t1  2\t3 4 "),
        format!("\u{feff}# first\n\n{SQUARE}"),
        "mtllib m.mtl\nusemtl a\nf 1 2 3 4\nv 0 0 0 1\nv 1 0 0 .5 .5 .5\nv 1 1 0\nv 0 1 0\n".to_owned(),
    ] {
        let scene = obj(&text).unwrap();
        assert_eq!((&scene.vertices, &scene.faces), (&plain.vertices, &plain.faces), "{text}");
    }
}

#[test]
fn faces_keep_their_object_and_material() {
    let text = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 2 0\nf 1 2 3\no one\nusemtl b\nf 1 3 4\n\
        g two\ng three\nf 2 5 3\nusemtl a\nf 3 5 4 \no one\nf 4 3 2 1\n";
    let scene = Scene::from_obj_text("s", text, "newmtl a\nKd 0\nnewmtl b\nKd 1\n").unwrap();
    assert_eq!(scene.objects, ["default", "one", "three"]);
    let found: Vec<(u32, &str)> =
        (0..6).map(|f| (scene.faces[f as usize].object, scene.material(f).name.as_str())).collect();
    assert_eq!(found, [(0, "(none)"), (1, "b"), (2, "b"), (2, "a"), (1, "a"), (1, "a")]);
}

#[test]
fn arrays_go_through_the_same_checks() {
    let square = [DVec3::ZERO, DVec3::X, DVec3::ONE, DVec3::Y];
    let grey = |rho: f32, e: f32| vec![Material::new("m", Rgb::splat(rho), Rgb::splat(e))];
    let make = |face: Vec<u32>, material, materials| Scene::from_faces("s", &square, &[(face, material)], materials);
    assert_eq!(make(vec![0, 1, 2], 0, grey(0.5, 1.0)).unwrap().faces.len(), 1);
    refuses(make(vec![0, 1, 4], 0, grey(0.5, 1.0)), &["s, face 0", "vertex 4"]);
    refuses(make(vec![0, 1], 0, grey(0.5, 1.0)), &["s, face 0", "2 corners"]);
    refuses(make(vec![0, 1, 2], 1, grey(0.5, 1.0)), &["material 1", "1 materials"]);
    refuses(make(vec![0, 1, 2], 0, grey(1.5, 1.0)), &["s, material 0", "1.5"]);
    refuses(make(vec![0, 1, 2], 0, grey(0.5, f32::NAN)), &["emits NaN"]);
    let nan = [DVec3::NAN, DVec3::X, DVec3::Y];
    refuses(Scene::from_faces("s", &nan, &[(vec![0, 1, 2], 0)], grey(0.5, 1.0)), &["s, vertex 0"]);
    refuses(Scene::from_faces("s", &square, &[], grey(0.5, 1.0)), &["no faces"]);
    let face = |object| GivenFace { corners: vec![0, 1, 2], material: 0, object };
    let named = |object| {
        let names = vec!["floor".into(), "wall".into()];
        Scene::from_objects("s", &square, &[face(0), face(object)], grey(0.5, 1.0), names)
    };
    assert_eq!(named(1).unwrap().objects, ["floor", "wall"]);
    let error = named(2).unwrap_err();
    assert_eq!((error.file(), error.place().map(|place| (place.item, place.number))), (Some("s"), Some(("face", 1))));
    refuses(named(2), &["s, face 1", "object 2", "2 objects"]);
}

#[test]
fn the_default_camera_frames_what_is_seen_from_outside() {
    for text in [SQUARE.to_owned(), SQUARE.replace("f 1 2 3 4", "f 4 3 2 1"), SQUARE.replace("v 1 1 0", "v 1 9 3")] {
        let scene = obj(&text).unwrap();
        let camera = scene.camera;
        let slope = (0.5 * camera.vertical_fov).to_radians().tan();
        for vertex in &scene.vertices {
            let offset = *vertex - camera.position;
            let depth = offset.dot(camera.forward);
            assert!(depth > 0.0);
            assert!(offset.dot(camera.right).abs() < slope * depth);
            assert!(offset.dot(camera.up).abs() < slope * depth);
        }
        let [a, b, c] = scene.corners(0);
        assert!((b - a).cross(c - a).dot(camera.position - a) > 0.0, "the front is what is seen");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// No bytes make the loader panic or hang.
    #[test]
    fn arbitrary_text_is_an_error_or_a_scene(text in "[\\PC\\n\\\\#/. 0-9vf-]{0,300}") {
        let _ = obj(&text);
        let _ = Scene::from_obj_text("s", SQUARE, &text);
        let _ = Scene::from_toml_text("s", &text, SQUARE, GREY, LoadOptions::default());
    }

    #[test]
    fn mutated_files_are_an_error_or_a_scene(which in 0..3usize, edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..3u8), 1..12)) {
        let camera = "obj = \"s.obj\"\nmode = \"global\"\n[camera]\nposition = [0, 0, 3]\ntarget = [0, 0, 0]\n[materials.a]\ntau = 0.5\n";
        let mut texts = [SQUARE.as_bytes().to_vec(), GREY.as_bytes().to_vec(), camera.as_bytes().to_vec()];
        for (at, byte, kind) in edits {
            let text = &mut texts[which];
            let at = at.index(text.len().max(1)).min(text.len());
            match kind {
                0 => text.insert(at, byte),
                1 => text.insert(at, b" \n0.-/fv#\\"[byte as usize % 10]),
                _ => { text.splice(at..(at + 1).min(text.len()), []); }
            }
        }
        let [obj, mtl, toml] = texts.map(|text| String::from_utf8_lossy(&text).into_owned());
        let _ = Scene::from_obj_text("s", &obj, &mtl);
        let _ = Scene::from_toml_text("s", &toml, &obj, &mtl, LoadOptions::default());
    }

    /// Size and place in the file change nothing but the frame.
    #[test]
    fn unit_coordinates_do_not_depend_on_size_or_place(exponent in -6..=6i32, shift in prop::array::uniform3(-1e5..1e5f64)) {
        let size = 10f64.powi(exponent);
        let points = [(0.0, 0.0, 0.0), (3.0, 0.1, 0.2), (0.3, 2.0, 0.7), (0.1, 0.2, 1.3)].map(|(x, y, z)| DVec3::new(x, y, z));
        let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]].map(|f| (f.to_vec(), 0));
        let grey = || vec![Material::new("m", Rgb::splat(0.5), Rgb::ZERO)];
        let moved = points.map(|p| size * (p + DVec3::from_array(shift)));
        let plain = Scene::from_faces("s", &points, &faces, grey()).unwrap();
        let scene = Scene::from_faces("s", &moved, &faces, grey()).unwrap();
        prop_assert_eq!(&scene.faces, &plain.faces);
        for (a, b) in scene.vertices.iter().zip(&plain.vertices) {
            // One rounding to single precision each, and 1e5 units of double precision.
            prop_assert!((*a - *b).abs().max_element() <= f32::EPSILON);
        }
        prop_assert!((scene.frame.scale / size - 1.5).abs() < 1e-9);
    }
}

fn lit(light: &str) -> Result<Scene, SceneError> {
    toml(&format!("[[lights]]\nintensity = [1, 2, 3]\n{light}"))
}

#[test]
fn lights_without_area_are_read_in_unit_coordinates() {
    // The square is one unit wide, so the frame's scale is a half.
    let scene = lit("type = \"point\"\nposition = [0.5, 0.5, 1]\nattenuation = [1, 2, 3]\n").unwrap();
    let place = PunctualPlace { position: DVec3::new(0.0, 0.0, 2.0), attenuation: [1.0, 1.0, 0.75] };
    let expected = PunctualLight { form: PunctualForm::even(place), intensity: Vec3::new(1.0, 2.0, 3.0), name: None };
    assert_eq!(scene.lights, [expected]);
    let spot = "type = \"spot\"\nposition = [0.5, 0.5, 1]\ndirection = [0, 0, -1e-200]\ncutoff = 60\n";
    let scene = lit(spot).unwrap();
    let PunctualForm::Point { place, beam: Beam::Spot { direction, exponent, cutoff } } = &scene.lights[0].form else {
        panic!("a spot");
    };
    assert_eq!((place.attenuation, *direction, *exponent), ([0.0, 0.0, 0.25], DVec3::NEG_Z, 0.0));
    assert!((cutoff - 0.5).abs() < 1e-15);
    let warn = "type = \"warn\"\nposition = [0, 0, 1]\ndirection = [0, 0, -2]\nexponent = 4\n";
    let form = lit(warn).unwrap().lights[0].form.clone();
    assert!(matches!(form, PunctualForm::Point { beam: Beam::Spot { exponent: 4.0, cutoff: 0.0, .. }, .. }));
    let form = lit("type = \"directional\"\ndirection = [3, 0, -4]\n").unwrap().lights[0].form.clone();
    let PunctualForm::Directional { direction } = form else { panic!("parallel light") };
    assert!(direction.distance(DVec3::new(0.6, 0.0, -0.8)) < 1e-15);
    // Two tables are two lights; a scene without emission is not dark where one of them shines.
    let two = "[[lights]]\ntype = \"directional\"\nintensity = [0, 0, 0]\ndirection = [0, 0, -1]\n".repeat(2);
    let text = format!("obj = \"s.obj\"\n{two}");
    let dark = Scene::from_toml_text("s", &text, SQUARE, "newmtl a\nKd .5\n", LoadOptions::default()).unwrap();
    assert_eq!(dark.lights.len(), 2);
    assert!(dark.require_emission().is_err());
    let text = text.replacen("[0, 0, 0]", "[0, 1, 0]", 1);
    let shining = Scene::from_toml_text("s", &text, SQUARE, "newmtl a\nKd .5\n", LoadOptions::default()).unwrap();
    assert!(shining.require_emission().is_ok());
}

#[test]
fn mistakes_in_lights_are_named_with_their_line() {
    const SPOT: &str = "type = \"spot\"\nposition = [0, 0, 1]\n";
    refuses(lit("type = \"laser\"\n"), &["s.toml, line 4", "`laser`"]);
    refuses(toml("[[lights]]\ntype = \"point\"\nposition = [0, 0, 1]\n"), &["line 2", "intensity"]);
    refuses(lit("type = \"point\"\n"), &["line 2", "`point`", "`position`"]);
    refuses(lit(SPOT), &["line 2", "`spot`", "`cutoff`"]);
    refuses(lit(&format!("{SPOT}cutoff = 30\n")), &["line 2", "`direction`"]);
    refuses(lit(&format!("{SPOT}cutoff = 91\ndirection = [0, 0, 1]\n")), &["line 6", "`cutoff`", "91", "90 degrees"]);
    refuses(lit(&format!("{SPOT}cutoff = 0\ndirection = [0, 0, 1]\n")), &["line 6", "`cutoff`"]);
    refuses(lit(&format!("{SPOT}cutoff = 30\ndirection = [0, 0, 0]\n")), &["line 7", "`direction`", "not zero"]);
    refuses(lit(&format!("{SPOT}cutoff = 30\ndirection = [0, nan, 0]\n")), &["line 7", "not finite"]);
    refuses(
        lit(&format!("{SPOT}cutoff = 30\nexponent = -1\ndirection = [0, 0, 1]\n")),
        &["line 7", "`exponent`", "-1"],
    );
    refuses(
        lit(&format!("{SPOT}attenuation = [0, 0, 0]\ncutoff = 30\ndirection = [0, 0, 1]\n")),
        &["line 6", "`attenuation`"],
    );
    refuses(lit(&format!("{SPOT}attenuation = [0, -1, 0]\ncutoff = 30\ndirection = [0, 0, 1]\n")), &["line 6", "-1"]);
    refuses(lit("type = \"warn\"\ndirection = [0, 0, 1]\nposition = [0, 0, 1]\n"), &["`warn`", "`exponent`"]);
    refuses(lit("type = \"warn\"\ncutoff = 5\n"), &["line 5", "`warn`", "no `cutoff`"]);
    refuses(lit("type = \"point\"\nexponent = 5\n"), &["line 5", "no `exponent`"]);
    refuses(lit("type = \"directional\"\nposition = [0, 0, 1]\n"), &["line 5", "no `position`"]);
    refuses(lit("type = \"point\"\nposition = [0, 0, 1]\nsize = 1\n"), &["line 6", "size"]);
    let negative = "[[lights]]\ntype = \"point\"\nposition = [0, 0, 1]\nintensity = [1, -1, 1]\n";
    refuses(toml(negative), &["line 5", "`intensity`", "-1"]);
}
