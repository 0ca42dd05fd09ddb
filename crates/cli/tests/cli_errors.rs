//! What a person gets for every mistake on the command line and in files: the exit code, a message that names the
//! place and the value, and no file.

use std::fs;
use std::process::{Command, Stdio};

use tempfile::TempDir;

use crate::run::{SHEET, SMALL, contents, files, halflight, place};

/// The OBJ and MTL of [`SHEET`] with one replacement in each.
fn sheet(obj: (&str, &str), mtl: (&str, &str)) -> TempDir {
    let [(obj_name, obj_text), (mtl_name, mtl_text), _] = SHEET;
    place(&[(obj_name, &obj_text.replace(obj.0, obj.1)), (mtl_name, &mtl_text.replace(mtl.0, mtl.1))])
}

/// Runs a command that must fail with this code, these words on stderr, and nothing else changed.
#[track_caller]
fn refuses(place: &TempDir, arguments: &str, code: i32, parts: &[&str]) {
    let before = contents(place);
    let ran = halflight(place, arguments);
    assert_eq!(ran.code, Some(code), "{arguments}: {}", ran.err);
    for part in parts {
        assert!(ran.err.contains(part), "`{part}` not in: {}", ran.err);
    }
    assert!(ran.out.is_empty(), "{arguments} prints {}", ran.out);
    assert!(!ran.err.contains("panicked"), "{}", ran.err);
    assert!(contents(place) == before, "{arguments} leaves files behind");
}

/// Refused by every command that reads a scene.
#[track_caller]
fn scene_refused(place: &TempDir, scene: &str, parts: &[&str]) {
    for command in ["render", "bounces"] {
        refuses(place, &format!("{command} {scene} {SMALL}"), 3, parts);
    }
}

#[test]
fn a_scene_that_is_not_there() {
    let empty = place(&[("scene.stl", "solid")]);
    let known = ["cornell-box", "two-rooms", "help:"];
    scene_refused(&empty, "room.obj", &[&known[..], &["room.obj"]].concat());
    scene_refused(&empty, "cornel-box", &[&known[..], &["`cornel-box`"]].concat());
    scene_refused(&empty, "scene.stl", &["scene.stl", "*.obj", "*.toml"]);
    scene_refused(&empty, ".", &["is a folder", "no .obj, .glb, .gltf or .toml file"]);
}

#[test]
fn mistakes_in_an_obj() {
    let with = |from: &str, to: &str| sheet((from, to), ("", ""));
    scene_refused(&with("v 1 1 0", "v 1 one 0"), "sheet.obj", &["sheet.obj, line 4", "`one`", "not a number"]);
    scene_refused(&with("v 1 1 0", "v nan 1 0"), "sheet.obj", &["sheet.obj, line 4", "`nan`", "not finite"]);
    scene_refused(&with("f 4 3 2 1", "f 4 3 2 9"), "sheet.obj", &["sheet.obj, line 7", "vertex 9", "4 vertices"]);
    let dark = ["nothing in `sheet` emits", "--light ceiling"];
    let undefined = ["sheet.obj, line 6", "glowing (the MTL files define glow)", "--reflectance"];
    scene_refused(&with("usemtl glow", "usemtl glowing"), "sheet.obj", &[&undefined[..], &dark].concat());
    let missing = ["sheet.obj, line 1", "lost.mtl (No such file"];
    scene_refused(&with("mtllib sheet.mtl", "mtllib lost.mtl"), "sheet.obj", &[&missing[..], &dark].concat());
    scene_refused(&with("f 4 3 2 1", ""), "sheet.obj", &["sheet.obj has no faces"]);
    scene_refused(&place(&[("e.obj", "")]), "e.obj", &["e.obj has no faces"]);
    let binary = place(&[]);
    fs::write(binary.path().join("b.obj"), b"v 0 0 0\nv \xff\0 0 0\n").unwrap();
    scene_refused(&binary, "b.obj", &["b.obj, line 2", "0xff", "UTF-8"]);
    fs::write(binary.path().join("b.obj"), b"v 0 0 0\nv \xff 0 0\n").unwrap();
    scene_refused(&binary, "b.obj", &["b.obj, line 2", "`ÿ`", "not a number"]);
}

#[test]
fn mistakes_in_an_mtl() {
    let with = |from: &str, to: &str| sheet(("", ""), (from, to));
    scene_refused(&with("Ke 1 1 1", ""), "sheet.obj", &["nothing in `sheet` emits", "Ke R G B"]);
    scene_refused(&with("Kd .5 .5 .5", "Kd .5 1.5 .5"), "sheet.obj", &["sheet.mtl, line 2", "`glow`", "1.5"]);
    scene_refused(&with("Ke 1 1 1", "Ke -1 1 1"), "sheet.obj", &["sheet.mtl, line 3", "`glow`", "-1"]);
}

#[test]
fn mistakes_in_a_scene_file() {
    let with = |toml: &str| {
        let [obj, mtl, _] = SHEET;
        place(&[obj, mtl, ("sheet.toml", toml)])
    };
    let obj = "obj = \"sheet.obj\"\n";
    scene_refused(&with("obj = sheet.obj\n"), "sheet.toml", &["sheet.toml, line 1"]);
    scene_refused(&with(&format!("{obj}[camera]\nposition = [0, 0]\n")), "sheet.toml", &["sheet.toml, line 3"]);
    scene_refused(&with(&format!("{obj}colour = 1\n")), "sheet.toml", &["sheet.toml, line 2", "colour"]);
    scene_refused(&with("obj = \"lost.obj\"\n"), "sheet.toml", &["sheet.toml, line 1", "`lost.obj`"]);
    scene_refused(&with(&format!("{obj}alpha = 2\n")), "sheet.toml", &["sheet.toml, line 2", "alpha = 2"]);
}

#[test]
fn wrong_arguments() {
    let place = place(&[]);
    for (arguments, parts) in [
        ("render --size 0x5", ["'0x5'", "--size", "640x480"]),
        ("render --size 640x", ["'640x'", "--size", "WIDTHxHEIGHT"]),
        ("render --alpha 2", ["'2'", "--alpha", "from 0 to 1"]),
        ("render --reflectance 1", ["'1'", "--reflectance", "below 1"]),
        ("render --light sun", ["'sun'", "--light", "ceiling"]),
        ("render --tau nan", ["'nan'", "--tau", "from 0 to 1"]),
        ("render --mode local --alpha 1", ["--mode", "--alpha", "cannot be used"]),
        ("render --mode lokal", ["'lokal'", "--mode", "local"]),
        ("render --threads 0", ["'0'", "--threads", "1..=1024"]),
        ("render --patches 0", ["'0'", "--patches", "1..="]),
        ("render --rays many", ["'many'", "--rays", "invalid"]),
        ("render --samples 0", ["'0'", "--samples", "1..="]),
        ("render --exposure nan", ["'nan'", "--exposure", "number"]),
        ("render --seed -1", ["'-1'", "--seed", "0..="]),
        ("render --memory -1", ["'-1'", "--memory", "above 0"]),
        ("map --patches -5", ["'-5'", "--patches", "1..="]),
        ("bounces --count 0", ["'0'", "--count", "1..="]),
        ("bounces -o x.png", ["'-o'", "unexpected", "--help"]),
        ("rendr", ["'rendr'", "similar", "'render'"]),
    ] {
        refuses(&place, arguments, 2, &parts);
    }
}

/// The scene is missing as well: that the extension is named shows that it is looked at first.
#[test]
fn a_format_that_is_not_known_is_refused_before_any_work() {
    let place = place(&[]);
    let parts = ["x.bmp", "\".bmp\"", ".png or .exr"];
    refuses(&place, "render lost.obj -o x.bmp", 2, &parts);
    let parts = ["without extension", ".png or .exr"];
    refuses(&place, "render lost.obj -o picture", 2, &parts);
    refuses(&place, "render lost.obj -o x.hdr", 2, &["\".hdr\""]);
}

/// The series diverges, exit code 4: that another code comes shows that places are checked before it is solved.
#[test]
fn places_that_cannot_be_written_are_refused_before_the_work() {
    let place = place(&[("way", "a file in the way")]);
    fs::create_dir(place.path().join("folder.png")).unwrap();
    let job = format!("furnished-room --mode shadowless {SMALL}");
    for (place_asked, part) in [
        ("-o way/deeper/x.png", "way/deeper: "),
        ("-o way/x.png", "way/x.png: not a directory"),
        ("-o folder.png", "folder.png: is a directory"),
        ("--out way", "way: not a directory"),
        ("--out way/deeper", "way/deeper: "),
    ] {
        refuses(&place, &format!("render {job} {place_asked}"), 1, &["cannot write", part, "help:"]);
    }
    for out in ["way", "way/deeper"] {
        let arguments = format!("bounces {job} --out {out}");
        refuses(&place, &arguments, 1, &["cannot write", out]);
    }
    // Among several pictures the one that has no place is found too.
    fs::create_dir(place.path().join("p-local.exr")).unwrap();
    let arguments = format!("render {SMALL} --mode all -o p.exr");
    refuses(&place, &arguments, 1, &["p-local.exr: is a directory"]);
}

#[cfg(unix)]
#[test]
fn a_directory_that_may_not_be_written() {
    use std::os::unix::fs::PermissionsExt;
    let place = place(&[]);
    let folder = place.path().join("locked");
    fs::create_dir(&folder).unwrap();
    fs::set_permissions(&folder, fs::Permissions::from_mode(0o555)).unwrap();
    // The superuser may write anywhere: then there is nothing to see.
    if fs::write(folder.join("probe"), "").is_ok() {
        return;
    }
    for arguments in ["-o locked/x.png", "--out locked", "--out locked/new"] {
        let arguments = format!("render {SMALL} {arguments}");
        refuses(&place, &arguments, 1, &["cannot write locked", "ermission denied"]);
    }
}

#[cfg(unix)]
#[test]
fn a_protected_picture_is_not_replaced() {
    let place = place(&[("kept.png", "old")]);
    let path = place.path().join("kept.png");
    let mut permissions = fs::metadata(&path).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&path, permissions).unwrap();
    let arguments = format!("render {SMALL} --mode local -o kept.png");
    refuses(&place, &arguments, 1, &["kept.png", "permission denied"]);
}

#[test]
fn pictures_that_cannot_be_compared() {
    let place = place(&[("broken.png", "not a picture")]);
    let small = SMALL.replace("48x48", "8x8");
    for (size, name) in [("8x8", "a.png"), ("9x8", "b.png")] {
        let small = small.replace("8x8", size);
        let drawn = halflight(&place, &format!("render {small} --mode local -o {name}"));
        assert_eq!(drawn.code, Some(0), "{}", drawn.err);
    }
    refuses(&place, "diff lost.png a.png", 3, &["lost.png"]);
    refuses(&place, "diff a.png broken.png", 3, &["broken.png", "PNG"]);
    refuses(&place, "diff a.png b.png", 3, &["8", "9"]);
    refuses(&place, "diff a.png a.png -o x.bmp", 2, &["\".bmp\""]);
}

/// A reader that leaves early (`| head`) is no mistake; a full disk is.
#[test]
fn standard_output_that_ends_or_fails() {
    let place = place(&[]);
    let run = |stdout: Stdio| {
        let mut program = Command::new(env!("CARGO_BIN_EXE_halflight"));
        let program = program.args(["scenes", "--json"]).current_dir(place.path());
        program.stdout(stdout).stderr(Stdio::piped()).spawn().unwrap()
    };
    let mut child = run(Stdio::piped());
    drop(child.stdout.take());
    let ended = child.wait_with_output().unwrap();
    let message = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(0), "{message}");
    if let Ok(full) = fs::File::options().write(true).open("/dev/full") {
        let ended = run(full.into()).wait_with_output().unwrap();
        let message = String::from_utf8_lossy(&ended.stderr);
        assert_eq!(ended.status.code(), Some(1), "{message}");
        assert!(message.contains("cannot write standard output"));
    }
    assert!(files(&place).is_empty());
}
