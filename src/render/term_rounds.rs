//! The terms of the bounce series to a wanted accuracy of their powers: patches and rays grow until no term is off by
//! more than the tolerance, or until more of them do not help.
//!
//! Not handled: what each round finds and states ([`crate::render::series`]).

use std::time::Instant;

use crate::form_factors::Sampling;
use crate::gather::sampling::deadline_after;
use crate::light::Transport;
use crate::render::assembly::{Prepared, Watch};
use crate::render::fineness::Fineness;
use crate::render::light_walks::{WalkGoal, WalkedPowers, walked_powers};
use crate::render::memory::{Held, Kept};
use crate::render::refinement::{Limits, Refinement};
use crate::render::series::{BounceSeries, Round, WantedTerms, cast};
use crate::render::term_errors::End;

/// Patches and rays a patch of the second round, at a tolerance of 1 %.
const FIRST: (f64, f64) = (1000.0, 64.0);
/// Patches, and rays a patch, at most.
const MOST: Fineness = Fineness { patches: 100_000, rays: 1 << 16 };
/// Times that patches and rays are chosen.
const ROUNDS: usize = 8;
/// The first round only tells the size of patches: it has a share of the patches.
const LESS: f64 = 0.25;
/// Rounds in a row that did not help, after which no more follow.
const STUCK: usize = 2;
/// Standard errors of the walks, as a share of the tolerance: small enough to judge patches by.
const WALKS: f64 = 0.25;
/// Share of the time given that walks may take.
const WALKS_TIME: f64 = 0.25;

/// The first bounces with their powers to a tolerance; the patches of `p` are cut anew as it needs.
pub fn explore_within(p: &mut Prepared, transport: Transport, wanted: &WantedTerms, watch: &dyn Watch) -> BounceSeries {
    let mut search = Search::new(p, transport, wanted);
    loop {
        search.begin(p, transport);
        let mut series = cast(p, transport, wanted, search.refinement.rays, watch);
        let own = series.round(p.patches.len(), search.earlier.as_ref(), wanted, &search.clock);
        let next = search.next(p, &series);
        if let Some(end) = search.end(p, &series, &own, next) {
            series.end = end;
            series.settle(&search.walked, wanted.tolerance);
            return series;
        }
        search.refinement.recut(p, next);
        search.earlier = Some(own);
    }
}

/// Rounds of patches and rays, what the last one told, and what walks say.
struct Search<'a> {
    wanted: &'a WantedTerms,
    clock: Instant,
    refinement: Refinement,
    walked: WalkedPowers,
    earlier: Option<Round>,
}

impl<'a> Search<'a> {
    fn new(p: &mut Prepared, transport: Transport, wanted: &'a WantedTerms) -> Search<'a> {
        let clock = Instant::now();
        let second = first_told(wanted.tolerance);
        let first = Fineness { patches: (LESS * second.patches as f64) as usize, ..second };
        let walked = walk(p, transport, wanted, &clock);
        let limits = Limits { most: MOST, rounds: ROUNDS, memory: wanted.memory };
        Search { wanted, clock, refinement: Refinement::new(p, first, limits), walked, earlier: None }
    }

    /// Begins a round: no more patches than memory allows.
    fn begin(&mut self, p: &mut Prepared, transport: Transport) {
        let sampling = Sampling { rays: self.refinement.rays, ..Sampling::default() };
        let held = Held { casts: 2, solutions: 1, terms: Kept::First(self.wanted.count) };
        self.refinement.begin(p, transport, &sampling, held);
    }

    /// Patches and rays of the round after this.
    fn next(&self, p: &Prepared, series: &BounceSeries) -> Fineness {
        match &self.earlier {
            None if !self.refinement.full => first_told(self.wanted.tolerance),
            _ => self.refinement.finer(p, series.missed(self.wanted.tolerance)),
        }
    }

    /// Why no round of so many patches and rays is to follow, if none is.
    fn end(&self, p: &Prepared, series: &BounceSeries, own: &Round, next: Fineness) -> Option<End> {
        let rounds = &self.refinement;
        let full = rounds.full;
        if own.missed <= 1.0 && (self.earlier.is_some() || full) {
            Some(End::Met)
        } else if self.earlier.is_some() && series.contradicted(&self.walked, self.wanted.tolerance) {
            // Finer patches would follow an estimate that is known to be wrong.
            Some(End::NoBetter)
        } else if full {
            Some(End::Memory)
        } else if (rounds.has_most_patches(p) && rounds.has_most_rays()) || rounds.is_last() {
            Some(End::Most)
        } else if own.stuck == STUCK {
            Some(End::NoBetter)
        } else {
            let late = self.wanted.time.is_some_and(|time| self.foreseen(p, own, next) > time);
            late.then_some(End::Time)
        }
    }

    /// Seconds from the start to the end of the next round.
    fn foreseen(&self, p: &Prepared, own: &Round, next: Fineness) -> f64 {
        let before = self.earlier.as_ref().map_or(0.0, |e| e.ended);
        let work = |effort: Fineness| effort.patches as f64 * f64::from(effort.rays);
        own.ended + (own.ended - before) * work(next) / work(self.refinement.now(p))
    }
}

/// Patches and rays of the first round that tells errors, by its difference to the one before.
fn first_told(tolerance: f64) -> Fineness {
    let fineness = Fineness::over_one_percent(tolerance);
    let rays = ((FIRST.1 * fineness) as u32).max(16);
    Fineness { patches: (FIRST.0 * fineness) as usize, rays }
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
