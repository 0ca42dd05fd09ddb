//! The Neumann series `L = E + KE + K²E + ...`, term by term.
//!
//! It stops when the proven bound on the tail is below the requested share of the reflected light, KE and what follows:
//! an emitter's own radiance is no measure of what is missing, however small and bright it is. It ends exactly at n = 1
//! where nothing reflected travels on, and refuses, before any term is summed, where the spectral radius is proved >=
//! 1.

use std::f64::consts::PI;

use glam::DVec3;

use crate::light::{Light, Rgb};
use crate::operator::{Bounds, LinearOperator, LitPatches, Spectrum, spectrum};
use crate::solve::tail::TailBound;

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Requested bound on the tail's norm as a share of the norm of the reflected light so far, `KE + K²E + ...`.
    pub tolerance: f64,
    /// Bounces to compute at most; the tail bound of the last says what is missing.
    pub max_terms: usize,
    /// Terms that are kept, E first, at least one: each takes 24 bytes a patch. Later ones are summed.
    pub keep: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Settings { tolerance: 1e-4, max_terms: 10_000, keep: usize::MAX }
    }
}

/// How the series behaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// Spectral radius proved below 1.
    Converges,
    /// `K²E = 0` exactly.
    Ends,
    /// Spectral radius proved to be 1 or more.
    Diverges,
    /// The bounds enclose 1.
    Undecided,
}

impl Verdict {
    /// `converges`, `ends`, `diverges` or `undecided`.
    pub fn name(self) -> &'static str {
        match self {
            Verdict::Converges => "converges",
            Verdict::Ends => "ends",
            Verdict::Diverges => "diverges",
            Verdict::Undecided => "undecided",
        }
    }
}

/// Figures of one term of the series.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Bounce {
    /// Number of reflections.
    pub n: usize,
    /// Power of the visible half per channel, W: `pi sum A_i L_i`.
    pub power: [f64; 3],
    /// Power of the invisible half per channel, W.
    pub power_invisible: [f64; 3],
    /// Area-weighted RMS over patches, channels and halves, W/(m² sr).
    pub norm: f64,
    /// Norm over that of the term before; none for n = 0 or after a zero term.
    pub ratio: Option<f64>,
    /// Proven bound on the norm of the sum of all later terms; none where there is none that says anything.
    pub tail_bound: Option<f64>,
}

/// L, its bounces, and the proof that it is one.
#[derive(Clone, Debug)]
pub struct Solution {
    /// `L`, both halves, per patch.
    pub light: Vec<Light>,
    /// `KⁿE`, n from 0, as many as are kept.
    pub terms: Vec<Vec<Light>>,
    /// Sum of the terms that are not kept; empty where all are.
    pub later: Vec<Light>,
    /// Figures of each term.
    pub bounces: Vec<Bounce>,
    /// How the series behaves.
    pub verdict: Verdict,
    /// Bounds on the spectral radius; both 0 where the series ends.
    pub radius: Bounds,
    /// Norm of the reflected light, `KE + K²E + ...`.
    pub reflected: f64,
    /// Proven bound on everything after the last term, patch by patch and either half: a field that may be gathered
    /// into a picture. Empty where there is none.
    pub left: Vec<Light>,
}

/// The series does not converge, or cannot be shown to.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "the bounce series {} in this mode: the spectral radius of K lies between {:.4} and {:.4}",
    if *.verdict == Verdict::Undecided { "is undecided" } else { .verdict.name() }, .radius.lower, .radius.upper
)]
pub struct Diverges {
    /// Diverges or undecided.
    pub verdict: Verdict,
    /// Proved bounds on the spectral radius.
    pub radius: Bounds,
    /// The series is proved to converge for every alpha below this.
    pub alpha_limit: f64,
    /// Whether all patches share one alpha; if not, the limit is a factor on each.
    pub uniform: bool,
}

/// Power of the visible and of the invisible half per channel, W: `pi sum A_i L_i`.
pub(crate) fn powers(areas: &[f64], term: &[Light]) -> [[f64; 3]; 2] {
    let power = |half: fn(&Light) -> glam::Vec3| {
        let sum: DVec3 = term.iter().zip(areas).map(|(l, a)| PI * a * half(l).as_dvec3()).sum();
        sum.to_array()
    };
    [power(|l| l.visible), power(|l| l.invisible)]
}

/// Measures a term; `before` is the norm of the one before it.
fn measure(k: &dyn LinearOperator, n: usize, term: &[Light], before: Option<f64>) -> Bounce {
    let [power, power_invisible] = powers(k.areas(), term);
    let norm = norm(k.areas(), term);
    Bounce { n, power, power_invisible, norm, ratio: before.filter(|&b| b > 0.0).map(|b| norm / b), tail_bound: None }
}

/// Area-weighted RMS over patches, channels and halves: `sqrt(sum A_i |L_i|² / (6 sum A_i))`.
pub fn norm(areas: &[f64], x: &[Light]) -> f64 {
    let (mut sum, mut area) = (0.0, 0.0);
    for (l, a) in x.iter().zip(areas) {
        let squared = l.invisible.as_dvec3().length_squared() + l.visible.as_dvec3().length_squared();
        sum += a * squared;
        area += a;
    }
    (sum / (6.0 * area)).sqrt()
}

/// The terms `E, KE, K²E, ...` without end, whether their sum converges or not; stops after an exactly zero term.
pub fn terms(k: &dyn LinearOperator) -> impl Iterator<Item = Vec<Light>> {
    let mut n = 0;
    let mut last: Vec<Light> = Vec::new();
    std::iter::from_fn(move || {
        let term = match n {
            0 => k.emission().to_vec(),
            1 => k.first_bounce(),
            _ if last.iter().all(|l| *l == Light::default()) => return None,
            _ => k.apply(&last),
        };
        n += 1;
        last.clone_from(&term);
        Some(term)
    })
}

/// The verdict on a series, with the bounds that prove it, which are those of K on the [`LitPatches`]; `None` for the
/// spectrum where the series ends.
pub fn verdict(k: &dyn LinearOperator) -> (Verdict, Option<Spectrum>) {
    verdict_on_lit(&LitPatches::of(k))
}

/// The verdict on the patches that light reaches.
pub(crate) fn verdict_on_lit(k: &LitPatches) -> (Verdict, Option<Spectrum>) {
    if !k.interreflects() {
        return (Verdict::Ends, None);
    }
    let spectrum = spectrum(k);
    let radius = spectrum.worst();
    let verdict = if radius.upper < 1.0 {
        Verdict::Converges
    } else if radius.lower >= 1.0 {
        Verdict::Diverges
    } else {
        Verdict::Undecided
    };
    (verdict, Some(spectrum))
}

/// Solves `L = E + K L` by its Neumann series.
///
/// # Errors
/// [`Diverges`] where the spectral radius is not proved to be below 1.
pub fn neumann(k: &dyn LinearOperator, settings: &Settings) -> Result<Solution, Diverges> {
    let k = &LitPatches::of(k);
    let (verdict, spectrum) = verdict_on_lit(k);
    if matches!(verdict, Verdict::Diverges | Verdict::Undecided) {
        return Err(refuse(k, verdict, spectrum.as_ref()));
    }
    let enough = |s: &Solution| s.rest() <= settings.tolerance * s.reflected;
    Ok(expand(k, (verdict, spectrum), settings, enough))
}

/// The first `count` bounces and E, whether the series converges or not; fewer where it ends or leaves the numbers.
pub fn explore(k: &dyn LinearOperator, count: usize) -> Solution {
    explore_keeping(k, count, usize::MAX)
}

/// The same, of which the first `keep` terms are kept, E among them.
pub fn explore_keeping(k: &dyn LinearOperator, count: usize, keep: usize) -> Solution {
    let k = &LitPatches::of(k);
    let settings = Settings { max_terms: count, keep, ..Settings::default() };
    expand(k, verdict_on_lit(k), &settings, |_| false)
}

/// A bound on the tail so many times the reflected light says nothing.
const SAYS_NOTHING: f64 = 1e3;

/// Adds bounces, until `enough` says so, a term is no longer finite, or there are as many as are allowed.
fn expand(
    k: &dyn LinearOperator,
    (verdict, spectrum): (Verdict, Option<Spectrum>),
    settings: &Settings,
    enough: impl Fn(&Solution) -> bool,
) -> Solution {
    let tail = spectrum.as_ref().and_then(|s| TailBound::new(k, s));
    let mut solution = Solution {
        light: vec![Light::default(); k.areas().len()],
        terms: Vec::new(),
        later: Vec::new(),
        bounces: Vec::new(),
        verdict,
        radius: spectrum.map(|s| s.worst()).unwrap_or_default(),
        reflected: 0.0,
        left: Vec::new(),
    };
    let mut reflected = vec![Light::default(); k.areas().len()];
    let mut last = Vec::new();
    for (n, term) in terms(k).take(settings.max_terms.max(1) + 1).enumerate() {
        if n >= 1 {
            add(&mut reflected, &term);
            solution.reflected = norm(k.areas(), &reflected);
        }
        solution.add(k, n, &term, tail.as_ref());
        last = solution.keep(term, settings.keep);
        let finite = solution.bounces[n].norm.is_finite();
        if !finite || (n >= 1 && enough(&solution)) {
            break;
        }
    }
    solution.bound_backwards();
    let last = if last.is_empty() { solution.terms.last() } else { Some(&last) };
    solution.left = solution.bound_field(tail.as_ref(), last);
    solution
}

/// Adds a term to a sum.
fn add(sum: &mut [Light], term: &[Light]) {
    for (l, t) in sum.iter_mut().zip(term) {
        l.invisible += t.invisible;
        l.visible += t.visible;
    }
}

impl Solution {
    fn add(&mut self, k: &dyn LinearOperator, n: usize, term: &[Light], tail: Option<&TailBound>) {
        add(&mut self.light, term);
        let mut bounce = measure(k, n, term, self.bounces.last().map(|b| b.norm));
        bounce.tail_bound = match tail {
            Some(tail) => tail.after(term),
            // Nothing comes after the first bounce of a series that ends.
            None => (n >= 1 && self.verdict == Verdict::Ends).then_some(0.0),
        };
        self.bounces.push(bounce);
    }

    /// Keeps a term, or adds it to the later ones where `most` are kept already; then it is given back.
    fn keep(&mut self, term: Vec<Light>, most: usize) -> Vec<Light> {
        if self.terms.len() < most.max(1) {
            self.terms.push(term);
            return Vec::new();
        }
        self.later.resize(term.len(), Light::default());
        add(&mut self.later, &term);
        term
    }

    /// The bound on everything after the last term.
    pub fn rest(&self) -> f64 {
        let last = self.bounces.last().and_then(|b| b.tail_bound);
        last.unwrap_or(f64::INFINITY)
    }

    /// What the series left out at most, as a share of the reflected light.
    pub fn truncation(&self) -> f64 {
        self.rest() / self.reflected.max(f64::MIN_POSITIVE)
    }

    /// The bound on what follows the last term as a field.
    fn bound_field(&self, tail: Option<&TailBound>, last: Option<&Vec<Light>>) -> Vec<Light> {
        let last = last.filter(|_| self.bounces.len() > 1);
        match (tail, last) {
            (Some(tail), Some(last)) => tail.field(last).unwrap_or_default(),
            _ if self.verdict == Verdict::Ends => vec![Light::default(); self.light.len()],
            _ => Vec::new(),
        }
    }

    /// After a term comes the next and what comes after that: where this bounds the tail more tightly than the term
    /// itself does, it is taken. For E it must be: luminaires' light goes by the closed form in KE, which is not
    /// bounded by the rows of F. Bounds that say nothing are none.
    fn bound_backwards(&mut self) {
        for n in (0..self.bounces.len().saturating_sub(1)).rev() {
            let next = &self.bounces[n + 1];
            let through = next.tail_bound.map(|t| next.norm + t);
            let own = self.bounces[n].tail_bound.filter(|_| n > 0);
            self.bounces[n].tail_bound = match (own, through) {
                (Some(a), Some(b)) => Some(a.min(b)),
                (a, b) => b.or(a),
            };
        }
        let most = SAYS_NOTHING * self.reflected;
        for bounce in &mut self.bounces {
            bounce.tail_bound = bounce.tail_bound.filter(|&t| t <= most);
        }
    }
}

/// The refusal of a series over K with this spectrum.
pub(crate) fn refuse(k: &dyn LinearOperator, verdict: Verdict, spectrum: Option<&Spectrum>) -> Diverges {
    Diverges::new(k.reflectances(), k.alphas(), verdict, spectrum.map(Spectrum::worst).unwrap_or_default())
}

impl Diverges {
    /// The refusal of a scene of these patches, with the alpha below which it is accepted.
    pub(crate) fn new(rho: &[Rgb], alpha: &[f32], verdict: Verdict, radius: Bounds) -> Diverges {
        let reflecting = rho.iter().map(|r| r.max_element() > 0.0);
        let mut passing = reflecting.zip(alpha).filter(|p| p.0).map(|p| *p.1);
        let first = passing.next().unwrap_or(0.0);
        let uniform = passing.all(|a| a == first);
        // The radius is proportional to alpha.
        let scale = if uniform { first as f64 } else { 1.0 };
        Diverges { verdict, radius, alpha_limit: scale / radius.upper, uniform }
    }
}
