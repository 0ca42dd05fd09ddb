//! The first minute with one's own room: a scene as a modelling program writes it, and what people type.

use halflight::pictures::read_picture;

use crate::run::{SMALL, files, halflight, place, report, report_of_mode, succeed};

/// A scaled cube with its fronts outside, a table in it, and a lamp 5 cm below the ceiling, as Blender writes them.
const ROOM: &str = include_str!("../../../tests/data/welcome/room.obj");
const MTL: &str = include_str!("../../../tests/data/welcome/room.mtl");

#[test]
fn a_room_of_a_scaled_cube_is_not_black() {
    let place = place(&[("room.obj", ROOM), ("room.mtl", MTL)]);
    let ran = succeed(&place, "render room.obj --size 48 --tolerance 5% -o pictures/new/room.exr");
    assert!(ran.err.contains("`Room` was turned inside out") && !ran.err.contains("black back"), "{}", ran.err);
    // Its legs stand on the floor, whose front is up: nothing lies in one place, and there is nothing else to say.
    assert_eq!(ran.err.lines().count(), 1, "{}", ran.err);
    // One picture, in a folder that was not there.
    assert_eq!(files(&place), ["pictures/new/room.exr", "room.mtl", "room.obj"]);
    let picture = read_picture(place.path().join("pictures/new/room.exr")).unwrap();
    assert_eq!((picture.width, picture.height), (48, 48));
    let lit = picture.pixels.iter().filter(|pixel| pixel.max_element() > 0.01).count();
    assert!(lit > picture.pixels.len() * 9 / 10, "{lit}");
    let kept = succeed(&place, "render room.obj --size 24 --tolerance 10% --as-modelled");
    assert!(kept.err.contains("--two-sided=Walls") && kept.err.contains("[materials.\"Walls\"]"), "{}", kept.err);
    // What the warning advises helps.
    let two = succeed(&place, "render room.obj --size 24 --tolerance 10% --as-modelled --two-sided=Walls,Wood");
    assert!(!two.err.contains("black back"), "{}", two.err);
    let unknown = halflight(&place, "render room.obj --two-sided=Wall");
    assert_eq!(unknown.code, Some(2));
    assert!(unknown.err.contains("no material `Wall`") && unknown.err.contains("Walls, Wood, Lamp"), "{}", unknown.err);
}

#[test]
fn a_file_gives_one_picture_unless_more_are_wanted() {
    let place = place(&[("room.obj", ROOM), ("room.mtl", MTL)]);
    let one = report_of_mode(&place, "render room.obj --size 16 --tolerance 20%");
    assert_eq!(one["mode"], "global");
    let all = report(&place, "render room.obj --size 16 --tolerance 20% --mode all");
    assert_eq!(all["modes"].as_array().map(Vec::len), Some(4));
}

/// Blender's strengths go from 1 to hundreds: near black, or burnt, where a radiance of 1 is white.
#[test]
fn pictures_are_as_bright_as_they_can_be_seen() {
    let shown = |strength: &str, options: &str| {
        let lamp = format!("Ke {strength} {strength} {strength}");
        let place = place(&[("room.obj", ROOM), ("room.mtl", &MTL.replace("Ke 12.000000 11.000000 10.000000", &lamp))]);
        let told = report_of_mode(&place, &format!("render room.obj --size 24 --tolerance 10% -o room.png {options}"));
        let picture = read_picture(place.path().join("room.png")).unwrap();
        let mean = picture.pixels.iter().map(|p| f64::from(p.y)).sum::<f64>() / picture.pixels.len() as f64;
        (mean, told["exposure"].as_f64().unwrap())
    };
    let found = ["0.5", "12", "500"].map(|strength| shown(strength, ""));
    for (mean, stops) in found {
        // Nine in ten pixels are at most half white, and most of a room is not far below.
        assert!((0.15..0.5).contains(&mean), "{found:?}");
        assert!((mean / found[0].0 - 1.0).abs() < 0.02 && (stops < 0.0 || found[0].1 > 0.0), "{found:?}");
    }
    assert!(found[0].1 > found[1].1 && found[1].1 > found[2].1, "{found:?}");
    assert_eq!(shown("12", "--exposure 0").1, 0.0);
    assert_eq!(report_of_mode(&place(&[]), &format!("render {SMALL} --mode local"))["exposure"], 0.0);
}

#[test]
fn what_people_type_is_answered() {
    let place = place(&[("room.obj", ROOM), ("room.mtl", MTL)]);
    std::fs::create_dir(place.path().join("rooms")).unwrap();
    std::fs::write(place.path().join("rooms/a.obj"), ROOM).unwrap();
    for (typed, code, answer) in [
        ("room.obj", 2, "`halflight render room.obj`"),
        ("two-rooms", 2, "`halflight render two-rooms`"),
        ("render cornel-box", 3, "did you mean `cornell-box`?"),
        ("render rooms", 3, "rooms is a folder"),
        ("render rooms", 3, "a.obj"),
    ] {
        let ran = halflight(&place, typed);
        assert_eq!(ran.code, Some(code), "{typed}: {}", ran.err);
        assert!(ran.err.contains(answer), "{typed}: {}", ran.err);
    }
    assert!(!halflight(&place, "render nothing-like-it").err.contains("did you mean"));
    assert!(!halflight(&place, "rendr").err.contains("a scene is rendered"));
    let listed = succeed(&place, "scenes").out;
    assert!(listed.contains("gallery ") && listed.contains("two-rooms "), "{listed}");
    succeed(&place, &format!("render gallery {SMALL} --mode local"));
}

/// What is guessed stands before what is left out, and that before what is only simpler, wherever each is in the file.
#[test]
fn the_worst_is_told_first() {
    let obj = "mtllib lost.mtl\np 1\nv 0 0 0\nv 1 0 0\nv 0 1 0\ns 1\nusemtl white\nf 1 2 3\n";
    let place = place(&[("smooth.obj", obj)]);
    let ran = succeed(&place, &format!("render smooth.obj --light sky --mode local {SMALL}"));
    let at = |words: &str| ran.err.find(words).unwrap_or_else(|| panic!("{words}: {}", ran.err));
    let [lost, point, smooth] = ["missing MTL file", "points, lines", "smooth face"].map(at);
    assert!(lost < point && point < smooth, "{}", ran.err);
}

#[test]
fn shells_and_manuals_know_every_command() {
    let place = place(&[]);
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let text = succeed(&place, &format!("completions {shell}")).out;
        assert!(text.contains("relight") && text.contains("two-sided"), "{shell}");
    }
    let manual = succeed(&place, "man").out;
    assert!(manual.starts_with(".ie") && manual.contains("relight"), "{manual}");
}
