//! The table at the head of the reader: each row has cases here, and each case comes out as its row says.

use glam::Vec3;
use halflight::scene::{Scene, SceneError, Sides, Warning};
use serde_json::{Value, json};

use crate::gltf::{base, binary, corners, with};

/// The reader's head, which has the table.
const HEAD: &str = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/scene/gltf/mod.rs"));

/// What comes of a file.
enum Outcome {
    /// The scene is so, and nothing is said.
    Shown(fn(&Scene) -> bool),
    /// There is a scene, and one line with each of these.
    Said(&'static [&'static str]),
    /// The scene is that of the file before the change, and nothing is said.
    Silent,
    /// The error says this.
    Refused(&'static str),
}

/// The beginning of a row, changes to a file that bring it up, and what comes of them.
type Case = (&'static str, Vec<(&'static str, Value)>, Outcome);

fn attributes(more: &[(&str, u32)]) -> Value {
    let mut all = json!({"POSITION": 0});
    more.iter().for_each(|(key, accessor)| all[key] = (*accessor).into());
    all
}

/// Accessors of the base, and more: three numbers of 0, four, two, and a matrix.
fn accessors() -> Value {
    let mut all = base()["accessors"].clone();
    for (kind, shape) in [(5126, "VEC3"), (5121, "VEC4"), (5126, "VEC2"), (5126, "MAT4")] {
        all.as_array_mut().unwrap().push(json!({"componentType": kind, "count": 5, "type": shape}));
    }
    all
}

fn rooms() -> Vec<Case> {
    use Outcome::Shown;
    let numbers: String = binary().iter().map(|byte| format!("%{byte:02x}")).collect();
    let moved = json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 3, 1]);
    vec![
        ("GLB, JSON", vec![("/buffers/0/uri", json!(format!("data:,{numbers}")))], Shown(|s| s.faces.len() == 1)),
        (
            "the default scene",
            vec![("/nodes", json!([{}, {"mesh": 0, "matrix": moved}])), ("/scenes", json!([{"nodes": [1]}]))],
            Shown(|s| corners(s)[0][0] == Vec3::new(0.0, 0.0, 3.0)),
        ),
        (
            "triangles, strips",
            vec![("/accessors/1/count", json!(4.0)), ("/meshes/0/primitives/0/mode", json!(6))],
            Shown(|s| s.faces.len() == 2),
        ),
        (
            "several nodes",
            vec![("/nodes", json!([{"mesh": 0, "children": [1]}, {"mesh": 0, "translation": [0, 0, 1]}]))],
            Shown(|s| s.faces.len() == 2 && s.objects.len() == 2),
        ),
        (
            "several nodes",
            vec![("/nodes/0/extensions", json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}}}))],
            Shown(|s| s.faces.len() == 5 && s.objects.len() == 1),
        ),
    ]
}

fn shapes() -> Vec<Case> {
    use Outcome::{Said, Shown, Silent};
    let skinned = attributes(&[("JOINTS_0", 3), ("WEIGHTS_0", 3)]);
    let morphed = json!([{"attributes": {"POSITION": 0}, "indices": 1, "material": 0, "targets": [{"POSITION": 0}]}]);
    vec![
        (
            "a skin",
            vec![
                ("/accessors", accessors()),
                ("/meshes/0/primitives/0/attributes", skinned),
                ("/nodes", json!([{"mesh": 0, "skin": 0, "name": "arm", "children": [1]}, {}])),
                ("/skins", json!([{"joints": [1]}])),
            ],
            Said(&["skins of nodes (arm)", "bind pose"]),
        ),
        (
            "COLOR_0",
            vec![("/accessors", accessors()), ("/meshes/0/primitives/0/attributes", attributes(&[("COLOR_0", 2)]))],
            Shown(|s| s.materials[0].rho == Vec3::ZERO),
        ),
        (
            "metal, gloss",
            vec![
                ("/accessors", accessors()),
                ("/meshes/0/primitives/0/attributes", attributes(&[("COLOR_0", 2), ("COLOR_1", 2)])),
            ],
            Said(&["further colours of vertices, of nodes (thing)", "COLOR_0 alone"]),
        ),
        (
            "metal, gloss",
            vec![("/meshes/0/primitives/0/attributes", attributes(&[("NORMAL", 0)]))],
            Said(&["smooth normals, of nodes (thing)", "flat"]),
        ),
        (
            "morph targets",
            vec![("/meshes/0", json!({"weights": [0.5], "primitives": morphed}))],
            Said(&["morph targets of nodes (thing)", "without them"]),
        ),
        ("extensions that change nothing", vec![("/meshes/0", json!({"weights": [0], "primitives": morphed}))], Silent),
        (
            "morph targets",
            vec![("/animations", json!([{"name": "walk", "channels": 5}]))],
            Said(&["animations (walk)", "nothing moves"]),
        ),
        (
            "morph targets",
            vec![(
                "/meshes/0/primitives",
                json!([base()["meshes"][0]["primitives"][0], {"attributes": {"POSITION": 0}, "mode": 0}]),
            )],
            Said(&["points and lines of nodes (thing)", "no area"]),
        ),
        (
            "soft edges",
            vec![("/cameras", json!([{"type": "orthographic"}])), ("/nodes/0/camera", json!(0))],
            Said(&["orthographic cameras (thing)", "cannot be looked through"]),
        ),
        (
            "perspective cameras",
            vec![
                ("/cameras", json!([{"perspective": {"yfov": 0.5, "aspectRatio": 0, "zfar": -1}}])),
                ("/nodes/0/camera", json!(0)),
            ],
            Shown(|s| s.cameras.len() == 1),
        ),
        ("perspective cameras", lights(json!({"type": "point", "intensity": 2})), Shown(|s| s.lights.len() == 1)),
        (
            "soft edges",
            lights(json!({"type": "area"})),
            Said(&["neither points, spots nor directional (light 0)", "not shine"]),
        ),
        (
            "soft edges",
            lights(json!({"type": "point", "range": 4})),
            Said(&["ranges of lights (light 0)", "beyond them"]),
        ),
        ("soft edges", lights(json!({"type": "spot"})), Said(&["soft edges of spots (light 0)", "hard"])),
    ]
}

fn lights(light: Value) -> Vec<(&'static str, Value)> {
    let of_node = json!({"KHR_lights_punctual": {"light": 0}});
    vec![("/extensions", json!({"KHR_lights_punctual": {"lights": [light]}})), ("/nodes/0/extensions", of_node)]
}

/// Two by two texels: red, green half there, blue, white not there.
const TWO: &str = "data:image/webp;base64,UklGRjAAAABXRUJQVlA4TCMAAAAvAUAAEB8w/wKCIv9H23+BAMG5c8GNKkFN2wYsfpOOiP7HAQA=";

fn image(texture: Value) -> Vec<(&'static str, Value)> {
    let base = json!({"metallicFactor": 0, "baseColorTexture": {"index": 0}});
    vec![
        ("/accessors", accessors()),
        ("/meshes/0/primitives/0/attributes", attributes(&[("TEXCOORD_0", 4)])),
        ("/materials/0/pbrMetallicRoughness", base),
        ("/textures", json!([texture])),
        ("/samplers", json!([{"magFilter": 0, "minFilter": "?", "wrapS": -1}])),
        ("/images", json!([{"uri": TWO, "mimeType": 5}, {"uri": "data:,DDS%20"}])),
    ]
}

fn materials() -> Vec<Case> {
    use Outcome::{Refused, Said, Shown};
    let base_color = |rgba: [f32; 4]| json!({"metallicFactor": 0, "baseColorFactor": rgba});
    let of = |specular: [f32; 3]| json!({"diffuseFactor": [0.125, 0.25, 0.5, 1], "specularFactor": specular});
    let [glossy, mirror] =
        [[0.0; 3], [1.0; 3]].map(|colour| json!({"KHR_materials_pbrSpecularGlossiness": of(colour)}));
    let strong = json!({"KHR_materials_emissive_strength": {"emissiveStrength": 3}});
    vec![
        (
            "base colour",
            vec![("/materials/0/extensions", glossy)],
            Shown(|s| s.materials[0].rho == Vec3::new(0.125, 0.25, 0.5)),
        ),
        ("metal, gloss", vec![("/materials/0/extensions", mirror)], Said(&["gloss, of materials (m)", "diffuse"])),
        (
            "metal, gloss",
            vec![("/materials/0/pbrMetallicRoughness", json!({"baseColorFactor": [0.5, 0.5, 0.5, 1]}))],
            Said(&["metal, of materials (m)", "mirrors nothing"]),
        ),
        ("metal, gloss", vec![("/materials/0/normalTexture", json!({"index": "?"}))], Said(&["bumps", "(m)", "even"])),
        (
            "a white base colour",
            vec![("/materials/0/pbrMetallicRoughness", base_color([1.0; 4]))],
            Said(&["white base colour of material `m`", "reflects 0.8"]),
        ),
        (
            "a white base colour",
            vec![("/meshes/0/primitives/0/material", Value::Null)],
            Said(&["1 bare face", "reflecting 0.8"]),
        ),
        (
            "`alphaMode`",
            vec![
                ("/materials/0/alphaMode", json!("BLEND")),
                ("/materials/0/doubleSided", json!(true)),
                ("/materials/0/pbrMetallicRoughness", base_color([0.5, 0.5, 0.5, 0.25])),
            ],
            Shown(|s| s.materials[0].sides == Sides::Two && s.means_of_face(0).coverage == 0.25),
        ),
        (
            "emissive factor",
            vec![("/materials/0/emissiveFactor", json!([1, 2, 0])), ("/materials/0/extensions", strong)],
            Shown(|s| s.materials[0].emission == Vec3::new(3.0, 6.0, 0.0)),
        ),
        ("PNG, JPEG", image(json!({"source": 0, "sampler": 0})), Shown(|s| s.materials[0].maps.is_some())),
        (
            "PNG, JPEG",
            image(json!({"source": 1, "extensions": {"EXT_texture_webp": {"source": 0}}})),
            Shown(|s| s.materials[0].maps.is_some()),
        ),
        (
            "images that",
            image(json!({"source": 1})),
            Said(&["formats that are not read, of materials (m: DDS)", "plain colour counts"]),
        ),
        (
            "images that",
            image(json!({"source": 0, "extensions": {"KHR_texture_basisu": {"source": 1}}})),
            Said(&["not read, of materials (m: KTX2)", "beside them is shown"]),
        ),
        (
            "of what is shown: indices",
            image(json!({"source": 2})),
            Refused("material `m`: it names image 2, but there are 2 of them"),
        ),
        (
            "of what is shown: rho",
            vec![("/materials/0/pbrMetallicRoughness", base_color([1.5; 4]))],
            Refused("reflects 1.5"),
        ),
        ("of what is shown: rho", vec![("/materials/0/emissiveFactor", json!([-1, 0, 0]))], Refused("emits -1")),
    ]
}

fn rest() -> Vec<Case> {
    use Outcome::{Refused, Said, Silent};
    let used = |name: &str| vec![("/extensionsUsed", json!([name]))];
    let required = |name: &str| vec![("/extensionsUsed", json!([name])), ("/extensionsRequired", json!([name]))];
    let view = json!({"buffer": 0, "byteLength": 60, "target": 0, "byteStride": 0, "name": 5});
    let views = [
        json!({"buffer": 0, "byteLength": 60}),
        json!({"buffer": 0, "byteOffset": 60, "byteLength": 10, "byteStride": 2}),
        json!({"buffer": 1, "byteLength": 9, "byteStride": 1}),
        json!({"buffer": 7, "byteLength": 9}),
    ];
    let [points, corners] = [0, 1].map(|number| base()["accessors"][number].clone());
    let spare = json!({"bufferView": 2, "componentType": 9, "count": 9, "type": "?"});
    let more = json!([points, corners, spare, {"bufferView": 99}]);
    let four = json!([points, corners, {"componentType": 5126, "count": 4, "type": "VEC3"}]);
    let wrong = json!({"emissiveTexture": {"index": 44}, "pbrMetallicRoughness": {"baseColorFactor": [7, 7, 7, 7]}});
    let unused = json!([base()["materials"][0], wrong]);
    vec![
        (
            "other extensions that are used",
            used("KHR_materials_unlit"),
            Said(&["extensions (KHR_materials_unlit)", "instead of showing it unlit"]),
        ),
        (
            "other extensions that are used",
            used("KHR_materials_transmission"),
            Said(&["KHR_materials_transmission", "no light goes through"]),
        ),
        (
            "other extensions that are used",
            used("ACME_anything"),
            Said(&["extensions (ACME_anything)", "not in the picture"]),
        ),
        (
            "other extensions that are required",
            required("KHR_materials_unlit"),
            Refused("not supported: KHR_materials_unlit"),
        ),
        (
            "other extensions that are required",
            required("EXT_meshopt_compression"),
            Refused("not supported: EXT_meshopt_compression"),
        ),
        ("other extensions that are required", vec![("/asset/version", json!("1.1"))], Refused("it is glTF 1.1")),
        ("extensions that change nothing", required("KHR_xmp_json_ld"), Silent),
        ("extensions that change nothing", required("EXT_structural_metadata"), Silent),
        ("extensions that change nothing", used("KHR_draco_mesh_compression"), Silent),
        (
            "`extras`",
            vec![
                ("/nodes/0/extras", json!([1])),
                ("/asset/minVersion", json!(7)),
                ("/extensions", json!({"ACME": [[[1]]]})),
            ],
            Silent,
        ),
        ("`extras`", vec![("/meshes/0/primitives/0/attributes", attributes(&[("_ID", 77), ("TANGENT", 88)]))], Silent),
        ("`target`", vec![("/bufferViews/0", view), ("/accessors/0/max", json!(["?"]))], Silent),
        ("unknown `magFilter`", vec![("/materials/0/alphaMode", json!("odd"))], Silent),
        (
            "what no mesh shown names",
            vec![("/bufferViews", json!(views)), ("/accessors", more), ("/materials", unused)],
            Silent,
        ),
        (
            "what no mesh shown names",
            vec![("/buffers", json!([{"byteLength": 70}, {"byteLength": 9, "uri": "lost.bin"}, {"byteLength": 1}]))],
            Silent,
        ),
        (
            "what no mesh shown names",
            vec![
                ("/skins", json!([{"joints": [99], "inverseBindMatrices": 99}])),
                ("/samplers", json!([{}])),
                ("/images", json!([{"uri": "lost.png"}])),
            ],
            Silent,
        ),
        (
            "of what is shown: indices",
            vec![("/meshes/0/primitives/0/material", json!(1))],
            Refused("node `thing`: it names material 1, but there are 1 of them"),
        ),
        (
            "of what is shown: indices",
            vec![("/accessors/0/bufferView", json!(2))],
            Refused("accessor 0: it names buffer view 2"),
        ),
        (
            "of what is shown: indices",
            vec![("/bufferViews/0/buffer", json!(1))],
            Refused("buffer view 0: it names buffer 1"),
        ),
        ("of what is shown: indices", vec![("/nodes/0/children", json!([4]))], Refused("it names node 4")),
        ("of what is shown: indices", vec![("/scene", json!(3))], Refused("it names scene 3")),
        ("of what is shown: indices", vec![("/nodes/0/camera", json!(0))], Refused("it names camera 0")),
        (
            "of what is shown: indices",
            vec![("/nodes/0/skin", json!(0))],
            Refused("node `thing`: skin 0: it names skin 0"),
        ),
        (
            "of what is shown: indices",
            vec![("/accessors/0/componentType", json!(5124))],
            Refused("componentType is 5124"),
        ),
        ("of what is shown: indices", vec![("/meshes/0/primitives/0/mode", json!(7))], Refused("its mode is 7")),
        (
            "of what is shown: indices",
            vec![("/buffers/0/uri", json!("lost.bin"))],
            Refused("cannot read buffer 0, `lost.bin`"),
        ),
        ("of what is shown: rho", vec![("/nodes/0/rotation", json!([0, 0, 0, 0]))], Refused("node 0 is not finite")),
        ("nodes with two parents", vec![("/nodes/0/children", json!([0]))], Refused("node 0 is met twice")),
        (
            "nodes with two parents",
            vec![
                ("/accessors", four),
                (
                    "/nodes/0/extensions",
                    json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0, "SCALE": 2}}}),
                ),
            ],
            Refused("node 0: of its instances TRANSLATION has 5 and SCALE 4"),
        ),
    ]
}

/// Rows of the table: what the format allows, and what becomes of it.
fn rows() -> Vec<(&'static str, &'static str)> {
    let rows = HEAD.lines().filter_map(|line| line.strip_prefix("//! | ")?.strip_suffix(" |")?.rsplit_once(" | "));
    rows.skip(1).collect()
}

#[test]
fn each_row_comes_out_as_it_says() {
    let rows = rows();
    let mut met = vec![0; rows.len()];
    for (row, changes, outcome) in [rooms(), shapes(), materials(), rest()].into_iter().flatten() {
        println!("{row}: {:?}", changes.iter().map(|(path, _)| *path).collect::<Vec<_>>());
        let at = rows.iter().position(|(what, _)| what.starts_with(row)).expect(row);
        met[at] += 1;
        let here = rows[at].1;
        check(with(&changes), &outcome, here);
    }
    let bare: Vec<_> = rows.iter().zip(met).filter(|(_, met)| *met == 0).collect();
    assert!(rows.len() > 20 && bare.is_empty(), "{bare:?}");
}

#[track_caller]
fn check(result: Result<Scene, SceneError>, outcome: &Outcome, here: &str) {
    match (outcome, result) {
        (Outcome::Shown(is_right), Ok(scene)) => {
            assert!(here.starts_with("modelled") || here == "read", "{here}");
            assert!(is_right(&scene) && scene.warnings.is_empty(), "{:?}", scene.warnings);
        }
        (Outcome::Said(parts), Ok(scene)) => {
            assert!(here.contains("said"), "{here}");
            let told = |warning: &&Warning| parts.iter().all(|part| warning.contains(part));
            assert_eq!(scene.warnings.iter().filter(told).count(), 1, "{parts:?}: {:?}", scene.warnings);
            assert!(scene.warnings.iter().all(|warning| warning.lines().count() == 1));
        }
        (Outcome::Silent, Ok(scene)) => {
            assert_eq!(here, "silent");
            let plain = with(&[]).unwrap();
            assert_eq!((corners(&scene), &scene.materials[0]), (corners(&plain), &plain.materials[0]));
            assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        }
        (Outcome::Refused(part), Err(error)) => {
            assert_eq!(here, "refused");
            assert!(error.to_string().contains(part), "{error}");
        }
        (_, Ok(scene)) => panic!("read: {:?}", scene.warnings),
        (_, Err(error)) => panic!("refused: {error}"),
    }
}
