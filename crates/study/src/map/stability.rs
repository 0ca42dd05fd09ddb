//! The grid of spectral radii over the (alpha, tau) square, and its frontiers read both ways.
//!
//! tau_c(alpha) comes from the secant rule between two columns: the radius rises with tau, entry by entry of F^tau, so
//! there is one tau_c for each alpha; log radius is convex in log tau (Kingman 1961: the entries are sums of powers of
//! tau), hence smooth enough that two steps suffice.
//!
//! Not handled: noise of F itself, which the number of rays sets.

use serde::Serialize;

use crate::map::survey::Survey;
use halflight::form_factors::Sampling;
use halflight::light::Transport;
use halflight::operator::{Bounds, Spectrum};
use halflight::render::{Discretization, Watch};
use halflight::scene::Scene;

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

/// Radii bounded for one alpha at most.
const STEPS: usize = 4;

/// The spectral radii at one tau and alpha = 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Column {
    /// Factor on every tau.
    pub tau: f64,
    /// Bounds on the spectral radius of K, worst channel.
    pub radius: Bounds,
    /// Bounds on that of the squared weights of the path tracer.
    pub squares: Bounds,
}

/// A point of a frontier alpha(tau), with proved bounds on alpha; above 1 where the frontier lies outside the square.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FrontierPoint {
    /// Factor on every tau.
    pub tau: f64,
    /// Factor on every alpha.
    pub alpha: f64,
    /// The frontier is proved not to lie below.
    #[serde(rename = "alpha_lower")]
    pub lower: f64,
    /// The frontier is proved not to lie above.
    #[serde(rename = "alpha_upper")]
    pub upper: f64,
}

/// A point of the frontier tau(alpha), with the bounds on the spectral radius there, which enclose 1 or nearly so.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TauPoint {
    /// Factor on every alpha.
    pub alpha: f64,
    /// Factor on every tau.
    pub tau: f64,
    /// Bounds on the spectral radius at (alpha, tau).
    #[serde(rename = "spectral_radius")]
    pub radius: Bounds,
}

/// A point of the grid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct GridPoint {
    /// Factor on every alpha.
    pub alpha: f64,
    /// Factor on every tau.
    pub tau: f64,
    /// Bounds on the spectral radius there.
    #[serde(flatten)]
    pub radius: Bounds,
}

/// The map of a scene.
#[derive(Clone, Debug)]
pub struct Map {
    /// By tau, from 0 to 1 in equal steps; as many steps in alpha.
    pub columns: Vec<Column>,
    /// tau_c of each alpha of the grid for which it lies in the square.
    pub tau_frontier: Vec<TauPoint>,
    /// Whether the growth of squared weights is bounded from both sides: one channel is the brightest on every surface.
    /// If not it is an upper bound, and the variance is finite inside its frontier but not proved infinite outside.
    pub grey: bool,
    /// Rays cast.
    pub rays: u64,
    /// Crossings kept.
    pub crossings: usize,
}

/// Maps a scene at `steps` by `steps` points, at least 2 each way.
pub fn map(p: &Discretization, steps: usize, sampling: &Sampling, watch: &dyn Watch) -> Map {
    let survey = Survey::new(p, sampling, watch);
    let last = steps.max(2) - 1;
    watch.begin("spectral radii", steps.max(2) as u64);
    let mut start = (survey.start(), survey.start());
    let mut columns = Vec::new();
    let mut spectra: Vec<Spectrum> = Vec::new();
    // Neighbours have nearly the same eigenvectors: each column starts from the last.
    for step in 0..=last {
        let tau = step as f64 / last as f64;
        let spectrum = survey.spectrum(tau, &start.0);
        let squares = survey.moment(tau, 2.0, &start.1);
        columns.push(Column { tau, radius: spectrum.worst(), squares: squares.worst() });
        start = (spectrum.x.clone(), squares.x);
        spectra.push(spectrum);
        watch.tick(1);
    }
    Map {
        tau_frontier: tau_frontier(&survey, &columns, &spectra),
        columns,
        grey: survey.grey(),
        rays: survey.rays(),
        crossings: survey.crossings(),
    }
}

impl Map {
    /// Every point of the grid, by alpha, then tau.
    pub fn grid(&self) -> impl Iterator<Item = GridPoint> {
        let last = (self.columns.len() - 1) as f64;
        (0..self.columns.len()).flat_map(move |step| {
            let alpha = step as f64 / last;
            let at = move |c: &Column| GridPoint { alpha, tau: c.tau, radius: scaled(c.radius, alpha) };
            self.columns.iter().map(at)
        })
    }

    /// alpha_c(tau): the mean diverges above. Empty where nothing travels on.
    pub fn frontier(&self) -> Vec<FrontierPoint> {
        self.points(|c| c.radius, |r| 1.0 / r)
    }

    /// alpha_v(tau): above, the variance of a path tracer with roulette and no splitting is infinite.
    pub fn variance_frontier(&self) -> Vec<FrontierPoint> {
        self.points(|c| c.squares, |r| 1.0 / r.sqrt())
    }

    fn points(&self, of: fn(&Column) -> Bounds, alpha: fn(f64) -> f64) -> Vec<FrontierPoint> {
        let growing = self.columns.iter().filter(|c| of(c).lower > 0.0);
        let point = |c: &Column| {
            let (lower, upper) = (alpha(of(c).upper), alpha(of(c).lower));
            FrontierPoint { tau: c.tau, alpha: 0.5 * (lower + upper), lower, upper }
        };
        growing.map(point).collect()
    }
}

/// Bounds of a matrix times a number.
fn scaled(b: Bounds, factor: f64) -> Bounds {
    Bounds { lower: factor * b.lower, upper: factor * b.upper }
}

/// Finds tau_c for every alpha of the grid whose frontier lies between two columns.
fn tau_frontier(survey: &Survey, columns: &[Column], spectra: &[Spectrum]) -> Vec<TauPoint> {
    let last = columns.len() - 1;
    let alphas = (1..=last).map(|step| step as f64 / last as f64);
    let found = alphas.filter_map(|alpha| {
        let right = columns.partition_point(|c| alpha * c.radius.middle() < 1.0);
        let inside = 1 <= right && right <= last;
        inside.then(|| solve(survey, alpha, &columns[right - 1..=right], &spectra[right]))
    });
    found.collect()
}

/// The tau between two columns at which alpha times the radius is 1.
fn solve(survey: &Survey, alpha: f64, ends: &[Column], near: &Spectrum) -> TauPoint {
    let excess = |radius: f64| (alpha * radius).ln();
    let mut low = (ends[0].tau, excess(ends[0].radius.middle()));
    let mut high = (ends[1].tau, excess(ends[1].radius.middle()));
    let mut start = near.x.clone();
    for step in 1.. {
        // A radius of 0 has no logarithm: halve.
        let share = if low.1.is_finite() { low.1 / (low.1 - high.1) } else { 0.5 };
        let tau = low.0 + (high.0 - low.0) * share;
        let spectrum = survey.spectrum(tau, &start);
        let radius = scaled(spectrum.worst(), alpha);
        if (radius.lower <= 1.0 && radius.upper >= 1.0) || step == STEPS {
            return TauPoint { alpha, tau, radius };
        }
        let here = (tau, radius.middle().ln());
        if here.1 < 0.0 {
            low = here;
        } else {
            high = here;
        }
        start = spectrum.x;
    }
    unreachable!("the last step returns")
}
