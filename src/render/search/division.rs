//! Scenes for which patches of a size do not stand: patches divided by the light on them, where the picture sees them.
//!
//! Paths from the camera show where light matters ([`ImportancePaths`]). Patches then stand for the points that paths
//! reach, not for all of their area: what lies hidden behind a skirting board or in a wall gives and takes nothing, and
//! the mean over what a patch stands for is the one that makes the picture's mean error vanish (the projection weighted
//! by importance: Smits, Arvo, Salesin 1992; Becker and Rannacher 2001). Where the light sampled at those points
//! differs by more than chance the patch is divided ([`crate::patches::Patches::divided`]).
//!
//! Other paths, of a few pixels, measure the error that remains. The gather pass makes up for it with less noise, or
//! more paths divide patches further, as long as that is the cheaper ([`PictureCost`]).
//!
//! Not handled: what no path reaches; its patches keep few rays.

use std::time::Instant;

use halflight_team::would_be_over;

use crate::error::{ImportancePaths, add_samples_of_bright};
use crate::light::budget::DIVIDED_FORM_FACTORS;
use crate::patches::Sample;
use crate::rays::purpose::Purpose;
use crate::render::goal::{Spent, timed};
use crate::render::search::picture_cost::PictureCost;
use crate::render::search::residual_check::{Check, brightness};
use crate::render::search::solved::{Next, Rough, Solved, Task};

/// The share of the squared error that remains after a round: of twice the samples the mean of as many parts as they
/// can separate leaves the power -1/2, on surfaces (C. J. Stone, *Optimal global rates of convergence for nonparametric
/// regression*, 1982: `n^(-2p / (2p + d))` with p = 1, d = 2).
const FALLS: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Errors of the light matter where one is so many times another.
const MATTERS: f64 = 1.5;
/// Rounds in a row that leave no less than the best before them, after which there are no more.
const STALLS: u32 = 2;
/// Paths at most that a few pixels measure it by.
const DRAWN: usize = 1 << 18;
/// Samples that the patches which all light comes from are to have together after the first round, twice as many after
/// each: a spot that is a tenth of all light then lies in some 800 of them, or as many as its part of a patch.
const BRIGHT: usize = 1 << 12;
/// Bytes that the paths may take that patches are divided by.
const HELD: u64 = 1_500_000_000;
/// Paths of every pixel at a tolerance of 2 %, and at least and at most.
const EACH: (f64, u32, u32) = (12.0, 6, 256);
/// Rays of a patch at first at a tolerance of 2 % or less, fewer in proportion at larger ones; at least, and at most.
const RAYS: (f64, u32, u32) = (512.0, 64, 1 << 14);
/// Times that patches are divided at a tolerance of 5 % or more, and times more for each halving of it. Every round has
/// twice the paths of the one before, and rays of the gather pass grow as the tolerance to the power -2, so rounds that
/// let it read at once stay a like share of all work.
const ROUNDS: (f64, f64) = (3.0, 2.0);

/// A solution, and the squared error that it leaves.
struct Candidate {
    squared: f64,
    solved: Box<Solved>,
}

impl Candidate {
    /// Whether its error is not larger than another by as much as matters.
    fn leaves_no_more_than(&self, squared: f64) -> bool {
        self.squared.is_finite() && self.squared < MATTERS * MATTERS * squared
    }
}

/// Rounds of dividing patches, and what they showed so far.
pub(crate) struct Division {
    /// How bright each pixel of the rough picture is.
    bright: Vec<f32>,
    /// Paths of every pixel in the next set.
    each: u32,
    /// Rounds at most.
    last: u32,
    round: u32,
    /// The paths that patches are divided by.
    paths: ImportancePaths,
    best: Option<Candidate>,
    stalls: u32,
    /// When this round began, and the rays cast before.
    began: Instant,
    before: u64,
    /// Whether the rays of this round are as many as pay.
    is_dense: bool,
    /// How many times as many rays the next round casts, for their noise.
    more: f64,
}

impl Division {
    /// Rays of a round, about: those of the paths that measure it, by four each.
    pub(crate) const RAYS: f64 = 4.0 * DRAWN as f64;

    /// Rays of a patch at first.
    pub(crate) fn first_rays(tolerance: f64) -> u32 {
        ((RAYS.0 * (0.02 / tolerance).min(1.0)) as u32).max(RAYS.1)
    }

    /// Follows the first paths, from a solution whose rough picture is given.
    pub(crate) fn new(task: &Task, solved: &Solved, rough: &Rough, spent: &mut Spent) -> Division {
        let tolerance = task.goal.tolerance;
        let each = ((EACH.0 * 0.02 / tolerance) as u32).clamp(EACH.1, EACH.2);
        let bright = brightness(&rough.gathered);
        let paths = follow(task, solved, &bright, each, 1, spent);
        let (last, began) = (rounds(tolerance, each), Instant::now());
        Division {
            bright,
            each,
            last,
            round: 0,
            paths,
            best: None,
            stalls: 0,
            began,
            before: 0,
            is_dense: false,
            more: 1.0,
        }
    }

    /// Rays of a patch in the next round, after so many in this.
    pub(crate) fn rays(&self, rays: u32) -> u32 {
        if self.more > 1.0 { ((f64::from(rays) * self.more) as u32).min(RAYS.2) } else { rays }
    }

    /// Begins a round: samples of the light that a solution has on the patches of the mesh. The solution leaves a
    /// squared error, and is kept if none before is better.
    pub(crate) fn samples(
        &mut self,
        task: &Task,
        solved: Solved,
        squared: f64,
        began: Instant,
        spent: &mut Spent,
    ) -> Vec<Vec<Sample>> {
        let goal = task.goal;
        self.round += 1;
        (self.began, self.before, self.is_dense) = (began, spent.rays, false);
        let sample = || {
            let mut samples = self.paths.samples(solved.mode.scene(), solved.patches(), &solved.fields);
            let (view, seed) = (solved.rough_view(goal), Purpose::BrightPatches(self.round).seed(goal.seed));
            let cast = add_samples_of_bright(&view, &solved.fields, &mut samples, BRIGHT << self.round, seed);
            (samples, cast)
        };
        let ((samples, cast), seconds) = timed(sample);
        spent.rays += cast;
        spent.seconds.patches += seconds;
        if !self.best.as_ref().is_some_and(|best| best.leaves_no_more_than(squared)) {
            self.best = Some(Candidate { squared, solved: Box::new(solved) });
        }
        samples
    }

    /// What is to be done with a solution on divided patches, of so many rays. Where none of the rounds is good enough
    /// the best solution is returned, the one before the first among them.
    pub(crate) fn judge(
        &mut self,
        task: &Task,
        rays: u32,
        mut solved: Solved,
        rough: &Rough,
        check: &mut Check,
        spent: &mut Spent,
    ) -> Next {
        let goal = task.goal;
        if rough.gathered.error.signal == 0.0 {
            return Next::Accept(Box::new(solved));
        }
        if !std::mem::replace(&mut self.is_dense, true) && !goal.is_late() {
            let took = spent.rays - self.before - rough.gathered.rays;
            let cost = PictureCost::new(rough, goal, self.paths.price(solved.patches(), &solved.fields));
            let denser = rays.saturating_mul(cost.denser(took as f64, solved.error.form_factors)).min(RAYS.2);
            if denser > rays && !would_be_over(goal.deadline, self.began, f64::from(denser / rays)) {
                return Next::Rays(denser);
            }
        }
        self.bright = brightness(&rough.gathered);
        check.compare_with(&rough.gathered);
        let found = check.measure(&solved, goal, DRAWN, spent);
        let squared = no_less_than_noise(found.upper(), solved.error.form_factors);
        let cost = PictureCost::new(rough, goal, check.price(&solved));
        let (now, then) = (cost.priced(squared), cost.priced(FALLS * squared));
        // The next round has twice the paths.
        let again = (spent.rays - self.before + self.paths.rays) as f64;
        let is_enough = now.rays.is_finite() && now.rays <= again + then.rays;
        let helped = self.best.as_ref().is_none_or(|best| !best.leaves_no_more_than(squared / FALLS));
        self.stalls = if helped { 0 } else { self.stalls + 1 };
        if is_enough || self.round >= self.last || self.stalls == STALLS || goal.would_be_late(self.began) {
            let better = self.best.take().filter(|best| !now.rays.is_finite() && best.leaves_no_more_than(squared));
            if let Some(best) = better {
                return Next::Accept(best.solved);
            }
            solved.camera = now.camera;
            solved.state(squared);
            return Next::Accept(Box::new(solved));
        }
        self.more = (solved.error.form_factors / (DIVIDED_FORM_FACTORS * goal.tolerance)).powi(2);
        solved.camera = now.camera;
        solved.state(squared);
        // Sets that exceed what paths may take together are not joined.
        let others = follow(task, &solved, &self.bright, self.each, 1 + self.round, spent);
        if self.paths.bytes() + others.bytes() > HELD {
            self.paths = others;
        } else {
            self.paths.absorb(others);
        }
        self.each *= 2;
        Next::Divide(Box::new(solved), squared)
    }
}

/// A squared error that paths show, where it is no less than noise of F alone makes it: where light comes by few ways
/// few paths find it, so that most sets of them show too little, and two scramblings of F show its noise without them.
/// What is no number stays so.
fn no_less_than_noise(squared: f64, noise: f64) -> f64 {
    if squared < noise * noise { noise * noise } else { squared }
}

/// Times that patches are divided at most, from `first` paths of every pixel on: as often as is worth it, while the
/// paths of a round are no more than [`EACH`] allows. All are kept, so more would not fit in memory.
fn rounds(tolerance: f64, first: u32) -> u32 {
    let worth = ROUNDS.0 + ROUNDS.1 * (0.05 / tolerance).log2().max(0.0);
    let held = 1 + (EACH.2 / first).max(1).ilog2();
    (worth as u32).min(held).max(ROUNDS.0 as u32)
}

/// Set number `set` of paths, `each` of every pixel.
fn follow(task: &Task, solved: &Solved, bright: &[f32], each: u32, set: u32, spent: &mut Spent) -> ImportancePaths {
    let view = solved.rough_view(task.goal);
    let seed = Purpose::Paths(set).seed(task.goal.seed);
    let mut paths = ImportancePaths::new(&view, bright.to_vec(), seed);
    let ((), seconds) = timed(|| paths.extend(&view, each));
    spent.rays += paths.rays;
    spent.seconds.solve += seconds;
    paths
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As in a classroom lit through its windows: paths show 1.1 % where noise of F is 2.1 and 1.5 are true.
    #[test]
    fn paths_that_show_less_than_noise_of_f_count_as_it() {
        assert_eq!([0.005, 0.02].map(|noise| no_less_than_noise(1e-4, noise)), [1e-4, 4e-4]);
        assert!(no_less_than_noise(f64::NAN, 0.02).is_nan());
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
