//! `halflight figure`: its files, its report, and that panels show what `render` shows.

use halflight::pictures::{Bitmap, Exposure, read_picture};
use serde_json::Value;
use tempfile::TempDir;

use crate::run::{fields, files, halflight, place, report, succeed};

const SIZE: (usize, usize) = (36, 24);
const EFFORT: &str = "--size 36x24 --patches 300 --rays 64 --samples 16";

/// The codes of a PNG file.
fn codes(place: &TempDir, file: &str) -> Bitmap {
    let picture = read_picture(place.path().join(file)).unwrap();
    Bitmap::from_picture(&picture, Exposure::default())
}

/// The codes of a panel of a page, cut out where the report says it is.
fn panel(page: &Bitmap, panel: &Value) -> Bitmap {
    let [left, top] = ["left", "top"].map(|key| panel[key].as_u64().unwrap() as usize);
    let mut cut = Bitmap::filled(SIZE.0, SIZE.1, [0; 3]);
    for row in 0..SIZE.1 {
        let from = 3 * ((top + row) * page.width + left);
        let to = 3 * row * SIZE.0;
        cut.bytes[to..to + 3 * SIZE.0].copy_from_slice(&page.bytes[from..from + 3 * SIZE.0]);
    }
    cut
}

fn panels(report: &Value, page: usize) -> &Vec<Value> {
    report["pages"][page]["panels"].as_array().unwrap()
}

fn labels(report: &Value, page: usize) -> Vec<&str> {
    panels(report, page).iter().map(|p| p["label"].as_str().unwrap()).collect()
}

/// Every panel that has light shows some, and no two places of one page are the same.
fn are_lit(place: &TempDir, report: &Value) {
    for (number, page) in report["pages"].as_array().unwrap().iter().enumerate() {
        let drawn = codes(place, page["file"].as_str().unwrap());
        let mut places = Vec::new();
        for p in panels(report, number) {
            let cut = panel(&drawn, p);
            assert!(cut.bytes.iter().any(|&code| code > 60), "{p}");
            places.push((p["left"].as_u64(), p["top"].as_u64()));
        }
        places.sort();
        places.dedup();
        assert_eq!(places.len(), panels(report, number).len());
    }
}

#[test]
fn the_four_modes_are_those_of_render() {
    let place = place(&[]);
    let found = report(&place, &format!("figure 1 {EFFORT}"));
    assert_eq!(fields(&found), ["figure", "files", "height", "pages", "scene", "seconds", "width"]);
    assert_eq!((&found["figure"], &found["scene"]), (&"1".into(), &"gallery".into()));
    assert_eq!((&found["width"], &found["height"]), (&36.into(), &24.into()));
    assert_eq!(files(&place), ["out/gallery-figure-1.png", "out/gallery-figure-1.svg"]);
    assert_eq!(labels(&found, 0), ["global", "shadowless", "one-bounce", "local"]);
    let verdicts = panels(&found, 0).iter().map(|p| p["verdict"].as_str().unwrap());
    assert_eq!(verdicts.collect::<Vec<_>>(), ["converges", "converges", "ends", "ends"]);
    are_lit(&place, &found);
    let page = codes(&place, "out/gallery-figure-1.png");
    let stops = found["pages"][0]["stops"].as_f64().unwrap();
    succeed(&place, &format!("render gallery {EFFORT} --exposure {stops}"));
    for p in panels(&found, 0) {
        let alone = codes(&place, &format!("out/gallery-{}.png", p["label"].as_str().unwrap()));
        assert_eq!(panel(&page, p), alone, "{p}");
    }
    // Shadowless is brighter than global where the partition casts its shadow, and local than one-bounce.
    let sum = |k: usize| panel(&page, &panels(&found, 0)[k]).bytes.iter().map(|&b| u64::from(b)).sum::<u64>();
    assert!(sum(1) > sum(0) && sum(0) > sum(3) && sum(3) > sum(2));
}

#[test]
fn figure_1_meets_a_tolerance_and_hatches_what_diverges() {
    let place = place(&[]);
    let found = report(&place, "figure 1 --scene furnished-room --size 36x24 --tolerance 0.2");
    let [global, shadowless, ..] = &panels(&found, 0)[..] else { panic!("{found}") };
    assert!(global["error"].as_f64().unwrap() <= 0.2, "{global}");
    assert_eq!((&shadowless["verdict"], &shadowless["error"]), (&"diverges".into(), &Value::Null));
    let page = codes(&place, "out/furnished-room-figure-1.png");
    // Nothing in a hatched panel has a colour.
    assert!(panel(&page, shadowless).bytes.chunks_exact(3).all(|p| p[0] == p[1] && p[1] == p[2] && p[0] > 20));
}

#[test]
fn sums_of_the_series_stand_under_their_terms() {
    let place = place(&[]);
    let found = report(&place, &format!("figure series {EFFORT}"));
    are_lit(&place, &found);
    let labels = labels(&found, 0);
    assert_eq!(labels.len(), 4 * 6 + 4 * 2);
    assert_eq!(labels[..3], ["global: E", "global: KE", "global: K²E"]);
    assert_eq!(labels[labels.len() - 1], "local: L = E + KE");
    let page = codes(&place, "out/gallery-figure-series.png");
    let at = |label: &str| {
        let number = labels.iter().position(|l| *l == label).unwrap();
        (panel(&page, &panels(&found, 0)[number]), &panels(&found, 0)[number])
    };
    // Where a mode ends L is E + KE; later terms are brightened, sums are not.
    assert_ne!(at("one-bounce: KE").0, at("one-bounce: L = E + KE").0);
    assert!(at("global: K⁴E").1["gain"].as_f64() > Some(1.0));
    assert_eq!(at("global: L").1["gain"], 1.0);
    let diverging = report(&place, &format!("figure series --scene furnished-room {EFFORT}"));
    assert!(panels(&diverging, 0).iter().all(|p| p["mode"] != "shadowless"));
}

#[test]
fn the_square_has_the_modes_in_its_corners_and_repeats() {
    let (here, there) = (place(&[]), place(&[]));
    let found = report(&here, &format!("figure between {EFFORT}"));
    report(&there, &format!("figure between {EFFORT} --threads 1"));
    let names = ["-between-strips.png", "-between-strips.svg", "-between.png", "-between.svg"];
    assert_eq!(files(&here), names.map(|name| format!("out/gallery-figure{name}")));
    assert_eq!(crate::run::contents(&here), crate::run::contents(&there));
    are_lit(&here, &found);
    let modes: Vec<&str> = panels(&found, 0).iter().filter_map(|p| p["mode"].as_str()).collect();
    assert_eq!((modes, panels(&found, 0).len()), (vec!["global", "shadowless", "one-bounce", "local"], 25));
    let modes: Vec<&str> = panels(&found, 1).iter().filter_map(|p| p["mode"].as_str()).collect();
    assert_eq!((modes, panels(&found, 1).len()), (vec!["global", "local", "one-bounce", "shadowless"], 18));
    // One cast for all tau and one for each give the light of the corner within the noise of either.
    let stops = found["pages"][0]["stops"].as_f64().unwrap();
    succeed(&here, &format!("render gallery {EFFORT} --mode shadowless --exposure {stops}"));
    let page = codes(&here, "out/gallery-figure-between.png");
    let corner = panel(&page, panels(&found, 0).iter().find(|p| p["mode"] == "shadowless").unwrap());
    let alone = codes(&here, "out/gallery-shadowless.png");
    let apart = |(a, b): (&u8, &u8)| f64::from(a.abs_diff(*b));
    let mean = corner.bytes.iter().zip(&alone.bytes).map(apart).sum::<f64>() / corner.bytes.len() as f64;
    assert!(mean < 4.0, "{mean} codes apart");
}

#[test]
fn points_without_a_sum_are_hatched() {
    let place = place(&[]);
    let found = report(&place, &format!("figure between --scene furnished-room {EFFORT}"));
    let page = codes(&place, "out/furnished-room-figure-between.png");
    let hatched: Vec<&Value> = panels(&found, 0).iter().filter(|p| p["verdict"] == "diverges").collect();
    assert!(hatched.iter().any(|p| p["mode"] == "shadowless") && hatched.len() < 6, "{hatched:?}");
    for p in hatched {
        assert!(panel(&page, p).bytes.chunks_exact(3).all(|c| c[0] == c[1] && c[1] == c[2]), "{p}");
    }
}

#[test]
fn what_cannot_be_made_is_refused_before_any_work() {
    let place = place(&[]);
    let unknown = halflight(&place, "figure 9");
    assert_eq!(unknown.code, Some(2));
    assert!(["1", "series", "between"].iter().all(|name| unknown.err.contains(name)), "{}", unknown.err);
    let aimed = halflight(&place, "figure series --tolerance 0.1");
    assert_eq!(aimed.code, Some(2));
    assert!(aimed.err.contains("--samples"), "{}", aimed.err);
    assert!(!place.path().join("out").exists());
}

#[test]
fn figure_4_reports_what_pictures_differ_by_with_or_without_opengl() {
    let place = place(&[]);
    let found = report(&place, "figure 4 --size 32x32 --samples 16 --triangles 4000 --sweep");
    assert_eq!(fields(&found), ["area", "files", "opengl", "point_lights", "quadrature", "sweep", "tracer"]);
    let names = ["-sweep.png", "-sweep.svg", ".png", ".svg"];
    assert_eq!(files(&place), names.map(|name| format!("out/gallery-figure-4{name}")));
    let lights = found["point_lights"].as_array().unwrap();
    if found["opengl"].is_null() {
        assert!(lights.is_empty());
    } else {
        assert_eq!(fields(&found["opengl"]), ["renderer", "seconds", "version"]);
        assert_eq!(lights.len(), 8);
        assert!(lights.iter().all(|l| l["e_pixel"].as_f64().unwrap() < 0.02), "{lights:?}");
    }
    // The paper's 0.4 %, roughly since pixels are large here, and what Gouraud's interpolation adds on large triangles,
    // which the same five lights tell.
    let gouraud = lights.first().map_or(0.0, |l| l["e_pixel"].as_f64().unwrap());
    let error = found["area"]["e_pixel"].as_f64().unwrap();
    assert!((0.002..0.006 + gouraud).contains(&error), "{error}, {gouraud}");
    assert!(found["quadrature"]["e_pixel"].as_f64().unwrap() < 1e-5);
    assert!(found["tracer"]["e_pixel"].as_f64().unwrap() < 0.05);
    for swept in found["sweep"].as_array().unwrap() {
        let [ratio, error, exact] = ["ratio", "e_pixel", "closed_form"].map(|key| swept[key].as_f64().unwrap());
        assert!(ratio > 0.25 || (error / exact - 1.0).abs() < 0.05, "{swept}");
    }
}
