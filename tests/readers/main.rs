//! The readers of OBJ, MTL, glTF, LM-63 and scene files under texts that are almost right: no panic, no scene that
//! breaks the rules of [`Scene`], no error without words, no work out of proportion to the text.
//!
//! `HALFLIGHT_INPUTS=10000000 cargo test --test readers -- --ignored --nocapture` runs as many inputs as wanted and
//! tells the slowest; `HALFLIGHT_SEED` chooses others.

#[allow(dead_code)] // the export of scenes is for others
#[path = "../gltf/glb.rs"]
mod glb;
mod gltf;
mod large;
mod mutate;

use std::panic::catch_unwind;
use std::time::Instant;

use halflight::scene::{LoadOptions, Scene, SceneError, THINNEST};
use miette::Diagnostic;
use mutate::Texts;
use proptest::prelude::*;
use rayon::prelude::*;

/// A result is right where the scene keeps every rule, or the error speaks.
pub fn check(result: Result<Scene, SceneError>) -> bool {
    match result {
        Ok(scene) => {
            check_scene(&scene);
            true
        }
        Err(error) => {
            assert!(!matches!(error, SceneError::Reader { .. }), "{error}");
            let message = error.to_string();
            assert!(!message.is_empty() && message.len() < 4096, "{message}");
            assert!(error.help().is_some());
            false
        }
    }
}

fn check_scene(scene: &Scene) {
    assert!(!scene.faces.is_empty());
    let inside = |v: &glam::Vec3| v.is_finite() && v.abs().max_element() <= 1.0 + 1e-6;
    assert!(scene.vertices.iter().all(inside), "{:?}", scene.vertices);
    for (i, face) in scene.faces.iter().enumerate() {
        assert!((face.material as usize) < scene.materials.len());
        assert!((face.object as usize) < scene.objects.len());
        let area = scene.area(i as u32);
        assert!(area.is_finite() && area > 0.0);
        let [a, b, c] = scene.corners(i as u32).map(|p| p.as_dvec3());
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        assert!(2.0 * area / longest >= 0.999 * THINNEST);
    }
    for m in &scene.materials {
        assert!(m.rho.min_element() >= 0.0 && m.rho.max_element() <= 1.0);
        assert!(m.emission.is_finite() && m.emission.min_element() >= 0.0);
        assert!(m.check_transport().is_ok());
    }
    let camera = &scene.camera;
    assert!(camera.position.is_finite());
    assert!((camera.forward.length() - 1.0).abs() < 1e-4 && (camera.up.length() - 1.0).abs() < 1e-4);
    assert!(camera.vertical_fov > 0.0 && camera.vertical_fov < 180.0);
    assert!(scene.frame.scale > 0.0 && scene.frame.center.is_finite());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4096))]

    #[test]
    fn texts_almost_right_are_read_or_refused(seed: u64) {
        check(Texts::new(seed).read());
    }

    #[test]
    fn any_text_is_read_or_refused(toml in ".{0,60}", obj in "[-vfolg0-9. /\\\\#\r\n]{0,80}", mtl in ".{0,60}") {
        check(Scene::from_obj_text("s", &obj, &mtl));
        check(Scene::from_toml_text("s", &toml, &obj, &mtl, LoadOptions::default()));
    }
}

/// A plate under a luminaire of some file.
fn with_luminaire(file: &str) -> Result<Scene, SceneError> {
    const TOML: &str =
        "obj = \"s.obj\"\nup = [0, 0, 1]\n[[lights]]\ntype = \"ies\"\nposition = [0, 0, 1]\nfile = \"l.ies\"\n";
    const PLATE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
    Scene::from_toml_text("s", TOML, PLATE, file, LoadOptions::default())
}

/// What lines of LM-63 files hold, right and wrong.
fn photometry() -> impl Strategy<Value = String> {
    let line = prop::sample::select(vec![
        "IESNA:LM-63-2002",
        "IES:LM-63-2019",
        "IESNA91",
        "[TEST] a",
        "Tilt head",
        "TILT=NONE",
        "TILT=INCLUDE",
        "TILT = none",
        "1 -1 1 2 1 1 2 0 0 0",
        "1 1 10",
        "1",
        "2",
        "0 90",
        "0",
        "1 0.5",
        "100 0",
        "1 -1 1 2 1 1 2 0 0 0 1 1 10",
        "\u{1a}",
        "",
        "1e400 nan",
        "-1",
        "100,0",
        "99999999999 1 1",
    ]);
    let end = prop::sample::select(vec!["\n", "\r\n", "\r", " ", "\0"]);
    prop::collection::vec((line, end), 0..16).prop_map(|parts| parts.iter().map(|(a, b)| format!("{a}{b}")).collect())
}

const LUMINAIRE: &str =
    "IESNA:LM-63-2002\nTILT=INCLUDE\n1\n2\n0 90\n1 0.5\n1 -1 1 2 1 1 2 0 0 0\n1 1 10\n0 90\n0\n100 0\n";

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2048))]

    #[test]
    fn any_photometry_is_read_or_refused(text in photometry(), at: prop::sample::Index, byte in 0_u8..128) {
        check(with_luminaire(&text));
        let mut bytes = LUMINAIRE.as_bytes().to_vec();
        let at = at.index(bytes.len());
        bytes[at] = byte;
        check(with_luminaire(&String::from_utf8(bytes).expect("ASCII")));
        check(with_luminaire(&LUMINAIRE[..at]));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    /// Files may hold anything, UTF-8 or not.
    #[test]
    fn any_bytes_are_read_or_refused(seed: u64, at: prop::sample::Index, byte: u8) {
        let place = tempfile::tempdir().unwrap();
        let texts = Texts::new(seed);
        let mut files = [
            ("s.obj", texts.obj.into_bytes()),
            ("m.mtl", texts.mtl.into_bytes()),
            ("s.toml", texts.toml.unwrap_or("obj = \"s.obj\"".into()).into_bytes()),
        ];
        let broken = &mut files[(seed >> 32) as usize % 3].1;
        broken.push(b'\n');
        let at = at.index(broken.len());
        broken[at] = byte;
        for (name, bytes) in &files {
            std::fs::write(place.path().join(name), bytes).unwrap();
        }
        for name in ["s.obj", "s.toml"] {
            check(Scene::load(&place.path().join(name), LoadOptions::default()));
        }
    }
}

fn setting(name: &str, default: u64) -> u64 {
    std::env::var(name).map_or(default, |value| value.parse().unwrap())
}

#[test]
#[ignore = "minutes of work; a sample of it runs above"]
fn millions_of_texts() {
    let (count, seed) = (setting("HALFLIGHT_INPUTS", 1_000_000), setting("HALFLIGHT_SEED", 0));
    let start = Instant::now();
    let one = |i: u64| {
        let own = (i + seed).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let clock = Instant::now();
        let read = catch_unwind(|| check(Texts::new(own).read()));
        let read = read.unwrap_or_else(|_| panic!("seed {own}"));
        (clock.elapsed().as_secs_f64(), own, u64::from(read))
    };
    let worse = |a: (f64, u64, u64), b: (f64, u64, u64)| {
        let slow = if a.0 > b.0 { a } else { b };
        (slow.0, slow.1, a.2 + b.2)
    };
    let (slowest, which, read) = (0..count).into_par_iter().map(one).reduce(|| (0.0, 0, 0), worse);
    println!(
        "{count} inputs in {:.0} s, {read} of them scenes; the slowest took {slowest:.4} s (seed {which}); peak memory {} KiB",
        start.elapsed().as_secs_f64(),
        large::peak().unwrap_or(0),
    );
}
