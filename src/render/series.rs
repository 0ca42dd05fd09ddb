//! The terms of the bounce series on patches of a size, with the errors of their powers.
//!
//! Each term's power has two errors. Noise of F: the spread over four casts with independent scramblings. Size of
//! patches: the difference to patches four times as large from the same rays, and the difference to the round before on
//! patches cut anew, whichever is larger. Errors fall as the patch size h to the power p of pictures
//! ([`ORDER`](crate::render::levels::ORDER)), so that between patches whose sizes differ by a factor of f those of the
//! smaller ones are the difference over `f^p - 1`. What a term is off is handed on by reflection: no term is taken to
//! be nearer than those before it, for two levels may cross and agree where both are wrong.
//!
//! Two levels of patches that are wrong alike see nothing: where patches lie half inside walls or half in the sun, each
//! bounce may be off by more than the one before (5 % at K⁸E in a furnished staircase with 0.65 % stated). So powers
//! are also measured by walks of light (`light_walks`), which know no patches. A term whose patches are off by more
//! than they state, as the walks tell, or by more than the tolerance, as they say themselves, takes the walks' power
//! and their standard error; norms and pictures stay those of the patches.
//!
//! Not handled: how many patches and rays they take ([`crate::render::term_rounds`]); terms below a millionth of the
//! first, whose share of the sum is below any tolerance; norms that patches of a size get wrong.

use std::time::Instant;

use crate::form_factors::Sampling;
use crate::light::{Light, Transport};
use crate::operator::Operator;
use crate::rays::sobol::replica_seed;
use crate::render::assembly::{Assembled, Prepared, Watch, assemble_seeing, sight};
use crate::render::levels::ORDER;
use crate::render::light_walks::WalkedPowers;
use crate::render::refinement::Excess;
use crate::render::term_errors::{End, TermError, errors, hand_on, looked_at};
use crate::solve::{Solution, coarse_terms, explore, measure};

/// Casts with independent scramblings.
const CASTS: u32 = 4;
/// A round that leaves more than this share of the error did not help.
const HELPED: f64 = 0.9;
/// Times that patches must be smaller than in the round before for the two to tell anything.
const CLEARLY: f64 = 1.2;
/// Standard errors of a difference that chance explains.
const DEVIATIONS: f64 = 2.0;

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
    /// Bytes that K may take; patches that are cut anew stay within.
    pub memory: f64,
    /// Chooses the scrambling of all points.
    pub seed: u32,
}

/// What is kept of a round for the next.
pub(crate) struct Round {
    patches: usize,
    powers: Vec<f64>,
    errors: Vec<TermError>,
    /// The worst term's error over what is allowed.
    pub missed: f64,
    /// Rounds in a row that did not help.
    pub stuck: usize,
    /// Seconds since the start.
    pub ended: f64,
}

impl BounceSeries {
    /// Takes the round before into the errors, and tells what the next one needs of this.
    pub(crate) fn round(
        &mut self,
        patches: usize,
        earlier: Option<&Round>,
        wanted: &WantedTerms,
        clock: &Instant,
    ) -> Round {
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
                error.patches = error.patches.max(left / (finer.powf(ORDER) - 1.0));
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
    pub(crate) fn contradicted(&self, walked: &WalkedPowers, tolerance: f64) -> bool {
        let proves = |n: usize| {
            let sure = DEVIATIONS * walked.errors[n - 1];
            self.apart(n, walked).is_some_and(|apart| apart - sure > tolerance.max(self.errors[n].total))
        };
        (1..self.errors.len()).any(proves)
    }

    /// Terms that are off by more than stated, as the walks tell, or by more than the tolerance, take the walks' power
    /// and error.
    pub(crate) fn settle(&mut self, walked: &WalkedPowers, tolerance: f64) {
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
    pub(crate) fn missed(&self, tolerance: f64) -> Excess {
        let worst = |part: fn(&TermError) -> f64| self.errors.iter().map(part).fold(0.0, f64::max);
        let share = 0.7 * tolerance;
        Excess { noise: worst(|e| e.form_factors) / share, size: worst(|e| e.patches) / share }
    }
}

/// One set of patches: the series of every cast, and of the larger patches under the first.
pub(crate) fn cast(
    p: &Prepared,
    transport: Transport,
    wanted: &WantedTerms,
    rays: u32,
    watch: &dyn Watch,
) -> BounceSeries {
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
