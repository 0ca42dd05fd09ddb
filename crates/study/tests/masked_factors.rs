//! Form factors of objects that are there in part, by their opacity.

use halflight::render::Silent;
use halflight::scene::{Scene, Sides};
use halflight_study::{FactorSettings, FactorTable, factors};

/// A pane of opacity 0.25 in a closed room took all that a whole one takes: a row of `factors` summed to more than 1.
#[test]
fn form_factors_count_what_is_there_of_a_masked_object() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = |name: &str| directory.path().join(name);
    let mut obj = String::from("mtllib room.mtl\nusemtl wall\no room\n");
    let box_corners = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n";
    obj += box_corners;
    for face in ["1 2 3 4", "5 8 7 6", "1 5 6 2", "4 3 7 8", "1 4 8 5", "2 6 7 3"] {
        obj += &format!("f {face}\n");
    }
    obj += "o pane\nusemtl glass\nv -0.5 -0.5 0\nv 0.5 -0.5 0\nv 0.5 0.5 0\nv -0.5 0.5 0\nf 9 10 11 12\n";
    std::fs::write(path("room.obj"), &obj).expect("written");
    let table = |opacity: f64| {
        let mtl = format!("newmtl wall\nKd 0.5 0.5 0.5\nnewmtl glass\nKd 0.5 0.5 0.5\nd {opacity}\n");
        std::fs::write(path("room.mtl"), mtl).expect("written");
        let mut scene = Scene::open(path("room.obj").to_str().expect("a path")).expect("a scene");
        let glass = scene.materials.iter_mut().find(|material| material.name == "glass");
        glass.expect("a pane").sides = Sides::Two;
        let settings = FactorSettings { tolerance: 1e-3, seed: 0 };
        factors(&scene, &vec![0.0; scene.materials.len()], &settings, &Silent)
    };
    let (whole, part) = (table(1.0), table(0.25));
    let of = |table: &FactorTable, from: usize, to: usize| {
        let found = table.factors.iter().find(|f| f.from == from && f.to == to).expect("a pair");
        (found.share.value, found.share.error)
    };
    let (all, _) = of(&whole, 0, 1);
    let (some, error) = of(&part, 0, 1);
    assert!((some - 0.25 * all).abs() < 5.0 * error.max(1e-6), "{some} ± {error} beside {}", 0.25 * all);
    let (rest, other) = of(&part, 0, 0);
    assert!((some + rest - 1.0).abs() < 5.0 * error.hypot(other).max(1e-6), "{some} {rest}");
}
