//! The command line: the files each command writes, what it prints, its JSON reports, and that they repeat.

use std::fs;

use glam::DVec3;
use halflight::pictures::{read_picture, relative_rms};
use halflight::scene::builtin;
use serde_json::{Value, json};

use crate::run::{SHEET, SMALL, contents, fields, files, halflight, place, report, report_of_mode, succeed};

#[test]
fn render_draws_the_cornell_box_in_all_modes() {
    let place = place(&[]);
    let ran = succeed(&place, &format!("render {SMALL}"));
    let names = ["global", "local", "modes", "one-bounce", "shadowless"];
    let wanted = names.map(|mode| format!("out/cornell-box-{mode}.png"));
    assert_eq!(files(&place), wanted);
    assert!(ran.err.is_empty(), "{}", ran.err);
    for name in wanted {
        assert!(ran.out.contains(&name), "{}", ran.out);
        let picture = read_picture(place.path().join(&name)).unwrap();
        let lit = picture.pixels.iter().any(|p| p.max_element() > 0.1);
        assert!(lit, "{name} is black");
        if !name.contains("modes") {
            assert_eq!((picture.width, picture.height), (48, 48));
        }
    }
}

/// The picture of a tolerance against another program's (tests/data/cornell), as the program itself makes it: with
/// HALFLIGHT_PROGRAM this tries the release profile.
#[test]
fn the_picture_is_as_near_the_reference_as_asked_and_stated() {
    let place = place(&[]);
    let found = report_of_mode(&place, "render --mode global --size 64x64 --tolerance 0.02 -o box.exr");
    let data = |name: &str| {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/cornell");
        read_picture(folder.join(name)).unwrap()
    };
    let picture = read_picture(place.path().join("box.exr")).unwrap();
    let (mask, se) = (data("mask.exr"), data("reference_se.exr"));
    let error = relative_rms(&picture, &data("reference.exr"), Some(&mask), Some(&se)).unwrap();
    let stated = found["error"]["total"].as_f64().unwrap();
    assert!(error <= 1.1 * 0.02 && error <= 1.2 * stated, "{error}, stated {stated}");
}

#[test]
fn each_mode_writes_its_own_picture() {
    for mode in ["global", "shadowless", "one-bounce", "local"] {
        let place = place(&[]);
        succeed(&place, &format!("render {SMALL} --mode {mode}"));
        assert_eq!(files(&place), [format!("out/cornell-box-{mode}.png")]);
    }
}

#[test]
fn output_names_one_file_or_one_a_mode() {
    let place = place(&[]);
    let run = |arguments: &str| succeed(&place, &format!("render {SMALL} {arguments}"));
    run("--mode local -o one.png");
    run("--mode local -o one.exr");
    assert_eq!(files(&place), ["one.exr", "one.png"]);
    run("--mode all --output many.exr");
    let added = ["global", "local", "one-bounce", "shadowless"];
    let mut wanted = added.map(|mode| format!("many-{mode}.exr")).to_vec();
    wanted.extend(["many-modes.png", "one.exr", "one.png"].map(String::from));
    wanted.sort();
    assert_eq!(files(&place), wanted);
}

/// In a convex room where all emits E and reflects rho, `L_visible = E + rho E / (1 - alpha rho)` whatever tau:
/// nothing is in the way.
#[test]
fn the_furnace_has_its_closed_form_in_every_pixel() {
    let (emission, rho) = furnace_material();
    let place = place(&[]);
    for (alpha, tau) in [(1.0, 0.0), (1.0, 1.0), (0.5, 0.25), (0.0, 0.0), (0.0, 1.0)] {
        let arguments = format!("render furnace {SMALL} --alpha {alpha} --tau {tau} -o f.exr");
        succeed(&place, &arguments);
        let picture = read_picture(place.path().join("f.exr")).unwrap();
        let wanted = emission + rho * emission / (1.0 - alpha * rho);
        for pixel in &picture.pixels {
            // The series stops at a tail of 1e-4; the pixel's rays and the rows of F sum to 1 within rounding.
            let error = (pixel.as_dvec3() - DVec3::splat(wanted)).abs().max_element();
            assert!(error < 2e-4, "alpha {alpha}, tau {tau}: {pixel}, not {wanted}");
        }
    }
}

/// One of alpha and tau may be given; the other is the global mode's.
#[test]
fn alpha_and_tau_stand_in_for_a_mode() {
    let place = place(&[]);
    for (arguments, alpha, tau) in
        [("--alpha 0.1", 0.1, 0.0), ("--tau 0.3", 1.0, 0.3), ("--tau 0.3 --alpha 0.1", 0.1, 0.3)]
    {
        let report = report_of_mode(&place, &format!("render {SMALL} {arguments}"));
        assert_eq!(report["mode"], Value::Null);
        assert_eq!((&report["alpha"], &report["tau"]), (&alpha.into(), &tau.into()));
        // f64 prints 1.0 as "1", as the file's name does.
        let file = format!("out/cornell-box-alpha-{alpha}-tau-{tau}.png");
        assert_eq!(report["files"], json!([file]));
        assert!(place.path().join(file).exists());
    }
    let corner = report_of_mode(&place, &format!("render {SMALL} --alpha 0 --tau 1"));
    assert_eq!(corner["mode"], "local");
}

const RENDER_FIELDS: &[&str] = &[
    "alpha",
    "error",
    "exposure",
    "files",
    "height",
    "met",
    "mode",
    "patches",
    "rays",
    "row_sums",
    "scene",
    "seconds",
    "spectral_radius",
    "tau",
    "triangles",
    "verdict",
    "why",
    "width",
];

#[test]
fn a_render_report_is_one_document_with_these_fields() {
    let place = place(&[]);
    let ran = succeed(&place, &format!("render {SMALL} --mode global --json"));
    assert!(ran.err.contains("global") && ran.err.contains("converges"));
    let report: Value = serde_json::from_str(&ran.out).unwrap();
    assert_eq!(fields(&report), ["files", "modes"]);
    let report = &report["modes"][0];
    assert_eq!(fields(report), RENDER_FIELDS);
    assert_eq!((&report["scene"], &report["mode"]), (&"cornell-box".into(), &"global".into()));
    assert_eq!((&report["width"], &report["height"]), (&48.into(), &48.into()));
    assert_eq!(report["files"], json!(["out/cornell-box-global.png"]));
    let number = |path: &str| report.pointer(path).and_then(Value::as_f64).unwrap();
    let steps = ["load", "patches", "form_factors", "solve", "gather"];
    let sum: f64 = steps.iter().map(|s| number(&format!("/seconds/{s}"))).sum();
    assert!((sum - number("/seconds/total")).abs() < 1e-9);
    assert_eq!(fields(&report["seconds"]).len(), steps.len() + 1);
    assert_eq!(fields(&report["spectral_radius"]), ["lower", "upper"]);
    let (lower, upper) = (number("/spectral_radius/lower"), number("/spectral_radius/upper"));
    assert!(0.0 < lower && lower <= upper && upper < 1.0);
    assert_eq!(fields(&report["row_sums"]), ["max", "mean", "min"]);
    assert!(number("/row_sums/min") <= number("/row_sums/mean"));
    // One crossing a ray at most, each of weight 1 / rays.
    assert!(number("/row_sums/mean") <= number("/row_sums/max") && number("/row_sums/max") <= 1.0 + 1e-6);
    // Every patch that reflects casts 64 rays.
    assert!(number("/rays") >= 64.0 && number("/patches") >= 100.0);
}

#[test]
fn reports_of_several_modes_are_an_array() {
    let place = place(&[]);
    let report = report(&place, &format!("render furnished-room {SMALL}"));
    assert_eq!(fields(&report), ["files", "modes"]);
    let modes = report["modes"].as_array().unwrap();
    let column = |name: &str| modes.iter().map(|m| m[name].clone()).collect::<Vec<_>>();
    assert_eq!(column("mode"), ["global", "shadowless", "one-bounce", "local"]);
    assert_eq!(column("verdict"), ["converges", "diverges", "ends", "ends"]);
    for mode in modes {
        assert_eq!(fields(mode), RENDER_FIELDS);
        let drawn = mode["files"].as_array().unwrap().len();
        assert_eq!(drawn, usize::from(mode["verdict"] != "diverges"));
    }
    assert_eq!(report["files"], json!(["out/furnished-room-modes.png"]));
}

#[test]
fn a_mode_that_diverges_has_no_picture_and_the_others_do() {
    let alone = place(&[]);
    let ran = halflight(&alone, &format!("render furnished-room --mode shadowless {SMALL}"));
    assert_eq!(ran.code, Some(4), "{}", ran.err);
    assert!(files(&alone).is_empty() && ran.out.is_empty());
    assert_eq!(ran.err.matches("diverges in this mode").count(), 1);
    for part in ["spectral radius of K lies", "for alpha below", "--alpha"] {
        assert!(ran.err.contains(part), "{}", ran.err);
    }
    let all = place(&[]);
    let ran = succeed(&all, &format!("render furnished-room --mode all {SMALL}"));
    assert!(ran.err.contains("shadowless: no picture"));
    let drawn = ["global", "local", "modes", "one-bounce"];
    assert_eq!(files(&all), drawn.map(|m| format!("out/furnished-room-{m}.png")));
}

#[test]
fn bounces_draws_tabulates_and_reports_every_mode() {
    let place = place(&[]);
    let ran = succeed(&place, &format!("bounces {SMALL} --count 3 --json"));
    for part in ["global (alpha 1, tau 0)", "K³E", "K²E = 0 exactly", "tail"] {
        assert!(ran.err.contains(part), "{}", ran.err);
    }
    let report: Value = serde_json::from_str(&ran.out).unwrap();
    assert_eq!(fields(&report), ["files", "modes"]);
    let mut listed: Vec<&str> = report["files"].as_array().unwrap().iter().map(|f| f.as_str().unwrap()).collect();
    listed.sort_unstable();
    assert_eq!(files(&place), listed);
    assert_eq!(listed.len(), 7);
    for mode in report["modes"].as_array().unwrap() {
        assert_eq!(
            fields(mode),
            ["alpha", "bounces", "met", "mode", "patches", "scene", "spectral_radius", "tau", "verdict", "why"]
        );
        check_bounces(mode["bounces"].as_array().unwrap());
    }
    let csv = fs::read_to_string(place.path().join("out/cornell-box-bounces.csv")).unwrap();
    let columns: Vec<usize> = csv.lines().map(|l| l.split(',').count()).collect();
    // Four terms of the two modes that go on, three of those that end with K²E = 0.
    assert_eq!(columns, [14; 1 + 4 + 4 + 3 + 3]);
}

fn check_bounces(bounces: &[Value]) {
    for (n, bounce) in bounces.iter().enumerate() {
        let names = ["error", "n", "norm", "power", "power_invisible", "ratio"];
        assert_eq!(fields(bounce), [&names[..], &["tail_bound"]].concat());
        assert_eq!(bounce["n"], n);
        for half in ["power", "power_invisible"] {
            assert_eq!(bounce[half].as_array().unwrap().len(), 3);
        }
        assert_eq!(bounce["ratio"].is_null(), n == 0);
        // No term is negative anywhere: the norm of their sum is at least the root of the sum of their squares.
        let later = bounces[n + 1..].iter().map(|b| b["norm"].as_f64().unwrap());
        let least = later.map(|norm| norm * norm).sum::<f64>().sqrt();
        let bound = bounce["tail_bound"].as_f64().unwrap();
        assert!(least <= bound * (1.0 + 1e-6), "{least}, {bound}");
    }
}

#[test]
fn a_series_that_diverges_is_an_answer_for_bounces() {
    let place = place(&[]);
    let report = report(&place, &format!("bounces furnished-room --mode shadowless {SMALL} --count 12"));
    let mode = &report["modes"][0];
    assert_eq!(mode["verdict"], "diverges");
    assert!(mode["spectral_radius"]["lower"].as_f64().unwrap() > 1.0);
    let bounces = mode["bounces"].as_array().unwrap();
    assert_eq!(bounces.len(), 13);
    // The first terms still change their shape; then each is larger than the one before, and no tail is bounded.
    for bounce in &bounces[8..] {
        assert!(bounce["ratio"].as_f64().unwrap() > 1.0, "{bounce}");
    }
    assert!(bounces.iter().all(|b| b["tail_bound"].is_null()));
}

/// `pi A E` W leave the furnace's walls, with A and E as its files say; each bounce of a closed opaque room of one
/// reflectance has rho times the power of the one before.
#[test]
fn powers_are_in_watts() {
    let area = quad_area(&furnace("obj"));
    let (emission, rho) = furnace_material();
    let place = place(&[]);
    let report = report(&place, &format!("bounces furnace --mode global {SMALL} --count 5"));
    for n in 0..=5 {
        let wanted = std::f64::consts::PI * area * emission * rho.powi(n);
        let bounce = &report["modes"][0]["bounces"][n as usize];
        for c in 0..3 {
            for half in ["power", "power_invisible"] {
                let power = bounce[half][c].as_f64().unwrap();
                // Single-precision corners and sums of 64 shares, once a bounce.
                assert!((power / wanted - 1.0).abs() < 1e-5, "{n}: {power}, not {wanted}");
            }
        }
    }
}

/// The text of one of the furnace's files.
fn furnace(extension: &str) -> String {
    let stem = concat!(env!("CARGO_MANIFEST_DIR"), "/../../meshes/furnace.");
    fs::read_to_string(format!("{stem}{extension}")).unwrap()
}

/// E and rho of the furnace's one grey material, as its file gives them.
fn furnace_material() -> (f64, f64) {
    let mtl = furnace("mtl");
    let value = |key: &str| -> f64 {
        let line = mtl.lines().find_map(|l| l.strip_prefix(key)).unwrap();
        line.split_whitespace().next().unwrap().parse().unwrap()
    };
    (value("Ke"), value("Kd"))
}

/// The area of a file of planar, convex quadrilaterals: half the cross product of the diagonals of each.
fn quad_area(obj: &str) -> f64 {
    let mut vertices = Vec::new();
    let mut area = 0.0;
    for line in obj.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let xyz: Vec<f64> = words.map(|w| w.parse().unwrap()).collect();
                vertices.push(DVec3::from_slice(&xyz));
            }
            Some("f") => {
                let corners: Vec<DVec3> = words.map(|w| vertices[w.parse::<usize>().unwrap() - 1]).collect();
                let [a, b, c, d] = corners[..] else {
                    panic!("not a quadrilateral: {line}");
                };
                area += 0.5 * (c - a).cross(d - b).length();
            }
            _ => (),
        }
    }
    area
}

#[test]
fn scenes_lists_what_is_built_in() {
    let place = place(&[]);
    let names: Vec<&str> = builtin::names().collect();
    let ran = succeed(&place, "scenes");
    let listed: Vec<&str> = ran.out.lines().filter_map(|l| l.split_whitespace().next()).collect();
    assert_eq!(listed, names);
    let report = report(&place, "scenes");
    let scenes = report.as_array().unwrap();
    assert_eq!(scenes.len(), names.len());
    for (scene, name) in scenes.iter().zip(names) {
        assert_eq!(fields(scene), ["description", "name", "triangles"]);
        assert_eq!(scene["name"], name);
        assert!(scene["triangles"].as_u64().unwrap() >= 12);
    }
    assert!(contents(&place).is_empty());
}

#[test]
fn quiet_says_nothing_even_where_there_is_something_to_warn_of() {
    let place = place(&SHEET);
    for command in [
        format!("render furnished-room {SMALL} -q"),
        format!("render sheet.toml {SMALL} --quiet"),
        format!("bounces --count 1 {SMALL} --quiet"),
        "scenes --quiet".into(),
    ] {
        let ran = succeed(&place, &command);
        assert!(ran.out.is_empty() && ran.err.is_empty(), "{command}");
    }
}

#[test]
fn black_backs_are_warned_of_once_with_the_remedy() {
    let place = place(&SHEET);
    let ran = succeed(&place, &format!("render sheet.toml {SMALL}"));
    assert_eq!(ran.err.matches("--two-sided").count(), 1, "{}", ran.err);
    assert!(ran.err.contains("black back"));
    let ran = succeed(&place, &format!("render sheet.toml {SMALL} --two-sided"));
    assert!(ran.err.is_empty(), "{}", ran.err);
}

/// The report with its times taken out, as text, and every file.
fn everything(arguments: &str) -> (String, Vec<(String, Vec<u8>)>) {
    fn without_seconds(value: &mut Value) {
        match value {
            Value::Object(fields) => {
                fields.remove("seconds");
                fields.values_mut().for_each(without_seconds);
            }
            Value::Array(items) => items.iter_mut().for_each(without_seconds),
            _ => (),
        }
    }
    let place = place(&[]);
    let mut report = report(&place, arguments);
    without_seconds(&mut report);
    (report.to_string(), contents(&place).into_iter().collect())
}

#[test]
fn the_same_seed_gives_the_same_bytes_on_any_number_of_threads() {
    for command in
        [format!("render {SMALL}"), format!("render {SMALL} --mode all -o l.exr"), format!("bounces {SMALL} --count 3")]
    {
        let one = everything(&format!("{command} --threads 1 --seed 7"));
        let two = everything(&format!("{command} --threads 2 --seed 7"));
        assert!(one == two, "{command}: threads change the result");
        let other = everything(&format!("{command} --threads 2 --seed 8"));
        assert!(one.0 != other.0, "{command}: the report ignores the seed");
        for ((name, ours), (_, theirs)) in one.1.iter().zip(&other.1) {
            // Directories hold no bytes; a chart's lines may agree to the pixel.
            let must_differ = [".exr", ".csv", "box-global.png"];
            if must_differ.iter().any(|end| name.ends_with(end)) {
                assert!(ours != theirs, "{name} ignores the seed");
            }
        }
    }
}

#[test]
fn help_names_the_commands_the_exit_codes_and_examples() {
    let place = place(&[]);
    let ran = succeed(&place, "--help");
    for part in ["render", "bounces", "scenes", "Exit codes", "Examples", "--seed"] {
        assert!(ran.out.contains(part), "{part}");
    }
    let ran = succeed(&place, "render --help");
    for part in ["--mode", "--alpha", "--two-sided", ".exr", "cornell-box", "docs/commands.md"] {
        assert!(ran.out.contains(part), "{part}");
    }
    // In groups, each with what belongs to it.
    let of = |heading: &str| ran.out.split(&format!("\n{heading}:\n")).nth(1).unwrap_or_else(|| panic!("{heading}"));
    for (heading, option) in [
        ("Scene", "--two-sided"),
        ("Accuracy", "--tolerance"),
        ("Picture", "--size"),
        ("Light at points", "--lux"),
        ("Keep", "--save"),
    ] {
        let own = of(heading).split("\n\n").take_while(|block| block.starts_with(' ')).collect::<String>();
        assert!(own.contains(option), "{option} is not under {heading}: {own}");
    }
    // Without a command: the help, and the exit code of wrong arguments.
    let ran = halflight(&place, "");
    assert_eq!(ran.code, Some(2));
    assert!(ran.err.contains("Usage: halflight"));
}

#[test]
fn a_picture_that_ran_out_of_time_says_so() {
    let place = place(&[]);
    let found = report_of_mode(&place, "render cornell-box --mode global --size 32x32 --tolerance 0.002 --time 0.05");
    assert_eq!(found["met"], false);
    let why = found["why"].as_str().unwrap();
    assert!(why.ends_with("when the time was over; a longer --time helps"), "{why}");
    // The picture is one at 10 %, with some hundred patches: what 0.2 % takes was not begun.
    assert!(found["patches"].as_u64() < Some(2000), "{}", found["patches"]);
}

#[test]
fn a_limit_that_does_not_bite_changes_no_byte() {
    let place = place(&[]);
    let render = |more: &str, file: &str| {
        let job = format!("render cornell-box --mode global --size 24x24 --tolerance 0.03 -o {file} {more}");
        let ran = halflight(&place, &job);
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        std::fs::read(place.path().join(file)).expect("a picture")
    };
    let free = render("", "free.exr");
    assert!(render("--time 600", "limited.exr") == free);
    // More seconds than a clock can tell are no limit.
    assert!(render("--time 1e30", "never.exr") == free);
    let ran = halflight(&place, "bounces cornell-box --mode local --size 8x8 --tolerance 0.1 --time 1e30");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
}
