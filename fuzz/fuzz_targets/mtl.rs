//! Any text as a material library: `cargo +nightly fuzz run mtl`.
#![no_main]

use halflight::scene::{Scene, SceneError};
use libfuzzer_sys::fuzz_target;

const OBJ: &str = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n";

fuzz_target!(|text: &str| {
    let read = Scene::from_obj_text("s", OBJ, text);
    assert!(!matches!(read, Err(SceneError::Reader { .. })));
});
