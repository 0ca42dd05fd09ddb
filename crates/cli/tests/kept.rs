//! `--save` and `--load`: what a folder holds, that F from it gives the bytes that rays give, what it is refused for,
//! and that damage shows.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::thread::sleep;
use std::time::Duration;

use halflight::solve::explore;
use halflight::{Fineness, Light, Solver};
use halflight_export::kept::{KeptFolder, KeptRows};
use serde_json::Value;
use tempfile::TempDir;

use crate::run::{SMALL, contents, fields, files, halflight, place, program, report, report_of_mode, succeed};

/// A box without a front, a lamp below its ceiling and a screen in it.
const ROOM: &str = "mtllib room.mtl
v 0 0 0\nv 2 0 0\nv 2 0 2\nv 0 0 2\nv 0 2 0\nv 2 2 0\nv 2 2 2\nv 0 2 2
v .7 1.9 .7\nv 1.3 1.9 .7\nv 1.3 1.9 1.3\nv .7 1.9 1.3
v .4 .1 .8\nv .9 .1 .8\nv .9 1 .8\nv .4 1 .8
o floor\nusemtl floor\nf 1 4 3 2\no ceiling\nusemtl wall\nf 5 6 7 8\no back\nf 1 2 6 5\no left\nf 1 5 8 4\no right\nf 2 3 7 6
o lamp\nusemtl lamp\nf 9 10 11 12\no screen\nusemtl screen\nf 13 14 15 16\n";
const MATERIALS: &str = "newmtl floor\nKd .5 .4 .3\nnewmtl wall\nKd .7 .7 .7\nnewmtl lamp\nKd 0 0 0\nKe 9 9 8\nnewmtl screen\nKd .2 .5 .2\n";
const VIEW: &str = "obj = \"room.obj\"\n[camera]\nposition = [1, 1, 4]\ntarget = [1, 1, 0]\nup = [0, 1, 0]\n[materials.screen]\ntwo_sided = true\n";

fn room() -> TempDir {
    place(&[("room.obj", ROOM), ("room.mtl", MATERIALS), ("room.toml", VIEW)])
}

/// Runs a command that must fail with this code and these words, and change nothing.
#[track_caller]
fn refuses(place: &TempDir, arguments: &str, code: i32, parts: &[&str]) {
    let before = contents(place);
    let ran = halflight(place, arguments);
    assert_eq!(ran.code, Some(code), "{arguments}: {}", ran.err);
    for part in parts.iter().chain(&["help:"]) {
        assert!(ran.err.contains(part), "`{part}` not in: {}", ran.err);
    }
    assert!(!ran.err.contains("panicked"), "{}", ran.err);
    let after: Vec<_> = contents(place).into_iter().filter(|(name, _)| !name.starts_with("out")).collect();
    let before: Vec<_> = before.into_iter().filter(|(name, _)| !name.starts_with("out")).collect();
    assert!(after == before, "{arguments} leaves files behind");
}

/// Bytes of a file.
fn bytes(place: &TempDir, name: &str) -> Vec<u8> {
    fs::read(place.path().join(name)).unwrap()
}

/// Renders with and without a folder that is read, which must make no difference; returns the report with it.
#[track_caller]
fn same_with(place: &TempDir, folder: &str, arguments: &str) -> Value {
    succeed(place, &format!("{arguments} -o without.exr"));
    let with = report_of_mode(place, &format!("{arguments} --load {folder} -o with.exr"));
    assert!(bytes(place, "with.exr") == bytes(place, "without.exr"), "{arguments}");
    with
}

#[test]
fn a_folder_holds_what_was_solved() {
    let place = room();
    let plain = report_of_mode(&place, &format!("render room.toml --mode global {SMALL} -o plain.exr"));
    let saved = report_of_mode(&place, &format!("render room.toml --mode global {SMALL} -o saved.exr --save kept"));
    assert!(bytes(&place, "plain.exr") == bytes(&place, "saved.exr"));
    // The lamp's row as well, which reflects nothing now.
    assert!(saved["rays"].as_u64() > plain["rays"].as_u64());
    let kept: Vec<String> = files(&place).into_iter().filter(|name| name.starts_with("kept/")).collect();
    assert_eq!(
        kept,
        ["F.npz", "L.npy", "meta.json", "patches.vtu", "scene.bin", "terms.npy"].map(|name| format!("kept/{name}"))
    );
    let meta: Value = serde_json::from_slice(&bytes(&place, "kept/meta.json")).unwrap();
    assert_eq!(meta["patches"]["count"], plain["patches"]);
    assert_eq!((meta["mode"].as_str(), meta["patches"]["requested"].as_u64()), (Some("global"), Some(300)));
    assert_eq!((&meta["casts"][0]["rays"], &meta["casts"][0]["seed"]), (&Value::from(64), &Value::from(0)));
    // No time, no name of a machine: the same folder from any number of threads.
    succeed(&place, &format!("render room.toml --mode global {SMALL} --save again --threads 1"));
    for name in kept {
        assert!(bytes(&place, &name) == bytes(&place, &name.replace("kept", "again")), "{name}");
    }
}

#[test]
fn other_modes_cameras_and_materials_take_no_ray_for_f() {
    let place = room();
    succeed(&place, &format!("render room.toml --mode one-bounce {SMALL} --save kept"));
    let rays = |report: &Value| report["rays"].as_u64().unwrap();
    for mode in ["--mode global", "--mode one-bounce", "--alpha 0.4 --tau 0"] {
        let with = same_with(&place, "kept", &format!("render room.toml {mode} {SMALL}"));
        let without = report_of_mode(&place, &format!("render room.toml {mode} {SMALL}"));
        let of_f = if mode.contains("one-bounce") { 0 } else { 1000 };
        assert!(rays(&with) + of_f <= rays(&without), "{mode}: {with}");
    }
    fs::write(place.path().join("room.toml"), VIEW.replace("[1, 1, 4]", "[0.5, 1.5, 3]")).unwrap();
    same_with(&place, "kept", &format!("render room.toml --mode global {SMALL}"));
    let ran = succeed(&place, &format!("render room.toml --mode global {SMALL} --load kept"));
    assert!(ran.out.starts_with("F from kept\n"), "{}", ran.out);
    // The lamp reflects and another emits: rows that were not needed before.
    let changed = MATERIALS.replace("Kd 0 0 0", "Kd .3 .3 .3").replace("Kd .2 .5 .2", "Kd .2 .5 .2\nKe 1 0 0");
    fs::write(place.path().join("room.mtl"), changed).unwrap();
    let same = same_with(&place, "kept", &format!("render room.toml --mode global {SMALL}"));
    // Without effort it is that of the folder.
    let given = report_of_mode(&place, "render room.toml --mode global --size 48x48 --samples 16 --load kept");
    assert!(given["error"].is_null() && given["patches"] == same["patches"], "{given}");
}

/// A search for a tolerance ends with two F, which are kept for other programs; none is taken from a folder.
#[test]
fn light_to_a_tolerance_is_kept_and_not_gone_on_from() {
    let place = place(&[]);
    let render = "render furnished-room --mode global --size 32x32";
    let plain = report_of_mode(&place, &format!("{render} --tolerance 0.2 -o plain.exr"));
    let saved = report_of_mode(&place, &format!("{render} --tolerance 0.2 --save kept -o saved.exr"));
    assert!(bytes(&place, "plain.exr") == bytes(&place, "saved.exr") && plain["error"] == saved["error"]);
    let kept: Vec<String> = files(&place).into_iter().filter(|name| name.starts_with("kept/")).collect();
    let names = ["F.1.npz", "F.npz", "L.npy", "meta.json", "patches.vtu", "scene.bin", "terms.npy"];
    assert_eq!(kept, names.map(|name| format!("kept/{name}")));
    let meta: Value = serde_json::from_slice(&bytes(&place, "kept/meta.json")).unwrap();
    assert_eq!((meta["casts"].as_array().map(Vec::len), &meta["patches"]["count"]), (Some(2), &saved["patches"]));
    refuses(&place, &format!("{render} --patches 300 --load kept"), 3, &["made to a tolerance"]);
    refuses(&place, &format!("{render} --tolerance 0.2 --load kept"), 2, &["--load", "--tolerance"]);
    refuses(&place, &format!("{render} --load kept"), 2, &["--load", "--tolerance"]);
}

#[test]
fn several_modes_have_a_folder_each() {
    let place = room();
    succeed(&place, &format!("render room.toml --mode all {SMALL} --save kept"));
    for mode in ["global", "shadowless", "one-bounce", "local"] {
        assert!(place.path().join(format!("kept/{mode}/F.npz")).exists(), "{mode}");
    }
    same_with(&place, "kept", &format!("render room.toml --alpha 0.5 --tau 1 {SMALL}"));
    same_with(&place, "kept/shadowless", &format!("render room.toml --mode shadowless {SMALL}"));
    let all = report(&place, &format!("render room.toml --mode all {SMALL} --load kept"));
    assert_eq!(all["modes"].as_array().map(Vec::len), Some(4));
}

#[test]
fn the_series_is_kept_and_goes_on_from_a_folder() {
    let place = room();
    let series = format!("bounces room.toml --mode global --size 8x8 {}", SMALL.trim_start_matches("--size 48x48"));
    let cast = report(&place, &format!("{series} --save kept"));
    let read = report(&place, &format!("{series} --load kept --save kept"));
    assert_eq!(cast["modes"], read["modes"]);
    same_with(&place, "kept", &format!("render room.toml --mode global {SMALL}"));
}

#[test]
fn folders_of_something_else_are_refused_with_what_differs() {
    let place = room();
    succeed(&place, &format!("render room.toml --mode global {SMALL} --save kept"));
    let render = |more: &str| format!("render room.toml {SMALL} --load kept {more}");
    refuses(&place, &render("--mode local --tau 1").replace("--mode local ", ""), 3, &["tau 0", "now tau is 1"]);
    refuses(&place, &render("--mode global --seed 3"), 3, &["--seed 0", "now it is 3"]);
    refuses(&place, &render("--mode global").replace("--rays 64", "--rays 65"), 3, &["--rays 64", "now it is 65"]);
    refuses(&place, &render("--mode global").replace("300", "400"), 3, &["--patches 300", "now it is 400"]);
    refuses(
        &place,
        "render --mode global --size 8x8 --samples 1 --load kept",
        3,
        &["another geometry", "room", "cornell-box"],
    );
    refuses(&place, "render room.toml --mode global --load nothing", 3, &["nothing", "meta.json"]);
    refuses(&place, "render room.toml --mode global --load out", 3, &["out", "meta.json"]);
    refuses(&place, &render("--mode global --two-sided"), 3, &["now on two"]);
    fs::write(place.path().join("room.obj"), ROOM.replace("v .4 1 .8", "v .4 1.1 .8")).unwrap();
    refuses(&place, &render("--mode global"), 3, &["another geometry", "in other places"]);
    fs::write(place.path().join("room.obj"), ROOM).unwrap();
    // What --save did not write is not replaced.
    refuses(&place, &format!("render room.toml --mode global {SMALL} --save out"), 1, &["out", "did not write"]);
    succeed(&place, &format!("render room.toml --mode global {SMALL} --save kept"));
}

#[test]
fn other_versions_are_refused() {
    let place = room();
    succeed(&place, &format!("render room.toml --mode global {SMALL} --save kept"));
    let path = place.path().join("kept/meta.json");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replace("\"format\": 4", "\"format\": 2")).unwrap();
    refuses(&place, &format!("render room.toml --mode global {SMALL} --load kept"), 3, &["kept", "in format 2"]);
}

#[test]
fn a_folder_is_opened_without_any_other_file() {
    let place = room();
    succeed(&place, &format!("bounces room.toml --alpha 0.9 --tau 0.2 --count 3 {SMALL} --save kept"));
    succeed(&place, &format!("render room.toml --mode all {SMALL} --save modes"));
    let opened = |name: &str| KeptFolder::open(&place.path().join(name)).unwrap();
    let (folder, rows) = (opened("kept"), KeptRows::new(None));
    let kept = folder.series().unwrap();
    assert_eq!((kept.bounces, kept.fineness), (Some(3), Fineness { patches: 300, rays: 64 }));
    for file in ["room.obj", "room.mtl", "room.toml"] {
        fs::remove_file(place.path().join(file)).unwrap();
    }
    let solver = Solver::new(&kept.scene).seed(kept.seed);
    folder.read(&solver.cut(300), &[kept.transport], &kept.fineness.sampling(kept.seed), &rows).unwrap();
    let k = solver.rows(Arc::new(rows)).operator(kept.transport, kept.fineness).unwrap();
    let light = explore(&k, 3).light;
    assert!(bytes(&place, "kept/L.npy").ends_with(&light_bytes(&light)));
    let several = opened("modes").series().unwrap_err().to_string();
    assert!(several.contains("several modes") && several.contains("shadowless"), "{several}");
}

/// The numbers of lights as a file has them.
fn light_bytes(light: &[Light]) -> Vec<u8> {
    light.iter().flat_map(|light| light.components()).flat_map(f32::to_le_bytes).collect()
}

#[test]
fn damaged_files_are_named() {
    let place = room();
    let render = "render room.toml --mode global --patches 60 --rays 16 --samples 1 --size 4x4";
    succeed(&place, &format!("{render} --save kept"));
    for name in ["meta.json", "scene.bin", "F.npz"] {
        let (path, whole) = (place.path().join("kept").join(name), bytes(&place, &format!("kept/{name}")));
        fs::write(&path, &whole[..whole.len() / 2]).unwrap();
        refuses(&place, &format!("{render} --load kept"), 3, &[name]);
        fs::remove_file(&path).unwrap();
        refuses(&place, &format!("{render} --load kept"), 3, &["kept"]);
        fs::write(&path, whole).unwrap();
    }
    succeed(&place, &format!("{render} --load kept"));
}

/// A long cast is interrupted after its first piece; the next run casts the others only, with the same result.
#[cfg(unix)]
#[test]
fn an_interrupted_cast_goes_on() {
    let place = place(&[]);
    let arguments = "bounces cornell-box --mode global --patches 3000 --rays 16384 --samples 1 --size 4x4 --count 1";
    let save = format!("{arguments} --save kept --json");
    let mut child = Command::new(program())
        .args(save.split_whitespace())
        .current_dir(place.path())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    // What is being written begins with a dot.
    let is_piece = |name: &&String| name.starts_with("kept.casting/") && !name.starts_with("kept.casting/.");
    let pieces = |place: &TempDir| files(place).iter().filter(is_piece).count();
    while pieces(&place) == 0 && child.try_wait().unwrap().is_none() {
        sleep(Duration::from_millis(5));
    }
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let status = child.wait().unwrap();
    if status.code() != Some(130) {
        // Whoever started the tests ignores interrupts.
        return;
    }
    let left = pieces(&place);
    assert!(left > 0 && !place.path().join("kept").exists(), "{:?}", files(&place));
    // One piece is damaged, and cast again.
    if left > 1 {
        let name = files(&place).iter().find(is_piece).unwrap().clone();
        let mut broken = bytes(&place, &name);
        broken.truncate(1000);
        fs::write(place.path().join(name), broken).unwrap();
    }
    succeed(&place, &save);
    assert_eq!(pieces(&place), 0);
    assert!(!Path::new(&place.path().join("kept.casting")).exists());
    let f = bytes(&place, "kept/F.npz");
    succeed(&place, &format!("{arguments} --save again"));
    assert!(f == bytes(&place, "again/F.npz"));
}

#[test]
fn factors_between_patches_are_kept() {
    let place = room();
    let cast = report(&place, "factors room.toml --patches 100 --rays 64 --save kept");
    assert_eq!(fields(&cast), ["entries", "files", "patches", "rays", "reciprocity", "row_sums", "scene"]);
    let first = bytes(&place, "out/room-patch-factors.npz");
    let read = report(&place, "factors room.toml --load kept");
    assert_eq!((read["rays"].as_u64(), &read["entries"]), (Some(0), &cast["entries"]));
    assert!(first == bytes(&place, "out/room-patch-factors.npz"));
    refuses(&place, "factors room.toml --save else", 2, &["--patches N"]);
    same_with(&place, "kept", "render room.toml --mode global --size 16x16 --samples 4 --patches 100 --rays 64");
}

#[test]
fn a_matrix_of_objects_has_names_and_residuals() {
    let place = room();
    let report = report(&place, "factors room.toml --light sky --tolerance 0.01");
    let text = String::from_utf8(bytes(&place, "out/room-factors-matrix.csv")).unwrap();
    let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows[0][..3], ["from", "floor", "ceiling"]);
    assert_eq!((rows.len(), rows[0].len()), (8, 9), "{text}");
    let cell = |from: usize, to: usize| rows[from + 1][to + 1].parse::<f64>().unwrap();
    assert!((cell(0, 1) - report["factors"][1]["F"].as_f64().unwrap()).abs() < 1e-12);
    let residuals = String::from_utf8(bytes(&place, "out/room-factors-residuals.csv")).unwrap();
    let floor: Vec<&str> = residuals.lines().nth(1).unwrap().split(',').collect();
    assert!(residuals.starts_with("object,area,row_sum,standard_error,closure,reciprocity\n"), "{residuals}");
    assert!(floor[0] == "floor" && (floor[1].parse::<f64>().unwrap() - 4.0).abs() < 1e-6, "{residuals}");
}
