//! A picture to a wanted accuracy: the error is estimated while running, and effort goes where it buys most.
//!
//! The relative RMS error of the picture over the pixels that see no luminaire has four parts.
//!
//! * Noise of F: the rows are cast twice with independent scramblings and half the rays each; the picture of half the
//!   difference of the two solutions is the standard error.
//! * Size of patches: the solution on patches four times as large, from the same rays ([`crate::solve::coarse_terms`]). The error is
//!   between first and second order, so that of the finer patches is about half the difference.
//! * Truncation of the series: bounded.
//! * The gather pass: estimated by itself ([`crate::gather::GatherError`]).
//!
//! A rough gather of few pixels first tells the first two parts in the picture, not on the patches: what no pixel sees
//! and no visible surface receives does not count. Until both are within their shares, patches are divided in the zones that
//! the error comes from, and rows whose noise shows get more rays ([`crate::render::patch_sizes`]). Then the
//! gather pass gets what is left of the tolerance. Where memory ends first they stay as they are, and the error says so.
//!
//! Not handled: patches along lines of contact have no larger patch; detail that neither level of patches resolves.

use std::time::Instant;

use crate::gather::Gathering;
use crate::light::Transport;
use crate::render::assembly::{Prepared, Watch};
use crate::render::divided_patches::divided;
use crate::render::error_shares::shares;
use crate::render::memory::keep_within;
use crate::render::patch_sizes::Sizes;
use crate::render::rendered::Rendered;
use crate::render::residual_check::Check;
use crate::render::solved::{Solved, Spent, half, solve};
use crate::render::wanted::Wanted;
use crate::scene::Material;
use crate::solve::Diverges;

/// Shares of the tolerance that noise of F, and patch size, may take.
const FORM_FACTORS: f64 = 0.35;
const PATCHES: f64 = 0.4;
/// Share of what is left that the gather pass aims at: its own estimate has an error too.
const GATHER: f64 = 0.9;
/// Patches and rays a patch at first, at a tolerance of 1 %.
const FIRST: (f64, f64) = (1000.0, 128.0);
/// Patches, and rays a patch, at most.
const MOST: (usize, u32) = (200_000, 1 << 16);
/// How far below their shares the next round aims.
const MARGIN: f64 = 1.1;
/// Times patches and rays are chosen anew.
const ROUNDS: usize = 5;
/// Share of the area whose patches have no larger one, beyond which the two levels tell too little.
const ALONE: f64 = 0.2;

/// Renders one mode to a tolerance; the patches of `p` are cut anew as it needs.
///
/// # Errors
/// [`Diverges`] where the series does.
pub fn render_within(
    p: &mut Prepared,
    transport: Transport,
    wanted: &Wanted,
    watch: &dyn Watch,
) -> Result<Rendered, Diverges> {
    let mut spent = Spent::default();
    let solved = solve_within(p, transport, wanted, &mut spent, watch)?;
    let clock = Instant::now();
    let left = wanted.tolerance.powi(2) - solved.error.sum().total.powi(2);
    // Where the solution used up the tolerance, the gather pass still has a share.
    let error = GATHER * left.max(0.25 * wanted.tolerance.powi(2)).sqrt();
    let seed = wanted.seed;
    let deadline = p.deadline;
    let within = Gathering::Within { error, seed, deadline };
    // The rough picture has told the errors of the fields.
    let gathered = solved.gather(p, &solved.fields.led().read_by(solved.reading), wanted.size, within, watch);
    spent.seconds.gather += clock.elapsed().as_secs_f64();
    spent.seconds.patches += p.seconds;
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
fn solve_within(
    p: &mut Prepared,
    transport: Transport,
    wanted: &Wanted,
    spent: &mut Spent,
    watch: &dyn Watch,
) -> Result<Solved, Diverges> {
    let fineness = (0.01 / wanted.tolerance).clamp(0.1, 10.0);
    let mut rays = ((FIRST.1 * fineness.sqrt()) as u32).next_power_of_two();
    let mut patches = (FIRST.0 * fineness) as usize;
    p.recut(patches);
    let mut sizes = None;
    let mut check: Option<Check> = None;
    let mut tight = false;
    for round in 1.. {
        let mean = (f64::from(rays) * p.density()).ceil() as u32;
        // Two solutions, and F transposed.
        let most = keep_within(p, transport, &half(mean, wanted.seed, 0), 3);
        tight |= most;
        let mut solved = solve(p, transport, rays, wanted, spent, watch)?;
        if solved.fields.is_dark() {
            return Ok(solved);
        }
        let rough = solved.rough(p, wanted, spent, watch);
        solved.set_errors(&rough);
        let check = check.get_or_insert_with(|| Check::new(p, &solved, wanted, &rough));
        let wrong = check.contradicts(p, &solved, wanted);
        if wrong && !tight {
            spent.rays += check.rays();
            return divided(p, transport, (solved, &rough), wanted, spent, watch);
        }
        let noise = solved.error.form_factors / (FORM_FACTORS * wanted.tolerance);
        let mut coarse = solved.error.patches / (PATCHES * wanted.tolerance);
        let blind = round == 1 && p.patches.alone() > ALONE;
        if blind {
            coarse = coarse.max(2.0);
        }
        let full = most || p.is_late() || (coarse > 1.0 && p.patches.len() >= MOST.0);
        if (noise <= 1.0 && coarse <= 1.0) || round == ROUNDS || full {
            // Patches of a size do not get there: those divided by light may, where memory is not what is short.
            if solved.error.sum().total > wanted.tolerance && !tight && !p.is_late() {
                spent.rays += check.rays();
                return divided(p, transport, (solved, &rough), wanted, spent, watch);
            }
            check.confirm(p, &mut solved, wanted);
            spent.rays += check.rays();
            return Ok(solved);
        }
        if blind {
            (patches, rays) = finer((p.patches.len(), rays), (noise, coarse), MOST);
            p.recut(patches);
            continue;
        }
        refine(p, &solved, &mut sizes, (noise, coarse), wanted, spent);
    }
    unreachable!("the last round returns")
}

/// Cuts smaller patches where their size makes the error, and casts more rays for the rows whose noise does; `noise` and
/// `coarse` tell how far the errors exceed their shares.
fn refine(
    p: &mut Prepared,
    solved: &Solved,
    sizes: &mut Option<Sizes>,
    (noise, coarse): (f64, f64),
    wanted: &Wanted,
    spent: &mut Spent,
) {
    let clock = Instant::now();
    let sizes = sizes.get_or_insert_with(|| Sizes::new(p));
    let shares = shares(p, solved, wanted);
    let mut more = vec![1.0; sizes.len()];
    if coarse > 1.0 {
        more = sizes.refine(p, &shares.size, (MARGIN * coarse).powi(-2), MOST.0);
    }
    if noise > 1.0 {
        sizes.spread(p, &shares.noise, (MARGIN * noise).powi(-2), &more);
    }
    spent.seconds.solve += clock.elapsed().as_secs_f64();
    sizes.apply(p, coarse > 1.0);
}

/// The patches and rays a patch of the next round, up to `most`, from how far noise and the error of patch size exceed
/// their shares.
pub(crate) fn finer((patches, rays): (usize, u32), (noise, coarse): (f64, f64), most: (usize, u32)) -> (usize, u32) {
    // The error of patch size falls about as their number; noise with all rays, as the root at least.
    let more = (1.1 * coarse).clamp(1.0, 4.0);
    let denser = (1.2 * noise * noise / more).clamp(1.0, 16.0);
    (((patches as f64 * more) as usize).min(most.0), ((f64::from(rays) * denser) as u32).min(most.1))
}
