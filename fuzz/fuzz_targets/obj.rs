//! Any text as an OBJ, with a library that defines `a`: `cargo +nightly fuzz run obj`.
#![no_main]

use halflight::scene::{Scene, SceneError};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let read = Scene::from_obj_text("s", text, "newmtl a\nKd .5\nKe 1\n");
    // The check made before must let nothing through that the OBJ crate reads otherwise.
    assert!(!matches!(read, Err(SceneError::Reader { .. })));
});
