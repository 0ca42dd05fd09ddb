//! `halflight chart`: its report and files, errors whose size is known, and when a kept reference is used again.

use std::fs;

use glam::Vec3;
use halflight::pictures::{Exposure, Picture, write_picture};
use serde_json::Value;
use tempfile::TempDir;

use crate::run::{contents, fields, files, halflight, place, report};

/// Small pictures and little time.
const QUICK: &str = "--mode one-bounce --size 12x12 --time 0.2 --out .";

/// A floor below a lamp.
const ROOM: [(&str, &str); 3] = [
    (
        "room.obj",
        "mtllib room.mtl\nv 0 0 0\nv 4 0 0\nv 4 0 4\nv 0 0 4\nv 1 3 1\nv 2 3 1\nv 2 3 2\nv 1 3 2\n\
         usemtl floor\nf 4 3 2 1\nusemtl lamp\nf 5 6 7 8\n",
    ),
    ("room.mtl", "newmtl floor\nKd .5 .4 .3\nnewmtl lamp\nKd 0 0 0\nKe 9 9 9\n"),
    ("room.toml", "obj = \"room.obj\"\n[camera]\nposition = [2, 2, 9]\ntarget = [2, 0, 2]\nup = [0, 1, 0]\n"),
];

fn mode(place: &TempDir, arguments: &str) -> Value {
    let report = report(place, arguments);
    assert_eq!(report["modes"].as_array().unwrap().len(), 1);
    report["modes"][0].clone()
}

fn list<'a>(value: &'a Value, name: &str) -> &'a Vec<Value> {
    value[name].as_array().unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

/// Whether the references for patch methods and for the path tracer were there already.
fn kept(mode: &Value) -> [bool; 2] {
    [0, 1].map(|i| mode["references"][i]["kept"].as_bool().unwrap())
}

#[test]
fn the_report_has_its_fields_and_the_files_exist() {
    let place = place(&ROOM);
    let mode = mode(&place, &format!("chart room.toml {QUICK}"));
    assert_eq!((&mode["scene"], &mode["mode"]), (&"room".into(), &"one-bounce".into()));
    for point in list(&mode, "points") {
        let [low, reached, high] = ["reached_low", "reached", "reached_high"].map(|name| number(&point[name]));
        assert!(0.0 <= low && low <= reached && reached <= high, "{point}");
        let seconds = &point["seconds"];
        let parts = ["load", "patches", "form_factors", "solve", "gather"];
        let sum: f64 = parts.map(|part| number(&seconds[part])).iter().sum();
        assert!((sum - number(&seconds["total"])).abs() < 1e-9 && sum > 0.0);
    }
    for method in ["tolerance", "patches alone", "rays alone", "samples alone", "shooting", "path tracing"] {
        let of = |p: &&Value| p["method"] == method;
        assert!(list(&mode, "points").iter().any(|p| of(&p)), "{method}");
        assert!(list(&mode, "slopes").iter().any(|p| of(&p)), "{method}");
    }
    assert_eq!(fields(&mode["references"][0]), ["by", "effort", "error", "files", "judges", "kept", "seconds"]);
    nothing_beats_the_front(&mode);
    let there = contents(&place);
    let named = list(&mode, "files").iter().chain(list(&mode["references"][0], "files"));
    for file in named {
        let name = file.as_str().unwrap().trim_start_matches("./");
        assert!(there.contains_key(name), "{name}");
    }
    let table = String::from_utf8(there["room-chart-one-bounce.csv"].clone()).unwrap();
    assert_eq!(table.lines().count(), 1 + list(&mode, "points").len());
}

fn nothing_beats_the_front(mode: &Value) {
    let points = list(mode, "points");
    let of = |p: &Value| (number(&p["seconds"]["total"]), number(&p["reached"]));
    let front: Vec<_> = points.iter().filter(|p| p["on_front"] == true).map(of).collect();
    assert!(!front.is_empty());
    for (seconds, error) in front {
        let beaten = points.iter().map(of).any(|(s, e)| e > 0.0 && s < seconds && e < error);
        assert!(!beaten);
    }
}

#[test]
fn a_kept_reference_is_used_again_until_the_scene_changes() {
    let place = place(&ROOM);
    let command = format!("chart room.toml {QUICK}");
    assert_eq!(kept(&mode(&place, &command)), [false, false]);
    let references = || -> Vec<(String, Vec<u8>)> {
        let all = contents(&place).into_iter();
        all.filter(|(name, _)| name.starts_with("references/")).collect()
    };
    let first = references();
    // Six pictures, two labels, and the folder.
    assert_eq!(first.len(), 9);
    let again = mode(&place, &command);
    assert_eq!(kept(&again), [true, true]);
    assert_eq!(references(), first);

    fs::write(place.path().join("room.mtl"), ROOM[1].1.replace(".5 .4 .3", ".5 .4 .31")).unwrap();
    let changed = mode(&place, &command);
    assert_eq!(kept(&changed), [false, false]);
    assert_ne!(changed["references"][0]["files"], again["references"][0]["files"]);
    // The old ones still serve the old scene, and nothing else.
    fs::write(place.path().join("room.mtl"), ROOM[1].1).unwrap();
    assert_eq!(kept(&mode(&place, &command)), [true, true]);
    let camera = ROOM[2].1.replace("[2, 2, 9]", "[2, 2, 9.01]");
    fs::write(place.path().join("room.toml"), camera).unwrap();
    assert_eq!(kept(&mode(&place, &command)), [false, false]);
}

#[test]
fn a_reference_that_does_not_fit_is_made_anew() {
    let place = place(&ROOM);
    let command = format!("chart room.toml {QUICK}");
    let first = mode(&place, &command);
    // A reference of another scene under this one's name: its label gives it away.
    let labels: Vec<String> = files(&place).into_iter().filter(|f| f.ends_with(".json")).collect();
    let paths = labels.iter().find(|name| name.contains("paths")).unwrap();
    let text = fs::read_to_string(place.path().join(paths)).unwrap();
    let mut label: Value = serde_json::from_str(&text).unwrap();
    label["key"] = "0".repeat(32).into();
    fs::write(place.path().join(paths), label.to_string()).unwrap();
    // And a picture that broke.
    let picture = first["references"][1]["files"][0].as_str().unwrap();
    fs::write(place.path().join(picture), b"half a file").unwrap();
    assert_eq!(kept(&mode(&place, &command)), [false, false]);
    assert_eq!(kept(&mode(&place, &command)), [true, true]);
    // With more time a better one can be had.
    let longer = command.replace("--time 0.2", "--time 0.4");
    assert_eq!(kept(&mode(&place, &longer)), [false, false]);
}

#[test]
fn the_error_against_a_reference_brought_along_is_right() {
    let place = place(&[]);
    // Everything in the furnace has radiance 0.25 / (1 - 0.5); against four fifths of it all pictures are a quarter too
    // bright.
    let own = Picture::filled(8, 8, Vec3::splat(0.8 * 0.5));
    write_picture(place.path().join("own.exr"), &own, Exposure::default()).unwrap();
    let command = "chart furnace --mode global --size 8x8 --time 0.2 --out . --reference own.exr";
    let found = mode(&place, command);
    assert_eq!(found["references"][0]["files"][0], "own.exr");
    assert!(!files(&place).iter().any(|name| name.starts_with("references/")));
    let tolerances = list(&found, "points").iter().filter(|p| p["method"] == "tolerance");
    for point in tolerances {
        // A picture off by the tolerance is off by 1.25 times as much of the reference.
        let apart = (number(&point["reached"]) - 0.25).abs();
        assert!(apart < 1.25 * number(&point["asked"]), "{point}");
    }
}

#[test]
fn references_that_cannot_serve_are_refused() {
    let place = place(&ROOM);
    let black = Picture::filled(12, 12, Vec3::ZERO);
    write_picture(place.path().join("black.exr"), &black, Exposure::default()).unwrap();
    let small = Picture::filled(8, 8, Vec3::ONE);
    write_picture(place.path().join("small.exr"), &small, Exposure::default()).unwrap();
    for (arguments, code, said) in [
        ("--reference small.exr", 3, "8 x 8"),
        ("--reference black.exr", 3, "black"),
        ("--reference none.exr", 3, "none.exr"),
        ("--reference-error small.exr", 2, "--reference"),
    ] {
        let ran = halflight(&place, &format!("chart room.toml {QUICK} {arguments}"));
        assert_eq!(ran.code, Some(code), "{arguments}: {}", ran.err);
        assert!(ran.err.contains(said), "{arguments}: {}", ran.err);
    }
    let ran = halflight(&place, "chart room.toml --time 0 --out .");
    assert_eq!(ran.code, Some(2), "{}", ran.err);
    let all = "chart room.toml --mode all --size 12x12 --reference small.exr --out .";
    let ran = halflight(&place, all);
    assert_eq!(ran.code, Some(2), "{}", ran.err);
    assert!(ran.err.contains("--mode"), "{}", ran.err);
}

#[test]
fn a_diverging_series_is_refused_before_any_reference_is_made() {
    let place = place(&[]);
    let command = "chart furnished-room --mode shadowless --size 12x12 --time 0.2 --out .";
    let ran = halflight(&place, command);
    assert_eq!(ran.code, Some(4), "{}", ran.err);
    assert!(contents(&place).is_empty());
}

#[test]
fn only_the_ladders_asked_for_are_run() {
    let place = place(&ROOM);
    let line = format!("chart room.toml {QUICK} --ladders rays,samples");
    let mode = mode(&place, &line);
    let methods: Vec<&str> = list(&mode, "points").iter().map(|p| p["method"].as_str().unwrap()).collect();
    assert!(methods.contains(&"rays alone") && methods.contains(&"samples alone"));
    assert!(methods.iter().all(|m| m.ends_with(" alone") && *m != "patches alone"));
    // No path tracer is judged, so no patch picture is made to judge it, and there is no tolerance to chart.
    let names = files(&place);
    assert!(names.iter().all(|name| !name.contains("-patches-") && !name.contains("-asked")));
}
