//! The built-in scenes: closed where they claim to be, seen from the front, equal to the files under `meshes/`.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use glam::DVec3;
use halflight::scene::{LoadOptions, Scene, builtin};

fn load(name: &str) -> Scene {
    Scene::builtin(name, LoadOptions::default()).expect("a built-in name").expect("a correct scene")
}

/// Faces of one object, or of all.
fn faces<'a>(scene: &'a Scene, object: Option<&'a str>) -> impl Iterator<Item = [DVec3; 3]> + 'a {
    let wanted = move |face: &u32| {
        let name = &scene.objects[scene.faces[*face as usize].object as usize];
        object.is_none_or(|object| object == name)
    };
    (0..scene.faces.len() as u32).filter(wanted).map(|face| scene.corners(face).map(|v| v.as_dvec3()))
}

/// Directed edges that no neighbour runs the other way; empty for a closed mesh.
fn open_edges(scene: &Scene, objects: &[&str]) -> usize {
    let mut edges: HashMap<(u32, u32), i32> = HashMap::new();
    for face in &scene.faces {
        if objects.contains(&scene.objects[face.object as usize].as_str()) {
            for i in 0..3 {
                let (a, b) = (face.vertices[i], face.vertices[(i + 1) % 3]);
                *edges.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
            }
        }
    }
    edges.values().filter(|&&sum| sum != 0).count()
}

/// What the camera's rays meet first: how many fronts, backs and nothing.
fn seen(scene: &Scene, n: u32) -> [usize; 3] {
    let mut counts = [0; 3];
    for i in 0..n * n {
        let (x, y) = ((i % n) as f32 + 0.513, (i / n) as f32 + 0.487);
        let (origin, way) = scene.camera.ray(x / n as f32, y / n as f32, 1.0);
        let (origin, way) = (origin.as_dvec3(), way.as_dvec3());
        let hits = faces(scene, None).filter_map(|[a, b, c]| {
            let normal = (b - a).cross(c - a);
            let t = (a - origin).dot(normal) / way.dot(normal);
            let p = origin + t * way;
            let inside = |u: DVec3, v: DVec3| (v - u).cross(p - u).dot(normal) >= 0.0;
            let hit = t > 0.0 && inside(a, b) && inside(b, c) && inside(c, a);
            hit.then_some((t, way.dot(normal) < 0.0))
        });
        let first = hits.min_by(|a, b| a.0.total_cmp(&b.0));
        counts[first.map_or(2, |(_, front)| usize::from(!front))] += 1;
    }
    counts
}

#[test]
fn all_load_without_warnings_and_emit() {
    for name in builtin::names() {
        let scene = load(name);
        scene.require_emission().unwrap();
        assert_eq!((scene.name.as_str(), scene.warnings.len()), (name, 0), "{:?}", scene.warnings);
    }
}

#[test]
fn the_files_under_meshes_are_the_embedded_ones() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes");
    for files in builtin::ALL {
        for (extension, text) in [("toml", files.toml), ("obj", files.obj), ("mtl", files.mtl)] {
            let path = folder.join(files.name).with_extension(extension);
            assert_eq!(fs::read_to_string(path).unwrap(), text);
            assert!(text.len() < 300_000);
        }
        let opened = Scene::load(&folder.join(files.name).with_extension("toml"), LoadOptions::default()).unwrap();
        assert_eq!(opened.faces, load(files.name).faces);
    }
}

#[test]
fn cameras_see_fronts_only() {
    for name in builtin::names() {
        let [front, back, nothing] = seen(&load(name), 24);
        assert_eq!(back, 0, "{name}");
        // The Cornell box is open to the camera and the picture a little larger than the opening.
        assert!(front > 400 && (nothing == 0 || name == "cornell-box"), "{name}: {front} {nothing}");
    }
}

#[test]
fn a_room_without_its_camera_is_seen_from_inside() {
    for name in ["furnace", "furnished-room", "two-rooms"] {
        let mut scene = load(name);
        scene.camera = halflight::scene::Camera::framing(&scene);
        let [front, back, nothing] = seen(&scene, 16);
        assert_eq!((front, back, nothing), (256, 0, 0), "{name}");
    }
}

#[test]
fn closed_scenes_have_no_open_edge() {
    for (name, shell) in [
        ("furnace", vec!["cube"]),
        ("concentric-spheres", vec!["outer", "cap"]),
        ("concentric-spheres", vec!["inner"]),
        ("furnished-room", vec!["room"]),
        ("two-rooms", vec!["floor", "ceilings", "left room", "right room", "dividing wall", "doorway"]),
    ] {
        assert_eq!(open_edges(&load(name), &shell), 0, "{name}");
    }
    // The Cornell box lacks its front wall: four edges of floor, ceiling and sides stay open there.
    let walls = ["floor", "ceiling", "back", "right_green", "left_red", "light"];
    assert!(open_edges(&load("cornell-box"), &walls) >= 4);
}

#[test]
fn room_walls_face_inwards() {
    for (name, object) in [("furnace", "cube"), ("furnished-room", "room")] {
        let scene = load(name);
        for [a, b, c] in faces(&scene, Some(object)) {
            let normal = (b - a).cross(c - a);
            assert!(normal.dot(a + b + c) < 0.0, "{name}: {a}");
        }
    }
}

#[test]
fn the_spheres_are_spheres() {
    let scene = load("concentric-spheres");
    for (object, radius, sign) in [("outer", 1.0, -1.0), ("cap", 1.0, -1.0), ("inner", 0.5, 1.0)] {
        for corners in faces(&scene, Some(object)) {
            // Nine decimals in the file, then single precision.
            assert!(corners.iter().all(|p| (p.length() - radius).abs() < 2e-7));
            let [a, b, c] = corners;
            assert!(sign * (b - a).cross(c - a).dot(a) > 0.0);
        }
    }
    let area = |object| faces(&scene, Some(object)).map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length()).sum::<f64>();
    // A quarter of the outer area; the inner sphere's coarser facets lose 1 %.
    assert!((area("inner") / (area("outer") + area("cap")) - 0.25).abs() < 0.0025);
}

/// An estimate, not a proof: the furniture as one convex body of the same area inside the room.
#[test]
fn the_furnished_room_holds_enough_for_shadowless_light_to_diverge() {
    let scene = load("furnished-room");
    let area = |[a, b, c]: [DVec3; 3]| 0.5 * (b - a).cross(c - a).length();
    let all: f64 = faces(&scene, None).map(area).sum();
    let room: f64 = faces(&scene, Some("room")).map(area).sum();
    let share = (all - room) / room;
    // Concentric spheres of this share q have the spectral radius rho (1 + sqrt(1 + 4 q))/2 (Cauchy and Crofton).
    let radius = 0.8 * (1.0 + (1.0 + 4.0 * share).sqrt()) / 2.0;
    assert!(radius > 1.0, "{share} {radius}");
}
