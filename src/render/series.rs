//! The terms of the bounce series to a wanted accuracy of their powers.
//!
//! Each term's power has two errors. Noise of F: the spread over four casts with independent scramblings. Size of
//! patches: the difference to patches four times as large from the same rays, and the difference to the round before on
//! patches cut anew, whichever is larger. Light of a patch is read as one value by K, an error of first order in patch
//! size, so the whole difference counts; between rounds of n and m patches it is the difference over `sqrt(n/m) - 1`.
//! What a term is off is handed on by reflection: no term is taken to be nearer than those before it, for two levels
//! may cross and agree where both are wrong.
//!
//! Patches and rays grow until no term is off by more than the tolerance, or until more of them do not help.
//!
//! Two levels of patches that are wrong alike see nothing: where patches lie half inside walls or half in the sun, each
//! bounce may be off by more than the one before (5 % at K⁸E in a furnished staircase with 0.65 % stated). So powers
//! are also measured by walks of light (`light_walks`), which know no patches. A term whose patches are off by more
//! than they state, as the walks tell, or by more than the tolerance, as they say themselves, takes the walks' power
//! and their standard error; norms and pictures stay those of the patches.
//!
//! Not handled: terms below a millionth of the first; their share of the sum is below any tolerance. Norms that patches
//! of a size get wrong.

use std::time::Instant;

use crate::form_factors::Sampling;
use crate::gather::sampling::deadline_after;
use crate::light::{Light, Transport};
use crate::operator::Operator;
use crate::rays::sobol::replica_seed;
use crate::render::assembly::{Assembled, Prepared, Watch, assemble_seeing, sight};
use crate::render::fineness::Fineness;
use crate::render::light_walks::{WalkGoal, WalkedPowers, walked_powers};
use crate::render::memory::{Held, Kept, keep_terms_within};
use crate::render::term_errors::{End, TermError, errors, hand_on, looked_at};
use crate::render::tolerance::{Excess, finer};
use crate::solve::{Solution, coarse_terms, explore, measure};

/// Casts with independent scramblings.
const CASTS: u32 = 4;
/// Patches and rays a patch at first, at a tolerance of 1 %.
const FIRST: (f64, f64) = (1000.0, 64.0);
/// Patches, and rays a patch, at most.
const MOST: Fineness = Fineness { patches: 100_000, rays: 1 << 16 };
/// Times patches and rays are chosen anew.
const ROUNDS: usize = 8;
/// The first round only tells the size of patches: it has a share of the patches.
const LESS: f64 = 0.25;
/// A round that leaves more than this share of the error did not help; so many of them in a row are enough.
const HELPED: f64 = 0.9;
const STUCK: usize = 2;
/// Times that patches must be smaller than in the round before for the two to tell anything.
const CLEARLY: f64 = 1.2;
/// Standard errors of a difference that chance explains.
const DEVIATIONS: f64 = 2.0;
/// Standard errors of the walks, as a share of the tolerance: small enough to judge patches by.
const WALKS: f64 = 0.25;
/// Share of the time given that walks may take.
const WALKS_TIME: f64 = 0.25;
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
    /// What ended it.
    pub end: End,
    /// Powers of all terms.
    powers: Vec<f64>,
}

/// What is asked of the terms.
#[derive(Clone, Copy, Debug)]
pub struct WantedTerms {
    /// Bounces, E not counted.
    pub count: usize,
    /// Relative error of each one's power.
    pub tolerance: f64,
    /// Seconds; no round is begun that would not end within them.
    pub time: Option<f64>,
    /// Chooses the scrambling of all points.
    pub seed: u32,
}

/// What is kept of a round for the next.
struct Round {
    patches: usize,
    powers: Vec<f64>,
    errors: Vec<TermError>,
    /// The worst term's error over what is allowed.
    missed: f64,
    /// Rounds in a row that did not help.
    stuck: usize,
    /// Seconds since the start.
    ended: f64,
}

/// The first bounces with their powers to a tolerance; the patches of `p` are cut anew as it needs.
pub fn explore_within(p: &mut Prepared, transport: Transport, wanted: &WantedTerms, watch: &dyn Watch) -> BounceSeries {
    let clock = Instant::now();
    let fineness = Fineness::over_one_percent(wanted.tolerance);
    let rays = ((FIRST.1 * fineness) as u32).max(16);
    let begin = Fineness { patches: (FIRST.0 * fineness) as usize, rays };
    let mut effort = Fineness { patches: (LESS * FIRST.0 * fineness) as usize, rays };
    let walked = walk(p, transport, wanted, &clock);
    let mut earlier: Option<Round> = None;
    for round in 1.. {
        p.recut(effort.patches);
        let sampling = Sampling { rays: effort.rays, ..Sampling::default() };
        let held = Held { casts: 2, solutions: 1, terms: Kept::First(wanted.count) };
        let most = keep_terms_within(p, transport, &sampling, held);
        let mut series = cast(p, transport, wanted, effort.rays, watch);
        let own = series.round(p.patches.len(), earlier.as_ref(), wanted, &clock);
        let done = Fineness { patches: own.patches, rays: effort.rays };
        let next = match &earlier {
            // The first round only tells something together with the second.
            None if !most => begin,
            _ => finer(done, series.missed(wanted.tolerance), MOST),
        };
        let before = earlier.as_ref().map_or(0.0, |e| e.ended);
        let work = |effort: Fineness| effort.patches as f64 * f64::from(effort.rays);
        let foreseen = own.ended + (own.ended - before) * work(next) / work(done);
        let end = if own.missed <= 1.0 && (earlier.is_some() || most) {
            End::Met
        } else if earlier.is_some() && series.contradicted(&walked, wanted.tolerance) {
            // Finer patches would follow an estimate that is known to be wrong.
            End::NoBetter
        } else if most {
            End::Memory
        } else if (done.patches >= MOST.patches && done.rays >= MOST.rays) || round == ROUNDS {
            End::Most
        } else if own.stuck == STUCK {
            End::NoBetter
        } else if wanted.time.is_some_and(|time| foreseen > time) {
            End::Time
        } else {
            (effort, earlier) = (next, Some(own));
            continue;
        };
        series.end = end;
        series.settle(&walked, wanted.tolerance);
        return series;
    }
    unreachable!("the last round returns")
}

impl BounceSeries {
    /// Takes the round before into the errors, and tells what the next one needs of this.
    fn round(&mut self, patches: usize, earlier: Option<&Round>, wanted: &WantedTerms, clock: &Instant) -> Round {
        if let Some(old) = earlier {
            self.compare(old, (patches as f64 / old.patches as f64).sqrt());
        }
        let Excess { noise, size: coarse } = self.missed(wanted.tolerance);
        let missed = noise.max(coarse);
        // The first round has nothing to be compared with, so the second's error may be larger.
        let stuck = match earlier {
            Some(old) if missed > HELPED * old.missed => old.stuck + 1,
            _ => 0,
        };
        Round {
            patches,
            powers: self.powers.clone(),
            errors: self.errors.clone(),
            missed,
            stuck,
            ended: clock.elapsed().as_secs_f64(),
        }
    }

    /// Errors of patch size are at least what the round before on fewer patches tells; `finer` is how many times as
    /// large those were.
    fn compare(&mut self, before: &Round, finer: f64) {
        if finer < CLEARLY {
            return;
        }
        for (n, error) in self.errors.iter_mut().enumerate() {
            let (Some(own), Some(old)) = (self.powers.get(n), before.powers.get(n)) else {
                continue;
            };
            let noise = before.errors.get(n).map_or(0.0, |e| e.form_factors);
            if looked_at(&self.powers, n) {
                // Of the difference, what chance does not explain.
                let apart = (own - old).abs() / own;
                let left = (apart - DEVIATIONS * noise.hypot(error.form_factors)).max(0.0);
                error.patches = error.patches.max(left / (finer - 1.0));
            }
        }
        hand_on(&mut self.errors, &self.powers);
    }

    /// By how much the walks' power of term n differs from the patches' own, relative to the walks'; None where the
    /// walks found nothing, or nothing surer.
    fn apart(&self, n: usize, walked: &WalkedPowers) -> Option<f64> {
        let power = walked.terms.get(n.checked_sub(1)?)?.visible.element_sum();
        (power > 0.0 && looked_at(&self.powers, n)).then(|| (self.powers[n] - power).abs() / power)
    }

    /// Whether the walks prove a term to be off by more than the tolerance and than its stated error.
    fn contradicted(&self, walked: &WalkedPowers, tolerance: f64) -> bool {
        let proves = |n: usize| {
            let sure = DEVIATIONS * walked.errors[n - 1];
            self.apart(n, walked).is_some_and(|apart| apart - sure > tolerance.max(self.errors[n].total))
        };
        (1..self.errors.len()).any(proves)
    }

    /// Terms that are off by more than stated, as the walks tell, or by more than the tolerance, take the walks' power
    /// and error.
    fn settle(&mut self, walked: &WalkedPowers, tolerance: f64) {
        for n in 1..self.errors.len() {
            let Some(apart) = self.apart(n, walked) else { continue };
            let (term, walks) = (walked.terms[n - 1], walked.errors[n - 1]);
            let error = &mut self.errors[n];
            if apart <= error.total && (error.total <= tolerance || error.total <= walks) {
                continue;
            }
            *error = TermError { walks, total: walks, ..TermError::default() };
            self.powers[n] = term.visible.element_sum();
            let bounce = &mut self.solution.bounces[n];
            (bounce.power, bounce.power_invisible) = (term.visible.to_array(), term.invisible.to_array());
        }
        if self.errors.iter().all(|e| e.total <= tolerance) {
            self.end = End::Met;
        }
    }

    /// How many times larger than their shares noise and the error of patch size are, in the worst term.
    fn missed(&self, tolerance: f64) -> Excess {
        let worst = |part: fn(&TermError) -> f64| self.errors.iter().map(part).fold(0.0, f64::max);
        let share = 0.7 * tolerance;
        Excess { noise: worst(|e| e.form_factors) / share, size: worst(|e| e.patches) / share }
    }
}

/// The powers of all terms by walks of light.
fn walk(p: &Prepared, transport: Transport, wanted: &WantedTerms, clock: &Instant) -> WalkedPowers {
    let goal = WalkGoal {
        count: wanted.count,
        error: WALKS * wanted.tolerance,
        deadline: wanted.time.and_then(|time| deadline_after(*clock, WALKS_TIME * time)),
        seed: wanted.seed,
    };
    walked_powers(&p.scene, &p.rays, transport, &goal)
}

/// One set of patches: the series of every cast, and of the larger patches under the first.
fn cast(p: &Prepared, transport: Transport, wanted: &WantedTerms, rays: u32, watch: &dyn Watch) -> BounceSeries {
    let sights = [sight(p, &p.scene.transports(transport))];
    let one = |cast: u32| {
        let sampling = Sampling { rays, seed: replica_seed(wanted.seed, cast), ..Sampling::default() };
        let (mut modes, _) = assemble_seeing(p, &[transport], &sights, &sampling, watch);
        let mode = modes.remove(0);
        let solution = explore(&mode.operator, wanted.count);
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
        end: End::Met,
        powers: powers.swap_remove(0),
    }
}

/// Power of the visible half of every term, channels added, W.
fn powers(k: &Operator, terms: &[Vec<Light>]) -> Vec<f64> {
    let power = |(n, term): (usize, &Vec<Light>)| measure(k, n, term, None).power.iter().sum();
    terms.iter().enumerate().map(power).collect()
}
