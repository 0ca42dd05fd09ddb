//! `halflight compare` and `halflight diff`: their reports, and verdicts on scenes whose answer is known.

use glam::Vec3;
use halflight::pictures::{Exposure, Picture, write_picture};
use serde_json::Value;

use crate::run::{contents, halflight, place, report, report_of_mode};

const QUICK: &str = "--time 0.25 --size 16x16 --out .";

fn names(report: &Value) -> Vec<&str> {
    let methods = report["methods"].as_array().unwrap();
    methods.iter().map(|m| m["name"].as_str().unwrap()).collect()
}

/// Whether a verdict is `agree`.
fn agrees(verdict: &Value) -> bool {
    match verdict.as_str() {
        Some("agree") => true,
        Some("differ") => false,
        other => panic!("{other:?} is no verdict"),
    }
}

/// A pair agrees just where no pixel fails and all means agree; means within their 95 % interval do, those outside of
/// five times that do not.
fn is_consistent(pair: &Value) {
    let orders = pair["orders"].as_array().unwrap();
    for means in orders.iter().chain([pair]) {
        let [apart, error] = ["mean_difference", "mean_difference_error"].map(|field| means[field].as_f64().unwrap());
        if apart.abs() <= error && means != pair {
            assert!(agrees(&means["verdict"]), "{means}");
        }
        // Light that a tail of 1e-4 may leave out counts as none.
        if apart.abs() > 5.0 * error + 2e-4 {
            assert!(!agrees(&means["verdict"]), "{means}");
        }
    }
    let failing = pair["failing_pixels"].as_u64().unwrap();
    let orders_agree = orders.iter().all(|order| agrees(&order["verdict"]));
    if agrees(&pair["verdict"]) {
        assert!(failing == 0 && orders_agree, "{pair}");
    }
    if failing > 0 || !orders_agree {
        assert!(!agrees(&pair["verdict"]), "{pair}");
    }
}

#[test]
fn five_methods_agree_on_a_furnace_to_rounding() {
    let place = place(&[]);
    let report = report_of_mode(&place, &format!("compare furnace --mode global {QUICK}"));
    assert_eq!(names(&report).len(), 5);
    let pairs = report["pairs"].as_array().unwrap();
    assert_eq!(pairs.len(), 10);
    for pair in pairs {
        // Everything is E/(1 - rho) here, so the patch methods know it to the tail they leave, 1e-4 of the sum.
        let apart = pair["mean_difference"].as_f64().unwrap().abs();
        let error = pair["mean_difference_error"].as_f64().unwrap();
        assert!(apart < 2e-4 + 2.0 * error, "{pair}");
        assert_eq!((&pair["verdict"], &pair["failing_pixels"]), (&"agree".into(), &0.into()), "{pair}");
        is_consistent(pair);
    }
}

#[test]
fn the_report_has_its_fields_and_the_files_exist() {
    let place = place(&[]);
    let report = report_of_mode(&place, &format!("compare --mode one-bounce {QUICK}"));
    assert_eq!(report["scene"], "cornell-box");
    assert_eq!((&report["alpha"], &report["tau"]), (&0.0.into(), &0.0.into()));
    assert!(report["reference"].is_string());
    for method in report["methods"].as_array().unwrap() {
        let points = method["points"].as_array().unwrap();
        assert!(!points.is_empty() && method.get("slope").is_some());
        for point in points {
            assert!(point["seconds"].as_f64().unwrap() > 0.0);
            assert!(point["rms"].as_f64().unwrap() >= 0.0);
        }
    }
    for pair in report["pairs"].as_array().unwrap() {
        assert!(pair["a"].is_string() && pair["b"].is_string());
        is_consistent(pair);
        let orders = pair["orders"].as_array().unwrap();
        assert_eq!(orders.len(), 6);
        for (n, order) in orders.iter().enumerate() {
            assert_eq!(order["n"], n);
            let [apart, error] =
                ["mean_difference", "mean_difference_error"].map(|field| order[field].as_f64().unwrap());
            // Light ends after one bounce here: both are black beyond.
            assert!(n < 2 || (apart, error) == (0.0, 0.0), "{order}");
        }
    }
    let files = contents(&place);
    for file in report["files"].as_array().unwrap() {
        let name = file.as_str().unwrap().trim_start_matches("./");
        assert!(files.contains_key(name), "{name}");
    }
    assert!(files["cornell-box-compare-one-bounce.svg"].starts_with(b"<svg"));
}

#[test]
fn a_diverging_series_is_refused_before_any_path_is_traced() {
    let place = place(&[]);
    let ran = halflight(&place, &format!("compare furnished-room --mode shadowless {QUICK}"));
    assert_eq!(ran.code, Some(4), "{}", ran.err);
    assert!(ran.err.contains("spectral radius"), "{}", ran.err);
    assert!(contents(&place).is_empty());
}

#[test]
fn diff_reports_what_was_changed() {
    let place = place(&[]);
    let mut picture = Picture::filled(8, 6, Vec3::splat(0.5));
    let exposure = Exposure { stops: 0.0 };
    let path = |name: &str| place.path().join(name);
    write_picture(path("a.exr"), &picture, exposure).unwrap();
    picture.pixels[2 * 8 + 3].y = 0.75;
    write_picture(path("b.exr"), &picture, exposure).unwrap();
    let same = report(&place, "diff a.exr a.exr --out .");
    assert_eq!((same["rms"].as_f64(), same["e_pixel"].as_f64()), (Some(0.0), Some(0.0)));
    let found = report(&place, "diff b.exr a.exr --out .");
    let largest = &found["largest"];
    assert_eq!((largest["x"].as_u64(), largest["y"].as_u64()), (Some(3), Some(2)));
    assert_eq!(largest["value"].as_f64(), Some(0.25));
    // One channel of one of 48 pixels differs by half the reference's value.
    let rms = 0.5 / (48.0f64 * 3.0).sqrt();
    assert!((found["rms"].as_f64().unwrap() - rms).abs() < 1e-9);
    let e_pixel = 0.25 / 3f64.sqrt() / 48.0;
    assert!((found["e_pixel"].as_f64().unwrap() - e_pixel).abs() < 1e-9);
    assert!((found["mean_difference"][1].as_f64().unwrap() - 0.25 / 48.0).abs() < 1e-9);
    assert!(contents(&place).contains_key("b-minus-a.png"));
}

#[test]
fn a_picture_with_a_nan_has_no_error() {
    let place = place(&[]);
    let mut picture = Picture::filled(4, 4, Vec3::ONE);
    let exposure = Exposure { stops: 0.0 };
    write_picture(place.path().join("a.exr"), &picture, exposure).unwrap();
    picture.pixels[5].x = f32::NAN;
    write_picture(place.path().join("nan.exr"), &picture, exposure).unwrap();
    let ran = halflight(&place, "diff nan.exr a.exr -o d.png");
    assert_eq!(ran.code, Some(3), "{}", ran.err);
    assert!(ran.err.contains("column 1, row 1"), "{}", ran.err);
    assert!(!contents(&place).contains_key("d.png"));
}
