//! One cast of rays: spectral radii at any tau, and those of any moment of the path tracer's weights; and how much
//! memory that takes.
//!
//! What a path carries, as [`reference`](halflight_reference) samples it: at a vertex with throughput T (its largest
//! channel over that of the first surface, so T >= 1 always) one ray is cast; X_j is the light of the crossings with
//! patch j for T = 1, S the sum of all X_j. The path goes on at j with probability X_j / S, so that its throughput
//! becomes T S whatever j; roulette lets it live with probability min(1, T S) and then sets it to max(1, T S). Hence
//! for the moment of order p >= 1
//!
//! ```text
//! E[T'^p, at j] = mean of X_j/S T S max(1, T S)^(p-1)  >=  T^p M^(p)_ij,       M^(p)_ij = mean of S^(p-1) X_j
//!               <= T^p M^(p)_ij + T B_ij   for p = 2,  B = M^(1)
//! ```
//!
//! so that the second moment of a path's whole weight is finite where the radii of B and M^(2) are below 1 (with B u <=
//! lambda u, M v <= mu v, the function C u T + v T² falls by a constant factor a step for C large), and infinite where
//! that of M^(2) is 1 or more and emitters see the patches concerned. Next-event estimation adds bounded factors only.
//!
//! Between the frontiers of M^(1) and M^(2) the weight has a tail of index p with radius of M^(p) = 1, 1 < p < 2, and
//! the error of a mean of N paths falls as N^-(1 - 1/p) (Kesten 1973 for products; stable laws for their sums).
//!
//! With colours, X_j takes the largest channel of alpha rho: exact where one channel is the largest everywhere.

use glam::Vec4;

use halflight::form_factors::{Layers, Sampling, Variant, cast_layers};
use halflight::light::{Rgb, Transport};
use halflight::operator::{Spectrum, SpectrumEffort, spectrum_of};
use halflight::patches::Patches;
use halflight::rays::Rays;
use halflight::render::{Discretization, Stored, Unfit, Watch, check_fit, pilots};
use halflight::scene::Scene;

/// How exactly radii are found. They are those at alpha = 1: on which side of 1 they lie is no question.
const EFFORT: SpectrumEffort = SpectrumEffort { gap: 1e-3, products: 256, undecided: 0 };

/// What is surveyed.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its rays.
    pub rays: &'a Rays,
    /// Its patches.
    pub patches: &'a Patches,
}

/// The crossings of a scene's rays, and what its patches pass on at alpha = 1.
pub struct Survey {
    layers: Layers,
    /// Own alpha times rho; the fourth component is 0.
    passed: Vec<Vec4>,
    /// The largest channel of that.
    largest: Vec<f32>,
    rays: u64,
}

impl Survey {
    /// (alpha, tau) of materials without their own, for the rays of a map.
    pub const CORNER: Transport = Transport { alpha: 1.0, tau: 1.0 };

    /// Casts the rays for materials at alpha = tau = 1, or their own.
    pub fn new(p: &Discretization, sampling: &Sampling, watch: &dyn Watch) -> Survey {
        let subject = Subject { scene: &p.geometry.scene, rays: &p.geometry.rays, patches: &p.patches };
        Survey::of(&subject, &p.transports(Survey::CORNER), sampling, watch)
    }

    /// The same for any (alpha, tau) of the materials, which take the place of their own.
    pub fn of(subject: &Subject, transports: &[Transport], sampling: &Sampling, watch: &dyn Watch) -> Survey {
        let Subject { scene, rays, patches } = *subject;
        let of = |(i, &m): (usize, &u32)| transports[m as usize].alpha * patches.reflectance(scene, i);
        let passed: Vec<Rgb> = patches.materials().iter().enumerate().map(of).collect();
        let largest: Vec<f32> = passed.iter().map(|b| b.max_element()).collect();
        let travels: Vec<bool> = largest.iter().map(|&b| b > 0.0).collect();
        let tau: Vec<f32> = transports.iter().map(|t| t.tau).collect();
        watch.begin("form factors", patches.len() as u64);
        let own = Variant { tau, rows: travels.clone(), columns: travels };
        let (layers, rays) = cast_layers(rays, patches, &own, sampling, &|done| watch.tick(done));
        Survey { layers, passed: passed.iter().map(|b| b.extend(0.0)).collect(), largest, rays }
    }

    /// An iteration's start that knows nothing.
    pub fn start(&self) -> Vec<Vec4> {
        vec![Vec4::ONE; self.passed.len()]
    }

    /// The spectrum of K at alpha = 1, iterating from `start`.
    pub fn spectrum(&self, tau: f64, start: &[Vec4]) -> Spectrum {
        let f = self.layers.form_factors(tau as f32);
        spectrum_of(&|x| f.product(x), &self.passed, start, &EFFORT)
    }

    /// The spectrum of `M^(order)` at alpha = 1, in the first channel; that at other alphas is alpha^order times this.
    pub fn moment(&self, tau: f64, order: f64, start: &[Vec4]) -> Spectrum {
        let m = self.layers.moment(tau as f32, &self.largest, order);
        let first = |b: &f32| if *b > 0.0 { Vec4::X } else { Vec4::ZERO };
        let visited: Vec<Vec4> = self.largest.iter().map(first).collect();
        spectrum_of(&|x| m.product(x), &visited, start, &EFFORT)
    }

    /// The index p in (1, 2) of the tail of a path's weight at (alpha, tau): alpha^p radius(M^(p)) = 1, to 1e-3.
    ///
    /// None where the second moment is finite or the mean is not.
    pub fn tail_index(&self, alpha: f64, tau: f64) -> Option<f64> {
        let mut start = self.start();
        let mut grows = |p: f64| {
            let found = self.moment(tau, p, &start);
            let radius = found.worst().middle();
            start = found.x;
            alpha.powf(p) * radius >= 1.0
        };
        let (mut low, mut high) = (1.0, 2.0);
        if grows(low) || !grows(high) {
            return None;
        }
        while high - low > 1e-3 {
            let middle = 0.5 * (low + high);
            if grows(middle) {
                high = middle;
            } else {
                low = middle;
            }
        }
        Some(0.5 * (low + high))
    }

    /// Whether one channel is the largest on every patch, so that moments are exact and not upper bounds.
    pub fn grey(&self) -> bool {
        let largest = |c: usize| {
            let mut pairs = self.passed.iter().zip(&self.largest);
            pairs.all(|(b, largest)| b[c] == *largest)
        };
        (0..3).any(largest)
    }

    /// Rays cast.
    pub fn rays(&self) -> u64 {
        self.rays
    }

    /// Crossings kept.
    pub fn crossings(&self) -> usize {
        self.layers.crossings()
    }
}

/// Bytes of a crossing, of a column or ray that is listed, and of a patch's three lists.
const CROSSING: f64 = 12.0;
const LISTED: f64 = 4.0;
const LISTS: f64 = 72.0;
/// Bytes of an entry of a matrix while it is made, and of its row.
const ENTRY: f64 = 24.0;
const ROW: f64 = 72.0;
/// Bytes of a patch for each column of the map, and for all other lists.
const VECTORS: f64 = 32.0;
const PATCH: f64 = 200.0;

/// Checks that the crossings of a [`map`](crate::map::map) of so many `steps` each way fit in `limit` bytes;
/// infinity checks nothing.
///
/// ```text
/// n (12 x + 4 c + 4 r + 72)    x crossings, c columns and r rays a patch; three lists
/// n (24 c + 72)                one matrix made from them, apart and joined
/// n (32 s + 200)               eigenvectors of s columns of the map, and other lists
/// ```
///
/// x and c are measured on a few patches; the scene itself is already loaded. Of the first two rows each of several
/// processes has its share.
///
/// # Errors
/// [`Unfit`], with the number of patches that would.
pub fn check_crossings(p: &Discretization, sampling: &Sampling, steps: usize, limit: f64) -> Result<(), Unfit> {
    if limit.is_infinite() {
        return Ok(());
    }
    let (crossings, columns) = pilot(p, sampling);
    let needs = |n: f64| {
        let c = columns.min(n);
        let kept = CROSSING * crossings + LISTED * (c + f64::from(sampling.rays)) + LISTS;
        n * (p.rows.kept_share() * (kept + ENTRY * c + ROW) + VECTORS * steps as f64 + PATCH)
    };
    check_fit(p.patches.len(), Stored::Crossings(crossings), limit, needs)
}

/// Mean crossings and columns of a few patches at alpha = tau = 1.
fn pilot(p: &Discretization, sampling: &Sampling) -> (f64, f64) {
    let n = p.patches.len();
    let mut receives = vec![false; n];
    let chosen = pilots(n, sampling);
    for &i in &chosen {
        receives[i] = true;
    }
    let corner = Transport { alpha: 1.0, tau: 1.0 };
    let transports = p.geometry.scene.transports(corner);
    let tau: Vec<f32> = transports.iter().map(|t| t.tau).collect();
    let own = Variant { tau, rows: receives, columns: vec![true; n] };
    let (layers, _) = cast_layers(&p.geometry.rays, &p.patches, &own, sampling, &|_| ());
    let mean = |count: usize| count as f64 / chosen.len().max(1) as f64;
    (mean(layers.crossings()), mean(layers.columns()))
}
