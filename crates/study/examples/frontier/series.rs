//! What the series, its bounds, its true tails, progressive shooting and the solvers do at a share of the frontier's
//! alpha.
//!
//! Not handled: what else solves the equation beyond the frontier ([`formal`](crate::formal)).

use std::time::Instant;

use crate::slice::Slice;
use halflight::light::Light;
use halflight::operator::{Bounds, LinearOperator, operator_norm};
use halflight::render::Assembled;
use halflight::solve::{
    RaySettings, Settings, Shooter, Shooting, ShootingSettings, TailBound, Verdict, direct, extrapolated, neumann,
    norm, terms, verdict,
};

/// Terms of the Neumann series at most: at 0.999 alpha_c it takes about ten thousand.
const MAX_TERMS: usize = 20_000;
/// Products to estimate a norm from.
const NORM_PRODUCTS: usize = 64;
/// Terms looked at where the series does not converge.
const TERMS_BEYOND: usize = 64;
/// Rays of one unit of emitted power in progressive shooting.
const SHOOTING_RAYS: u32 = 1 << 16;
/// Shots a patch after which shooting gives up.
const SHOTS_A_PATCH: u64 = 400;

/// What happened at one alpha.
#[derive(Clone, Debug)]
pub struct SeriesRun {
    /// alpha over the frontier's alpha.
    pub share: f64,
    /// alpha.
    pub alpha: f64,
    /// Proved bounds on the spectral radius.
    pub radius: Bounds,
    /// norm(K), from below.
    pub norm: f64,
    /// Norms of `KⁿE`, n from 0.
    pub norms: Vec<f64>,
    /// The proved bound on everything after term n, from n = 1; none beyond the frontier.
    pub bounds: Vec<f64>,
    /// The norm of everything after term n, from LU; none beyond the frontier.
    pub tails: Vec<f64>,
    /// Terms to the wanted bound; none where the settings' number of terms does not reach it.
    pub terms: Option<usize>,
    /// Products of the extrapolated solve; none beyond the frontier.
    pub extrapolated: Option<usize>,
    /// Seconds of the solves of L over the same K on this machine: the Neumann series and the extrapolated one, their
    /// bounds included, LU, and shooting to a thousandth unshot; none where a method refuses.
    pub seconds: [Option<f64>; 4],
    /// How progressive shooting with rays ended.
    pub shot: Verdict,
    /// Its batches.
    pub shots: Vec<Shot>,
}

/// The state of shooting after a batch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shot {
    /// Shots over patches.
    pub sweeps: f64,
    /// Unshot power as a share of that emitted.
    pub unshot: f64,
}

/// Runs every method at a share of the frontier's alpha.
pub fn run(slice: &Slice, share: f64) -> SeriesRun {
    let settings = Settings { max_terms: MAX_TERMS, ..Settings::default() };
    let alpha = share * slice.alpha_c;
    let mode = slice.equations(alpha);
    let mut run = follow(&mode, share, alpha, &settings);
    let rays = RaySettings { rays: SHOOTING_RAYS, seed: slice.sampling.seed, ..RaySettings::default() };
    (run.shots, run.shot) = shoot(&mode.ray_shooter(rays), mode.patches().len());
    run
}

/// Follows the series of one K to the wanted bound, or some way beyond the frontier.
fn follow(mode: &Assembled, share: f64, alpha: f64, settings: &Settings) -> SeriesRun {
    let k = &mode.operator;
    let (_, spectrum) = verdict(k);
    let tail = spectrum.as_ref().and_then(|s| TailBound::new(k, s));
    let zero = Bounds { lower: 0.0, upper: 0.0 };
    let mut run = SeriesRun {
        share,
        alpha,
        radius: spectrum.map_or(zero, |s| s.worst()),
        norm: operator_norm(k, NORM_PRODUCTS),
        norms: Vec::new(),
        bounds: Vec::new(),
        tails: Vec::new(),
        terms: None,
        extrapolated: extrapolated(k, settings).ok().map(|found| found.products),
        seconds: time(mode, settings),
        shot: Verdict::Undecided,
        shots: Vec::new(),
    };
    let exact = tail.as_ref().and_then(|_| direct(k));
    let mut sum = vec![Light::default(); k.len()];
    let last = if tail.is_some() { settings.max_terms } else { TERMS_BEYOND };
    for (n, term) in terms(k).take(last + 1).enumerate() {
        add(&mut sum, &term, 1.0);
        run.norms.push(norm(k.areas(), &term));
        let (Some(tail), Some(exact)) = (&tail, &exact) else {
            continue;
        };
        let mut rest = exact.clone();
        add(&mut rest, &sum, -1.0);
        run.tails.push(norm(k.areas(), &rest));
        if n == 0 {
            continue;
        }
        let bound = tail.after(&term).unwrap_or(f64::INFINITY);
        run.bounds.push(bound);
        if bound <= settings.tolerance * norm(k.areas(), &sum) {
            run.terms = Some(run.bounds.len());
            break;
        }
    }
    run
}

/// Solves over one K in four ways.
fn time(mode: &Assembled, settings: &Settings) -> [Option<f64>; 4] {
    let k = &mode.operator;
    [
        seconds(|| neumann(k, settings).ok()),
        seconds(|| extrapolated(k, settings).ok()),
        seconds(|| direct(k)),
        seconds(|| empty(mode)),
    ]
}

/// Shoots over K until a thousandth is unshot; none where that takes too many shots.
fn empty(mode: &Assembled) -> Option<()> {
    let settings = ShootingSettings { generations: 2, shots_per_patch: SHOTS_A_PATCH, ..ShootingSettings::default() };
    Shooting::new(&mode.operator, settings).ok()?.run(|_| ()).ok().map(drop)
}

/// Seconds that something took, if it came to an end.
fn seconds<T>(solve: impl FnOnce() -> Option<T>) -> Option<f64> {
    let start = Instant::now();
    let solved = solve();
    solved.map(|_| start.elapsed().as_secs_f64())
}

fn add(sum: &mut [Light], term: &[Light], factor: f32) {
    for (s, t) in sum.iter_mut().zip(term) {
        s.invisible += factor * t.invisible;
        s.visible += factor * t.visible;
    }
}

/// Shoots until a thousandth is unshot or growth shows.
fn shoot(shooter: &dyn Shooter, patches: usize) -> (Vec<Shot>, Verdict) {
    let settings = ShootingSettings { shots_per_patch: SHOTS_A_PATCH, ..ShootingSettings::default() };
    let mut seen = Vec::new();
    let ended = Shooting::new(shooter, settings).and_then(|mut shooting| {
        shooting.run(|s| {
            let progress = s.progress();
            seen.push(Shot { sweeps: progress.shots as f64 / patches as f64, unshot: progress.share });
        })
    });
    let verdict = ended.map_or_else(|refused| refused.verdict, |_| Verdict::Converges);
    (seen, verdict)
}
