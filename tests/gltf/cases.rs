//! Files as other programs write them, each beside a twin that says the same in plainer words.

use std::fs;
use std::path::Path;

use glam::Vec3;
use halflight::Solver;
use halflight::light::Mode;
use halflight::pictures::Picture;
use halflight::scene::{DEFAULT_RHO, LoadOptions, Scene};
use serde_json::{Value, json};

use crate::gltf::glb::glb;
use crate::gltf::{base, binary, corners, normals, with};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/gltf/");

fn load(name: &str) -> Scene {
    Scene::load(Path::new(&format!("{FOLDER}{name}")), LoadOptions::default()).unwrap()
}

#[track_caller]
fn same(a: &Scene, b: &Scene) {
    assert_eq!((corners(a), &a.materials, &a.faces), (corners(b), &b.materials, &b.faces));
}

#[test]
fn attributes_of_applications_and_any_extras_are_read_over() {
    let plain = load("attributes/none.gltf");
    for name in ["attributes/feature-id.gltf", "attributes/extras-array.gltf"] {
        let scene = load(name);
        same(&scene, &plain);
        assert_eq!(scene.warnings, plain.warnings, "{name}");
    }
    assert_eq!(plain.materials[0].rho, Vec3::new(0.5, 0.25, 0.125));
    for extras in
        [json!([1, [2]]), json!(7), json!("text"), json!(true), Value::Null, json!({"a": {"b": []}}), json!([])]
    {
        let mut json = base();
        for at in [
            "/nodes/0",
            "/meshes/0",
            "/meshes/0/primitives/0",
            "/materials/0",
            "/accessors/0",
            "/buffers/0",
            "/asset",
            "",
        ] {
            json.pointer_mut(at).unwrap()["extras"] = extras.clone();
        }
        same(&crate::gltf::read(&json).unwrap(), &with(&[]).unwrap());
    }
    for (key, accessor) in [
        ("_FEATURE_ID_0", json!({"componentType": 5126, "count": 5, "type": "SCALAR"})),
        ("_BATCHID", json!({"bufferView": 1, "componentType": 5125, "count": 9000, "type": "MAT3"})),
        ("_id", json!({"componentType": 5130, "type": "STRING"})),
        ("TEXCOORD_9", json!({"componentType": 5126, "count": 5, "type": "VEC2"})),
        ("JOINTS_1", json!({"bufferView": 77, "componentType": 5123, "count": 5, "type": "VEC4"})),
        ("TANGENT", json!({"componentType": 5126, "count": 1, "type": "VEC3"})),
    ] {
        let mut json = base();
        json["accessors"].as_array_mut().unwrap().push(accessor);
        json["meshes"][0]["primitives"][0]["attributes"][key] = 2.into();
        let scene = crate::gltf::read(&json).unwrap();
        assert!(scene.warnings.is_empty(), "{key}: {:?}", scene.warnings);
        same(&scene, &with(&[]).unwrap());
    }
}

#[test]
fn a_byte_order_mark_and_zeros_are_read_over() {
    same(&load("bom/bom.gltf"), &load("bom/plain.gltf"));
    let plain = with(&[]).unwrap();
    for text in [format!("\u{feff}{}", base()), format!("{}\0\0\0\0", base()), format!("\u{feff}\r\n{}\r\n", base())] {
        same(&Scene::from_gltf_bytes("s", &glb(&text, &binary())).unwrap(), &plain);
    }
    // A name in Latin-1.
    let numbers: String = binary().iter().map(|byte| format!("%{byte:02x}")).collect();
    let mut json = base();
    json["buffers"][0]["uri"] = format!("data:,{numbers}").into();
    let latin: Vec<u8> = json.to_string().replace("thing", "caf\u{e9}").chars().map(|c| c as u8).collect();
    assert_eq!(Scene::from_gltf_bytes("s", &latin).unwrap().objects, ["caf\u{fffd}"]);
}

#[test]
fn instances_are_where_copies_would_be() {
    let [used, copies] = ["instancing/used", "instancing/copies"].map(|name| load(&format!("{name}.toml")));
    assert_eq!(corners(&used), corners(&copies));
    assert_eq!(used.objects, ["plates", "ground", "sky"]);
    assert!(used.warnings.is_empty(), "{:?}", used.warnings);
    let picture = |scene| -> Picture {
        Solver::new(scene).seed(1).render(Mode::Global, (24, 24)).tolerance(0.1).unwrap().picture
    };
    assert_eq!(picture(&used).pixels, picture(&copies).pixels);
    let text = fs::read_to_string(format!("{FOLDER}instancing/used.gltf")).unwrap();
    let mut required: Value = serde_json::from_str(&text).unwrap();
    required["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    let required = Scene::from_gltf_bytes("s", required.to_string().as_bytes()).unwrap();
    assert_eq!(corners(&required), corners(&used)[..corners(&required).len()]);
    assert_eq!(required.faces.len(), 10);
}

/// A file of one triangle whose node is moved by (0, 0, 1) and has these instances: key, component type, shape, whether
/// normalised, and bytes.
fn instanced(parts: &[(&str, u32, &str, bool, Vec<u8>)], count: usize) -> Result<Scene, halflight::scene::SceneError> {
    let (mut json, mut numbers) = (base(), binary());
    numbers.resize(72, 0);
    json["nodes"][0]["translation"] = json!([0, 0, 1]);
    for (i, (key, kind, shape, normalized, bytes)) in parts.iter().enumerate() {
        let view = json!({"buffer": 0, "byteOffset": numbers.len(), "byteLength": bytes.len()});
        json["bufferViews"].as_array_mut().unwrap().push(view);
        let mut accessor = json!({"bufferView": 2 + i, "componentType": kind, "count": count, "type": shape});
        accessor["normalized"] = (*normalized).into();
        json["accessors"].as_array_mut().unwrap().push(accessor);
        json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"][key] = (2 + i).into();
        numbers.extend(bytes);
        numbers.resize(numbers.len().next_multiple_of(4), 0);
    }
    json["buffers"][0]["byteLength"] = numbers.len().into();
    Scene::from_gltf_bytes("s", &glb(&json.to_string(), &numbers))
}

fn floats(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
}

#[test]
fn instances_are_turned_scaled_and_moved_behind_the_node() {
    // A quarter turn about z in bytes and in shorts: 90 of 127 twice are made one by their length.
    let half = 0.5f32.sqrt();
    let scale = ("SCALE", 5126, "VEC3", false, floats(&[2.0, 2.0, 2.0, -1.0, 1.0, 1.0]));
    let moved = ("TRANSLATION", 5126, "VEC3", false, floats(&[5.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
    let short: Vec<u8> = [0i16, 0, 23170, 23170, 0, 0, 0, 32767].iter().flat_map(|x| x.to_le_bytes()).collect();
    for rotation in [
        ("ROTATION", 5126, "VEC4", false, floats(&[0.0, 0.0, half, half, 0.0, 0.0, 0.0, 1.0])),
        ("ROTATION", 5120, "VEC4", true, vec![0, 0, 90, 90, 0, 0, 0, 127]),
        ("ROTATION", 5122, "VEC4", true, short),
    ] {
        let scene = instanced(&[moved.clone(), rotation, scale.clone()], 2).unwrap();
        let found = corners(&scene);
        // (x, y, 0) becomes (5 - 2 y, 2 x, 1), and its mirror image (-x, y, 1), whose corners go the other way round.
        let right = [
            [Vec3::new(5.0, 0.0, 1.0), Vec3::new(5.0, 2.0, 1.0), Vec3::new(3.0, 2.0, 1.0)],
            [Vec3::new(0.0, 0.0, 1.0), Vec3::new(-1.0, 1.0, 1.0), Vec3::new(-1.0, 0.0, 1.0)],
        ];
        for (a, b) in found.as_flattened().iter().zip(right.as_flattened()) {
            assert!(a.distance(*b) < 1e-6, "{found:?}");
        }
        assert!(normals(&scene).iter().all(|normal| normal.distance(Vec3::Z) < 1e-6));
        assert_eq!(scene.objects, ["thing"]);
    }
    // Each alone is enough, and what an application adds counts for nothing.
    assert_eq!(instanced(&[scale], 2).unwrap().faces.len(), 2);
    assert_eq!(instanced(&[("_ID", 5126, "SCALAR", false, floats(&[1.0, 2.0]))], 2).unwrap().faces.len(), 1);
}

#[test]
fn a_skinned_mesh_is_where_its_joints_are() {
    let [local, bind] = ["skins/local.gltf", "skins/bind.gltf"].map(load);
    assert_eq!(corners(&local), corners(&bind));
    for scene in [&local, &bind] {
        assert_eq!(scene.warnings.len(), 1);
        let warning = &scene.warnings[0];
        assert!(warning.contains("skins of nodes (skinned plate)") && warning.contains("bind pose"), "{warning}");
    }
    // A joint below a moved parent moves the mesh, and the mesh's own node and parents do not.
    let text = fs::read_to_string(format!("{FOLDER}skins/local.gltf")).unwrap();
    let change = |change: &dyn Fn(&mut Value)| {
        let mut json: Value = serde_json::from_str(&text).unwrap();
        change(&mut json);
        corners(&Scene::from_gltf_bytes("s", json.to_string().as_bytes()).unwrap())
    };
    let at = |offset: Vec3| {
        let mut all = corners(&bind);
        all[..2].as_flattened_mut().iter_mut().for_each(|corner| *corner += offset);
        all
    };
    let below = |json: &mut Value| {
        json["nodes"]
            .as_array_mut()
            .unwrap()
            .push(json!({"translation": [3, 1, 0], "scale": [1, 1, 2], "children": [1]}));
        json["scenes"][0]["nodes"] = json!([0, 3, 2]);
    };
    assert_eq!(change(&below), at(Vec3::ZERO));
    let posed = |json: &mut Value| json["nodes"][0]["translation"] = json!([0.5, 0.25, 0]);
    assert_eq!(change(&posed), at(Vec3::new(0.5, 0.25, 0.0)));
    // Without matrices joints bind where they are; without weights the first counts, and without joints none.
    let bare = |json: &mut Value| {
        json["skins"][0].as_object_mut().unwrap().remove("inverseBindMatrices");
        json["nodes"][0]["translation"] = json!([0.5, 0.25, 0]);
    };
    assert_eq!(change(&bare), at(Vec3::new(0.5, 0.25, 0.0)));
    let unweighted = |json: &mut Value| {
        json["accessors"][2].as_object_mut().unwrap().remove("bufferView");
        json["nodes"][0]["translation"] = json!([0.5, 0.25, 0]);
    };
    assert_eq!(change(&unweighted), at(Vec3::new(0.5, 0.25, 0.0)));
    let unbound = |json: &mut Value| {
        json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("JOINTS_0");
        json["nodes"][0]["translation"] = json!([0.5, 0.25, 0]);
    };
    assert_eq!(change(&unbound), at(Vec3::ZERO));
    let elsewhere = |json: &mut Value| {
        json["nodes"].as_array_mut().unwrap().push(json!({"translation": [9, 9, 9]}));
        json["skins"][0]["joints"] = json!([3]);
    };
    assert_eq!(change(&elsewhere), at(Vec3::ZERO), "its joint is in no scene");
}

/// WebP: (200, 100, 50) without loss, and with; BMP: the same.
const PACKED: &str = "data:image/webp;base64,UklGRh4AAABXRUJQVlA4TBEAAAAvA8AAAAdQsiJXpv+BiOh/AAA=";
const LOSSY: &str = "data:image/webp;base64,UklGRj4AAABXRUJQVlA4IDIAAADQAQCdASoEAAQAAMASJaACdLoB+AADsAD+2ib/7vN+09e09f1M//jKnyA/4yp/xcwAAA==";
const BMP: &str = "data:image/bmp;base64,Qk1mAAAAAAAAADYAAAAoAAAABAAAAAQAAAABABgAAAAAADAAAADEDgAAxA4AAAAAAAAAAAAAMmTIMmTIMmTIMmTIMmTIMmTIMmTIMmTIMmTIMmTIMmTIMmTIMmTIMmTIMmTIMmTI";
const KTX2: &str = "data:image/ktx2;base64,q0tUWCAyMLsNChoK";

/// The base with a texture on its material's white base colour.
fn textured(texture: Value, images: &[&str]) -> Scene {
    let images: Vec<Value> = images.iter().map(|uri| json!({"uri": uri})).collect();
    let used = ["EXT_texture_webp", "KHR_texture_basisu"];
    with(&[
        ("/materials/0/pbrMetallicRoughness", json!({"metallicFactor": 0, "baseColorTexture": {"index": 0}})),
        ("/textures", json!([texture])),
        ("/images", json!(images)),
        ("/extensionsUsed", json!(used)),
        ("/extensionsRequired", json!(used)),
    ])
    .unwrap()
}

#[test]
fn the_image_of_an_extension_counts_first() {
    let linear = |code: f32| ((code / 255.0 + 0.055) / 1.055).powf(2.4);
    let right = Vec3::new(linear(200.0), linear(100.0), linear(50.0));
    let webp = json!({"extensions": {"EXT_texture_webp": {"source": 0}}});
    let both = json!({"source": 1, "extensions": {"EXT_texture_webp": {"source": 0}}});
    for (texture, images, apart) in [
        (webp.clone(), vec![PACKED], 1e-6),
        (webp, vec![LOSSY], 0.02),
        (both.clone(), vec![PACKED, KTX2], 1e-6),
        (json!({"source": 0}), vec![PACKED], 1e-6),
        (json!({"source": 0}), vec![BMP], 1e-6),
    ] {
        let scene = textured(texture, &images);
        assert!((scene.materials[0].rho - right).abs().max_element() < apart, "{:?}", scene.materials[0].rho);
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    }
    // What cannot be read is named, with what counts in its place.
    let basisu = json!({"source": 1, "extensions": {"KHR_texture_basisu": {"source": 0}}});
    for (texture, images, name) in
        [(basisu, vec![KTX2, BMP], "m: KTX2"), (both, vec!["lost.webp", BMP], "m: lost.webp")]
    {
        let scene = textured(texture, &images);
        assert!((scene.materials[0].rho - right).abs().max_element() < 1e-6);
        let [warning] = &scene.warnings[..] else { panic!("{:?}", scene.warnings) };
        assert!(warning.contains(name) && warning.contains("gives beside them is shown"), "{warning}");
    }
    let alone = json!({"extensions": {"KHR_texture_basisu": {"source": 0}}});
    for (texture, image, name) in [
        (alone, KTX2, "of formats that are not read, of materials (m: KTX2)"),
        (json!({"source": 0}), KTX2, "of formats that are not read, of materials (m: KTX2)"),
        (json!({"source": 0}), "data:,DDS%20", "(m: DDS)"),
        (json!({"source": 0}), "a%20b.png", "images that cannot be read, of materials (m: a%20b.png)"),
        (json!({}), BMP, "(m: a texture without an image)"),
    ] {
        let scene = textured(texture, &[image]);
        assert_eq!(scene.materials[0].rho, Vec3::splat(DEFAULT_RHO));
        let all = scene.warnings.join("\n");
        assert!(all.contains(name) && all.contains("the plain colour counts"), "{name}: {all}");
    }
}

#[test]
fn primitives_without_a_material_are_those_of_gltf() {
    let mut json = base();
    json["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("material");
    let place = tempfile::tempdir().unwrap();
    let file = place.path().join("s.glb");
    fs::write(&file, glb(&json.to_string(), &binary())).unwrap();
    for (reflectance, rho) in [(None, DEFAULT_RHO), (Some(0.25), 0.25)] {
        let scene = Scene::load(&file, LoadOptions { reflectance, ..LoadOptions::default() }).unwrap();
        assert_eq!(scene.rho_at(0, Vec3::ZERO), Vec3::splat(rho));
        let [warning] = &scene.warnings[..] else { panic!("{:?}", scene.warnings) };
        let said = format!("reflecting {rho} (--reflectance)");
        assert!(warning.contains("1 bare face") && warning.contains(&said), "{warning}");
    }
}
