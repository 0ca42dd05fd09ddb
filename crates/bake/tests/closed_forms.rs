//! Rooms whose irradiance is known.

use halflight::pictures::Picture;
use halflight_bake::Bake;

use crate::{baked, folder, goal, name};

/// Texels that show something.
fn shown(found: &Bake) -> impl Iterator<Item = (usize, [f32; 3])> {
    let Picture { pixels, .. } = &found.maps[0].irradiance;
    let all = pixels.iter().enumerate().filter(|(k, _)| found.coverage.of(*k) > 0.0);
    all.map(|(k, pixel)| (k, pixel.to_array()))
}

/// A closed cube that emits 0.25 and reflects 0.5 everywhere has the radiance 0.5, so the irradiance pi / 2.
#[test]
fn a_uniform_furnace_is_flat() {
    let (_, found) = baked("furnace", &goal(64, 0.05));
    let exact = std::f32::consts::FRAC_PI_2;
    for (k, pixel) in shown(&found) {
        assert!(pixel.iter().all(|x| (x / exact - 1.0).abs() < 1e-3), "{k} {pixel:?}");
    }
    // Texels between charts as well, which mipmaps mix in.
    let all = &found.maps[0].irradiance.pixels;
    assert!(all.iter().all(|pixel| (pixel.x / exact - 1.0).abs() < 1e-3));
    assert!(found.unmet.is_none() && found.coverage.count() > 1500, "{}", found.coverage.count());
}

/// A closed room of black-backed faces under a sky of 100, with a floor that its walls touch.
const ROOM: &str = "v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nv 0 1 0\nv 1 1 0\nv 1 1 1\nv 0 1 1\n\
    o floor\nf 4 3 2 1\no ceiling\nf 5 6 7 8\no walls\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

/// The same room of solid walls, a fifth thick, that stand on a floor which goes on below them.
fn thick() -> String {
    let mut text = String::new();
    let mut count = 0;
    let mut solid = |name: &str, low: [f64; 3], high: [f64; 3]| {
        text += &format!("o {name}\n");
        for k in 0..8 {
            let at = |axis: usize| if (k >> axis) & 1 == 0 { low[axis] } else { high[axis] };
            text += &format!("v {} {} {}\n", at(0), at(1), at(2));
        }
        for face in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
            text += &format!("f {}\n", face.map(|k| (k + 1 + count).to_string()).join(" "));
        }
        count += 8;
    };
    solid("floor", [-0.2, -0.1, -0.2], [1.2, 0.0, 1.2]);
    solid("ceiling", [-0.2, 1.0, -0.2], [1.2, 1.1, 1.2]);
    solid("west", [-0.2, 0.0, -0.2], [0.0, 1.0, 1.2]);
    solid("east", [1.0, 0.0, -0.2], [1.2, 1.0, 1.2]);
    solid("north", [0.0, 0.0, -0.2], [1.0, 1.0, 0.0]);
    solid("south", [0.0, 0.0, 1.0], [1.0, 1.0, 1.2]);
    text
}

fn under_a_sky(obj: &str) -> (tempfile::TempDir, String) {
    let scene = "obj = \"room.obj\"\n[sky]\nradiance = [100, 100, 100]\n[camera]\nposition = [0.5, 0.5, 0.9]\n\
                 target = [0.5, 0.4, 0.1]\n";
    let folder = folder(&[("room.obj", obj), ("room.toml", scene)]);
    let name = name(&folder, "room.toml");
    (folder, name)
}

#[test]
fn no_light_leaks_into_a_closed_room() {
    let (_folder, name) = under_a_sky(ROOM);
    let (_, found) = baked(&name, &goal(64, 0.05));
    let lit: Vec<_> = shown(&found).filter(|(_, pixel)| pixel.iter().any(|x| *x != 0.0)).collect();
    assert!(lit.is_empty() && found.coverage.count() > 1500, "{lit:?}");
}

/// Of the floor only what is between the walls is shown, and it is dark; of texels below the edge of a wall as well.
#[test]
fn no_light_leaks_below_walls_that_stand_on_a_floor() {
    let (_folder, name) = under_a_sky(&thick());
    let scene = halflight::Scene::open(&name).expect("a scene");
    let model = halflight_bake::Model::open(&name, &scene).expect("parts");
    let goal = goal(256, 0.05);
    let solver = halflight::Solver::new(&scene).seed(goal.seed);
    let laid = halflight_bake::LaidOut::new(&solver, model.parts(), &goal).expect("charts");
    let middles = laid.middles(&scene);
    let found = laid.bake(solver, &goal).expect("maps");
    let (mut within, mut outside) = (0, 0);
    for (k, pixel) in shown(&found) {
        let (at, _) = middles[k].expect("shown");
        // Between the walls, floor, ceiling and walls alike.
        if at.cmpgt(glam::DVec3::new(-0.01, -0.001, -0.01)).all() && at.cmplt(glam::DVec3::new(1.01, 1.001, 1.01)).all()
        {
            assert_eq!(pixel, [0.0; 3], "{at}");
            within += 1;
        } else {
            outside += usize::from(pixel[0] > 10.0);
        }
    }
    assert!(within > 2000 && outside > 2000, "{within} {outside}");
}
