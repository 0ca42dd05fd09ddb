//! Whether the path tracer's variance is finite in one scene and mode, found before it starts.
//!
//! With B and `M = M^(2)` of [`Survey`] for the materials' (alpha, tau), the second moment of a path's weight is finite
//! where the radii of both are below 1, and infinite where that of M is 1 or more. Nothing need be cast where
//!
//! ```text
//! nothing travels on (alpha rho = 0 everywhere):   a path has one reflection
//! tau = 0 everywhere and alpha rho <= q < 1:       one crossing a ray, so S <= q,
//!                                                  rows of B sum to at most q and those of M to q²
//! ```
//!
//! Elsewhere radii come from some hundred patches. Their size and the noise of their rays move the radii by some
//! percent, so what lies within [`MARGIN`] of 1 is undecided, as is what colours leave open. Not handled:
//! `max_bounces`, which makes any variance finite, of the sum up to there, and by far too large to be of use where it
//! would be infinite without.

use crate::map::survey::{Subject, Survey};
use halflight::form_factors::Sampling;
use halflight::light::Transport;
use halflight::operator::Bounds;
use halflight::patches::Patches;
use halflight::rays::Rays;
use halflight::render::Silent;
use halflight::scene::Scene;

/// Patches that radii are found on.
const PATCHES: usize = 600;
/// Rays in all, about, and from one patch at least and at most: a scene of many faces has as many patches.
const RAYS: usize = 1 << 17;
const RAYS_EACH: (usize, usize) = (8, 256);
/// Radii of patches as coarse are within this share of those of fine ones (furnished room, 4,785 patches: 0.8 % for B,
/// 3.6 % for M).
const MARGIN: f64 = 0.08;

/// What is known of a path tracer's second moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Variance {
    /// It exists: errors fall as N^-1/2.
    Finite,
    /// It does not: errors fall slower.
    Infinite,
    /// Too near to the frontier, or colours leave it open.
    Undecided,
}

/// Growth of a path's weight a step, and what follows from it; null in reports where nothing is known.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Growth {
    /// What is known of the variance.
    #[serde(rename = "verdict")]
    pub variance: Variance,
    /// Bounds on the spectral radius of K, coarse patches; none where nothing had to be cast.
    #[serde(rename = "spectral_radius")]
    pub mean: Option<Bounds>,
    /// Bounds on that of the squared weights.
    #[serde(rename = "squared_weights")]
    pub squares: Option<Bounds>,
    /// x of the error of a mean of N paths, which falls as N^-x: 1 - 1/p where the variance is infinite and the mean is
    /// not.
    pub exponent: Option<f64>,
}

impl Growth {
    /// Whether the mean is infinite as well: the series diverges.
    pub fn diverges(&self) -> bool {
        self.mean.is_some_and(|b| b.lower > 1.0 + MARGIN)
    }
}

/// Finds out what the path tracer's variance does when a scene's materials without their own (alpha, tau) take
/// `transport`.
pub fn growth(scene: &Scene, rays: &Rays, transport: Transport, seed: u32) -> Growth {
    let transports = scene.transports(transport);
    if surely_finite(scene, &transports) {
        return Growth { variance: Variance::Finite, mean: None, squares: None, exponent: Some(0.5) };
    }
    let patches = Patches::new(scene, rays, PATCHES);
    let each = (RAYS / patches.len().max(1)).clamp(RAYS_EACH.0, RAYS_EACH.1);
    let sampling = Sampling { rays: each as u32, seed, ..Sampling::default() };
    let survey = Survey::of(&Subject { scene, rays, patches: &patches }, &transports, &sampling, &Silent);
    let mean = survey.spectrum(1.0, &survey.start()).worst();
    let squares = survey.moment(1.0, 2.0, &survey.start()).worst();
    let variance = judge(mean, squares, survey.grey());
    let exponent = match variance {
        Variance::Finite => Some(0.5),
        Variance::Infinite => survey.tail_index(1.0, 1.0).map(|p| 1.0 - 1.0 / p),
        Variance::Undecided => None,
    };
    Growth { variance, mean: Some(mean), squares: Some(squares), exponent }
}

/// What follows without casting a ray.
fn surely_finite(scene: &Scene, transports: &[Transport]) -> bool {
    let pairs = || scene.materials.iter().zip(transports);
    let passed = pairs().map(|(m, t)| (t.alpha * m.rho).max_element());
    let most = passed.fold(0.0, f32::max);
    most == 0.0 || (most < 1.0 && transports.iter().all(|t| t.tau == 0.0))
}

/// On which side of 1 the radii lie, for sure; `grey` if those of M are bounds from below as well.
fn judge(mean: Bounds, squares: Bounds, grey: bool) -> Variance {
    let below = |b: Bounds| b.upper < 1.0 - MARGIN;
    let above = |b: Bounds| b.lower > 1.0 + MARGIN;
    // That of B is then below 1 as well: its square is no larger than that of M (Cauchy-Schwarz).
    if below(squares) {
        return Variance::Finite;
    }
    // A mean that is infinite has no variance, whatever the colours.
    if above(mean) || above(squares) && grey { Variance::Infinite } else { Variance::Undecided }
}
