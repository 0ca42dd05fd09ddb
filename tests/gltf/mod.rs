//! glTF 2.0: what is read, what is ignored with a warning, and what is refused; and that a room is lit as its OBJ is.

mod broken;
mod cases;
pub(crate) mod glb;
mod table;

use std::fs;

use glam::{DVec3, Vec3};
use glb::{bytes, export, glb};
use halflight::scene::{Beam, DEFAULT_RHO, LoadOptions, PunctualForm, Scene, SceneError, Sides};
use halflight::{Mode, Solver};
use serde_json::{Value, json};

/// A triangle in z = 0, its front towards +z, and two more corners.
const POINTS: [[f32; 3]; 5] = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 2.0, 0.0]];

/// One mesh of one triangle at one node, its numbers in the binary chunk.
fn base() -> Value {
    json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "thing"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [{"name": "m", "pbrMetallicRoughness":
            {"baseColorFactor": [0.25, 0.5, 0.75, 1], "metallicFactor": 0}}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 5, "type": "VEC3", "min": [0, 0, 0], "max": [1, 2, 0]},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteLength": 60}, {"buffer": 0, "byteOffset": 60, "byteLength": 10}],
        "buffers": [{"byteLength": 70}],
    })
}

fn binary() -> Vec<u8> {
    bytes(&POINTS, &[0, 1, 2, 3, 4])
}

fn read(json: &Value) -> Result<Scene, SceneError> {
    Scene::from_gltf_bytes("s", &glb(&json.to_string(), &binary()))
}

/// The base with some of its JSON changed, by JSON pointers.
fn with(changes: &[(&str, Value)]) -> Result<Scene, SceneError> {
    let mut json = base();
    for (path, value) in changes {
        let (parent, key) = path.rsplit_once('/').unwrap();
        match json.pointer_mut(parent).unwrap() {
            Value::Array(list) => list[key.parse::<usize>().unwrap()] = value.clone(),
            table => table[key] = value.clone(),
        }
    }
    read(&json)
}

/// Corners of all faces in the file's units.
fn corners(scene: &Scene) -> Vec<[Vec3; 3]> {
    let file = |p| scene.frame.to_file(p).as_vec3();
    (0..scene.faces.len() as u32).map(|face| scene.exact_corners(face).map(file)).collect()
}

fn normals(scene: &Scene) -> Vec<Vec3> {
    corners(scene).iter().map(|[a, b, c]| (*b - *a).cross(*c - *a).normalize()).collect()
}

#[test]
fn a_glb_is_read_with_its_names() {
    let scene = with(&[]).unwrap();
    assert_eq!(corners(&scene), [[Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0)]]);
    assert_eq!((scene.objects[0].as_str(), scene.materials[0].name.as_str()), ("thing", "m"));
    assert_eq!(scene.materials[0].rho, Vec3::new(0.25, 0.5, 0.75));
    assert_eq!(scene.materials[0].sides, Sides::One);
    assert_eq!((scene.materials.len(), scene.warnings.len()), (1, 0));
}

#[test]
fn a_gltf_is_read_with_a_data_uri_and_with_a_file() {
    let place = tempfile::tempdir().unwrap();
    fs::create_dir(place.path().join("parts")).unwrap();
    let numbers: String = binary().iter().map(|byte| format!("%{byte:02x}")).collect();
    for uri in [format!("data:application/octet-stream,{numbers}"), "a%20b.bin".to_owned()] {
        let mut json = base();
        json["buffers"][0]["uri"] = uri.into();
        fs::write(place.path().join("parts/s.gltf"), json.to_string()).unwrap();
        fs::write(place.path().join("parts/a b.bin"), binary()).unwrap();
        let toml = "mesh = \"parts/s.gltf\"\n[camera]\nposition = [0, 0, 5]\ntarget = [0, 0, 0]\n[materials.m]\nemission = [1, 2, 3]\n";
        fs::write(place.path().join("s.toml"), toml).unwrap();
        let load = |name: &str| Scene::load(&place.path().join(name), LoadOptions::default()).unwrap();
        let [own, named] = [load("parts/s.gltf"), load("s.toml")];
        assert_eq!(corners(&own), corners(&with(&[]).unwrap()));
        assert_eq!(corners(&own), corners(&named));
        assert_eq!(named.materials[0].emission, Vec3::new(1.0, 2.0, 3.0));
        assert_eq!(named.camera.forward, Vec3::NEG_Z);
    }
    fs::remove_file(place.path().join("parts/a b.bin")).unwrap();
    let error = Scene::load(&place.path().join("s.toml"), LoadOptions::default()).unwrap_err();
    assert!(matches!(error, SceneError::MissingBuffer { number: 0, .. }), "{error}");
}

#[test]
fn strips_and_fans_are_triangles_of_one_orientation() {
    let all = [("/accessors/1/count", json!(5)), ("/meshes/0/primitives/0/mode", json!(6))];
    let fan = with(&all).unwrap();
    assert_eq!(fan.faces.len(), 2, "two more are flat: {:?}", corners(&fan));
    assert!(normals(&fan).iter().all(|n| *n == Vec3::Z));
    // A strip of the square's corners goes 0, 1, 3, 2.
    let strip = json!({"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 5}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 48}], "buffers": [{"byteLength": 48}]});
    let square = [POINTS[0], POINTS[1], POINTS[3], POINTS[2]];
    let scene = Scene::from_gltf_bytes("s", &glb(&strip.to_string(), &bytes(&square, &[]))).unwrap();
    assert_eq!(scene.faces.len(), 2);
    assert!(normals(&scene).iter().all(|n| *n == Vec3::Z), "{:?}", corners(&scene));
    assert_eq!((scene.materials[0].name.as_str(), scene.objects[0].as_str()), ("(none)", "node 0"));
}

#[test]
fn nodes_place_their_meshes() {
    // A quarter turn about z, then along x; the parent doubles.
    let half = 0.5f64.sqrt();
    let nodes = json!([
        {"children": [1, 2], "scale": [2, 2, 2]},
        {"mesh": 0, "translation": [1, 0, 0], "rotation": [0, 0, half, half], "name": "a"},
        {"mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 3, 1], "name": "b"}]);
    let scene = with(&[("/nodes", nodes)]).unwrap();
    let found = corners(&scene);
    let expected = [
        [Vec3::new(2.0, 0.0, 0.0), Vec3::new(2.0, 2.0, 0.0), Vec3::new(0.0, 2.0, 0.0)],
        [Vec3::new(0.0, 0.0, 6.0), Vec3::new(2.0, 0.0, 6.0), Vec3::new(2.0, 2.0, 6.0)],
    ];
    for (found, expected) in found.as_flattened().iter().zip(expected.as_flattened()) {
        assert!((*found - *expected).length() < 1e-5, "{found} {expected}");
    }
    assert_eq!(scene.objects, ["a", "b"]);
}

#[test]
fn mirrored_meshes_keep_their_fronts() {
    // The triangle seen in a mirror at x = 0 still looks towards +z, and one in a mirror at z = 0 towards -z.
    for (scale, normal) in
        [([-1, 1, 1], Vec3::Z), ([1, 1, -1], Vec3::NEG_Z), ([-1, -1, 1], Vec3::Z), ([-1, -1, -1], Vec3::NEG_Z)]
    {
        let scene = with(&[("/nodes/0/scale", json!(scale))]).unwrap();
        assert_eq!(normals(&scene), [normal], "{scale:?}");
    }
}

#[test]
fn the_default_scene_is_shown_else_the_first() {
    let scenes = json!([{"nodes": [0]}, {"nodes": [1]}]);
    let nodes = json!([{"mesh": 0, "name": "first"}, {"mesh": 0, "name": "second"}]);
    let both = [("/scenes", scenes), ("/nodes", nodes)];
    assert_eq!(with(&both).unwrap().objects, ["first"]);
    assert_eq!(with(&[&both[..], &[("/scene", json!(1))]].concat()).unwrap().objects, ["second"]);
    assert_eq!(with(&[&both[..], &[("/scene", Value::Null)]].concat()).unwrap().objects, ["first"]);
}

#[test]
fn cameras_look_as_the_file_says() {
    let cameras = json!([
        {"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "znear": 0.1, "zfar": 9}},
        {"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1, "aspectRatio": 2}}]);
    let turned = json!([0, 0.5f64.sqrt(), 0, 0.5f64.sqrt()]);
    let nodes = json!([{"mesh": 0, "children": [1, 2, 3]}, {"camera": 0, "name": "flat"},
        {"camera": 1, "name": "front", "translation": [0.5, 0.5, 3]},
        {"camera": 1, "name": "side", "translation": [4, 0, 0], "rotation": turned, "scale": [1, 1, 7]}]);
    let mut scene = with(&[("/cameras", cameras), ("/nodes", nodes)]).unwrap();
    assert_eq!(scene.camera.forward, Vec3::NEG_Z);
    assert!((f64::from(scene.camera.vertical_fov) - 0.5f64.to_degrees()).abs() < 1e-4);
    let position = scene.frame.to_file(scene.camera.position.as_dvec3());
    assert!((position - DVec3::new(0.5, 0.5, 3.0)).length() < 1e-6, "{position}");
    assert!(scene.warnings[0].contains("orthographic cameras (flat)"), "{:?}", scene.warnings);
    scene.look_through("side").unwrap();
    assert!((scene.camera.forward - Vec3::NEG_X).length() < 1e-6);
    let message = scene.look_through("flat").unwrap_err();
    assert!(matches!(message, SceneError::NoCamera { known, .. } if known == "front, side"));
}

#[test]
fn lights_are_read_in_their_units() {
    let lights = json!({"KHR_lights_punctual": {"lights": [
        {"type": "point", "intensity": 8, "color": [1, 0.5, 0.25], "range": 3, "name": "bulb"},
        {"type": "spot", "intensity": 3, "spot": {"innerConeAngle": 0, "outerConeAngle": 1}, "name": "lamp"},
        {"type": "directional", "intensity": 2}]}});
    let at = |light: u32| json!({"KHR_lights_punctual": {"light": light}});
    let nodes = json!([{"mesh": 0, "children": [1, 2, 3]},
        {"extensions": at(0), "translation": [0.5, 0.5, 2]}, {"extensions": at(1)},
        {"extensions": at(2), "rotation": [1, 0, 0, 0], "scale": [9, 9, 9]}]);
    let scene = with(&[("/extensions", lights), ("/nodes", nodes)]).unwrap();
    let [point, spot, sun] = &scene.lights[..] else { panic!("{:?}", scene.lights) };
    // Candela and lux, by 683 lm/W.
    let near = |found: Vec3, expected: Vec3| (683.0 * found - expected).abs().max_element() < 1e-5;
    assert!(near(point.intensity, Vec3::new(8.0, 4.0, 2.0)), "{}", point.intensity);
    let PunctualForm::Point { place, beam: Beam::Even } = &point.form else { panic!("{point:?}") };
    // Half the box's largest extent is 0.5, its middle (0.5, 0.5, 0).
    assert_eq!((place.position, place.attenuation), (DVec3::new(0.0, 0.0, 4.0), [0.0, 0.0, 0.25]));
    let PunctualForm::Point { beam: Beam::Spot { cutoff, direction, exponent }, .. } = &spot.form else {
        panic!("{spot:?}")
    };
    assert!((cutoff - (2.0 + 1f64.cos()) / 3.0).abs() < 1e-7 && *direction == DVec3::NEG_Z && *exponent == 0.0);
    assert!(near(sun.intensity, Vec3::splat(2.0)), "{}", sun.intensity);
    assert_eq!(sun.form, PunctualForm::Directional { direction: DVec3::Z });
    let [range, edge] = &scene.warnings[..] else { panic!("{:?}", scene.warnings) };
    assert!(range.contains("ranges of lights (bulb)") && edge.contains("soft edges of spots (lamp)"), "{range} {edge}");
}

#[test]
fn what_is_not_modelled_is_named_once() {
    let material = json!({"name": "glass", "alphaMode": "BLEND", "doubleSided": true, "normalTexture": {"index": 0},
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "roughnessFactor": 0.1},
        "emissiveFactor": [1, 0.5, 0], "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}}});
    let scene = with(&[
        ("/materials/0", material),
        ("/textures", json!([{"source": 0}])),
        ("/images", json!([{"uri": "no such file.png"}])),
        ("/extensionsUsed", json!(["KHR_materials_ior", "KHR_materials_emissive_strength"])),
        (
            "/meshes/0/primitives",
            json!([{"attributes": {"POSITION": 0}, "mode": 0}, base()["meshes"][0]["primitives"][0]]),
        ),
    ])
    .unwrap();
    let glass = &scene.materials[0];
    assert_eq!((glass.rho, glass.sides), (Vec3::splat(DEFAULT_RHO), Sides::Two));
    assert_eq!(glass.emission, Vec3::new(4.0, 2.0, 0.0));
    let [white, ignored @ ..] = &scene.warnings[..] else { panic!("{:?}", scene.warnings) };
    assert!(white.contains("1 white base colour of material `glass`") && white.contains("reflects 0.8"), "{white}");
    for part in [
        "textures of gloss, bumps and occlusion, of materials (glass)",
        "images that cannot be read, of materials (glass: no such file.png)",
        "metal, of materials (glass)",
        "gloss, of materials (glass)",
        "points and lines of nodes (thing)",
        "extensions (KHR_materials_ior)",
    ] {
        let named = ignored.iter().filter(|warning| warning.contains(part)).count();
        assert_eq!(named, 1, "{part}: {ignored:?}");
    }
    assert_eq!(ignored.len(), 6, "{ignored:?}");
}

#[test]
fn quantised_and_sparse_positions_are_read() {
    let quantised = json!({"bufferView": 0, "componentType": 5120, "normalized": true, "count": 3, "type": "VEC3"});
    let json = json!({"asset": {"version": "2.0"}, "extensionsRequired": ["KHR_mesh_quantization"],
        "nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [quantised], "buffers": [{"byteLength": 12}],
        "bufferViews": [{"buffer": 0, "byteLength": 12, "byteStride": 4}]});
    let scene =
        Scene::from_gltf_bytes("s", &glb(&json.to_string(), &[0, 0, 0, 9, 127, 0, 0, 9, 0, 128, 0, 9])).unwrap();
    assert_eq!(corners(&scene), [[Vec3::ZERO, Vec3::X, Vec3::NEG_Y]]);
    let sparse = json!({"count": 1, "indices": {"bufferView": 1, "byteOffset": 2, "componentType": 5123},
        "values": {"bufferView": 0, "byteOffset": 48}});
    let scene = with(&[("/accessors/0/sparse", sparse)]).unwrap();
    assert_eq!(corners(&scene), [[Vec3::ZERO, Vec3::new(0.0, 2.0, 0.0), Vec3::new(1.0, 1.0, 0.0)]]);
}

/// A closed room of whole numbers with a lamp and a block, two of its faces two-sided.
const ROOM: &str = "mtllib m.mtl\no room\nv 0 0 0\nv 8 0 0\nv 8 0 6\nv 0 0 6\nv 0 4 0\nv 8 4 0\nv 8 4 6\nv 0 4 6\n\
    usemtl grey\nf 4 3 2 1\nf 5 6 7 8\nusemtl red\nf 1 5 8 4\nusemtl green\nf 2 3 7 6\nusemtl grey\nf 1 2 6 5\n\
    f 4 8 7 3\no lamp\nv 3 3.5 2\nv 5 3.5 2\nv 5 3.5 4\nv 3 3.5 4\nusemtl glow\nf -4 -3 -2 -1\no sheet\n\
    v 1 1 1\nv 2 1 3\nv 2 3 3\nv 1 3 1\nusemtl paper\nf -4 -3 -2 -1\n";
const MATERIALS: &str = "newmtl grey\nKd .5\nnewmtl red\nKd .7 .1 .1\nnewmtl green\nKd .1 .6 .2\nnewmtl glow\nKd 0\n\
    Ke 16 12 4\nnewmtl paper\nKd .8 .8 .6\n";

#[test]
fn a_room_is_lit_as_its_obj_is() {
    let mut obj = Scene::from_obj_text("s", ROOM, MATERIALS).unwrap();
    obj.materials[4].sides = Sides::Two;
    let glb = Scene::from_gltf_bytes("s", &export(&obj)).unwrap();
    assert_eq!((&obj.objects, &obj.materials, obj.frame), (&glb.objects, &glb.materials, glb.frame));
    assert_eq!((&obj.vertices, &obj.exact, &obj.faces), (&glb.vertices, &glb.exact, &glb.faces));
    assert_eq!(obj.camera, glb.camera);
    let picture = |scene| Solver::new(scene).seed(3).render(Mode::Global, (24, 24)).tolerance(0.1).unwrap().picture;
    assert_eq!(picture(&obj).pixels, picture(&glb).pixels);
}
