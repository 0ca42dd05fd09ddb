//! Pictures held against walks of light: what neither patches nor rays from the camera ever met is stated.

use halflight::Solver;
use halflight::light::Mode;
use halflight::render::{Ended, Rendered};
use halflight::scene::{LoadOptions, Scene};

const OBJ: &str = include_str!("data/sunbeam/sunbeam.obj");
const MTL: &str = include_str!("data/sunbeam/sunbeam.mtl");
const TOML: &str = include_str!("data/sunbeam/sunbeam.toml");

/// A room with a lamp of some radiance, and a beam onto the wall behind the camera.
fn sunbeam(lamp: &str, seed: u32) -> Rendered {
    let mtl = MTL.replace("Ke 10 10 10", &format!("Ke {lamp}"));
    let scene = Scene::from_toml_text("sunbeam", TOML, OBJ, &mtl, LoadOptions::default()).expect("a scene");
    let solver = Solver::new(&scene).seed(seed);
    solver.render(Mode::Global, (64, 64)).tolerance(0.05).expect("it converges")
}

/// A path tracer's reference shows 25 % more light than the receivers of patches ever met (its two halves, 1 % apart).
#[test]
fn light_that_no_receiver_met_is_stated() {
    for seed in [0, 1, 2] {
        let found = sunbeam("10 10 10", seed);
        let error = found.error;
        assert!(error.total > 0.8 * 0.25, "seed {seed}: {error:?}");
        assert!(found.unmet(0.05).is_some() && found.ended == Ended::Contradicted, "seed {seed}: {error:?}");
    }
}

/// The beam alone: all that the camera sees is reflected by walls that it lights.
#[test]
fn a_dark_picture_of_a_lit_room_is_not_within_its_tolerance() {
    let found = sunbeam("0 0 0", 0);
    assert!(found.unmet(0.05).is_some() && found.error.total > 0.5, "{:?}", found.error);
}

#[test]
fn pictures_that_are_right_are_not_contradicted() {
    for scene in ["cornell-box", "furnished-room", "two-rooms", "gallery"] {
        for (mode, seed) in [(Mode::Global, 0), (Mode::Local, 1), (Mode::OneBounce, 2)] {
            let scene = Scene::open(scene).expect("a built-in scene");
            let solver = Solver::new(&scene).seed(seed);
            let found = solver.render(mode, (48, 48)).tolerance(0.05).expect("it converges");
            assert!(
                found.ended == Ended::ByItself && found.error.total <= 0.05,
                "{} {mode}: {:?}",
                scene.name,
                found.error
            );
        }
    }
}
