//! `halflight audit` as a person runs it, and the layers that denoisers take.

use halflight::light::Rgb;
use halflight::pictures::{Exposure, Picture, read_layers, read_picture, write_picture};
use serde_json::Value;
use tempfile::TempDir;

use crate::run::{fields, files, halflight, place, report, report_of_mode, succeed};

/// A place with a picture of the Cornell box, right but for a little noise, and the same brighter by a quarter.
fn pictures() -> TempDir {
    let place = place(&[]);
    succeed(&place, "render cornell-box --mode global --size 32x24 --tolerance 0.05 -o right.exr");
    let right = read_picture(place.path().join("right.exr")).unwrap();
    write_picture(place.path().join("wrong.exr"), &right.scaled(1.25), Exposure::default()).unwrap();
    place
}

fn number(report: &Value, path: &str) -> f64 {
    report.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path} in {report}"))
}

#[test]
fn an_error_is_told_with_its_cause_and_maps() {
    let place = pictures();
    let found = report(&place, "audit wrong.exr cornell-box --mode global");
    for (name, truth) in [("/error", 0.25), ("/mean_error/total", 0.25)] {
        let [value, error] = ["value", "standard_error"].map(|own| number(&found, &format!("{name}/{own}")));
        // The picture itself is up to 5 % off.
        assert!((value - truth).abs() < 4.0 * error + 0.05, "{name}: {value} {error}");
    }
    assert_eq!((&found["causes"][0]["kind"], &found["met"]), (&"brightness".into(), &true.into()));
    assert!(number(&found, "/causes/0/explains") > 0.8);
    assert_eq!(fields(&found["where"][0]), ["columns", "mean", "rows", "share"]);
    assert_eq!(found["files"], serde_json::json!(["out/wrong-audit.png", "out/wrong-audit.exr"]));
    let map = read_layers(place.path().join("out/wrong-audit.exr")).unwrap();
    let names: Vec<&str> = map.iter().map(|layer| layer.name.as_str()).collect();
    assert_eq!(names, ["", "estimate", "estimate", "mask", "rms error"]);
    // Where it is certain the picture is brighter, and nowhere darker.
    let certain = |sign: f32| map[0].picture.pixels.iter().filter(|p| sign * p.element_sum() > 0.0).count();
    assert!(certain(1.0) > 300 && certain(-1.0) == 0, "{} {}", certain(1.0), certain(-1.0));
    // People are told the same.
    let said = succeed(&place, "audit wrong.exr cornell-box --mode global --out again").out;
    assert!(said.contains("times as bright") && said.contains("% of its square in columns"), "{said}");
}

#[test]
fn exit_codes_tell_whether_an_error_is_at_most_what_was_asked() {
    let place = pictures();
    let above = halflight(&place, "audit wrong.exr cornell-box --mode global --at-most 0.1 --json");
    assert_eq!(above.code, Some(7), "{}", above.err);
    assert!(above.err.contains("certainly more than 10.00 %"), "{}", above.err);
    let found: Value = serde_json::from_str(&above.out).unwrap();
    assert_eq!((&found["verdict"], &found["at_most"]), (&"above".into(), &0.1.into()));
    let within = report(&place, "audit right.exr cornell-box --mode global --at-most 10%");
    assert_eq!(within["verdict"], "within");
    // In no time there is one round, and what it leaves open is said.
    let right = read_picture(place.path().join("right.exr")).unwrap();
    write_picture(place.path().join("near.exr"), &right.scaled(1.1), Exposure::default()).unwrap();
    let error = number(&report(&place, "audit near.exr cornell-box --mode global --resolve 0.02"), "/error/value");
    let open = halflight(&place, &format!("audit near.exr cornell-box --mode global --at-most {error} --time 1e-9"));
    assert!(open.code == Some(0) && open.err.contains("more --time tells"), "{}", open.err);
}

#[test]
fn what_cannot_be_audited_is_refused() {
    let place = pictures();
    let before = files(&place);
    for (arguments, code, part) in [
        ("audit wrong.exr cornell-box", 2, "--mode global"),
        ("audit lost.exr cornell-box --mode global", 3, "lost.exr"),
        ("audit right.tiff cornell-box --mode global", 2, ".tiff"),
        ("audit right.exr lost-scene --mode global", 3, "lost-scene"),
        ("audit right.exr cornell-box --mode global --at-most 2", 2, "0.0001 to 0.5"),
        ("audit right.exr cornell-box --mode global --resolve 0", 2, "above 0"),
        ("audit right.exr cornell-box --mode global -o map.jpg", 2, ".jpg"),
        ("audit right.exr furnished-room --mode shadowless -o map.exr", 4, "diverges"),
    ] {
        let ran = halflight(&place, arguments);
        assert_eq!(ran.code, Some(code), "{arguments}: {}", ran.err);
        assert!(ran.err.contains(part), "{arguments}: {}", ran.err);
    }
    assert_eq!(files(&place), before);
}

/// A PNG file has a curve, an exposure and 255 codes; what is assumed is said.
#[test]
fn a_png_is_read_at_its_exposure() {
    let place = pictures();
    let right = read_picture(place.path().join("right.exr")).unwrap();
    write_picture(place.path().join("shown.png"), &right, Exposure { stops: -3.0 }).unwrap();
    let ran = succeed(&place, "audit shown.png cornell-box --mode global --exposure -3 --at-most 10% --json");
    assert!(ran.err.contains("sRGB at an exposure of -3 stops"), "{}", ran.err);
    let found: Value = serde_json::from_str(&ran.out).unwrap();
    assert_eq!(found["verdict"], "within");
}

fn sum(pictures: &[&Picture]) -> Vec<Rgb> {
    let mut sum = pictures[0].scaled(0.0);
    pictures.iter().for_each(|own| sum = sum.plus(own).unwrap());
    sum.pixels
}

/// Direct and indirect light and what is emitted add up to the picture, and so do halves, which differ.
#[test]
fn layers_for_denoisers_are_named_as_theirs_and_add_up() {
    let place = place(&[]);
    let arguments = "render cornell-box --mode global --size 24x24 --tolerance 0.1 --layers denoiser,bounces -o d.exr";
    let found = report_of_mode(&place, arguments);
    let layers = found["layers"].as_array().unwrap();
    for name in ["albedo", "normal", "depth", "direct", "indirect", "half A", "half B", "bounce.1"] {
        assert!(layers.contains(&name.into()), "{name} in {layers:?}");
    }
    let bytes = std::fs::read(place.path().join("d.exr")).unwrap();
    for channel in ["albedo.B", "normal.X", "normal.Z", "depth.Z", "half A.R"] {
        let text = [channel.as_bytes(), &[0]].concat();
        assert!(bytes.windows(text.len()).any(|window| window == text), "{channel}");
    }
    let read = read_layers(place.path().join("d.exr")).unwrap();
    let layer = |name: &str| &read.iter().find(|layer| layer.name == name).unwrap_or_else(|| panic!("{name}")).picture;
    let picture = layer("");
    let near = |all: Vec<Rgb>, factor: f32| {
        let apart = all.iter().zip(&picture.pixels).map(|(a, b)| (factor * *a - *b).abs().max_element());
        // Sums in another order, of light up to that of the lamp.
        assert!(apart.fold(0.0, f32::max) < 1e-4);
    };
    near(sum(&[layer("bounce.0"), layer("direct"), layer("indirect")]), 1.0);
    near(sum(&[layer("half A"), layer("half B")]), 0.5);
    assert!(layer("half A") != layer("half B"));
    // Without them the picture is the same, and bounces that only denoisers need are no layers.
    let found = report_of_mode(
        &place,
        "render cornell-box --mode global --size 24x24 --tolerance 0.1 --layers direct -o e.exr",
    );
    assert_eq!(found["layers"], serde_json::json!(["direct"]));
    assert!(read_picture(place.path().join("e.exr")).unwrap() == *picture);
    let refused = halflight(&place, "render cornell-box --mode global --size 24x24 --layers albedo -o a.png");
    assert!(refused.code == Some(2) && refused.err.contains("EXR"), "{}", refused.err);
}
