//! Files that break the rules of glTF, or would take more memory than they have bytes: refused with what is wrong.
//!
//! `HALFLIGHT_FILES=DIR cargo test --test all gltf:: -- --ignored --nocapture` reads every glTF file under a folder and
//! tells what came of it.

use std::path::{Path, PathBuf};

use halflight::scene::{LoadOptions, Scene, SceneError};
use serde_json::{Value, json};

use crate::gltf::glb::glb;
use crate::gltf::{base, binary, with};

#[track_caller]
fn refused(result: Result<Scene, SceneError>, part: &str) {
    let message = result.map(|_| ()).expect_err("must be refused").to_string();
    assert!(message.contains(part) && message.contains("s.gltf"), "{message}");
}

#[test]
fn broken_files_are_refused_with_what_is_wrong() {
    for (path, value, part) in [
        ("/asset/version", json!("1.0"), "it is glTF 1.0"),
        ("/asset/version", json!(1), "it is glTF 1;"),
        ("/nodes/0/mesh", json!(7), "node 0: it names mesh 7, but there are 1 of them"),
        ("/nodes/0/children", json!([0]), "node 0 is met twice"),
        ("/nodes/0/rotation", json!([0, 0, 0, 0]), "the transform of node 0 is not finite"),
        ("/nodes/0/scale", json!([1e39, 1, 1]), "number out of range"),
        (
            "/meshes/0/primitives/0/attributes/POSITION",
            json!(9),
            "node `thing`: it names accessor 9, but there are 2 of them",
        ),
        ("/accessors/0/count", json!(6), "accessor 0: 6 elements of 12 bytes do not fit into the 60 of buffer view 0"),
        ("/accessors/0/count", json!(u64::MAX), "points and corners"),
        ("/accessors/0/byteOffset", json!(u64::MAX), "do not fit"),
        ("/accessors/0/componentType", json!(5126.5), "its JSON is not that of glTF 2.0"),
        ("/accessors/0/type", json!("VEC2"), "accessor 0: its type is VEC2, not VEC3"),
        ("/accessors/1/byteOffset", json!(6), "do not fit"),
        ("/accessors/0/count", json!(2), "accessor 1: index 2, but there are 2 vertices"),
        ("/accessors/1/componentType", json!(5126), "accessor 1"),
        ("/bufferViews/0/byteLength", json!(73), "buffer view 0 goes beyond buffer 0"),
        ("/bufferViews/0/byteOffset", json!(u64::MAX), "buffer view 0 goes beyond buffer 0"),
        ("/bufferViews/0/byteStride", json!(8), "overlap"),
        ("/buffers/0/byteLength", json!(73), "buffer 0 has 72 bytes, not the 73"),
        ("/buffers/0/uri", json!("data:;base64,@"), "the data URI of buffer 0 cannot be decoded"),
        ("/buffers/0/uri", json!("/no/such.bin"), "cannot read buffer 0, `/no/such.bin`"),
        ("/materials/0/emissiveFactor", json!([-1, 0, 0]), "material 0: material `m` emits -1"),
        ("/extensionsRequired", json!(["KHR_draco_mesh_compression"]), "not supported: KHR_draco_mesh_compression"),
    ] {
        println!("{path} {value}");
        refused(with(&[(path, value)]), part);
    }
    let whole = glb(&base().to_string(), &binary());
    for length in 0..whole.len() {
        assert!(Scene::from_gltf_bytes("s", &whole[..length]).is_err());
    }
}

#[test]
fn deep_graphs_and_many_instances_are_bounded() {
    let n = 50_000;
    let mut nodes: Vec<Value> = (1..n).map(|i| json!({"children": [i]})).collect();
    nodes.push(json!({"mesh": 0}));
    assert_eq!(with(&[("/nodes", json!(nodes))]).unwrap().faces.len(), 1);
    // 20,000 nodes with a mesh of 20,000 primitives of three corners.
    let primitive = &base()["meshes"][0]["primitives"][0];
    let many = |what: Value| Value::from(vec![what; 20_000]);
    let nodes = many(json!({"mesh": 0}));
    let scenes = json!([{"nodes": (0..20_000).collect::<Vec<u32>>()}]);
    let changes = [("/nodes", nodes), ("/scenes", scenes), ("/meshes/0/primitives", many(primitive.clone()))];
    refused(with(&changes), "repeated, have more than");
    let zeros = json!({"componentType": 5126, "count": 1u64 << 40, "type": "VEC3", "sparse": {"count": 1,
        "indices": {"bufferView": 1, "componentType": 5123}, "values": {"bufferView": 0}}});
    refused(with(&[("/accessors/0", zeros.clone())]), "points and corners");
    let mut fewer = zeros;
    fewer["count"] = 1000.into();
    refused(with(&[("/accessors/0", fewer)]), "more elements than the buffers have bytes");
}

/// All glTF files under a folder.
fn below(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        if entry.is_dir() {
            found.extend(below(&entry));
        } else if entry.extension().is_some_and(|e| e == "glb" || e == "gltf") {
            found.push(entry);
        }
    }
    found
}

#[test]
#[ignore = "needs a folder of models"]
fn files_of_a_folder() {
    let folder = PathBuf::from(std::env::var("HALFLIGHT_FILES").unwrap());
    for file in below(&folder) {
        let told = match Scene::load(&file, LoadOptions::default()) {
            Ok(scene) => format!("{} faces, {} objects; {:?}", scene.faces.len(), scene.objects.len(), scene.warnings),
            Err(error) => format!("REFUSED {error}"),
        };
        println!("{}: {told}", file.strip_prefix(&folder).unwrap().display());
    }
}
