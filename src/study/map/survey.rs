//! One cast of rays, asked for spectral radii at any tau, and for those of any moment of the path tracer's weights.
//!
//! What a path carries, as [`reference`](crate::reference) samples it: at a vertex with throughput T (its largest
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

use crate::form_factors::{Layers, Sampling, Variant, cast_layers};
use crate::light::{Rgb, Transport};
use crate::operator::{Effort, Spectrum, spectrum_of};
use crate::patches::Patches;
use crate::rays::Rays;
use crate::scene::Scene;

use crate::render::{Prepared, Watch};

/// How exactly radii are found. They are those at alpha = 1: on which side of 1 they lie is no question.
const EFFORT: Effort = Effort { gap: 1e-3, products: 256, undecided: 0 };

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
    /// Casts the rays for materials at alpha = tau = 1, or their own.
    pub fn new(p: &Prepared, sampling: &Sampling, watch: &dyn Watch) -> Survey {
        let corner = Transport { alpha: 1.0, tau: 1.0 };
        let transports = p.scene.transports(corner);
        let subject = Subject { scene: &p.scene, rays: &p.rays, patches: &p.patches };
        Survey::of(&subject, &transports, sampling, watch)
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
            let radius = found.worst();
            start = found.x;
            alpha.powf(p) * 0.5 * (radius.lower + radius.upper) >= 1.0
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
