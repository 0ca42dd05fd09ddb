//! Textures of glTF: the room of an OBJ as a GLB, samplers, transforms, alpha, and images that are not what they say.

use std::fs;

use glam::{DVec2, Vec3};
use halflight::Solver;
use halflight::light::Mode;
use halflight::pictures::relative_rms;
use halflight::scene::textures::{Filter, Wrap};
use halflight::scene::{LoadOptions, Material, Scene, SceneError};
use serde_json::{Value, json};

use crate::textures::room;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/textured/");

/// The room's GLB with some of its JSON changed, by JSON pointers.
fn with(changes: &[(&str, Value)]) -> Result<Scene, SceneError> {
    let bytes = fs::read(format!("{FOLDER}room.glb")).unwrap();
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let mut json: Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
    for (path, value) in changes {
        let (parent, key) = path.rsplit_once('/').unwrap();
        match json.pointer_mut(parent).unwrap() {
            Value::Array(list) => list[key.parse::<usize>().unwrap()] = value.clone(),
            table => table[key] = value.clone(),
        }
    }
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let rest = &bytes[20 + length..];
    let words = [2, (20 + text.len() + rest.len()) as u32, text.len() as u32].map(u32::to_le_bytes);
    let all = [b"glTF".as_slice(), words.as_flattened(), b"JSON", &text, rest].concat();
    Scene::from_gltf_bytes("room", &all)
}

fn material<'a>(scene: &'a Scene, name: &str) -> &'a Material {
    scene.materials.iter().find(|material| material.name == name).unwrap()
}

#[test]
fn a_glb_shows_what_its_obj_shows() {
    let obj = room();
    let glb = Scene::open_with(&format!("{FOLDER}room-glb.toml"), LoadOptions::default()).unwrap();
    assert_eq!(glb.warnings, [""; 0]);
    for own in &obj.materials {
        let other = material(&glb, &own.name);
        assert!((own.rho - other.rho).abs().max_element() < 1e-6 && own.sides == other.sides, "{}", own.name);
        assert!((own.emission - other.emission).abs().max_element() < 1e-5, "{}", own.name);
        assert_eq!(own.maps.is_some(), other.maps.is_some(), "{}", own.name);
    }
    // Faces are in another order: each is found by its corners.
    for face in 0..obj.faces.len() as u32 {
        // The GLB has its corners in single precision.
        let near = |(p, q): (Vec3, Vec3)| p.distance(q) < 1e-6;
        let same = |other: &u32| obj.corners(face).into_iter().zip(glb.corners(*other)).all(near);
        let other = (0..glb.faces.len() as u32).find(same).expect("the face");
        let [a, b, c] = obj.corners(face);
        for (u, v) in [(0.2, 0.3), (0.7, 0.1), (0.05, 0.9)] {
            let at: Vec3 = a + u * (b - a) + v * (c - a);
            let apart = (obj.rho_at(face, at) - glb.rho_at(other, at)).abs().max_element();
            // Coordinates of single precision on images of 48 texels whose contrast is 1.
            assert!(apart < 1e-4, "{} {at}: {apart}", obj.material(face).name);
            assert!((obj.coverage_at(face, at) - glb.coverage_at(other, at)).abs() < 1e-4);
            let [e, f] = [obj.emitted_at(face, at), glb.emitted_at(other, at)].map(|light| light.visible);
            assert!((e - f).abs().max_element() < 1e-3);
        }
    }
    let [a, b] = [&obj, &glb].map(|scene| Solver::new(scene).render(Mode::Global, (32, 32)).tolerance(0.02).unwrap());
    let apart = relative_rms(&a.picture, &b.picture, None, None).unwrap();
    assert!(apart <= 1.5 * a.error.total.hypot(b.error.total), "{apart}");
}

#[test]
fn samplers_and_transforms_are_read() {
    let turned = json!({"scale": [2, 3], "offset": [0.5, 0.25], "rotation": std::f32::consts::FRAC_PI_2});
    let scene = with(&[
        ("/samplers/0", json!({"wrapS": 33648, "wrapT": 33071, "magFilter": 9728})),
        ("/materials/3/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform", turned),
    ])
    .unwrap();
    let texture = material(&scene, "poster").maps.as_ref().unwrap().reflectance.as_ref().unwrap();
    assert_eq!((texture.wrap, texture.filter), ([Wrap::Mirror, Wrap::Clamp], Filter::Nearest));
    // Scaled to (2 u, 3 v), then a quarter turn with v down: (x, y) becomes (y, -x).
    let found = texture.placement.transform_point2(DVec2::new(0.25, 0.5));
    assert!((found - DVec2::new(1.5 + 0.5, -0.5 + 0.25)).length() < 1e-6, "{found}");
}

#[test]
fn alpha_cuts_holes_as_its_mode_says() {
    let mask = |mode: &str, alpha: f32| {
        let scene = with(&[
            ("/materials/5/alphaMode", json!(mode)),
            ("/materials/5/pbrMetallicRoughness/baseColorFactor", json!([1, 1, 1, alpha])),
        ])
        .unwrap();
        material(&scene, "leaf").maps.as_ref().unwrap().mask.as_ref().map(|mask| (mask.factor, mask.cutoff))
    };
    assert_eq!(mask("OPAQUE", 0.75), None);
    assert_eq!(mask("BLEND", 0.75), Some((0.75, None)));
    assert_eq!(mask("MASK", 0.75), Some((0.75, Some(0.5))));
    // Without texels the factor is the share everywhere.
    let plain = |alpha: f32| {
        let scene = with(&[
            ("/materials/0/alphaMode", json!("BLEND")),
            ("/materials/0/pbrMetallicRoughness/baseColorFactor", json!([0.5, 0.5, 0.5, alpha])),
        ])
        .unwrap();
        material(&scene, "plain").maps.is_some()
    };
    assert_eq!([plain(1.0), plain(0.25)], [false, true]);
}

#[test]
fn images_that_are_not_there_are_named_and_broken_ones_refused() {
    let missing = with(&[("/images/0", json!({"uri": "lost.png"}))]).unwrap();
    let all = missing.warnings.join("\n");
    assert!(all.contains("images that cannot be read, of materials (floor: lost.png)"), "{all}");
    assert!(material(&missing, "floor").maps.is_none());
    // Positions are no image.
    let other = with(&[("/images/0/bufferView", json!(0))]).unwrap();
    assert!(other.warnings.join("\n").contains("materials (floor: an unknown format)"));
    let view = |scene: Result<Scene, SceneError>| scene.unwrap_err().to_string();
    let error = view(with(&[("/images/0", json!({"uri": "data:image/png;base64,iVBORw0KGgo="}))]));
    assert!(error.contains("image 0 is broken"), "{error}");
    let error = view(with(&[("/images/0", json!({"uri": "data:image/png;base64,AA=A"}))]));
    assert!(error.contains("image 0 is broken: its data URI"), "{error}");
}

#[test]
fn textures_without_coordinates_are_named() {
    let scene = with(&[("/meshes/0/primitives/1/attributes", json!({"POSITION": 3}))]).unwrap();
    let all = scene.warnings.join("\n");
    assert!(all.contains("textures without coordinates, of materials (floor)"), "{all}");
}
