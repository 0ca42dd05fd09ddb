//! Scenes for which patches of a size do not stand: patches divided by the light on them, where the picture sees them.
//!
//! Paths from the camera tell where light matters ([`ImportancePaths`]). Patches then stand for the points that paths
//! reach, not for all of their area: what lies hidden behind a skirting board or in a wall gives and takes nothing, and
//! the mean over what a patch stands for is the one that makes the picture's mean error vanish (the projection weighted
//! by importance: Smits, Arvo, Salesin 1992; Becker and Rannacher 2001). Where the light sampled at those points
//! differs by more than chance the patch is divided ([`crate::patches::Patches::divide`]).
//!
//! Other paths, of a few pixels, measure what error is left. The gather pass makes up for it with less noise, or
//! follows one more ray; or more paths divide patches further, as long as that is the cheaper ([`ReadingCost`]).
//!
//! Not handled: what no path reaches; its patches keep few rays.

use std::time::Instant;

use crate::gather::sampling::would_be_over;
use crate::gather::{Effort, Gathered, ImportancePaths, READINGS, Reading, add_samples_of_bright};
use crate::light::budget::{DIVIDED_FORM_FACTORS, SURE};
use crate::patches::Patches;
use crate::rays::purpose::Purpose;
use crate::render::assembly::Prepared;
use crate::render::reading_cost::{MATTERS, ReadingCost};
use crate::render::residual_check::brightness;
use crate::render::solved::{Rough, Solved, Spent, Task, solve};
use crate::render::wanted::Wanted;
use crate::solve::Diverges;

/// What a round leaves of the squared error: of twice the samples the mean of parts as many as they can tell apart
/// leaves the power -1/2, on surfaces (C. J. Stone, *Optimal global rates of convergence for nonparametric
/// regression*, 1982: `n^(-2p / (2p + d))` with p = 1, d = 2).
const FALLS: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Rounds in a row that leave no less than the best before them, after which there are no more.
const STALLS: u32 = 2;
/// Paths at most that a few pixels tell it by.
const DRAWN: usize = 1 << 18;
/// Samples that the patches which all light comes from are to have together after the first round, twice as many after
/// each: a spot that is a tenth of all light then lies in some 800 of them, or as many as its part of a patch.
const BRIGHT: usize = 1 << 12;
/// Bytes that the paths may take that patches are divided by.
const HELD: usize = 1_500_000_000;
/// Paths of every pixel at a tolerance of 2 %, and at least and at most.
const EACH: (f64, u32, u32) = (12.0, 6, 256);
/// Rays of a patch at first at a tolerance of 2 % or less, fewer in proportion at larger ones; at least, and at most.
const RAYS: (f64, u32, u32) = (512.0, 64, 1 << 14);
/// Rays of a patch over those of all in the mean, at least and at most.
const DENSITY: (f32, f32) = (0.5, 8.0);
/// Rays of a patch that no path reaches.
const UNSEEN: f64 = 16.0;
/// Times that patches are divided at a tolerance of 5 % or more, and times more for each halving of it. Every round has
/// twice the paths of the one before, and rays of the gather pass grow as the tolerance to the power -2, so rounds that
/// let it read at once stay a like share of all work.
const ROUNDS: (f64, f64) = (3.0, 2.0);

/// The paths of a round.
#[derive(Clone, Copy)]
struct Round<'a> {
    wanted: &'a Wanted,
    /// Per pixel: how bright it was found to be.
    bright: &'a [f32],
    /// Paths of every pixel.
    each: u32,
    /// Tells sets of paths apart.
    set: u32,
}

/// A solution with the patches that it is on, and the squared error that its reading leaves.
struct Kept {
    squared: f64,
    solved: Solved,
    patches: Patches,
    densities: Vec<f32>,
}

impl Kept {
    /// This one, or one found before unless that leaves an error that is larger by as much as matters.
    fn better(self, before: Option<Kept>) -> Kept {
        match before {
            Some(before) if before.leaves_no_more_than(self.squared) => before,
            _ => self,
        }
    }

    /// Whether its error is not larger than another by as much as matters.
    fn leaves_no_more_than(&self, squared: f64) -> bool {
        self.squared.is_finite() && self.squared < MATTERS * MATTERS * squared
    }

    /// Takes its patches for those of the scene.
    fn restore(self, p: &mut Prepared) -> Solved {
        (p.patches, p.densities) = (self.patches, self.densities);
        self.solved
    }
}

/// Solves on patches divided by light, from a solution on others, which leaves a `squared` error if that is known, and
/// the `first` rough picture of it. Where none of the rounds is good enough the best solution is returned, the first
/// among them.
pub(crate) fn divided(
    p: &mut Prepared,
    task: &Task,
    mut solved: Solved,
    mut squared: f64,
    first: &Gathered,
    spent: &mut Spent,
) -> Result<Solved, Diverges> {
    let Task { wanted, .. } = *task;
    let each = (EACH.0 * 0.02 / wanted.tolerance) as u32;
    let mut each = each.clamp(EACH.1, EACH.2);
    let last = rounds(wanted.tolerance, each);
    let mut rays = ((RAYS.0 * (0.02 / wanted.tolerance).min(1.0)) as u32).max(RAYS.1);
    let mut bright = brightness(first);
    let mut pixels = solved.pixels(p, wanted, &bright);
    let mut seen = walks(p, &solved, Round { wanted, bright: &bright, each, set: 1 }, spent);
    let mut best: Option<Kept> = None;
    let mut stalls = 0;
    for round in 1u32.. {
        let before = spent.rays;
        let clock = Instant::now();
        let began = clock;
        let mut samples = seen.samples(&p.scene, &p.patches, &solved.fields);
        let view = solved.rough_view(p, wanted);
        spent.rays += add_samples_of_bright(
            &view,
            &solved.fields,
            &mut samples,
            BRIGHT << round,
            Purpose::BrightPatches(round).seed(wanted.seed),
        );
        let (patches, densities) = (p.patches.clone(), p.densities.clone());
        p.divide(samples);
        spent.seconds.patches += clock.elapsed().as_secs_f64();
        let (now, mut rough) = cast(p, task, rays, spent)?;
        let kept = Kept { squared, solved: std::mem::replace(&mut solved, now), patches, densities };
        best = Some(kept.better(best));
        if rough.gathered.error.signal > 0.0 && !wanted.is_late() {
            let took = spent.rays - before - rough.gathered.rays;
            let cost = ReadingCost::new(&rough, wanted, seen.prices(&p.patches, &solved.fields));
            let denser = rays.saturating_mul(cost.denser(took as f64, solved.error.form_factors)).min(RAYS.2);
            let is_late = would_be_over(wanted.deadline, clock, f64::from(denser / rays));
            if denser > rays && !is_late {
                rays = denser;
                (solved, rough) = cast(p, task, rays, spent)?;
            }
        }
        let noise = solved.error.form_factors / (DIVIDED_FORM_FACTORS * wanted.tolerance);
        let signal = rough.gathered.error.signal.powi(2);
        if signal == 0.0 {
            return Ok(solved);
        }
        bright = brightness(&rough.gathered);
        let certain = signal * (SURE * wanted.tolerance).powi(2);
        let clock = Instant::now();
        let effort = Effort { wanted: certain, most: DRAWN, deadline: wanted.deadline };
        let drawn = solved.drawn(p, wanted, &mut pixels, effort, spent);
        spent.seconds.solve += clock.elapsed().as_secs_f64();
        let all = believed(drawn.map(|squared| squared.over(signal).upper()), solved.error.form_factors);
        let cost = ReadingCost::new(&rough, wanted, pixels.prices(&p.patches, &solved.fields));
        let (now, then) = (cost.cheapest(all), cost.cheapest(all.map(|s| FALLS * s)));
        squared = all[now.reading.number()];
        // The next round has twice the paths.
        let again = (spent.rays - before + seen.rays) as f64;
        let is_enough = now.rays.is_finite() && now.rays <= again + then.rays;
        let helped = best.as_ref().is_none_or(|best| !best.leaves_no_more_than(squared / FALLS));
        stalls = if helped { 0 } else { stalls + 1 };
        if is_enough || round >= last || stalls == STALLS || wanted.would_be_late(began) {
            if let Some(best) = best.filter(|best| !now.rays.is_finite() && best.leaves_no_more_than(squared)) {
                return Ok(best.restore(p));
            }
            solved.reading = now.reading;
            solved.state(squared);
            return Ok(solved);
        }
        if noise > 1.0 {
            rays = ((f64::from(rays) * noise * noise) as u32).min(RAYS.2);
        }
        solved.reading = now.reading;
        solved.state(squared);
        // Sets that exceed what paths may take together are not joined.
        let others = walks(p, &solved, Round { wanted, bright: &bright, each, set: 1 + round }, spent);
        if seen.bytes() + others.bytes() > HELD {
            seen = others;
        } else {
            seen.absorb(others);
        }
        each *= 2;
    }
    unreachable!("the last round returns")
}

/// Solves with so many rays a patch; a rough picture tells the errors.
fn cast(p: &mut Prepared, task: &Task, rays: u32, spent: &mut Spent) -> Result<(Solved, Rough), Diverges> {
    p.densities = densities(p, rays);
    let mut solved = solve(p, task, rays, spent)?;
    let rough = solved.rough(p, task.wanted, spent, task.watch);
    solved.set_errors(&rough.gathered);
    solved.set_nearest(p, task.wanted, spent);
    Ok((solved, rough))
}

/// The squared errors by reading that paths tell, where they are no less than noise of F alone makes them.
///
/// Where light comes by few ways few paths find it, so that most sets of them tell too little. Two scramblings of F
/// tell its noise without them; what they contradict is taken to be too small by as much at every reading.
fn believed(told: [f64; READINGS], noise: f64) -> [f64; READINGS] {
    let plain = told[Reading::AtOnce.number()];
    let short = if plain > 0.0 { (noise * noise / plain).max(1.0) } else { 1.0 };
    told.map(|squared| short * squared)
}

/// Times that patches are divided at most, from `first` paths of every pixel on: as often as is worth it, while the
/// paths of a round are no more than [`EACH`] allows. All are kept, so more would not fit in memory.
fn rounds(tolerance: f64, first: u32) -> u32 {
    let worth = ROUNDS.0 + ROUNDS.1 * (0.05 / tolerance).log2().max(0.0);
    let held = 1 + (EACH.2 / first).max(1).ilog2();
    (worth as u32).min(held).max(ROUNDS.0 as u32)
}

/// Paths of one set, `each` of every pixel.
fn walks(p: &Prepared, solved: &Solved, round: Round, spent: &mut Spent) -> ImportancePaths {
    let clock = Instant::now();
    let view = solved.rough_view(p, round.wanted);
    let mut walks =
        ImportancePaths::new(&view, round.bright.to_vec(), Purpose::Paths(round.set).seed(round.wanted.seed));
    walks.extend(&view, round.each);
    spent.rays += walks.rays;
    spent.seconds.solve += clock.elapsed().as_secs_f64();
    walks
}

/// Rays of each patch over those asked for: in proportion to how often paths reach it, and few where none does.
fn densities(p: &Prepared, rays: u32) -> Vec<f32> {
    let few = (UNSEEN / f64::from(rays)).min(1.0) as f32;
    let reached: Vec<f32> = (0..p.patches.len()).map(|i| p.patches.chosen(i).len() as f32).collect();
    let count = reached.iter().filter(|&&n| n > 0.0).count().max(1);
    let mean = reached.iter().sum::<f32>() / count as f32;
    let own = |&n: &f32| {
        if n > 0.0 { (n / mean).clamp(DENSITY.0, DENSITY.1) } else { few }
    };
    reached.iter().map(own).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A classroom lit through its windows had paths that told 1.1 % where noise of F was 2.1 and 1.5 were true.
    #[test]
    fn paths_that_tell_less_than_noise_of_f_are_not_believed() {
        let mut told = [1e-4; READINGS];
        told[1] = 0.25e-4;
        assert_eq!(believed(told, 0.005), told);
        let more = believed(told, 0.02);
        assert!((more[0] - 4e-4).abs() < 1e-12 && (more[1] - 1e-4).abs() < 1e-12, "{more:?}");
        // What is no number stays so.
        assert!(believed([f64::NAN; READINGS], 0.02)[0].is_nan());
    }

    /// Paths double from round to round: 14 rounds at 0.1 % would be 2 million of every pixel.
    #[test]
    fn rounds_are_more_at_small_tolerances_as_long_as_paths_fit() {
        assert_eq!(
            [(0.1, 12), (0.05, 12), (0.02, 12), (0.01, 24), (0.001, 240)].map(|(t, n)| rounds(t, n)),
            [3, 3, 5, 4, 3]
        );
        for first in EACH.1..=EACH.2 {
            let last = first << (rounds(1e-6, first) - 1);
            assert!(last <= EACH.2.max(4 * first), "{first}: {last}");
        }
    }
}
