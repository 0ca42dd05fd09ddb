//! Any text as an LM-63 file: `cargo +nightly fuzz run photometry`.
#![no_main]

use halflight::scene::{LoadOptions, Scene, SceneError};
use libfuzzer_sys::fuzz_target;

const TOML: &str = "obj = \"s.obj\"\n[[lights]]\ntype = \"ies\"\nposition = [0, 0, 1]\nfile = \"l.ies\"\n";
const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

fuzz_target!(|text: &str| {
    let read = Scene::from_toml_text("s", TOML, OBJ, text, LoadOptions::default());
    assert!(!matches!(read, Err(SceneError::Reader { .. })));
});
