//! The terms of the bounce series to a tolerance: powers by walks of light, everything else on patches of a size.
//!
//! Walks of light ([`crate::error::bounce_powers`]) know no patches, so the powers of terms that they measure have no
//! error but their standard error. Patches that lie half inside walls or half in the sun get each bounce wrong by more
//! than the one before (5 % at K⁸E in a furnished staircase with 0.65 % stated by two levels of them), so norms,
//! ratios, bounds and pictures alone are those of the patches.
//!
//! Where walks bring far less than patches have they missed a place, and more of them are taken. What they still miss
//! stays as patches have it, with the difference for its error.
//!
//! Not handled: errors of norms and pictures of single terms.

use std::sync::Arc;
use std::time::Instant;

use halflight_team::{deadline_after, is_over};

use crate::error::bounce_powers::{WalkGoal, WalkedPowers, walked_powers};
use crate::light::{Light, Transport};
use crate::operator::{EmitterLight, LinearOperator};
use crate::render::assembly::{Assembled, Discretization, Watch, assemble};
use crate::render::fineness::Fineness;
use crate::render::memory::Held;
use crate::render::pilot::fewer;
use crate::solve::{Solution, each_bounce, explore, powers};

/// Standard errors of the walks that are aimed at, as a share of the tolerance.
const WALKS: f64 = 0.5;
/// Share of the time left that walks may take; pictures are made of the rest.
const WALKS_TIME: f64 = 0.5;

/// What ended the search for a tolerance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// Every term is within the tolerance.
    Met,
    /// There are as many walks as are ever taken.
    Most,
    /// The time was over.
    Time,
}

impl End {
    /// What keeps the error above the tolerance; none where nothing does.
    pub fn why(self) -> Option<&'static str> {
        match self {
            End::Met => None,
            End::Most => Some("no more walks of light are taken than these"),
            End::Time => Some("more walks of light would not end in time"),
        }
    }
}

/// The series of one mode, and how far the powers of its terms may be off.
pub struct BounceSeries {
    /// K.
    pub mode: Assembled,
    /// Its series, with the powers that walks of light measured.
    pub solution: Solution,
    /// Relative standard errors of the terms' powers, E first; empty where effort was given in place of a tolerance.
    pub errors: Vec<f64>,
    /// What ended the search for a tolerance; none where effort was given.
    pub end: Option<End>,
    /// The terms of each emitter, where they are kept apart.
    pub emitters: Vec<EmitterTerms>,
}

/// The terms of one emitter.
#[derive(Clone, Debug)]
pub struct EmitterTerms {
    /// Its name.
    pub name: String,
    /// Power of the visible half of each term per channel, W, E first.
    pub powers: Vec<[f64; 3]>,
    /// Estimated relative errors of those; empty where effort was given in place of a tolerance.
    pub errors: Vec<f64>,
}

impl BounceSeries {
    /// The first bounces on patches as they are.
    pub(crate) fn fixed(mode: Assembled, count: usize) -> BounceSeries {
        let solution = explore(&mode.operator, count);
        let emitters = emitter_terms(&mode, solution.bounces.len() - 1);
        BounceSeries { mode, solution, errors: Vec::new(), end: None, emitters }
    }
}

/// Every emitter with its E; none where they are not kept apart.
fn emitted_terms(mode: &Assembled) -> Vec<EmitterTerms> {
    let k = &mode.operator;
    let names = mode.lights.emitters().names().iter().zip(k.emitters());
    let own = |(name, light): (&String, &EmitterLight)| EmitterTerms {
        name: name.clone(),
        powers: vec![powers(k.areas(), &light.emission)[0]],
        errors: Vec::new(),
    };
    names.map(own).collect()
}

/// The first terms of every emitter on patches.
fn emitter_terms(mode: &Assembled, count: usize) -> Vec<EmitterTerms> {
    let mut emitters = emitted_terms(mode);
    if !emitters.is_empty() {
        each_bounce(&mode.operator, &mode.sources(), count, |_, terms| {
            let power = |term: &[Light]| powers(mode.operator.areas(), term)[0];
            emitters.iter_mut().zip(terms).for_each(|(own, term)| own.powers.push(power(term)));
        });
    }
    emitters
}

/// The terms of every emitter as walks measured them.
fn walked_terms(mode: &Assembled, walked: &WalkedPowers) -> Vec<EmitterTerms> {
    let mut emitters = emitted_terms(mode);
    for (own, terms) in emitters.iter_mut().zip(&walked.emitters) {
        own.errors.push(0.0);
        for (term, error) in terms {
            own.powers.push(term.visible.to_array());
            own.errors.push(*error);
        }
    }
    emitters
}

/// The requested accuracy of the terms, and what it may take.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TermsGoal {
    /// Bounces, E not counted.
    pub count: usize,
    /// Relative error of each one's power.
    pub tolerance: f64,
    /// Seconds; half of them are the walks'.
    pub time: Option<f64>,
    /// Bytes that K may take; patches stay within.
    pub memory: f64,
    /// Chooses the scrambling of all points.
    pub seed: u32,
}

/// The first bounces with their powers to a tolerance.
pub(crate) fn bounces_to_tolerance(
    first: &Discretization,
    transport: Transport,
    goal: &TermsGoal,
    watch: &dyn Watch,
) -> BounceSeries {
    let began = Instant::now();
    let fineness = Fineness::of_terms(goal.tolerance);
    let sampling = fineness.sampling(goal.seed);
    let p = first.cut(fineness.patches);
    let held = Held { casts: 1, solutions: 1, bounces: Some(goal.count) };
    let p = fewer(&p, transport, &sampling, held, goal.memory.into()).unwrap_or(p);
    let lights = p.lights(p.transports(transport), goal.tolerance);
    let mode = assemble(&[(transport, lights)], &*p.rows, &sampling, watch).0.remove(0);
    let mut solution = explore(&mode.operator, goal.count);
    let left = |time: f64| time - began.elapsed().as_secs_f64();
    let deadline = goal.time.and_then(|time| deadline_after(Instant::now(), WALKS_TIME * left(time).max(0.0)));
    let walks = WalkGoal {
        count: goal.count,
        error: WALKS * goal.tolerance,
        deadline,
        seed: goal.seed,
        emitters: Arc::clone(&first.luminaires.emitters),
        on_patches: solution.bounces[1..].iter().map(|bounce| bounce.power.iter().sum()).collect(),
    };
    let walked = walked_powers(&first.geometry.scene, &first.geometry.rays, transport, &walks);
    let errors = take_powers(&mut solution, &walked, &walks);
    let end = match errors.iter().all(|&error| error <= goal.tolerance) {
        true => End::Met,
        false if is_over(deadline) => End::Time,
        false => End::Most,
    };
    let emitters = walked_terms(&mode, &walked);
    BounceSeries { mode, solution, errors, end: Some(end), emitters }
}

/// Gives the terms the powers that walks measured, and returns their errors. A term that walks missed keeps the power
/// that it has on patches, and the share that walks did not bring is its error.
fn take_powers(solution: &mut Solution, walked: &WalkedPowers, walks: &WalkGoal) -> Vec<f64> {
    // E is exact.
    let mut errors = vec![0.0];
    for (k, bounce) in solution.bounces[1..].iter_mut().enumerate() {
        let on_patches = walks.on_patches[k];
        errors.push(match walked.terms.get(k) {
            Some(term) if walks.is_missed(k, term) => 1.0 - term.0.total() / on_patches,
            Some((term, error)) if term.is_known() => {
                (bounce.power, bounce.power_invisible) = (term.visible.to_array(), term.invisible.to_array());
                *error
            }
            // A term of no power has no error.
            _ if on_patches == 0.0 => 0.0,
            _ => 1.0,
        });
    }
    errors
}
