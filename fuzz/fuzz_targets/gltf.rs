//! Any bytes as a glTF file: `cargo +nightly fuzz run gltf`.
#![no_main]

use halflight::scene::Scene;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let _ = Scene::from_gltf_bytes("s", bytes);
});
