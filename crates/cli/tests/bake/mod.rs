//! `halflight bake`: its files, its errors; and in a real viewer whether a baked room looks as it is rendered.
//!
//! The viewer is three.js in Chromium without a window, as `explore`'s tests find it; HALFLIGHT_PLAYWRIGHT names the
//! folder of the npm package playwright-core, beside which npm's `three` is looked for. Tests say that they were
//! skipped where these are missing. Not handled: other viewers.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use halflight::light::Rgb;
use halflight::pictures::read_layers;
use serde_json::Value;

use crate::explore::browser;
use crate::run::{halflight, place, report, succeed};

/// What the picture of a viewer, eight bits a channel and filtered maps, may differ by from a rendered one.
const ALLOWED: f64 = 0.02;
/// Pixels to a side of the pictures compared.
const SIDE: usize = 96;

#[test]
fn a_bake_leaves_maps_a_model_and_a_list_of_them() {
    let place = place(&[]);
    let found =
        report(&place, "bake cornell-box --texels 48 --tolerance 0.1 --per luminaire --standard-error -o baked");
    let files =
        ["cornell-box.glb", "cornell-box-lightmaps.json", "cornell-box-lightmap.png", "cornell-box-lightmap-light.exr"];
    files.iter().for_each(|file| assert!(place.path().join("baked").join(file).is_file(), "{file}"));
    let listed: Value =
        serde_json::from_slice(&fs::read(place.path().join("baked/cornell-box-lightmaps.json")).unwrap()).unwrap();
    assert_eq!(listed, found, "what is printed is what is written");
    assert_eq!((&found["maps"][0]["lamp"], &found["maps"][1]["lamp"]), (&Value::Null, &"light".into()));
    assert!(found["met"] == true && found["error"]["total"].as_f64().unwrap() <= 0.1);
    assert_eq!(found["objects"][0]["uv_rect"], serde_json::json!([0.0, 0.0, 1.0, 1.0]));
    let layers = read_layers(place.path().join("baked/cornell-box-lightmap.exr")).unwrap();
    assert_eq!(layers.len(), 2, "the map and its standard error");
    // Any number of threads makes the same bytes.
    succeed(&place, "bake cornell-box --texels 48 --tolerance 0.1 --per luminaire --threads 1 -o alone");
    let bytes = |folder: &str, file: &str| fs::read(place.path().join(folder).join(file)).unwrap();
    ["cornell-box.glb", "cornell-box-lightmap-light.png"]
        .iter()
        .for_each(|f| assert_eq!(bytes("baked", f), bytes("alone", f)));
}

#[test]
fn a_volume_is_a_texture_or_coefficients() {
    let place = place(&[]);
    let found = report(&place, "bake cornell-box --volume 2x3x2 --tolerance 0.2 -o baked");
    assert_eq!((&found["grid"][1], &found["kind"]), (&3.into(), &"ambient cube".into()));
    // Header, description, and six half floats of four channels a point.
    let bytes = fs::read(place.path().join("baked/cornell-box-volume.ktx2")).unwrap();
    assert!(bytes.starts_with(b"\xABKTX 20\xBB") && bytes.len() >= 12 * 6 * 8);
    succeed(&place, "bake cornell-box --volume 2x2x2 --keep harmonics --tolerance 0.2 -o baked");
    assert!(fs::read(place.path().join("baked/cornell-box-volume.npz")).unwrap().starts_with(b"PK"));
}

#[test]
fn what_cannot_be_baked_says_so_and_leaves_nothing() {
    let place = place(&[]);
    for (arguments, code, words) in [
        ("bake cornell-box --indirect --per luminaire -o baked", 2, "--per luminaire"),
        ("bake cornell-box --mode all -o baked", 2, "one mode"),
        ("bake cornell-box --volume 4x4 -o baked", 2, "XxYxZ"),
        ("bake cornell-box --keep harmonics -o baked", 2, "--volume"),
        ("bake cornell-box --texels 16 --padding 8 -o baked", 3, "do not fit"),
        ("bake no-such-scene -o baked", 3, "no-such-scene"),
    ] {
        let ran = halflight(&place, arguments);
        assert_eq!(ran.code, Some(code), "{arguments}: {}", ran.err);
        assert!(ran.err.contains(words), "{arguments}: {}", ran.err);
    }
    assert!(!place.path().join("baked").exists());
}

/// npm's three beside playwright-core, or nothing, which is said.
fn packages() -> Option<(PathBuf, PathBuf)> {
    let playwright = std::env::var_os("HALFLIGHT_PLAYWRIGHT").map(PathBuf::from);
    let found = playwright.and_then(|own| Some((own.clone(), own.parent()?.join("three"))));
    let found = found.filter(|(playwright, three)| playwright.is_dir() && three.is_dir());
    if found.is_none() {
        eprintln!("skipped: HALFLIGHT_PLAYWRIGHT names no playwright-core with three beside it");
    }
    found
}

/// The Cornell box in three.js, by its `MOZ_lightmap` alone, is what `render` shows by the same camera.
#[test]
fn a_baked_room_in_three_js_is_the_rendered_one() {
    let (Some(browser), Some((playwright, three))) = (browser(), packages()) else { return };
    let place = place(&[]);
    succeed(&place, "bake cornell-box --texels 512 --tolerance 0.01 -o baked");
    succeed(
        &place,
        &format!("render cornell-box --mode global --tolerance 0.01 --size {SIDE} --layers bounces -o r.exr"),
    );
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut show = Command::new("node");
    show.arg(own.join("tests/bake/show.mjs")).args([&playwright, &three, &browser]);
    show.arg(own.join("../bake/viewer")).arg(place.path().join("baked/cornell-box.glb"));
    let ran = show.arg(SIDE.to_string()).arg(place.path().join("shot.png")).output().expect("node");
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    let found: Value = serde_json::from_slice(&ran.stdout).expect("JSON");
    assert_eq!((&found["webgl2"], &found["errors"]), (&true.into(), &serde_json::json!([])));
    let numbers: Vec<f32> = found["pixels"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap() as f32).collect();
    let shown: Vec<Rgb> = numbers.chunks_exact(3).map(Rgb::from_slice).collect();
    let layers = read_layers(place.path().join("r.exr")).unwrap();
    let layer = |name: &str| &layers.iter().find(|layer| layer.name == name).unwrap().picture.pixels;
    let (rendered, emitted) = (layer(""), layer("bounce.0"));
    let (mut apart, mut squares) = (0.0, 0.0);
    for k in (0..SIDE * SIDE).filter(|k| emitted[*k] == Rgb::ZERO) {
        apart += f64::from(shown[k].distance_squared(rendered[k]));
        squares += f64::from(rendered[k].length_squared());
    }
    let rms = (apart / squares).sqrt();
    assert!(rms < ALLOWED && squares > 1.0, "{rms}");
}
