//! What exporters write that is not quite a scene: read as other readers read it, with one warning of each kind.

use std::fs;

use halflight::Scene;
use halflight::scene::{AddedLight, LoadOptions, SceneError, Warning};
use tempfile::TempDir;

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

fn place(files: &[(&str, &[u8])]) -> TempDir {
    let place = TempDir::new().unwrap();
    for (name, bytes) in files {
        let path = place.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
    place
}

fn load(place: &TempDir, options: LoadOptions) -> Result<Scene, SceneError> {
    Scene::load(&place.path().join("s.obj"), options)
}

/// Name and reflectance of all materials, and the warnings.
fn read(obj: &str, files: &[(&str, &[u8])]) -> (Vec<(String, f32)>, Vec<Warning>) {
    let place = place(&[&[("s.obj", obj.as_bytes())], files].concat());
    let scene = load(&place, LoadOptions { reflectance: Some(0.25), ..LoadOptions::default() }).unwrap();
    (scene.materials.into_iter().map(|m| (m.name, m.rho.x)).collect(), scene.warnings)
}

#[track_caller]
fn one_of_each(warnings: &[Warning], parts: &[&str]) {
    assert_eq!(warnings.len(), parts.len(), "{warnings:#?}");
    for part in parts {
        assert_eq!(warnings.iter().filter(|w| w.contains(part)).count(), 1, "{part}: {warnings:#?}");
    }
}

fn named(list: &[(&str, f32)]) -> Vec<(String, f32)> {
    list.iter().map(|(name, rho)| ((*name).to_owned(), *rho)).collect()
}

#[test]
fn missing_libraries_and_materials_are_grey() {
    let obj = format!(
        "mtllib lost.mtl\nmtllib m.mtl gone.mtl\n{SQUARE}usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\nusemtl c\nf 4 2 1\n"
    );
    let (materials, warnings) = read(&obj, &[("m.mtl", b"newmtl a\nKd .75\n")]);
    assert_eq!(materials, named(&[("a", 0.75), ("b", 0.25), ("c", 0.25)]));
    one_of_each(&warnings, &["2 missing MTL files (first: ", "2 undefined materials (first: "]);
    assert!(warnings[0].contains("s.obj, line 1): lost.mtl, gone.mtl (No such file"), "{}", warnings[0]);
    assert!(warnings[1].contains("s.obj, line 9): b, c (the MTL files define a): reflecting 0.25 (--reflectance)"));
}

/// Blender wrote such lines, and other readers take them.
#[test]
fn a_material_may_have_no_name() {
    let square = format!("{SQUARE}mtllib m.mtl\nusemtl \nf 1 2 3 4\n");
    let (materials, warnings) = read(&square, &[("m.mtl", b"newmtl \nKd .75\n")]);
    assert_eq!((materials, warnings), (named(&[("(none)", 0.75)]), Vec::new()));
    let obj = format!("{SQUARE}mtllib m.mtl\nusemtl a\nf 1 2 3\nusemtl \nf 1 3 4\n");
    let (materials, warnings) = read(&obj, &[("m.mtl", b"newmtl a\nKd .75\n")]);
    assert_eq!(materials, named(&[("a", 0.75), ("(none)", 0.25)]));
    one_of_each(&warnings, &["1 undefined material (first: "]);
}

#[test]
fn faces_without_a_material_are_grey() {
    let (materials, warnings) = read(&format!("{SQUARE}f 1 2 3\nf 1 3 4\n"), &[]);
    assert_eq!(materials, named(&[("(none)", 0.25)]));
    one_of_each(&warnings, &["2 faces (first: "]);
    assert!(warnings[0].contains("s.obj, line 5): no usemtl") && warnings[0].contains("0.25 (--reflectance)"));
    let (materials, warnings) = read(&format!("{SQUARE}usemtl a\nf 1 2 3\n"), &[]);
    assert_eq!(materials, named(&[("a", 0.25)]));
    one_of_each(&warnings, &["1 undefined material (first: "]);
    assert!(warnings[0].contains("line 5): a (the OBJ has no mtllib line)"));
}

#[test]
fn a_scene_file_may_say_what_a_missing_material_is() {
    let toml = "obj = \"s.obj\"\n[materials.a]\nemission = [1, 2, 3]\n";
    let obj = format!("{SQUARE}usemtl a\nf 1 2 3\n");
    let scene = Scene::from_toml_text("s", toml, &obj, "", LoadOptions::default()).unwrap();
    assert_eq!((scene.materials[0].emission.y, scene.materials[0].rho.y), (2.0, 0.5));
    scene.require_emission().unwrap();
}

#[test]
fn a_reflectance_that_is_none_is_refused() {
    for reflectance in [-0.1, 1.1, f32::NAN] {
        let place = place(&[("s.obj", format!("{SQUARE}f 1 2 3\n").as_bytes())]);
        let read = load(&place, LoadOptions { reflectance: Some(reflectance), ..LoadOptions::default() });
        assert!(matches!(read, Err(SceneError::Rho { .. })));
    }
}

#[test]
fn latin_1_is_read_and_warned_of_once() {
    let obj =
        [b"# \xa9 caf\xe9\nmtllib s.mtl\n", SQUARE.as_bytes(), b"o t\xfcr\nusemtl gr\xfcn\nf 1 2 3 # \xe9\n"].concat();
    let files = [("s.obj", &obj[..]), ("s.mtl", b"newmtl gr\xfcn\nKd .5\n")];
    let scene = load(&place(&files), LoadOptions::default()).unwrap();
    assert_eq!((scene.materials[0].name.as_str(), scene.objects[0].as_str()), ("grün", "tür"));
    one_of_each(&scene.warnings, &["3 lines (first: "]);
    assert!(scene.warnings[0].contains("s.obj, line 7): not UTF-8"), "{}", scene.warnings[0]);
    let comments = [("s.obj", &b"# \xe9\nv 0 0 0 # \xff\nv 1 0 0\nv 0 1 0\nmtllib s.mtl\nusemtl a\nf 1 2 3\n"[..])];
    let comments = [comments[0], ("s.mtl", b"# \xe9\nnewmtl a\nKd .5\n")];
    assert!(load(&place(&comments), LoadOptions::default()).unwrap().warnings.is_empty());
    // A library in UTF-8 defines what an OBJ in Latin-1 uses.
    let mixed = [("s.obj", &obj[..]), ("s.mtl", "newmtl grün\nKd .75\n".as_bytes())];
    assert_eq!(load(&place(&mixed), LoadOptions::default()).unwrap().materials[0].rho.x, 0.75);
}

#[test]
fn all_libraries_are_read_and_the_first_definition_stands() {
    let obj = format!("mtllib a.mtl b.mtl\nmtllib c d.mtl a.mtl\n{SQUARE}usemtl z\nf 1 2 3\n");
    let files: [(&str, &[u8]); 3] = [
        ("a.mtl", b"newmtl x\nKd .1\nnewmtl x\nKd .2\n"),
        ("b.mtl", b"newmtl y\nKd .3\nnewmtl x\nKd .4\n"),
        ("c d.mtl", b"newmtl z\nKd .5\n"),
    ];
    let (materials, warnings) = read(&obj, &files);
    assert_eq!(materials, named(&[("x", 0.1), ("y", 0.3), ("z", 0.5)]));
    let twice = ["1 repeated definition of material `x` (first: a.mtl, line 3)", "`x` (first: b.mtl, line 3)"];
    one_of_each(&warnings, &twice);
}

#[test]
fn one_number_is_a_grey() {
    let obj = format!("mtllib m.mtl\n{SQUARE}usemtl a\nf 1 2 3\n");
    let place = place(&[("s.obj", obj.as_bytes()), ("m.mtl", b"newmtl a\nKd 0.5\nKe 10\n")]);
    let scene = load(&place, LoadOptions::default()).unwrap();
    assert_eq!((scene.materials[0].rho.to_array(), scene.materials[0].emission.z), ([0.5; 3], 10.0));
    assert!(scene.warnings.is_empty());
}

#[test]
fn paths_of_other_machines_are_found() {
    let material: &[u8] = b"newmtl a\nKd .5\n";
    for (written, file) in [
        ("sub\\my room.mtl", "sub/my room.mtl"),
        (".\\m.mtl", "m.mtl"),
        ("C:\\Users\\somebody\\my room.mtl", "my room.mtl"),
        ("/home/somebody/m.mtl", "m.mtl"),
        ("my own room.mtl", "my own room.mtl"),
    ] {
        let (materials, warnings) =
            read(&format!("mtllib {written}\n{SQUARE}usemtl a\nf 1 2 3\n"), &[(file, material)]);
        assert_eq!((materials, warnings.len()), (named(&[("a", 0.5)]), 0), "{written}");
    }
}

#[test]
fn textures_that_are_missing_or_not_modelled_are_warned_of() {
    let obj = format!("mtllib m.mtl\n{SQUARE}usemtl a\nf 1 2 3\n");
    let mtl = b"newmtl a\nKd .5\nmap_Kd textures\\lost wood.jpg\nmap_Bump -bm 1 there.png\n";
    let (_, warnings) = read(&obj, &[("m.mtl", mtl), ("there.png", b"")]);
    one_of_each(
        &warnings,
        &[
            "1 missing map_Kd of material `a` (first: m.mtl, line 3)",
            "1 texture of material `a` (first: m.mtl, line 4)",
        ],
    );
}

fn lit(obj: &str) -> Scene {
    let place = place(&[("s.obj", obj.as_bytes())]);
    let scene = load(&place, LoadOptions { light: Some(AddedLight::Ceiling), ..LoadOptions::default() }).unwrap();
    scene.require_emission().unwrap();
    scene
}

/// Width, height, depth and corner-to-corner position of the added light in the file's units.
#[track_caller]
fn light(scene: &Scene) -> [[f64; 2]; 3] {
    let own: Vec<u32> = (0..scene.faces.len() as u32).filter(|&f| scene.material(f).emits()).collect();
    assert_eq!(own.len(), 2);
    let corners: Vec<_> = own.iter().flat_map(|&f| scene.exact_corners(f)).map(|p| scene.frame.to_file(p)).collect();
    for &face in &own {
        let [a, b, c] = scene.corners(face);
        assert!((b - a).cross(c - a).y < 0.0, "the front looks down");
    }
    [0, 1, 2].map(|axis| {
        let values = corners.iter().map(|p| (1e6 * p[axis]).round() / 1e6);
        [values.clone().fold(f64::INFINITY, f64::min), values.fold(f64::NEG_INFINITY, f64::max)]
    })
}

/// A box of 4 by 3 by 2 whose fronts look inside, of the sides chosen: floor, ceiling, back, front, left, right.
fn room(sides: &[usize]) -> String {
    let faces = ["1 4 3 2", "5 6 7 8", "1 2 6 5", "4 8 7 3", "1 5 8 4", "2 3 7 6"];
    let corners = "v 0 0 0\nv 4 0 0\nv 4 0 2\nv 0 0 2\nv 0 3 0\nv 4 3 0\nv 4 3 2\nv 0 3 2\n";
    let sides = sides.iter().map(|&side| format!("f {}\n", faces[side]));
    format!("{corners}{}", sides.collect::<String>())
}

#[test]
fn the_light_hangs_below_a_ceiling() {
    let below = [[1.0, 3.0], [2.97, 2.97], [0.5, 1.5]];
    for sides in [&[0, 1, 2, 3, 4, 5][..], &[0, 1, 2, 4, 5], &[0, 2, 3, 4, 5], &[0, 2, 4, 5]] {
        assert_eq!(light(&lit(&room(sides))), below, "{sides:?}");
    }
    // A lamp that hangs from the ceiling is no ceiling; a second roof above it is none either.
    let lamp = "v 2 2.5 1\nv 2.1 2.5 1\nv 2 2.5 1.1\nf 9 10 11\n";
    assert_eq!(light(&lit(&format!("{}{lamp}", room(&[0, 1, 2, 3, 4, 5])))), below);
    let roof = "v 0 3.2 0\nv 0 3.2 2\nv 4 3.2 2\nv 4 3.2 0\nf 9 10 11 12\n";
    let [x, y, _] = light(&lit(&format!("{}{roof}", room(&[0, 1, 2, 3, 4, 5]))));
    assert_eq!((x, y), ([1.0, 3.0], [2.968, 2.968]));
}

#[test]
fn the_light_lies_above_what_is_seen_from_outside() {
    let above = |obj: &str| light(&lit(obj))[1][0];
    // A floor alone, a body without a floor, and a table on one: a quarter of the larger side above the top.
    assert_eq!(above("v 0 0 0\nv 0 0 2\nv 4 0 2\nv 4 0 0\nf 1 2 3 4\n"), 1.0);
    let outward = room(&[0, 1, 2, 3, 4, 5]).replace("f 1 4 3 2", "f 1 2 3 4").replace("f 5 6 7 8", "f 8 7 6 5");
    assert_eq!(above(&outward), 4.0);
    let table =
        "v 0 3 0\nv 0 3 2\nv 4 3 2\nv 4 3 0\nv 0 0 0\nv 0 0 2\nv 4 0 2\nv 4 0 0\nf 1 2 3 4\nf 4 3 2 1\nf 5 6 7 8\n";
    assert_eq!(above(table), 4.0);
    // A wall alone.
    let [_, y, z] = light(&lit("v 0 0 0\nv 4 0 0\nv 4 3 0\nv 0 3 0\nf 1 2 3 4\n"));
    assert_eq!((y, z), ([4.0, 4.0], [-0.5, 0.5]));
}

#[test]
fn the_light_gives_the_floor_an_irradiance_of_pi() {
    let scene = lit("v 0 0 0\nv 0 0 2\nv 2 0 2\nv 2 0 0\nv 0 2 0\nv 0 2 2\nv 0 1 0\nf 1 2 3 4\nf 5 6 7\n");
    let [x, y, z] = light(&scene);
    let (n, distance) = (40, y[0]);
    let at = |i: usize, [low, high]: [f64; 2]| low + (high - low) * (i as f64 + 0.5) / n as f64;
    let mut sum = 0.0;
    for i in 0..n * n {
        for j in 0..n * n {
            let across = at(i / n, [0.0, 2.0]) - at(j / n, x);
            let along = at(i % n, [0.0, 2.0]) - at(j % n, z);
            sum += (distance / (distance * distance + across * across + along * along)).powi(2);
        }
    }
    let area = (x[1] - x[0]) * (z[1] - z[0]);
    let mean = f64::from(scene.materials.last().unwrap().emission.x) * sum * area / (n * n * n * n) as f64;
    assert!((mean / std::f64::consts::PI - 1.0).abs() < 2e-3, "{mean}");
}

#[test]
fn a_bright_room_gets_less_light() {
    let radiance = |reflectance: f32| {
        let place = place(&[("s.obj", room(&[0, 1, 2, 3, 4, 5]).as_bytes())]);
        let options =
            LoadOptions { light: Some(AddedLight::Ceiling), reflectance: Some(reflectance), ..LoadOptions::default() };
        load(&place, options).unwrap().materials.last().unwrap().emission.x
    };
    // 1/L = F + rho/(1 - rho) 2/52: the light has 2 of the room's 52 square units.
    let (black, grey, white) = (radiance(0.0), radiance(0.5), radiance(0.8));
    assert!((1.0 / grey - 1.0 / black - 1.0 / 26.0).abs() < 1e-5);
    assert!((1.0 / white - 1.0 / black - 4.0 / 26.0).abs() < 1e-5);
}

#[test]
fn the_light_changes_neither_camera_nor_the_rest() {
    let text = room(&[0, 1, 2, 3, 4, 5]);
    let plain = Scene::from_obj_text("s", &text, "").unwrap();
    let scene = lit(&text);
    assert_eq!(scene.camera, plain.camera);
    assert_eq!(scene.faces[..plain.faces.len()], plain.faces[..]);
    let flat = place(&[("s.obj", b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")]);
    let read = load(&flat, LoadOptions { light: Some(AddedLight::Ceiling), ..LoadOptions::default() });
    assert!(matches!(read, Err(SceneError::Empty { .. })));
}

/// Such files once read as one line: an OBJ was refused as one without faces, an MTL was empty.
#[test]
fn every_end_of_a_line_gives_the_same_scene() {
    let obj = format!("# old\nmtllib m.mtl\n{SQUARE}o thing \nusemtl a b\nf 1 2 \\\n3 # part\n\nf 1 3 4\np 1\n");
    let mtl = "# of paint\nnewmtl a b\nKd .25\nKs 1 1 1\n\nnewmtl c\nKd .5\n";
    let read = |end: &str, other: &str| {
        let files = [("s.obj", obj.replace('\n', end)), ("m.mtl", mtl.replace('\n', other))];
        let files = files.each_ref().map(|(name, text)| (*name, text.as_bytes()));
        let scene = load(&place(&files), LoadOptions::default()).unwrap();
        (scene.vertices, scene.faces, scene.materials, scene.objects, scene.warnings)
    };
    let plain = read("\n", "\n");
    one_of_each(&plain.4, &["1 specular colour of material `a b` (first: m.mtl, line 4)", "line 13"]);
    for (end, other) in [("\r", "\n"), ("\r\n", "\r"), ("\r", "\r"), ("\r\n", "\r\n")] {
        let same = read(end, other);
        // Messages name a folder of their own.
        assert_eq!((&same.0, &same.1, &same.2, &same.3), (&plain.0, &plain.1, &plain.2, &plain.3), "{end:?} {other:?}");
        one_of_each(&same.4, &["1 specular colour of material `a b` (first: m.mtl, line 4)", "line 13"]);
    }
    // A line that is not UTF-8 is one line here too.
    let latin = place(&[("s.obj", b"v 0 0 0\rv 1 0 0\rv 0 1 0\ro t\xfcr\rf 1 2 3\r")]);
    let scene = load(&latin, LoadOptions::default()).unwrap();
    assert_eq!(scene.objects, ["tür"]);
    assert!(scene.warnings[0].contains("s.obj, line 4): not UTF-8"), "{:?}", scene.warnings);
}

#[test]
fn a_file_of_one_line_is_said_to_be_one() {
    let one = SQUARE.trim().replace('\n', "\u{2028}") + " f 1 2 3";
    for text in [one, "# exported v 0 0 0 v 1 0 0 v 0 1 0 f 1 2 3".to_owned()] {
        let error = load(&place(&[("s.obj", text.as_bytes())]), LoadOptions::default()).unwrap_err();
        assert!(
            matches!(error, SceneError::OneLine { .. }) && error.to_string().contains("s.obj is a text of one line")
        );
    }
    let obj = format!("mtllib m.mtl\n{SQUARE}usemtl a\nf 1 2 3\n");
    let files = [("s.obj", obj.as_bytes()), ("m.mtl", b"newmtl a Kd .5 .5 .5".as_slice())];
    assert!(matches!(load(&place(&files), LoadOptions::default()), Err(SceneError::OneLine { .. })));
}

#[test]
fn groups_of_two_objects_are_told_apart() {
    let obj = format!(
        "{SQUARE}o floor\ng default\nf 1 2 3\no ceiling\ng default\nf 1 3 4\ng lamp\nf 4 2 1\no floor\nf 4 3 2\n"
    );
    let scene = load(&place(&[("s.obj", obj.as_bytes())]), LoadOptions::default()).unwrap();
    assert_eq!(scene.objects, ["floor/default", "ceiling/default", "lamp", "floor"]);
    assert_eq!(scene.faces.iter().map(|face| face.object).collect::<Vec<_>>(), [0, 1, 2, 3]);
}

/// The rows of the reader's table: what no picture needs is silent.
#[test]
fn statements_that_change_nothing_are_read_over() {
    let silent = "vp 0 0\ndeg 2\nstep 1\ncstype bezier\nparm u 0 1\nend\nbevel on\nc_interp on\nd_interp on\nlod 3\n\
                  shadow_obj a.obj\ntrace_obj b.obj\nmg 1\nres 1\nstech a\n# a comment\nv 0 0 0 1\n";
    let mtl =
        b"newmtl a\nKd .5\nKa 1 1 1\nmap_Ka a.png\nsharpness 60\nTf 1 1 1\nPm 0\nPr 1\nillum 2\nNi 1.5\nKs 0 0 0\n";
    let obj = format!("mtllib m.mtl\n{silent}{SQUARE}usemtl a\nf -4 -3 -2\n");
    let (_, warnings) = read(&obj, &[("m.mtl", mtl)]);
    assert!(warnings.is_empty(), "{warnings:?}");
}

#[test]
fn statements_that_are_not_modelled_are_named_once() {
    let obj = format!(
        "{SQUARE}vn 0 0 1\nvn 0 1 1\nmg 1\nlod 2\ncall other.obj\ncsh ls\nusemap wood\ncall more.obj\n\
         f 1//1 2//1 3//1\nf 1//1 3//2 4//1\nf 2//1 3//2 4//1\ns 1\nf 1 2 4\ns off\nf 2 3 4\nf 1 1\n"
    );
    let scene = load(&place(&[("s.obj", obj.as_bytes())]), LoadOptions::default()).unwrap();
    one_of_each(
        &scene.warnings,
        &[
            "3 smooth faces (first: ",
            "4 statements call, csh, usemap (first: ",
            "no usemtl",
            "fewer than three corners",
            "3 triangles of object `default` lie where",
        ],
    );
    let mtl = b"newmtl a\nKd .5\nKa 1 1 1\nNs 10\nillum 3\nTf 1 1 1\nPm .5\nPr .5\nnorm n.png\nmap_Pr r.png\nmap_Ka a.png\nFoo 1\n";
    let obj = format!("mtllib m.mtl\n{SQUARE}usemtl a\nf 1 2 3\n");
    let (_, warnings) = read(&obj, &[("m.mtl", mtl)]);
    one_of_each(
        &warnings,
        &[
            "2 textures of material `a` (first: m.mtl, line 9): norm, map_Pr: of textures",
            "4 statements of material `a` (first: m.mtl, line 5): illum 3, Pm, Pr, Foo: not modelled, and left out",
        ],
    );
}
