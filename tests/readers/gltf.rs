//! GLB files that are almost right: changes to the words of their JSON, to their numbers, and to the chunks.

use std::panic::catch_unwind;

use halflight::scene::Scene;
use proptest::prelude::*;
use rayon::prelude::*;

use crate::glb::{bytes, glb};
use crate::mutate::{Random, change};
use crate::{check, setting};

/// A valid file that uses what the reader knows: instances, a strip, a sparse accessor, cameras, lights, textures,
/// a skin.
const JSON: &str = r#"{
 "asset": { "version": "2.0" }, "scene": 0,
 "scenes": [ { "nodes": [ 0, 3 ] } ],
 "nodes": [
  { "mesh": 0, "children": [ 1, 2 ], "name": "a", "scale": [ 1, 2, -1 ], "extensions": { "KHR_lights_punctual": { "light": 0 } } },
  { "mesh": 1, "translation": [ 1, 0, 3 ], "rotation": [ 0, 0, 1, 0 ],
    "extensions": { "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": 8, "SCALE": 8, "ROTATION": 4 } } } },
  { "camera": 0, "matrix": [ 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1 ] },
  { "mesh": 0, "camera": 1, "skin": 0, "extras": [ 1 ], "extensions": { "KHR_lights_punctual": { "light": 1 } } } ],
 "cameras": [ { "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1 } },
  { "type": "orthographic", "orthographic": { "xmag": 1, "ymag": 1, "znear": 0, "zfar": 1 } } ],
 "extensions": { "KHR_lights_punctual": { "lights": [
  { "type": "spot", "intensity": 5, "spot": { "innerConeAngle": 0.1, "outerConeAngle": 0.6 } },
  { "type": "directional", "color": [ 1, 0.5, 0 ] } ] } },
 "meshes": [ { "primitives": [
   { "attributes": { "POSITION": 0, "TEXCOORD_0": 3 }, "indices": 1, "material": 0 },
   { "attributes": { "POSITION": 0, "JOINTS_0": 5, "WEIGHTS_0": 6, "_ID": 1, "COLOR_0": 6 }, "indices": 1, "mode": 5 } ] },
  { "name": "fan", "primitives": [ { "attributes": { "POSITION": 2 }, "mode": 6, "material": 1 } ] } ],
 "materials": [
  { "name": "grey", "pbrMetallicRoughness": { "baseColorFactor": [ 0.5, 0.5, 0.5, 1 ],
    "baseColorTexture": { "index": 0, "extensions": { "KHR_texture_transform": { "scale": [ 2, 2 ], "rotation": 1 } } } },
    "alphaMode": "BLEND", "emissiveTexture": { "index": 1 }, "doubleSided": true },
  { "emissiveFactor": [ 1, 1, 1 ], "extensions": {
    "KHR_materials_pbrSpecularGlossiness": { "diffuseFactor": [ 1, 0.5, 0.5, 1 ], "diffuseTexture": { "index": 1 } },
    "KHR_materials_emissive_strength": { "emissiveStrength": 9 } } } ],
 "accessors": [
  { "bufferView": 0, "componentType": 5126, "count": 5, "type": "VEC3", "min": [ 0, 0, 0 ], "max": [ 1, 2, 0 ] },
  { "bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR" },
  { "bufferView": 0, "byteOffset": 12, "componentType": 5126, "count": 4, "type": "VEC3",
    "sparse": { "count": 1, "indices": { "bufferView": 1, "componentType": 5123 }, "values": { "bufferView": 0 } } },
  { "bufferView": 0, "componentType": 5126, "count": 5, "type": "VEC2" },
  { "bufferView": 1, "componentType": 5120, "normalized": true, "count": 3, "type": "VEC4", "byteOffset": 0 },
  { "componentType": 5121, "count": 5, "type": "VEC4" },
  { "bufferView": 2, "componentType": 5121, "normalized": true, "count": 5, "type": "VEC4" },
  { "componentType": 5126, "count": 1, "type": "MAT4", "byteOffset": 0,
    "sparse": { "count": 1, "indices": { "bufferView": 1, "componentType": 5123 }, "values": { "bufferView": 3 } } },
  { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" } ],
 "skins": [ { "joints": [ 1 ], "inverseBindMatrices": 7 } ],
 "textures": [ { "source": 0, "sampler": 0 }, { "source": 1, "extensions": { "EXT_texture_webp": { "source": 2 } } } ], "samplers": [ { "wrapS": 33071, "magFilter": 9728 } ],
 "images": [ { "uri": "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAIAAAACCAYAAABytg0kAAAAGUlEQVR42gXBsQEAAAjDINZ+7ecRRHLIth43MQWXzZkelAAAAABJRU5ErkJggg==" }, { "bufferView": 1, "mimeType": "image/png" },
  { "uri": "data:image/webp;base64,UklGRjAAAABXRUJQVlA4TCMAAAAvAUAAEB8w/wKCIv9H23+BAMG5c8GNKkFN2wYsfpOOiP7HAQA=" } ],
 "bufferViews": [ { "buffer": 0, "byteLength": 60, "byteStride": 12 },
  { "buffer": 0, "byteOffset": 60, "byteLength": 12 }, { "buffer": 0, "byteLength": 20 },
  { "buffer": 0, "byteOffset": 4, "byteLength": 64 } ],
 "buffers": [ { "byteLength": 72 } ] }"#;

const POINTS: [[f32; 3]; 5] = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.5], [0.0, 1.0, 0.0], [0.0, 2.0, 0.0]];

/// A file of a seed: up to four changes to the JSON, up to two to the numbers, seldom one to all bytes.
fn file(seed: u64) -> Vec<u8> {
    let mut random = Random(seed);
    let mut json = JSON.to_owned();
    for _ in 0..random.below(5) {
        json = if random.below(3) == 0 { swap_digit(&json, &mut random) } else { change(json, &mut random) };
    }
    let mut numbers = bytes(&POINTS, &[0, 1, 2, 0, 2, 3]);
    for _ in 0..random.below(3) {
        let at = random.below(numbers.len());
        numbers[at] = random.below(256) as u8;
    }
    let mut all = glb(&json, &numbers);
    if random.below(8) == 0 {
        let at = random.below(all.len());
        match random.below(3) {
            0 => all.truncate(at),
            1 => all[at.min(24)] = random.below(256) as u8,
            _ => all[at] = random.below(256) as u8,
        }
    }
    all
}

/// Puts another digit in the place of one: the text stays JSON, and indices, counts and offsets are wrong.
fn swap_digit(json: &str, random: &mut Random) -> String {
    let digits: Vec<usize> = json.match_indices(|c: char| c.is_ascii_digit()).map(|digit| digit.0).collect();
    if digits.is_empty() {
        return json.to_owned();
    }
    let at = digits[random.below(digits.len())];
    format!("{}{}{}", &json[..at], random.below(10), &json[at + 1..])
}

fn read(seed: u64) -> bool {
    check(Scene::from_gltf_bytes("s", &file(seed)))
}

#[test]
fn the_file_that_is_changed_is_right() {
    assert!(check(Scene::from_gltf_bytes("s", &glb(JSON, &bytes(&POINTS, &[0, 1, 2, 0, 2, 3])))));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4096))]

    #[test]
    fn files_almost_right_are_read_or_refused(seed: u64) {
        read(seed);
    }
}

#[test]
#[ignore = "minutes of work; a sample of it runs above"]
fn a_million_files() {
    let (count, seed) = (setting("HALFLIGHT_INPUTS", 1_000_000), setting("HALFLIGHT_SEED", 0));
    let one = |i: u64| {
        let own = (i + seed).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        u64::from(catch_unwind(|| read(own)).unwrap_or_else(|_| panic!("seed {own}")))
    };
    let scenes: u64 = (0..count).into_par_iter().map(one).sum();
    println!("{count} files, {scenes} of them scenes, none a panic");
}
