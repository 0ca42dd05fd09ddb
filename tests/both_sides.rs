//! Pictures held against walks of light: what neither patches nor rays from the camera ever met is found, or stated.

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

/// Means of the channels over 4 × 4 parts of the picture by the path tracer, 885,000 paths a part: 0.1 % off.
const REFERENCE: [f64; 16] = [
    0.1010, 0.0765, 0.0786, 0.0938, 0.1227, 0.0952, 0.0998, 0.1182, 0.1142, 0.1005, 0.1028, 0.1134, 0.1398, 0.1624,
    0.1700, 0.1550,
];

/// The mean of the channels over 4 × 4 parts of a picture.
fn parts(found: &Rendered) -> [f64; 16] {
    let (picture, mut sums) = (&found.picture, [0.0; 16]);
    for (k, pixel) in picture.pixels.iter().enumerate() {
        let (x, y) = (4 * (k % picture.width) / picture.width, 4 * (k / picture.width) / picture.height);
        sums[4 * y + x] += f64::from(pixel.element_sum()) / 3.0;
    }
    sums.map(|sum| 16.0 * sum / picture.pixels.len() as f64)
}

/// A quarter of the light is lost where receivers alone look for it. Walks find where it lands, and what is stated
/// holds: the squared error of means is no more than that of pixels, of which the root mean square is larger, too.
#[test]
fn light_that_receivers_miss_is_found_where_walks_land() {
    let norm = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>().sqrt();
    for seed in [0, 1, 2] {
        let found = sunbeam("10 10 10", seed);
        let off: Vec<f64> = parts(&found).iter().zip(REFERENCE).map(|(own, other)| own - other).collect();
        let error = norm(&off) / norm(&REFERENCE);
        assert!(error < found.error.total && error < 0.1, "seed {seed}: {error}, {:?}", found.error);
    }
}

/// The beam alone: all that the camera sees is reflected by walls that it lights. The lamp alone is 0.0861 in the mean,
/// within 0.5 %, and light adds up.
#[test]
fn a_beam_alone_lights_a_room() {
    let expected = REFERENCE.iter().sum::<f64>() / 16.0 - 0.0861;
    for seed in [0, 1, 2] {
        let found = sunbeam("0 0 0", seed);
        let mean = parts(&found).iter().sum::<f64>() / 16.0;
        let error = (mean / expected - 1.0).abs();
        // What is stated is an RMS over pixels, which differ little here.
        assert!(error < 1.2 * found.error.total && error < 0.2, "seed {seed}: {mean}, {:?}", found.error);
    }
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
