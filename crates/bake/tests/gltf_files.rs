//! glTF files written back: what they hold, and what is refused.

use std::fs;

use halflight::Scene;
use halflight_bake::{Held, Model, bake, write_maps};
use serde_json::{Value, json};

use crate::{data, folder, goal, name};

/// A square room of one mesh at two nodes, one above the other turned over, and a lamp; coordinates of the second set
/// where they are given.
fn two_squares(second: Option<[[f32; 2]; 4]>) -> String {
    let length = buffer(second).len();
    let mut attributes = json!({ "POSITION": 0 });
    let mut views =
        vec![json!({ "buffer": 0, "byteLength": 48 }), json!({ "buffer": 0, "byteOffset": 48, "byteLength": 12 })];
    let mut accessors = vec![
        json!({ "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 0, 1] }),
        json!({ "bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR" }),
    ];
    if second.is_some() {
        views.push(json!({ "buffer": 0, "byteOffset": 60, "byteLength": 32 }));
        accessors.push(json!({ "bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC2" }));
        attributes["TEXCOORD_1"] = 2.into();
    }
    let primitive = |material: usize| json!({ "attributes": attributes, "indices": 1, "material": material });
    let root = json!({
        "asset": { "version": "2.0" },
        "scenes": [{ "nodes": [0, 1, 2] }],
        "nodes": [
            { "name": "floor", "mesh": 0, "extras": { "kept": 7 } },
            { "name": "shelf", "mesh": 0, "translation": [0.5, 0.3, 0.5], "scale": [0.3, 1, 0.3] },
            { "name": "lamp", "mesh": 1, "translation": [0, 1, 0], "rotation": [1, 0, 0, 0] }
        ],
        "meshes": [{ "name": "square", "primitives": [primitive(0)] }, { "primitives": [primitive(1)] }],
        "materials": [
            { "name": "white", "doubleSided": true, "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.5, 0.5, 1] } },
            { "name": "glow", "emissiveFactor": [1, 1, 1], "pbrMetallicRoughness": { "baseColorFactor": [0, 0, 0, 1] } }
        ],
        "bufferViews": views, "accessors": accessors,
        "buffers": [{ "byteLength": length, "uri": "room.bin" }]
    });
    root.to_string()
}

/// The bytes of the buffer of that file.
fn buffer(second: Option<[[f32; 2]; 4]>) -> Vec<u8> {
    let points: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, 0.0]];
    let mut bytes: Vec<u8> = points.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend([0_u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    bytes.extend(second.iter().flatten().flatten().flat_map(|x| x.to_le_bytes()));
    bytes
}

fn room(second: Option<[[f32; 2]; 4]>) -> (tempfile::TempDir, String) {
    let folder = folder(&[("room.gltf", &two_squares(second))]);
    fs::write(folder.path().join("room.bin"), buffer(second)).expect("a file");
    let name = name(&folder, "room.gltf");
    (folder, name)
}

/// The JSON of a `.glb` file, and its buffer.
fn parts_of(glb: &[u8]) -> (Value, Vec<u8>) {
    let length = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().expect("four bytes")) as usize;
    assert_eq!((&glb[..4], length(4), length(8)), (&b"glTF"[..], 2, glb.len()));
    let text = length(12);
    (serde_json::from_slice(&glb[20..20 + text]).expect("JSON"), glb[28 + text..].to_vec())
}

/// The floats of an accessor without a stride.
fn floats(root: &Value, binary: &[u8], accessor: &Value) -> Vec<f32> {
    let own = &root["accessors"][accessor.as_u64().expect("a number") as usize];
    let view = &root["bufferViews"][own["bufferView"].as_u64().expect("a view") as usize];
    let start = view["byteOffset"].as_u64().unwrap_or(0) as usize;
    let length = view["byteLength"].as_u64().expect("a length") as usize;
    binary[start..start + length].chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().expect("four"))).collect()
}

const UNIT: [[f32; 2]; 4] = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]];

#[test]
fn instances_have_maps_of_their_own_and_all_else_stays() {
    for second in [None, Some(UNIT)] {
        let (folder, name) = room(second);
        let scene = Scene::open(&name).expect("a scene");
        let model = Model::open(&name, &scene).expect("parts");
        let found = bake(&scene, model.parts(), &goal(64, 0.1)).expect("maps");
        let out = folder.path().join("baked");
        let (report, files) =
            write_maps((&out, "room"), (&scene, &model), &found, (Held::All, 0.1), true).expect("files");
        assert!(files.iter().all(|file| file.is_file()) && report.objects.len() == 3);
        let (root, binary) = parts_of(&fs::read(out.join("room.glb")).expect("a file"));
        // Every node has a mesh of its own, with coordinates within the map that no other has.
        let meshes: Vec<u64> = (0..3).map(|n| root["nodes"][n]["mesh"].as_u64().expect("a mesh")).collect();
        assert!(meshes[0] != meshes[1] && root["meshes"].as_array().expect("meshes").len() == 3);
        assert_eq!(root["nodes"][0]["extras"]["kept"], 7);
        let mut boxes = Vec::new();
        for mesh in meshes {
            let attributes = &root["meshes"][mesh as usize]["primitives"][0]["attributes"];
            let places = floats(&root, &binary, &attributes["TEXCOORD_1"]);
            assert_eq!(places.len(), 8, "four corners are not split");
            let ends = |axis: usize| {
                let of = || places.iter().skip(axis).step_by(2).copied();
                [of().fold(1.0, f32::min), of().fold(0.0, f32::max)]
            };
            assert!(places.iter().all(|x| (0.0..=1.0).contains(x)));
            assert_eq!(floats(&root, &binary, &attributes["POSITION"]).len(), 12);
            boxes.push([ends(0), ends(1)]);
        }
        let apart = |a: [[f32; 2]; 2], b: [[f32; 2]; 2]| (0..2).any(|k| a[k][1] < b[k][0] || b[k][1] < a[k][0]);
        assert!(apart(boxes[0], boxes[1]) && apart(boxes[0], boxes[2]) && apart(boxes[1], boxes[2]), "{boxes:?}");
        for material in root["materials"].as_array().expect("materials") {
            let own = &material["extensions"]["MOZ_lightmap"];
            assert!(own["texCoord"] == 1 && own["intensity"].as_f64().is_some_and(|x| x > 0.0), "{own}");
        }
        // What was written is the scene that was read.
        let again = Scene::open(&out.join("room.glb").display().to_string()).expect("a scene");
        assert_eq!((again.vertices, again.objects), (scene.vertices.clone(), scene.objects.clone()));
    }
}

#[test]
fn charts_that_overlap_or_leave_their_square_are_refused() {
    let refused = |second: [[f32; 2]; 4]| {
        let (_folder, name) = room(Some(second));
        let scene = Scene::open(&name).expect("a scene");
        let model = Model::open(&name, &scene).expect("parts");
        bake(&scene, model.parts(), &goal(64, 0.1)).err().expect("refused").to_string()
    };
    let folded = refused([[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.2, 0.9]]);
    assert!(folded.contains("`floor` overlap"), "{folded}");
    let outside = refused([[0.0, 0.0], [0.0, 1.0], [1.5, 1.0], [1.5, 0.0]]);
    assert!(outside.contains("`floor` leave the square") && outside.contains("1.5"), "{outside}");
}

/// Rooms with several objects, textures and lights without area come through.
#[test]
fn other_files_are_read() {
    let mut tried = 0;
    let folders = ["attributes", "bom", "skins", "instancing"].map(|name| data("tests/data/gltf").join(name));
    for entry in folders.iter().flat_map(|folder| fs::read_dir(folder).expect("a folder").flatten()) {
        let path = entry.path();
        if path.extension().is_some_and(|e| e == "glb" || e == "gltf") {
            let name = path.display().to_string();
            let Ok(scene) = Scene::open(&name) else { continue };
            match Model::open(&name, &scene) {
                Ok(model) => assert!(!model.parts().is_empty()),
                // What moves or is drawn many times gets no map.
                Err(error) => assert!(error.to_string().contains("no triangles to bake"), "{name}: {error}"),
            }
            tried += 1;
        }
    }
    assert!(tried > 0);
}
