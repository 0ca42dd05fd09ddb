//! A picture to a wanted accuracy: the error is estimated while running, and effort goes where it buys most.
//!
//! The relative RMS error of the picture over the pixels that see no luminaire has four parts.
//!
//! * Noise of F: the rows are cast twice with independent scramblings and half the rays each; the picture of half the
//!   difference of the two solutions is the standard error.
//! * Size of patches: the solution on patches four times as large, from the same rays ([`crate::solve::coarse_terms`]).
//!   The error is of order 1.5 ([`crate::render::levels`]), so that of the finer patches is about half the difference.
//! * Truncation of the series: bounded.
//! * The gather pass: estimated by itself ([`crate::gather::GatherError`]).
//!
//! A rough gather of few pixels first tells the first two parts in the picture, not on the patches: what no pixel sees
//! and no visible surface receives does not count. Until both are within their shares, all patches become smaller and
//! their rays more, or patches are divided by light ([`crate::render::divided_patches`]). Then the gather pass gets
//! what is left of the tolerance. Where memory ends first they stay as they are, and the error says so.
//!
//! Not handled: patches along lines of contact have no larger patch; detail that neither level of patches resolves.

use std::time::Instant;

use crate::direct::luminaire_texture::TOLERABLE;
use crate::gather::{GatherPass, Gathering};
use crate::light::Transport;
use crate::light::budget::{FEW_PIXELS, FORM_FACTORS, PATCHES, STAND_INS, left};
use crate::render::assembly::{Prepared, Watch};
use crate::render::divided_patches::divided;
use crate::render::fineness::Fineness;
use crate::render::memory::{Held, Kept};
use crate::render::refinement::{Excess, Limits, Refinement};
use crate::render::rendered::Rendered;
use crate::render::residual_check::{Check, Finding};
use crate::render::solved::{Rough, Solved, Spent, Task, half, solve};
use crate::render::wanted::Wanted;
use crate::scene::Material;
use crate::solve::Diverges;

/// Patches, and rays a patch, at most.
const MOST: Fineness = Fineness { patches: 200_000, rays: 1 << 16 };
/// Pixels that tell their errors together; a picture of fewer is the mean of one of more.
const ENOUGH: usize = 256;
/// Times that patches and rays are chosen.
const ROUNDS: usize = 5;
/// Two solutions, and F transposed.
const HELD: Held = Held { casts: 3, solutions: 1, terms: Kept::Enough };
/// Share of the squared error, as measured at points, that patches half as wide may leave for more of them to be of
/// use: light that is smooth in patches leaves a quarter or less.
const HELPED: f64 = 0.5;
/// Share of the area whose patches have no larger one, beyond which the two levels tell too little.
const ALONE: f64 = 0.2;

/// Renders one mode to a tolerance; the patches of `p` are cut anew as it needs. Work that is late ends after its
/// round.
pub(crate) fn attempt(
    p: &mut Prepared,
    transport: Transport,
    wanted: &Wanted,
    watch: &dyn Watch,
) -> Result<Rendered, Diverges> {
    p.luminaires.tolerate(STAND_INS * wanted.tolerance);
    let found = attempted(p, transport, wanted, watch);
    // What is asked for next does not depend on this.
    p.luminaires.tolerate(TOLERABLE);
    found
}

/// Renders one mode to a tolerance, textured luminaires being as near as they were set to be.
///
/// A picture of few pixels is the mean of a larger one: what a handful of pixels tell of their own errors, each by one
/// difference of halves, is chance.
fn attempted(p: &mut Prepared, transport: Transport, wanted: &Wanted, watch: &dyn Watch) -> Result<Rendered, Diverges> {
    let (asked, step) = (wanted.size, wanted.size.enlargement(ENOUGH));
    let tolerance = if step > 1 { FEW_PIXELS * wanted.tolerance } else { wanted.tolerance };
    let wanted = &Wanted { size: asked.times(step), tolerance, ..*wanted };
    let mut spent = Spent::default();
    let solved = solve_within(p, &Task { transport, wanted: &wanted.of_light(), watch }, &mut spent)?;
    let clock = Instant::now();
    let error = left(wanted.tolerance, solved.error.sum().total.powi(2));
    let within = Gathering::Within { error, seed: wanted.seed, deadline: wanted.deadline };
    // The rough picture has told the errors of the fields.
    let fields = solved.fields.led().read_by(solved.reading);
    let gathered = solved.gather(p, &fields, &GatherPass::new(wanted.size, within), watch);
    let gathered = if step > 1 { gathered.averaged(step) } else { gathered };
    spent.seconds.gather += clock.elapsed().as_secs_f64();
    let lit = p.scene.materials.iter().any(Material::emits);
    let mut within = solved.finish(p, gathered, spent);
    if lit && within.is_black() {
        // Light that no ray found is no proof that there is none.
        within.error.gather = 1.0;
        within.error = within.error.sum();
    }
    Ok(within)
}

/// Solves on more patches and with more rays until their errors in a rough picture are within their shares.
fn solve_within(p: &mut Prepared, task: &Task, spent: &mut Spent) -> Result<Solved, Diverges> {
    let mut rounds = Rounds::new(p, task.wanted);
    let found = refined(p, task, &mut rounds, spent);
    spent.seconds.patches += rounds.refinement.cutting;
    found
}

/// Goes through the rounds to the last.
fn refined(p: &mut Prepared, task: &Task, rounds: &mut Rounds, spent: &mut Spent) -> Result<Solved, Diverges> {
    loop {
        rounds.begin(p, task.transport);
        let mut solved = solve(p, task, rounds.refinement.rays, spent)?;
        if solved.fields.is_dark() {
            return Ok(solved);
        }
        let rough = solved.rough(p, task.wanted, spent, task.watch);
        solved.set_errors(&rough.gathered);
        match rounds.judge(p, &mut solved, &rough, spent) {
            Next::Accept => return Ok(solved),
            Next::Divide(squared) => {
                // Its paths take memory.
                rounds.check = None;
                return divided(p, task, solved, squared, &rough.gathered, spent);
            }
            Next::Denser(noise) => rounds.denser(p, noise),
            Next::Finer(excess) => rounds.finer(p, excess),
        }
    }
}

/// What is to be done after a round.
enum Next {
    /// Nothing: the light is as it is wanted, or as good as it gets.
    Accept,
    /// Patches of a size do not stand for the scene, or are not known to, with some squared error that may be infinite:
    /// divide them by light.
    Divide(f64),
    /// More rays on the same patches, whose noise is so many times its share: it hides whether they are wrong.
    Denser(f64),
    /// Smaller patches everywhere, and more rays.
    Finer(Excess),
}

/// Rounds of patches and rays, and what they told so far.
struct Rounds<'a> {
    wanted: &'a Wanted,
    refinement: Refinement,
    /// Whether the patches are as they were cut first.
    first: bool,
    check: Option<Check>,
    /// Squared error as the check told it last.
    squared: f64,
}

impl<'a> Rounds<'a> {
    fn new(p: &mut Prepared, wanted: &'a Wanted) -> Rounds<'a> {
        let limits = Limits { most: MOST, rounds: ROUNDS, memory: wanted.memory };
        let refinement = Refinement::new(p, Fineness::first(wanted.tolerance), limits);
        Rounds { wanted, refinement, first: true, check: None, squared: f64::INFINITY }
    }

    /// Begins a round: no more patches than memory allows.
    fn begin(&mut self, p: &mut Prepared, transport: Transport) {
        let mean = (f64::from(self.refinement.rays) * p.density()).ceil() as u32;
        self.refinement.begin(p, transport, &half(mean, self.wanted.seed, 0), HELD);
    }

    /// What is to be done with a solution whose errors two levels of patches and two scramblings tell; states what the
    /// check tells of one that is accepted.
    fn judge(&mut self, p: &Prepared, solved: &mut Solved, rough: &Rough, spent: &mut Spent) -> Next {
        let wanted = self.wanted;
        let mut excess = Excess {
            noise: solved.error.form_factors / (FORM_FACTORS * wanted.tolerance),
            size: solved.error.patches / (PATCHES * wanted.tolerance),
        };
        let unpaired = self.first && p.patches.alone() > ALONE;
        if unpaired {
            excess.size = excess.size.max(2.0);
        }
        let last = self.refinement.full || wanted.is_late() || self.refinement.is_last();
        let check = self.check.get_or_insert_with(|| Check::new(p, solved, wanted, &rough.gathered));
        check.compare_with(&rough.gathered);
        let finding = check.find(p, solved, wanted, last || excess.is_none(), spent);
        let more_rays_tell = excess.noise > 1.0 && !self.refinement.has_most_rays();
        if finding == Finding::Noisy && more_rays_tell && !last {
            return Next::Denser(excess.noise);
        }
        let wrong = finding == Finding::Wrong;
        let squared = check.squared();
        let helped = squared < HELPED * std::mem::replace(&mut self.squared, squared);
        if wrong && helped && !last && are_told_apart(p) {
            return Next::Finer(Excess { noise: excess.noise, size: f64::INFINITY });
        }
        if wrong && !self.refinement.tight {
            return Next::Divide(f64::INFINITY);
        }
        if helped {
            excess.size = excess.size.max(squared.sqrt() / (PATCHES * wanted.tolerance));
        }
        if excess.is_none() || last || (excess.size > 1.0 && self.refinement.has_most_patches(p)) {
            // Not before: rays that go on hide what patches mix, and dividing those serves all rays.
            solved.set_nearest(p, wanted, spent);
            check.confirm(p, solved, wanted, rough, spent);
            // Patches of a size do not get there: those divided by light may, where memory is not what is short.
            let total = solved.error.sum().total;
            if total > wanted.tolerance && !self.refinement.tight && !wanted.is_late() {
                return Next::Divide(total * total);
            }
            return Next::Accept;
        }
        if excess.size > 1.0 { Next::Finer(excess) } else { Next::Denser(excess.noise) }
    }

    /// Casts more rays from every patch, for a noise that is so many times its share.
    fn denser(&mut self, p: &Prepared, noise: f64) {
        self.refinement.rays = self.refinement.finer(p, Excess { noise, size: 0.0 }).rays;
    }

    /// Cuts smaller patches everywhere, with more rays if their noise asks for them.
    fn finer(&mut self, p: &mut Prepared, excess: Excess) {
        self.first = false;
        let next = self.refinement.finer(p, excess);
        self.refinement.recut(p, next);
    }
}

/// Whether patches half as wide as these would be as many as triangles, and so could tell those apart.
fn are_told_apart(p: &Prepared) -> bool {
    (p.scene.faces.len()..=MOST.patches).contains(&(4 * p.patches.len()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::assembly::prepare;
    use crate::scene::Scene;

    /// Noise that hides whether patches are wrong is answered by rays alone: the same patches are judged again.
    #[test]
    fn a_denser_round_keeps_its_patches() {
        let mut p = prepare(Scene::open("cornell-box").expect("a scene"), 100);
        let wanted = Wanted { tolerance: 0.05, size: (8, 8).into(), deadline: None, memory: f64::INFINITY, seed: 0 };
        let mut rounds = Rounds::new(&mut p, &wanted);
        let (patches, rays) = (p.patches.len(), rounds.refinement.rays);
        rounds.denser(&p, 2.0);
        assert_eq!(rounds.refinement.rays, (1.2 * 4.0 * f64::from(rays)) as u32);
        assert!(p.patches.len() == patches && rounds.first);
        rounds.finer(&mut p, Excess { noise: 0.0, size: 2.0 });
        assert!(p.patches.len() > patches && !rounds.first);
    }
}
