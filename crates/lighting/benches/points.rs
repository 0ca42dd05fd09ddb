//! Light at points: seconds, the share of points within the tolerance, and how often stated errors hold.
//!
//! ```text
//! cargo bench --bench points -- SCENE TOLERANCE REFERENCE COUNT [SEEDS] [grid:OBJECT@HEIGHT,SPACING | FILE.csv]
//! ```
//!
//! COUNT points all over the box of the scene, a grid, or those of a table are measured to TOLERANCE with some seeds,
//! and once with another seed to REFERENCE, a smaller one. `held` is the share within twice the root of both squared
//! errors, of the points that see light; `stated / true` the root of the ratio of the mean squares, relative to each
//! point's light, with the reference's taken off. Not handled: whether the reference is right;
//! `benches/against_rtrace.py` asks that.

use std::env;
use std::path::Path;
use std::time::Instant;

use glam::DVec3;
use halflight::light::Mode;
use halflight::rays::sobol::hash;
use halflight::render::{Sensor, SensorLight};
use halflight::{Scene, Solver};
use halflight_lighting::SensorLayout;

/// Of the points anywhere, so that they lie the same in every run.
const PLACES: u32 = 0x706c_6163;
/// The seed of the reference.
const OTHER: u32 = 1000;

fn main() {
    let given: Vec<String> = env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let [scene, numbers @ ..] = &given[..] else {
        println!("SCENE TOLERANCE REFERENCE COUNT [SEEDS] [grid:OBJECT@HEIGHT,SPACING | FILE.csv]");
        return;
    };
    let scene = Scene::open(scene).expect("a scene");
    let number = |k: usize, default: f64| numbers.get(k).and_then(|text| text.parse().ok()).unwrap_or(default);
    let (tolerance, reference) = (number(0, 0.01), number(1, 0.003));
    let sensors = match numbers.get(4) {
        Some(place) => match place.strip_prefix("grid:") {
            Some(grid) => laid(&scene, grid),
            None => SensorLayout::read(Path::new(place)).expect("a table of points").sensors,
        },
        None => anywhere(&scene, number(2, 200.0) as u32),
    };
    let truth = if reference > 0.0 { Some(measure(&scene, &sensors, reference, OTHER)) } else { None };
    for seed in 1..=number(3, 3.0) as u32 {
        let found = measure(&scene, &sensors, tolerance, seed);
        if let Some(truth) = &truth {
            compare(&found, truth);
        }
    }
}

/// Points all over the middle four fifths of a scene's box, looking anywhere.
fn anywhere(scene: &Scene, count: u32) -> Vec<Sensor> {
    let random = |k: u32, what: u32| 2.0 * f64::from(hash(k, hash(what, PLACES))) / 2_f64.powi(32) - 1.0;
    let vector = |k: u32, what: u32| DVec3::from([0, 1, 2].map(|axis| random(k, 3 * what + axis)));
    let corners = (0..scene.solid_faces()).flat_map(|f| scene.exact_corners(f));
    let (low, high) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(a, b), c| (a.min(c), b.max(c)));
    let place = |k: u32| scene.frame.to_file(0.5 * (low + high) + 0.4 * (high - low) * vector(k, 0));
    (0..count).map(|k| Sensor { position: place(k), normal: vector(k, 1) }).collect()
}

/// A grid written OBJECT@HEIGHT,SPACING.
fn laid(scene: &Scene, grid: &str) -> Vec<Sensor> {
    let (object, rest) = grid.split_once('@').expect("OBJECT@HEIGHT,SPACING");
    let (height, spacing) = rest.split_once(',').expect("HEIGHT,SPACING");
    let number = |text: &str| text.parse().expect("a number");
    SensorLayout::over(scene, object, number(height), number(spacing)).expect("a grid").sensors
}

fn measure(scene: &Scene, sensors: &[Sensor], tolerance: f64, seed: u32) -> Vec<SensorLight> {
    let start = Instant::now();
    let solver = Solver::new(scene).seed(seed);
    let found = solver.points(Mode::Global, sensors).tolerance(tolerance).expect("converges");
    println!(
        "{} points to {:.2} %, seed {seed}: {:.2} s, {} patches, {:.1} million rays, met {:.1} %",
        sensors.len(),
        100.0 * tolerance,
        start.elapsed().as_secs_f64(),
        found.patches,
        found.rays as f64 / 1e6,
        100.0 * found.met
    );
    found.points
}

/// Length of a vector of three channels.
fn length(channels: [f64; 3]) -> f64 {
    DVec3::from(channels).length()
}

fn compare(found: &[SensorLight], truth: &[SensorLight]) {
    let sees = |(_, truth): &(&SensorLight, &SensorLight)| !truth.is_inside && length(truth.irradiance) > 0.0;
    let lit: Vec<_> = found.iter().zip(truth).filter(sees).collect();
    let mut worst = (0.0, 0);
    let (mut held, mut stated, mut reached) = (0, 0.0, 0.0);
    for (k, (own, truth)) in lit.iter().enumerate() {
        let off = length([0, 1, 2].map(|c| own.irradiance[c] - truth.irradiance[c]));
        let (error, other, all) = (length(own.error), length(truth.error), length(truth.irradiance));
        let sigmas = off / error.hypot(other).max(1e-9 * all);
        if sigmas > worst.0 {
            worst = (sigmas, k);
        }
        held += usize::from(off <= 2.0 * error.hypot(other));
        stated += (error / all).powi(2);
        reached += (off * off - other * other) / (all * all);
    }
    let count = lit.len() as f64;
    println!(
        "    held {:.1} % of {}, stated {:.3} %, true {:.3} %, stated / true {:.2}",
        100.0 * held as f64 / count,
        lit.len(),
        100.0 * (stated / count).sqrt(),
        100.0 * (reached / count).max(0.0).sqrt(),
        (stated / reached.max(0.0)).sqrt()
    );
    let (own, other) = lit[worst.1];
    println!(
        "    farthest off, {:.1} stated errors: {:?} ± {:?}, reference {:?} ± {:?}",
        worst.0, own.irradiance, own.error, other.irradiance, other.error
    );
}
