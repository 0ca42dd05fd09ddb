//! One comparison: every method run, every error taken, every pair judged.

use super::{
    Estimate, Method, ORDERS, Pair, Run, climb, error_against, judge, replicate, slope, trace,
};
use crate::image::Picture;
use crate::light::{Rgb, Transport};
use crate::rays::Rays;
use crate::reference::NextEvent;
use crate::scene::Scene;
use crate::solve::Diverges;

/// What is compared, and for how long.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// (alpha, tau) of every material that has none of its own.
    pub transport: Transport,
    /// Width and height of the pictures.
    pub size: (usize, usize),
    /// Seconds each method may climb.
    pub seconds: f64,
    /// Chooses sample points.
    pub seed: u32,
}

/// Error after some time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Seconds from the scene to the picture.
    pub seconds: f64,
    /// Relative RMS error of the picture.
    pub rms: f64,
    /// Relative RMS errors of the bounces n = 0 to [`ORDERS`]; none where the reference is black.
    pub orders: [Option<f64>; ORDERS + 1],
}

/// A method's errors.
#[derive(Clone, Debug)]
pub struct Track {
    /// Which.
    pub method: Method,
    /// What the errors are taken against.
    pub reference: String,
    /// Climbing.
    pub points: Vec<Point>,
    /// Slope of log error over log seconds.
    pub slope: Option<f64>,
}

/// The result.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// What each method reached.
    pub runs: Vec<Run>,
    /// Their errors.
    pub tracks: Vec<Track>,
    /// Every pair's verdict.
    pub pairs: Vec<(Method, Method, Pair)>,
    /// Pixels that see no luminaire, or all where each sees one: where errors are taken.
    pub mask: Picture,
}

/// Steps of the path tracers' clock, as shares of the time.
const STEPS: [f64; 6] = [1.0 / 32.0, 1.0 / 16.0, 1.0 / 8.0, 1.0 / 4.0, 1.0 / 2.0, 1.0];

/// Runs every method, telling `begin` which.
///
/// # Errors
/// [`Diverges`] where the series does: there is nothing to compare.
pub fn compare(scene: &Scene, plan: &Plan, begin: &dyn Fn(Method)) -> Result<Comparison, Diverges> {
    // A diverging series is found before any path is traced.
    begin(Method::Neumann);
    let neumann = climb_patches(scene, Method::Neumann, plan)?;
    let rays = Rays::new(scene);
    let steps = STEPS.map(|s| s * plan.seconds);
    let paths = |next_event| {
        let which = (plan.transport, plan.size);
        trace((scene, &rays), which, next_event, plan.seed, &steps)
    };
    begin(Method::PathsNextEvent);
    let (next_event, mask) = paths(NextEvent::On);
    let mask = counted(mask);
    begin(Method::Paths);
    let (plain, _) = paths(NextEvent::Off);
    let mut runs = vec![finish(scene, Method::Neumann, plan, neumann, &mask)?];
    for method in [Method::ShootingAssembled, Method::ShootingRays] {
        begin(method);
        let ladder = climb_patches(scene, method, plan)?;
        runs.push(finish(scene, method, plan, ladder, &mask)?);
    }
    for (method, ladder) in [(Method::PathsNextEvent, next_event), (Method::Paths, plain)] {
        let best = ladder[ladder.len() - 1].clone();
        runs.push(Run {
            method,
            ladder,
            best,
        });
    }
    let tracks = runs.iter().map(|run| track(run, &runs, &mask)).collect();
    let pairs = pairs(&runs, &mask);
    Ok(Comparison {
        runs,
        tracks,
        pairs,
        mask,
    })
}

/// The mask, or every pixel where all see a luminaire, as in a furnace.
fn counted(mask: Picture) -> Picture {
    match mask.pixels.iter().any(|p| p.x >= 0.5) {
        true => mask,
        false => Picture::filled(mask.width, mask.height, Rgb::ONE),
    }
}

type Ladder = Vec<(super::Rung, Estimate)>;

fn climb_patches(scene: &Scene, method: Method, plan: &Plan) -> Result<Ladder, Diverges> {
    climb(
        scene,
        method,
        plan.transport,
        plan.size,
        plan.seed,
        plan.seconds,
    )
}

/// Repeats the finest rung that fits a quarter of the time.
fn finish(
    scene: &Scene,
    method: Method,
    plan: &Plan,
    ladder: Ladder,
    mask: &Picture,
) -> Result<Run, Diverges> {
    let fits = |(_, e): &&(super::Rung, Estimate)| e.seconds <= 0.25 * plan.seconds;
    let rung = ladder.iter().rev().find(fits).unwrap_or(&ladder[0]).0;
    let best = replicate(
        scene,
        method,
        plan.transport,
        plan.size,
        plan.seed,
        rung,
        mask,
    )?;
    Ok(Run {
        method,
        ladder: ladder.into_iter().map(|(_, e)| e).collect(),
        best,
    })
}

/// A method's errors against the best of the other kind.
fn track(run: &Run, runs: &[Run], mask: &Picture) -> Track {
    let kind = match run.method.is_patchwise() {
        true => Method::PathsNextEvent,
        false => Method::Neumann,
    };
    let reference = runs
        .iter()
        .find(|r| r.method == kind)
        .map_or(&run.best, |r| &r.best);
    let point = |e: &Estimate| {
        let error = |n: usize| {
            let noise = reference.order_noise.as_ref().map(|o| &o[n]);
            error_against(&e.orders[n], &reference.orders[n], noise, mask)
        };
        let all = error_against(
            &e.picture,
            &reference.picture,
            reference.noise.as_ref(),
            mask,
        );
        Some(Point {
            seconds: e.seconds,
            rms: all?,
            orders: std::array::from_fn(error),
        })
    };
    let points: Vec<Point> = run.ladder.iter().filter_map(point).collect();
    let line: Vec<(f64, f64)> = points.iter().map(|p| (p.seconds, p.rms)).collect();
    Track {
        method: run.method,
        reference: format!("{}, {}", kind.name(), reference.effort),
        slope: slope(&line),
        points,
    }
}

fn pairs(runs: &[Run], mask: &Picture) -> Vec<(Method, Method, Pair)> {
    let mut pairs = Vec::new();
    for (k, a) in runs.iter().enumerate() {
        for b in &runs[k + 1..] {
            pairs.push((a.method, b.method, judge(&a.best, &b.best, mask)));
        }
    }
    pairs
}
