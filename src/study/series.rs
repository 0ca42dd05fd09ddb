//! The terms of the bounce series to a wanted accuracy of their powers.
//!
//! Each term's power has two errors. Noise of F: the spread over four casts with independent scramblings. Size of
//! patches: the difference to patches four times as large from the same rays, a third of it for errors of second order. Patches
//! and rays grow until no term is off by more than the tolerance.
//!
//! Not handled: terms below a millionth of the first; their share of the sum is below any tolerance.

use super::memory::keep_within;
use super::pipeline::{Assembled, Prepared, Watch, assemble_seeing, sight};
use super::tolerance::finer;
use crate::form_factors::Sampling;
use crate::light::{Light, Transport};
use crate::operator::Operator;
use crate::solve::{Solution, coarse_terms, explore, measure};

/// Casts with independent scramblings.
const CASTS: u32 = 4;
/// Patches and rays a patch at first, at a tolerance of 1 %.
const FIRST: (f64, f64) = (1000.0, 64.0);
/// Patches, and rays a patch, at most.
const MOST: (usize, u32) = (100_000, 1 << 16);
/// Times patches and rays are chosen anew.
const ROUNDS: usize = 6;
/// The error on the finer patches as a share of the difference between the two levels.
const SECOND_ORDER: f64 = 1.0 / 3.0;
/// Terms below this share of the first are not looked at.
const NEGLIGIBLE: f64 = 1e-6;

/// Estimated relative errors of one term's power.
#[derive(Clone, Copy, Debug, Default, serde::Serialize)]
pub struct TermError {
    /// Noise of F.
    pub form_factors: f64,
    /// Size of the patches.
    pub patches: f64,
    /// Both together.
    pub total: f64,
}

/// The series of one mode, and how far its terms may be off.
pub struct BounceSeries {
    /// K, from the first cast.
    pub mode: Assembled,
    /// Its series.
    pub solution: Solution,
    /// Errors of the terms, E first.
    pub errors: Vec<TermError>,
    /// Rays cast from each patch.
    pub rays: u32,
}

/// The first `count` bounces with their powers to a tolerance; the patches of `p` are cut anew as it needs.
pub fn explore_within(
    p: &mut Prepared,
    transport: Transport,
    count: usize,
    (tolerance, seed): (f64, u32),
    watch: &dyn Watch,
) -> BounceSeries {
    let fineness = (0.01 / tolerance).clamp(0.1, 10.0);
    let (mut patches, mut rays) = ((FIRST.0 * fineness) as usize, (FIRST.1 * fineness) as u32);
    for round in 1.. {
        p.recut(patches);
        let sampling = Sampling {
            rays: rays.max(16),
            ..Sampling::default()
        };
        let most = keep_within(p, transport, &sampling, 2);
        let series = cast(p, transport, count, (rays.max(16), seed), watch);
        let worst =
            |part: fn(&TermError) -> f64| series.errors.iter().map(part).fold(0.0, f64::max);
        let noise = worst(|e| e.form_factors) / (0.7 * tolerance);
        let coarse = worst(|e| e.patches) / (0.7 * tolerance);
        let full = most || (p.patches.len() >= MOST.0 && rays >= MOST.1);
        if (noise <= 1.0 && coarse <= 1.0) || round == ROUNDS || full {
            return series;
        }
        (patches, rays) = finer((p.patches.len(), rays), (noise, coarse), MOST);
    }
    unreachable!("the last round returns")
}

/// One set of patches: the series of every cast, and of the larger patches under the first.
fn cast(
    p: &Prepared,
    transport: Transport,
    count: usize,
    (rays, seed): (u32, u32),
    watch: &dyn Watch,
) -> BounceSeries {
    let sights = [sight(p, &p.scene.transports(transport))];
    let one = |cast: u32| {
        let sampling = Sampling {
            rays,
            seed: seed.wrapping_add(cast.wrapping_mul(0x9e37_79b9)),
            ..Sampling::default()
        };
        let (mut modes, _) = assemble_seeing(p, &[transport], &sights, &sampling, watch);
        let mode = modes.remove(0);
        let solution = explore(&mode.operator, count);
        (mode, solution)
    };
    let (mode, solution) = one(0);
    let last = solution.terms.len() - 1;
    let mut powers = vec![powers(&mode.operator, &solution.terms)];
    powers.extend((1..CASTS).map(|c| {
        let (mode, solution) = one(c);
        self::powers(&mode.operator, &solution.terms)
    }));
    let coarse = coarse_terms(&mode.operator, p.patches.areas(), p.patches.parents(), last);
    let coarse = self::powers(&mode.operator, &coarse);
    BounceSeries {
        errors: errors(&powers, &coarse),
        mode,
        solution,
        rays,
    }
}

/// Power of the visible half of every term, channels added, W.
fn powers(k: &Operator, terms: &[Vec<Light>]) -> Vec<f64> {
    let power = |(n, term): (usize, &Vec<Light>)| measure(k, n, term, None).power.iter().sum();
    terms.iter().enumerate().map(power).collect()
}

/// Errors of the first cast's powers.
fn errors(casts: &[Vec<f64>], coarse: &[f64]) -> Vec<TermError> {
    let terms = casts.iter().map(Vec::len).min().unwrap_or(0);
    let first = casts[0].get(1).copied().unwrap_or(0.0);
    let one = |n: usize| {
        let own = casts[0][n];
        if n == 0 || own <= NEGLIGIBLE * first || !own.is_finite() {
            return TermError::default();
        }
        let count = casts.len() as f64;
        let mean = casts.iter().map(|c| c[n]).sum::<f64>() / count;
        let spread: f64 = casts.iter().map(|c| (c[n] - mean).powi(2)).sum();
        let form_factors = (spread / (count - 1.0)).sqrt() / own;
        let patches = SECOND_ORDER * (own - coarse[n]).abs() / own;
        TermError {
            form_factors,
            patches,
            total: form_factors.hypot(patches),
        }
    };
    (0..terms).map(one).collect()
}
