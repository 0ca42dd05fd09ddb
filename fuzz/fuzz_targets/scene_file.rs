//! Any text as a scene file: `cargo +nightly fuzz run scene_file`.
#![no_main]

use halflight::scene::{LoadOptions, Scene, SceneError};
use libfuzzer_sys::fuzz_target;

const OBJ: &str = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n";

fuzz_target!(|text: &str| {
    let read = Scene::from_toml_text("s", text, OBJ, "newmtl a\nKe 1\n", LoadOptions::default());
    assert!(!matches!(read, Err(SceneError::Reader { .. })));
});
