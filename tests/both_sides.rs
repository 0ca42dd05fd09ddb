//! Pictures held against walks of light: what neither patches nor rays from the camera ever met is found, or stated.

use glam::DVec3;
use halflight::Solver;
use halflight::light::Mode;
use halflight::render::{Ended, Rendered, Sensor};
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

/// Places 0.8 above the floor, and the green irradiance there looking up, W/m²: of the room with a lamp in the disc's
/// place that sends its light, which every method finds.
const POINTS: [([f64; 2], f64); 20] = [
    ([1.4442, 0.9127], 0.9167),
    ([4.1718, 3.7018], 0.4870),
    ([1.1907, 0.9247], 0.9622),
    ([3.7018, 1.2737], 0.6042),
    ([4.0202, 0.8469], 0.4800),
    ([2.3944, 0.8574], 0.7206),
    ([4.1355, 2.7895], 0.6029),
    ([2.8956, 2.2242], 1.0264),
    ([0.6853, 3.0054], 0.6373),
    ([4.4891, 1.2823], 0.4615),
    ([1.9233, 3.4878], 0.8026),
    ([0.7464, 1.4155], 0.8413),
    ([1.2102, 2.3361], 0.8374),
    ([3.4395, 4.3395], 0.4935),
    ([2.1417, 4.2732], 0.5870),
    ([2.2766, 1.0458], 0.8033),
    ([0.6792, 1.1783], 0.8887),
    ([4.4270, 2.1958], 0.5408),
    ([3.2073, 1.0986], 0.6590),
    ([0.9891, 2.6170], 0.7604),
];

/// No ray from a point meets the disc, and a ray meets the patch that it lies on once in a hundred.
#[test]
fn points_have_the_light_of_a_spot_that_no_ray_meets() {
    let scene = Scene::from_toml_text("sunbeam", TOML, OBJ, MTL, LoadOptions::default()).expect("a scene");
    let sensor = |([x, y], _): ([f64; 2], f64)| Sensor { position: DVec3::new(x, y, 0.8), normal: DVec3::Z };
    let sensors = POINTS.map(sensor);
    let mut held = 0;
    for seed in [0, 1, 2] {
        let found =
            Solver::new(&scene).seed(seed).points(Mode::Global, &sensors).tolerance(0.05).expect("it converges");
        let off = || found.points.iter().zip(POINTS).map(|(own, (_, truth))| (own, own.irradiance[1] - truth, truth));
        held += off().filter(|(own, off, _)| off.abs() <= 2.0 * own.error[1]).count();
        let squares = off().map(|(_, off, truth)| (off / truth).powi(2)).sum::<f64>();
        let rms = (squares / POINTS.len() as f64).sqrt();
        assert!(rms < 0.06 && found.met > 0.9, "seed {seed}: {rms} {}", found.met);
    }
    // With a chance of 0.95 each, 3.1 standard deviations below the mean.
    assert!(held >= 52, "{held} of 60");
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
