//! A glTF file's cameras, chosen by name.

#[path = "../../../tests/gltf/glb.rs"]
#[allow(dead_code, reason = "the core's tests use all of it")]
mod glb;

use std::fs;

use glb::{bytes, glb};
use serde_json::json;

use crate::run::{SMALL, halflight, place, succeed};

#[test]
fn the_program_renders_a_glb_through_a_camera_by_name() {
    let place = place(&[]);
    let glow = json!({"name": "m", "emissiveFactor": [1, 1, 1], "pbrMetallicRoughness": {"metallicFactor": 0,
        "baseColorFactor": [0.5, 0.5, 0.5, 1]}});
    let json = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "children": [1, 2]}, {"camera": 0, "name": "away", "translation": [0, 0, -9]},
            {"camera": 0, "name": "near", "translation": [0.5, 0.5, 1]}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 1}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [glow],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 6}],
        "buffers": [{"byteLength": 42}],
    });
    let triangle = bytes(&[[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]], &[0, 1, 2]);
    fs::write(place.path().join("s.glb"), glb(&json.to_string(), &triangle)).unwrap();
    let mean = |arguments: &str| {
        succeed(&place, &format!("render s.glb {arguments} --mode local -o s.exr {}", SMALL));
        let picture = halflight::pictures::read_picture(place.path().join("s.exr")).unwrap();
        picture.pixels.iter().map(|p| f64::from(p.x)).sum::<f64>() / picture.pixels.len() as f64
    };
    assert_eq!(mean(""), 0.0);
    assert!(mean("--camera near") > 0.3);
    let ran = halflight(&place, "render s.glb --camera far");
    assert_eq!(ran.code, Some(3));
    assert!(ran.err.contains("no camera `far`") && ran.err.contains("away, near"), "{}", ran.err);
}
