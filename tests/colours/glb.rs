//! Colours of vertices in glTF (`COLOR_0`): every type, RGB and RGBA, and what alpha does.

use glam::{Vec3, Vec4Swizzles};
use halflight::scene::textures::Mask;
use halflight::scene::{DEFAULT_RHO, Scene, SceneError};
use serde_json::{Value, json};

use super::near;
use crate::gltf::glb;

/// How colours are stored.
struct Stored {
    kind: u32,
    parts: &'static str,
    normalized: bool,
    bytes: Vec<u8>,
}

/// A triangle with colours and a second one without, both of material 0 and at a node each.
fn read(stored: &Stored, material: &Value, mirrored: bool) -> Result<Scene, SceneError> {
    let points: [[f32; 3]; 3] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mut binary: Vec<u8> = points.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    binary.extend(&stored.bytes);
    let size = stored.bytes.len();
    let scale = if mirrored { -1.0 } else { 1.0 };
    let json = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"mesh": 0, "name": "coloured", "scale": [scale, 1, 1]}, {"mesh": 1, "name": "plain", "translation": [5, 0, 0]}],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0, "COLOR_0": 1}, "material": 0}]},
            {"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "materials": [material],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": stored.kind, "count": 3, "type": stored.parts, "normalized": stored.normalized}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": size}],
        "buffers": [{"byteLength": 36 + size}],
    });
    Scene::from_gltf_bytes("s", &glb::glb(&json.to_string(), &binary))
}

const COLOURS: [[f32; 4]; 3] = [[1.0, 0.2, 0.0, 0.4], [0.0, 0.6, 0.2, 1.0], [0.4, 0.0, 1.0, 0.2]];

fn floats(parts: usize) -> Vec<u8> {
    COLOURS.iter().flat_map(|colour| &colour[..parts]).flat_map(|x| x.to_le_bytes()).collect()
}

fn rgba() -> Stored {
    Stored { kind: 5126, parts: "VEC4", normalized: false, bytes: floats(4) }
}

fn material(mode: &str, alpha: f32) -> Value {
    let base = json!({"baseColorFactor": [0.5, 0.5, 0.5, alpha], "metallicFactor": 0});
    json!({"name": "m", "alphaMode": mode, "pbrMetallicRoughness": base})
}

#[test]
fn every_type_of_colour_is_read() {
    let eight = COLOURS.iter().flat_map(|c| c.map(|x| (255.0 * x).round() as u8)).collect();
    // Three bytes a vertex, without padding.
    let three = COLOURS.iter().flat_map(|c| [c[0], c[1], c[2]].map(|x| (255.0 * x).round() as u8)).collect();
    let sixteen =
        COLOURS.iter().flat_map(|c| c.map(|x| (65535.0 * x).round() as u16)).flat_map(u16::to_le_bytes).collect();
    for (kind, parts, normalized, bytes) in [
        (5126, "VEC3", false, floats(3)),
        (5126, "VEC4", false, floats(4)),
        (5121, "VEC4", true, eight),
        (5121, "VEC3", true, three),
        (5123, "VEC4", true, sixteen),
    ] {
        for mirrored in [false, true] {
            let stored = Stored { kind, parts, normalized, bytes: bytes.clone() };
            let scene = read(&stored, &material("OPAQUE", 1.0), mirrored).unwrap();
            assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
            let places = [Vec3::ZERO, if mirrored { Vec3::NEG_X } else { Vec3::X }, Vec3::Y];
            for (place, colour) in places.iter().zip(COLOURS) {
                let at = scene.frame.to_unit(place.as_dvec3()).as_vec3();
                near(scene.rho_at(0, at), 0.5 * Vec3::new(colour[0], colour[1], colour[2]));
            }
            // The other node's are white, and alpha counts nowhere.
            near(scene.means_of_face(1).rho.as_vec3(), Vec3::splat(0.5));
            assert_eq!(scene.means_of_face(0).coverage, 1.0);
        }
    }
}

#[test]
fn alpha_is_a_factor_on_the_mask_where_there_is_one() {
    for (mode, factor, expected) in [
        ("BLEND", 1.0, [0.4f32, 1.0, 0.2]),
        ("BLEND", 0.5, [0.2, 0.5, 0.1]),
        ("MASK", 1.0, [0.0, 1.0, 0.0]),
        ("OPAQUE", 0.5, [1.0; 3]),
    ] {
        let scene = read(&rgba(), &material(mode, factor), false).unwrap();
        let mask = scene.materials[0].maps.as_ref().unwrap().mask.clone();
        let share = |alpha: f32| mask.as_ref().map_or(1.0, |mask: &Mask| mask.at(glam::DVec2::ZERO, alpha));
        let found = scene.colours[0].map(|colour| share(colour.w));
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{mode} {factor}: {found:?}");
        // A mean over 576 points of an alpha that is linear is that of the corners but for rounding.
        let mean = expected.iter().sum::<f32>() / 3.0;
        let coverage = scene.means_of_face(0).coverage;
        assert!(mode == "MASK" || (coverage - f64::from(mean)).abs() < 1e-6, "{mode} {factor}: {coverage} {mean}");
        assert!(mode != "OPAQUE" || scene.colours[0].iter().all(|colour| colour.w == 1.0));
    }
}

#[test]
fn a_white_material_reflects_its_colours() {
    let white = json!({"name": "m", "pbrMetallicRoughness": {"metallicFactor": 0}});
    let scene = read(&rgba(), &white, false).unwrap();
    near(
        scene.means_of_face(0).rho.as_vec3(),
        COLOURS.map(glam::Vec4::from_array).iter().sum::<glam::Vec4>().xyz() / 3.0,
    );
    near(scene.means_of_face(1).rho.as_vec3(), Vec3::splat(DEFAULT_RHO));
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    // White colours say no more than a white material.
    let bytes: Vec<u8> = [1.0f32; 9].iter().flat_map(|x| x.to_le_bytes()).collect();
    let blank = Stored { kind: 5126, parts: "VEC3", normalized: false, bytes };
    let scene = read(&blank, &white, false).unwrap();
    near(scene.means_of_face(0).rho.as_vec3(), Vec3::splat(DEFAULT_RHO));
    assert!(scene.warnings.len() == 1 && scene.warnings[0].contains("white base colour"), "{:?}", scene.warnings);
}

#[test]
fn colours_that_are_none_are_clamped_or_refused() {
    let odd: Vec<u8> =
        [2.0f32, -1.0, f32::NAN, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5].iter().flat_map(|x| x.to_le_bytes()).collect();
    let stored = Stored { kind: 5126, parts: "VEC3", normalized: false, bytes: odd };
    let scene = read(&stored, &material("OPAQUE", 1.0), false).unwrap();
    assert!(scene.warnings.len() == 1 && scene.warnings[0].contains("outside 0..1"), "{:?}", scene.warnings);
    assert_eq!(scene.colours[0][0].to_array(), [1.0, 0.0, 0.0, 1.0]);
    let short = Stored { kind: 5126, parts: "SCALAR", normalized: false, bytes: floats(3) };
    let error = read(&short, &material("OPAQUE", 1.0), false).unwrap_err().to_string();
    assert!(error.contains("node `coloured`: accessor 1"), "{error}");
}

#[test]
fn a_material_of_alpha_without_an_image_lacks_no_coordinates() {
    let stored = Stored {
        kind: 5126,
        parts: "VEC3",
        normalized: false,
        bytes: [0.5f32; 9].iter().flat_map(|x| x.to_le_bytes()).collect(),
    };
    let scene = read(&stored, &material("BLEND", 0.3), false).unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    assert!((scene.means_of_face(1).coverage - 0.3).abs() < 1e-6);
}
