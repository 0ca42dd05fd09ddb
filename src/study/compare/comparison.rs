//! One comparison: every method run, every error taken, every pair judged.

use crate::light::{Rgb, Transport};
use crate::pictures::Picture;
use crate::reference::NextEvent;
use crate::render::{Unfit, Watch, prepare};
use crate::scene::Scene;
use crate::solve::Diverges;
use crate::study::compare::arithmetic::combine;
use crate::study::compare::patchwise::{Rung, climb, cut_within};
use crate::study::compare::replicas::answers;
use crate::study::compare::tracing::trace;
use crate::study::compare::verdict::{Pair, judge};
use crate::study::compare::{Estimate, Method, ORDERS, Run, error_against};
use crate::study::statistics::log_slope;

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
    /// Bytes that K and its solutions may take.
    pub memory: f64,
}

/// There is nothing to compare.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// The series diverges.
    #[error(transparent)]
    Diverges(#[from] Diverges),
    /// K of the patches that verdicts need does not fit in memory.
    #[error(transparent)]
    Memory(#[from] Unfit),
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

/// What happens while methods are compared.
pub trait Stage: Watch {
    /// A method begins to climb its ladder.
    fn climbs(&self, method: Method);
    /// The patch methods repeat their best.
    fn repeats(&self);
}

/// Runs every method.
///
/// # Errors
/// [`CompareError`] where the series diverges, and where memory would not do.
pub fn compare<S: Stage>(scene: &Scene, plan: &Plan, stage: &S) -> Result<Comparison, CompareError> {
    let mut p = prepare(scene.clone(), 1);
    p.memory = plan.memory;
    cut_within(&mut p, plan, Rung::least(plan))?;
    // A diverging series is found before any path is traced.
    let mut ladders = Vec::new();
    for method in Method::ALL.into_iter().filter(|m| m.is_patchwise()) {
        stage.climbs(method);
        ladders.push(climb(&mut p, method, plan, stage)?);
    }
    let steps = STEPS.map(|s| s * plan.seconds);
    let paths = |method, next_event| {
        stage.climbs(method);
        trace((scene, &p.rays), plan, next_event, &steps, stage)
    };
    let next_event = paths(Method::PathsNextEvent, NextEvent::On);
    let plain = paths(Method::Paths, NextEvent::Off);
    let mask = counted(&next_event.mask, &plain.mask);
    stage.repeats();
    let best = answers(&mut p, plan, &mask, stage)?;
    let patchwise = best.into_iter().zip(ladders);
    let mut runs: Vec<Run> = patchwise.map(|((method, best), ladder)| Run { method, ladder, best }).collect();
    for (method, traced) in [(Method::PathsNextEvent, next_event), (Method::Paths, plain)] {
        runs.push(Run { method, best: traced.best(&mask), ladder: traced.ladder });
    }
    let tracks = runs.iter().map(|run| track(run, &runs, &mask)).collect();
    let pairs = pairs(&runs, &mask);
    Ok(Comparison { runs, tracks, pairs, mask })
}

/// Pixels that see no luminaire in either picture, or every pixel where none is left, as in a furnace.
fn counted(a: &Picture, b: &Picture) -> Picture {
    let mask = combine(a, b, |a, b| a * b);
    match mask.pixels.iter().any(|p| p.x >= 0.5) {
        true => mask,
        false => Picture::filled(mask.width, mask.height, Rgb::ONE),
    }
}

/// A method's errors against the best of the other kind.
fn track(run: &Run, runs: &[Run], mask: &Picture) -> Track {
    let kind = match run.method.is_patchwise() {
        true => Method::PathsNextEvent,
        false => Method::Neumann,
    };
    let reference = runs.iter().find(|r| r.method == kind).map_or(&run.best, |r| &r.best);
    let point = |e: &Estimate| {
        let error = |n: usize| {
            let noise = reference.order_noise.as_ref().map(|o| &o[n]);
            error_against(&e.orders[n], &reference.orders[n], noise, mask)
        };
        let all = error_against(&e.picture, &reference.picture, reference.noise.as_ref(), mask);
        Some(Point { seconds: e.seconds, rms: all?, orders: std::array::from_fn(error) })
    };
    let points: Vec<Point> = run.ladder.iter().filter_map(point).collect();
    let line: Vec<(f64, f64)> = points.iter().map(|p| (p.seconds, p.rms)).collect();
    Track {
        method: run.method,
        reference: format!("{}, {}", kind.name(), reference.effort),
        slope: log_slope(&line),
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
