//! `halflight factors` as a person runs it: table, CSV, JSON, and what it says of wrong arguments.

use crate::run::{contents, fields, halflight, place, report, succeed};

/// Two unit squares face to face without a material, let alone a light.
const SQUARES: (&str, &str) = (
    "squares.obj",
    "o low\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\no high, with comma\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nf 8 7 6 5\n",
);

/// Howell's catalogue, C-11.
const TRUTH: f64 = 0.199_824_895_698_387_4;

#[test]
fn the_report_holds_every_pair() {
    let place = place(&[SQUARES]);
    let report = report(&place, "factors squares.obj");
    assert_eq!(fields(&report), ["factors", "files", "objects", "reciprocity", "scene", "tolerance", "unmet"]);
    let factors = report["factors"].as_array().unwrap();
    assert_eq!(factors.len(), 4);
    assert_eq!(fields(&factors[0]), ["F", "from", "method", "standard_error", "to"]);
    for f in factors {
        let truth = if f["from"] == f["to"] { 0.0 } else { TRUTH };
        assert!((f["F"].as_f64().unwrap() - truth).abs() < 1e-9, "{f}");
        assert_eq!(f["method"], "closed-form");
    }
    for object in report["objects"].as_array().unwrap() {
        assert_eq!(object["area"], 1.0);
        assert!((object["row_sum"].as_f64().unwrap() - TRUTH).abs() < 1e-9);
    }
    assert!(report["reciprocity"][0]["residual"].as_f64().unwrap().abs() < 1e-9);
}

#[test]
fn the_table_and_the_file_say_the_same() {
    let place = place(&[SQUARES]);
    let ran = succeed(&place, "factors squares.obj");
    assert!(ran.out.contains("0.199824896"), "{}", ran.out);
    assert!(ran.out.contains("row sum") && ran.out.contains("reciprocity"));
    let files = contents(&place);
    let csv = String::from_utf8(files["out/squares-factors.csv"].clone()).unwrap();
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!(lines[0], "from,to,F,standard_error,method");
    assert_eq!(lines.len(), 5);
    assert!(lines[2].starts_with("low,\"high, with comma\",0.19982489"), "{}", lines[2]);
}

#[test]
fn an_object_without_faces_has_an_area_of_zero() {
    // The second plate lies in the first and faces the same way, so the first is there alone.
    let twice = format!("{}o twin\nf 1 2 3 4\n", SQUARES.1);
    let place = place(&[("twice.obj", &twice)]);
    let ran = succeed(&place, "factors twice.obj");
    let line = ran.out.lines().find(|line| line.starts_with("twin ") && line.split_whitespace().count() == 4);
    assert_eq!(line.expect("a line").split_whitespace().nth(1), Some("0.00000e0"), "{}", ran.out);
    let files = contents(&place);
    for name in ["out/twice-factors-residuals.csv", "out/twice-factors.csv", "out/twice-factors-matrix.csv"] {
        let csv = String::from_utf8(files[name].clone()).unwrap();
        assert!(csv.contains("twin") && csv.split([',', '\n']).all(|cell| cell != "-0"), "{name}: {csv}");
    }
    assert_eq!(report(&place, "factors twice.obj")["objects"][2]["area"].to_string(), "0.0");
}

#[test]
fn tau_lets_light_through() {
    // A plate between the two: a quarter of what it blocks at tau 0 is let through at tau 0.25.
    let plate = format!("{}o plate\nv .2 .2 .5\nv .8 .2 .5\nv .8 .8 .5\nv .2 .8 .5\nf 9 10 11 12\n", SQUARES.1);
    let place = place(&[("plate.obj", &plate)]);
    let found = ["0", "0.25", "1"].map(|tau| {
        let report = report(&place, &format!("factors plate.obj --tau {tau}"));
        report["factors"][1]["F"].as_f64().unwrap()
    });
    assert!((found[2] - TRUTH).abs() < 1e-9, "{found:?}");
    let mixed = 0.75 * found[0] + 0.25 * found[2];
    assert!((found[1] - mixed).abs() < 2e-4 * mixed, "{found:?}");
    assert!(found[0] < 0.6 * TRUTH);
}

#[test]
fn wrong_arguments_and_scenes_are_told_apart() {
    let place = place(&[]);
    for (arguments, code, part) in [
        ("factors", 2, "SCENE"),
        ("factors furnace --tolerance 0", 2, "1e-9 to 1"),
        ("factors furnace --tau 2", 2, "0 to 1"),
        ("factors nothing.obj", 3, "no such file"),
    ] {
        let ran = halflight(&place, arguments);
        assert_eq!(ran.code, Some(code), "{arguments}: {}", ran.err);
        assert!(ran.err.contains(part), "{arguments}: {}", ran.err);
    }
    assert!(contents(&place).is_empty());
}
