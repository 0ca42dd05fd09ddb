//! Rooms whose walls are wound either way: the camera that a file without one gets, and what is said of black backs.

use glam::{DVec3, Vec3};
use halflight::scene::{AddedLight, Camera, LoadOptions, Scene, Sides, SkyLight, Winding};

use crate::run;

/// Walls of a room of 4 by 3 by 5 with the front inside: floor, ceiling, left, right, back, front.
const WALLS: [&str; 6] = ["1 5 8 4", "2 3 7 6", "1 2 6 5", "4 8 7 3", "1 4 3 2", "5 6 7 8"];
const CORNERS: &str = "v 0 0 0\nv 0 3 0\nv 4 3 0\nv 4 0 0\nv 0 0 5\nv 0 3 5\nv 4 3 5\nv 4 0 5\n";
const LAMP: &str = "v 1.5 2.9 2\nv 2.5 2.9 2\nv 2.5 2.9 3\nv 1.5 2.9 3\no lamp\nusemtl lamp\nf 9 10 11 12\n";
const MTL: &str = "newmtl white\nKd .6 .6 .6\nnewmtl lamp\nKd 0\nKe 10\n";

/// The room with the walls of these numbers wound outwards, each an object.
fn room(outwards: &[usize], more: &str) -> String {
    let wall = |(number, corners): (usize, &&str)| {
        let mut turned: Vec<&str> = corners.split(' ').collect();
        if outwards.contains(&number) {
            turned.reverse();
        }
        format!("o wall{number}\nf {}\n", turned.join(" "))
    };
    let walls: String = WALLS.iter().enumerate().map(wall).collect();
    format!("mtllib m.mtl\n{CORNERS}usemtl white\n{walls}{more}")
}

fn read(obj: &str, options: LoadOptions) -> Scene {
    let toml = "obj = \"s.obj\"";
    Scene::from_toml_text("s", toml, obj, MTL, options).expect("a scene")
}

/// Whether the camera is in the room.
fn is_inside(scene: &Scene) -> bool {
    let eye = scene.frame.to_file(scene.camera.position.as_dvec3());
    eye.cmpgt(DVec3::ZERO).all() && eye.cmplt(DVec3::new(4.0, 3.0, 5.0)).all()
}

const TWO: LoadOptions = LoadOptions {
    two_sided: Sides::Two,
    reflectance: None,
    light: None,
    highlights: false,
    unit: None,
    winding: Winding::Turned,
};

#[test]
fn a_room_with_a_lamp_in_it_is_seen_from_inside_however_it_is_wound() {
    let plain = read(&room(&[], LAMP), LoadOptions::default());
    let two = read(&room(&[], LAMP), TWO);
    assert!(is_inside(&plain) && two.camera == plain.camera);
    for outwards in [&[0][..], &[1], &[2], &[5], &[0, 1], &[2, 3, 4], &[0, 1, 2, 3, 4, 5]] {
        let text = room(outwards, LAMP);
        assert!(is_inside(&read(&text, LoadOptions::default())), "{outwards:?}");
        // With two sides all are one scene.
        assert_eq!(read(&text, TWO).camera, two.camera, "{outwards:?}");
    }
}

#[test]
fn bodies_and_what_is_open_are_seen_from_outside() {
    let all = [0, 1, 2, 3, 4, 5];
    let sky = LoadOptions { light: Some(AddedLight::Sky), ..LoadOptions::default() };
    // A box whose fronts look outward, under a sky, under an added lamp above it, and with a lamp beside it.
    assert!(!is_inside(&read(&room(&all, ""), sky)));
    let ceiling = LoadOptions { light: Some(AddedLight::Ceiling), ..LoadOptions::default() };
    assert!(!is_inside(&read(&room(&all, ""), ceiling)));
    let beside =
        LAMP.replace("v 1.5 2.9 2", "v 1.5 9 2").replace("v 2.5 2.9", "v 2.5 9").replace("v 1.5 2.9 3", "v 1.5 9 3");
    assert!(!is_inside(&read(&room(&all, &beside), LoadOptions::default())));
    // A closed two-sided box under a sky is dark inside.
    assert!(!is_inside(&read(&room(&[], ""), LoadOptions { light: Some(AddedLight::Sky), ..TWO })));
    // Walls that lack one: no room, whichever way.
    for outwards in [&[][..], &all] {
        let open = room(outwards, LAMP).replace("o wall5\nf 5 6 7 8\n", "").replace("o wall5\nf 8 7 6 5\n", "");
        assert!(!is_inside(&read(&open, LoadOptions::default())), "{outwards:?}");
    }
}

#[test]
fn light_from_outside_shows_a_room_with_windows_from_inside() {
    // The back wall as a frame around a window, closed by a pane that lets light through.
    let frame = "v 1 1 0\nv 1 2.5 0\nv 3 2.5 0\nv 3 1 0\nf 1 4 12 9\nf 4 3 11 12\nf 3 2 10 11\nf 2 1 9 10\n";
    let pane = "usemtl pane\nf 9 12 11 10\n";
    let text = |outwards: &[usize], pane: &str| {
        let back = if outwards.contains(&4) { "2 3 4 1" } else { "1 4 3 2" };
        room(outwards, &format!("{frame}{pane}")).replace(&format!("o wall4\nf {back}\n"), "o wall4\n")
    };
    let lit = |text: &str, options: LoadOptions| {
        let mtl = format!("{MTL}newmtl pane\nKd 0\nd .1\n");
        let mut scene =
            Scene::from_toml_text("s", "obj = \"s.obj\"\n[sky]\nradiance = [1, 1, 1]", text, &mtl, options).unwrap();
        scene.set_sky(SkyLight { upper: Vec3::ONE, lower: Vec3::ONE }, DVec3::Y);
        assert_eq!(Camera::framing(&scene), scene.camera);
        scene
    };
    for pane in ["", pane] {
        assert!(is_inside(&lit(&text(&[], pane), LoadOptions::default())), "{pane}");
        for outwards in [&[][..], &[0, 1, 2, 3, 5]] {
            assert!(is_inside(&lit(&text(outwards, pane), TWO)), "{pane} {outwards:?}");
        }
    }
}

#[test]
fn a_two_sided_ceiling_is_one_however_it_is_wound() {
    let height = |outwards: &[usize], two_sided| {
        let options = LoadOptions { light: Some(AddedLight::Ceiling), two_sided, ..LoadOptions::default() };
        let scene = read(&room(outwards, ""), options);
        let lamp = (0..scene.faces.len() as u32).find(|&face| scene.material(face).emits()).unwrap();
        (scene.frame.to_file(scene.exact_corners(lamp)[0]).y, is_inside(&scene))
    };
    let (below, inside) = height(&[], Sides::One);
    // The rays that find the ceiling are of single precision.
    assert!((below - 2.97).abs() < 1e-6 && inside);
    for outwards in [&[][..], &[0], &[1], &[0, 1, 2, 3, 4, 5]] {
        assert_eq!(height(outwards, Sides::Two), (below, true), "{outwards:?}");
    }
    // Of a body with one side the inside is not lit.
    assert!(height(&[0, 1, 2, 3, 4, 5], Sides::One).0 > 3.0);
}

/// Whether some of a scene was turned inside out.
fn is_turned(scene: &Scene) -> bool {
    scene.warnings.iter().any(|warning| warning.text.contains("turned inside out"))
}

const ALL: [usize; 6] = [0, 1, 2, 3, 4, 5];

/// The room as one object, with fewer of its walls or wound outwards.
fn as_one(outwards: &[usize], more: &str) -> String {
    room(outwards, more).lines().filter(|line| !line.starts_with("o wall")).map(|line| format!("{line}\n")).collect()
}

/// A scaled default cube is wound outwards: the picture was black, without an error.
#[test]
fn a_closed_room_that_looks_outward_is_turned() {
    let plain = read(&room(&[], LAMP), LoadOptions::default());
    for text in [room(&ALL, LAMP), as_one(&ALL, LAMP)] {
        let turned = read(&text, LoadOptions::default());
        assert!(is_turned(&turned) && turned.camera == plain.camera);
        // The middle of unit coordinates is that of the room; the lamp faces down as it did.
        let looks_outward = |scene: &Scene, face: u32| {
            let [a, b, c] = scene.exact_corners(face);
            (b - a).cross(c - a).dot(a) > 0.0
        };
        assert!((0..turned.solid_faces()).all(|face| !looks_outward(&turned, face)));
        let kept = read(&text, LoadOptions { winding: Winding::AsModelled, ..LoadOptions::default() });
        assert!(!is_turned(&kept) && looks_outward(&kept, 0));
    }
    // By a camera of its own, and lit from outside, through a window.
    let toml = "obj = \"s.obj\"\n[camera]\nposition = [1, 1, 1]\ntarget = [2, 1, 3]\n[sky]\nradiance = [1, 1, 1]";
    let wall = "v 1 1 0\nv 1 2.5 0\nv 3 2.5 0\nv 3 1 0\nf 9 12 4 1\nf 12 11 3 4\nf 11 10 2 3\nf 10 9 1 2\n";
    let text = as_one(&ALL, wall).replace("f 2 3 4 1\n", "");
    assert!(is_turned(&Scene::from_toml_text("s", toml, &text, MTL, LoadOptions::default()).expect("a scene")));
}

#[test]
fn what_is_right_or_open_or_seen_from_outside_is_not_turned() {
    let given = |at: &str, text: &str| {
        let toml = format!("obj = \"s.obj\"\n[camera]\nposition = {at}\ntarget = [2, 1, 2.5]");
        is_turned(&Scene::from_toml_text("s", &toml, text, MTL, LoadOptions::default()).expect("a scene"))
    };
    let [inside, outside] = ["[1, 1, 1]", "[9, 5, 12]"];
    assert!(!given(inside, &as_one(&[], LAMP)), "its fronts are inside");
    assert!(given(inside, &as_one(&ALL, LAMP)) && !given(outside, &as_one(&ALL, LAMP)));
    // The outer faces of walls with thickness look outward.
    let corners = "v -1 -1 -1\nv -1 4 -1\nv 5 4 -1\nv 5 -1 -1\nv -1 -1 6\nv -1 4 6\nv 5 4 6\nv 5 -1 6\n";
    let outer = "f 12 16 13 9\nf 14 15 11 10\nf 13 14 10 9\nf 11 15 16 12\nf 10 11 12 9\nf 16 15 14 13\n";
    let lamp = LAMP.replace("f 9 10 11 12", "f -4 -3 -2 -1");
    assert!(!given(inside, &as_one(&[], &format!("{corners}{outer}{lamp}"))));
    // A room that lacks a wall, and a sheet.
    assert!(!given(inside, &as_one(&ALL, LAMP).replace("f 8 7 6 5\n", "")));
    let sheet = format!("mtllib m.mtl\n{CORNERS}usemtl white\nf 4 8 5 1\n{LAMP}");
    assert!(!given(inside, &sheet));
    // Furniture that stands in a room which is turned keeps its fronts.
    let table = "v 1 .1 1\nv 1 1 1\nv 2 1 1\nv 2 .1 1\nv 1 .1 2\nv 1 1 2\nv 2 1 2\nv 2 .1 2\n";
    let table =
        format!("{table}f 12 16 13 9\nf 14 15 11 10\nf 13 14 10 9\nf 11 15 16 12\nf 10 11 12 9\nf 16 15 14 13\n");
    let toml = "obj = \"s.obj\"\n[camera]\nposition = [3.5, 1, 4]\ntarget = [2, 1, 2.5]";
    let text = as_one(&ALL, &format!("{table}{lamp}"));
    let scene = Scene::from_toml_text("s", toml, &text, MTL, LoadOptions::default()).expect("a scene");
    let kept = read(&as_one(&[], &format!("{table}{lamp}")), LoadOptions::default());
    assert!(is_turned(&scene));
    let fronts = |scene: &Scene| -> Vec<DVec3> {
        let normal = |face: u32| {
            let [a, b, c] = scene.exact_corners(face);
            (b - a).cross(c - a).normalize().round()
        };
        (0..scene.solid_faces()).map(normal).collect()
    };
    assert_eq!(fronts(&scene)[12..], fronts(&kept)[12..]);
}

/// What a run says on stderr of a room in a folder of its own.
fn said(obj: &str, arguments: &str) -> String {
    let place = run::place(&[("room.obj", obj), ("m.mtl", MTL)]);
    run::succeed(&place, &format!("{arguments} room.obj --size 24x24")).err
}

#[test]
fn black_backs_are_named_with_their_share_and_the_remedy() {
    let render = "render --mode global --tolerance 0.1";
    let text = said(&room(&[0], LAMP), render);
    let warned: Vec<&str> = text.lines().filter(|line| line.contains("black back")).collect();
    assert_eq!(warned.len(), 1, "{text}");
    assert!(warned[0].contains("of wall0:") && warned[0].contains("--two-sided"), "{}", warned[0]);
    let share = warned[0].split_whitespace().find_map(|word| word.parse::<f64>().ok());
    assert!(share.is_some_and(|share| (1.0..100.0).contains(&share)), "{}", warned[0]);
    assert!(!said(&room(&[0], LAMP), &format!("{render} --two-sided")).contains("black back"));
    assert!(!said(&room(&[], LAMP), render).contains("black back"));
    // All of them together are turned.
    let all = said(&room(&ALL, LAMP), render);
    assert!(all.contains("`wall0` (and 5 more objects) was turned inside out") && !all.contains("black back"), "{all}");
    assert!(said(&room(&ALL, LAMP), &format!("{render} --as-modelled")).contains("black back"));
    // A tracer of several modes says it once as well.
    let traced = said(&room(&[0], LAMP), "trace --mode all --samples 4");
    assert_eq!(traced.matches("black back").count(), 1, "{traced}");
}
