//! The stability map: bounds on the spectral radius over the (alpha, tau) square, and the two frontiers, from one cast of rays.
//!
//! A material without numbers of its own takes (alpha, tau); one with its own takes alpha times its alpha and tau times
//! its tau. Then with `B(alpha, tau) = alpha b F^tau`, b = own alpha rho,
//!
//! ```text
//! radius(alpha, tau) = alpha radius(1, tau)               so alpha_c(tau) = 1 / radius(1, tau): one column a tau
//! second moment of a path's weight ~ (alpha² radius of M(tau))ⁿ     so alpha_v(tau) = radius(M(tau))^(-1/2)
//! ```
//!
//! M is the operator of squared weights of the path tracer ([`Survey::moment`]). alpha_v <= alpha_c always
//! (Cauchy-Schwarz: M x² >= (B x)² ray by ray). The bounds are those of [`spectrum_of`](crate::operator::spectrum_of): proofs for F as cast.
//!
//! Not handled: noise of F itself, which the number of rays sets.

pub(crate) mod contour;
pub(crate) mod inverse;
pub(crate) mod memory;
pub(crate) mod survey;
pub(crate) mod variance;

pub use contour::MapChart;
pub use memory::check_crossings;
pub use survey::Survey;
pub use variance::{Growth, Variance, growth};

use crate::form_factors::Sampling;
use crate::operator::{Bounds, Spectrum};

use crate::render::{Prepared, Watch};
use crate::study::map::inverse::tau_frontier;

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
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrontierPoint {
    /// Factor on every tau.
    pub tau: f64,
    /// Factor on every alpha.
    pub alpha: f64,
    /// The frontier is proved not to lie below.
    pub lower: f64,
    /// The frontier is proved not to lie above.
    pub upper: f64,
}

/// A point of the frontier tau(alpha), with the bounds on the spectral radius there, which enclose 1 or nearly so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TauPoint {
    /// Factor on every alpha.
    pub alpha: f64,
    /// Factor on every tau.
    pub tau: f64,
    /// Bounds on the spectral radius at (alpha, tau).
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
pub fn map(p: &Prepared, steps: usize, sampling: &Sampling, watch: &dyn Watch) -> Map {
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
    /// `(alpha, tau, bounds on the radius)` of every point of the grid, by alpha, then tau.
    pub fn grid(&self) -> impl Iterator<Item = (f64, f64, Bounds)> {
        let last = (self.columns.len() - 1) as f64;
        (0..self.columns.len()).flat_map(move |step| {
            let alpha = step as f64 / last;
            let at = move |c: &Column| (alpha, c.tau, scaled(c.radius, alpha));
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
