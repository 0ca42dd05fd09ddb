//! One tau of a scene's stability map: where both frontiers lie along alpha, and what the series, its bounds, its true
//! tails, progressive shooting and the formal solution do at given shares of the frontier's alpha.
//!
//! Not handled: the whole map ([`map`](crate::map::map)).

use std::time::Instant;

use serde::Serialize;

use crate::map::Survey;
use halflight::Solver;
use halflight::form_factors::Sampling;
use halflight::light::{Light, Transport};
use halflight::operator::{Bounds, LinearOperator, Operator, operator_norm};
use halflight::render::{Assembled, Discretization, Silent, Stored, Unfit, Watch, check_fit};
use halflight::scene::Scene;
use halflight::solve::{
    RaySettings, Settings, Shooter, Shooting, ShootingSettings, TailBound, Verdict, direct, extrapolated, neumann,
    norm, terms, verdict,
};

/// The scene with every own alpha and tau (1 where a material has none) times these: a point of its stability map.
pub fn at(scene: &Scene, alpha: f64, tau: f64) -> Scene {
    let own = scene.transports(Transport { alpha: 1.0, tau: 1.0 });
    let mut scaled = scene.clone();
    for (material, own) in scaled.materials.iter_mut().zip(own) {
        material.alpha = Some((alpha * f64::from(own.alpha)) as f32);
        material.tau = Some((tau * f64::from(own.tau)) as f32);
    }
    scaled
}

/// Where the frontiers lie at one tau.
#[derive(Serialize)]
pub struct Slice {
    /// Factor on every tau.
    pub tau: f64,
    /// The mean diverges beyond: 1 over the spectral radius at alpha = 1.
    pub alpha_c: f64,
    /// The path tracer's variance is infinite beyond.
    pub alpha_variance: f64,
    /// Upper bound on the spectral radius at alpha = 1.
    #[serde(skip)]
    pub radius: f64,
    #[serde(skip)]
    survey: Survey,
}

impl Slice {
    /// Casts the rays, and finds both frontiers from the middle of their bounds.
    pub fn new(p: &Discretization, tau: f64, sampling: &Sampling, watch: &dyn Watch) -> Slice {
        let survey = Survey::new(p, sampling, watch);
        let radius = survey.spectrum(tau, &survey.start()).worst();
        let squares = survey.moment(tau, 2.0, &survey.start()).worst();
        Slice {
            tau,
            alpha_c: 2.0 / (radius.lower + radius.upper),
            alpha_variance: (2.0 / (squares.lower + squares.upper)).sqrt(),
            radius: radius.upper,
            survey,
        }
    }

    /// x of the path tracer's predicted error ~ N^x at this alpha: -(1 - 1/p) for a weight with a tail of index p.
    pub fn exponent(&self, alpha: f64) -> f64 {
        1.0 / self.survey.tail_index(alpha, self.tau).unwrap_or(2.0) - 1.0
    }
}

/// Products to estimate a norm from.
const NORM_PRODUCTS: usize = 64;
/// Terms looked at where the series does not converge.
const TERMS_BEYOND: usize = 64;
/// Rays of one unit of emitted power in progressive shooting.
const SHOOTING_RAYS: u32 = 1 << 16;
/// Shots a patch after which shooting gives up.
const SHOTS_A_PATCH: u64 = 400;

/// What happened at one alpha.
#[derive(Clone, Debug, Serialize)]
pub struct SeriesRun {
    /// alpha over the frontier's alpha.
    pub share: f64,
    /// alpha.
    pub alpha: f64,
    /// Proved bounds on the spectral radius.
    #[serde(rename = "spectral_radius")]
    pub radius: Bounds,
    /// norm(K), from below.
    #[serde(rename = "norm_of_k")]
    pub norm: f64,
    /// What the bounds say of the series.
    pub verdict: Verdict,
    /// Norms of `KⁿE`, n from 0.
    #[serde(skip)]
    pub norms: Vec<f64>,
    /// The proved bound on everything after term n, from n = 1; none beyond the frontier.
    #[serde(skip)]
    pub bounds: Vec<f64>,
    /// The norm of everything after term n, from LU; none beyond the frontier.
    #[serde(skip)]
    pub tails: Vec<f64>,
    /// Terms to the wanted bound; none where the settings' number of terms does not reach it.
    pub terms: Option<usize>,
    /// Products of the extrapolated solve; none beyond the frontier.
    #[serde(rename = "products_extrapolated")]
    pub extrapolated: Option<usize>,
    /// Seconds of each solve of L over the same K.
    pub seconds: Timing,
    /// How progressive shooting with rays ended.
    #[serde(rename = "shooting")]
    pub shot: Verdict,
    /// Its last batch.
    #[serde(flatten)]
    pub last_shot: Shot,
    /// All its batches.
    #[serde(skip)]
    pub shots: Vec<Shot>,
}

/// Seconds of solving for L on this machine; none where a method refuses.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Timing {
    /// The Neumann series, bounds included.
    pub neumann: Option<f64>,
    /// The extrapolated series, bounds included.
    pub extrapolated: Option<f64>,
    /// LU.
    pub direct: Option<f64>,
    /// Shooting over K to a thousandth unshot.
    pub shooting: Option<f64>,
}

/// The state of shooting after a batch.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Shot {
    /// Shots over patches.
    #[serde(rename = "shots_per_patch")]
    pub sweeps: f64,
    /// Unshot power as a share of that emitted.
    pub unshot: f64,
}

/// Points at one tau that approach the frontier.
#[derive(Clone, Debug)]
pub struct Approach {
    /// Transmission of all of them.
    pub tau: f64,
    /// Share of alpha at the frontier, and alpha.
    pub alphas: Vec<(f64, f64)>,
}

/// Runs every method at each alpha, all on patches and rays of the same seed.
pub fn runs(
    scene: &Scene,
    patches: usize,
    approach: &Approach,
    sampling: &Sampling,
    settings: &Settings,
) -> Vec<SeriesRun> {
    let run = |&(share, alpha): &(f64, f64)| {
        let p = Solver::new(&at(scene, alpha, approach.tau)).cut(patches);
        let mode = p.assemble(&[Transport::default()], sampling, &Silent).0.remove(0);
        let mut run = follow(&mode, share, alpha, settings);
        let rays = RaySettings { rays: SHOOTING_RAYS, seed: sampling.seed, ..RaySettings::default() };
        (run.shots, run.shot) = shoot(&mode.ray_shooter(rays), mode.patches().len());
        run.last_shot = run.shots.last().copied().unwrap_or(run.last_shot);
        run
    };
    approach.alphas.iter().map(run).collect()
}

/// Follows the series of one K to the wanted bound, or some way beyond the frontier.
fn follow(mode: &Assembled, share: f64, alpha: f64, settings: &Settings) -> SeriesRun {
    let k = &mode.operator;
    let (verdict, spectrum) = verdict(k);
    let tail = spectrum.as_ref().and_then(|s| TailBound::new(k, s));
    let zero = Bounds { lower: 0.0, upper: 0.0 };
    let mut run = SeriesRun {
        share,
        alpha,
        radius: spectrum.map_or(zero, |s| s.worst()),
        norm: operator_norm(k, NORM_PRODUCTS),
        verdict,
        norms: Vec::new(),
        bounds: Vec::new(),
        tails: Vec::new(),
        terms: None,
        extrapolated: extrapolated(k, settings).ok().map(|found| found.products),
        seconds: time(mode, settings),
        shot: Verdict::Undecided,
        last_shot: Shot { sweeps: 0.0, unshot: 1.0 },
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
fn time(mode: &Assembled, settings: &Settings) -> Timing {
    let k = &mode.operator;
    Timing {
        neumann: seconds(|| neumann(k, settings).ok()),
        extrapolated: seconds(|| extrapolated(k, settings).ok()),
        direct: seconds(|| direct(k)),
        shooting: seconds(|| empty(mode)),
    }
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

/// The formal solution of (I - K) L = E beyond the frontier, in figures: there is one, and it is not light.
///
/// If L >= 0 solved it with radius lambda > 1 and y > 0 the left eigenvector of B, then `y L = y E + lambda y L`, so
/// `y L = -y E/(lambda - 1) < 0`: some patch of every scene whose light reaches everything is negative.
#[derive(Clone, Debug, Serialize)]
pub struct Formal {
    /// L, negative in places.
    #[serde(skip)]
    pub light: Vec<Light>,
    /// The smallest invisible radiance, W/(m² sr).
    pub smallest: f64,
    /// The largest.
    pub largest: f64,
    /// Patches with a negative channel.
    #[serde(rename = "negative_patches")]
    pub negative: usize,
}

/// Checks that the dense solves of a frontier's study fit in `limit` bytes.
///
/// # Errors
/// [`Unfit`] where three matrices of both halves' size do not.
pub fn check_dense(p: &Discretization, limit: f64) -> Result<(), Unfit> {
    // (2 n)² numbers of 8 bytes: I, K, and their difference.
    check_fit(p.patches.len(), Stored::Dense, limit, |n| 3.0 * 8.0 * (2.0 * n).powi(2))
}

/// Solves (I - K) L = E by LU ([`direct`]), O(patches³); none where that is singular, lambda being an eigenvalue to
/// rounding.
pub fn formal(k: &Operator) -> Option<Formal> {
    let light = direct(k)?;
    let least = |l: &Light| l.invisible.min_element().min(l.visible.min_element());
    let smallest = light.iter().map(|l| l.invisible.min_element());
    let largest = light.iter().map(|l| l.invisible.max_element());
    Some(Formal {
        smallest: smallest.fold(f32::INFINITY, f32::min).into(),
        largest: largest.fold(f32::NEG_INFINITY, f32::max).into(),
        negative: light.iter().filter(|l| least(l) < 0.0).count(),
        light,
    })
}
