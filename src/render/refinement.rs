//! Rounds of ever more patches and rays, which pictures to a tolerance and terms to a tolerance share: how many the
//! next round takes, and when there are no more to take.
//!
//! Errors of patch size fall as the size to the power [`ORDER`](crate::render::levels::ORDER), noise of F as the root
//! of all rays, at least.
//!
//! Not handled: what an error is, and which one is enough; those who run the rounds tell
//! ([`tolerance`](crate::render::tolerance), [`term_rounds`](crate::render::term_rounds)).

use std::time::Instant;

use crate::form_factors::Sampling;
use crate::light::Transport;
use crate::render::assembly::Prepared;
use crate::render::fineness::Fineness;
use crate::render::levels::patches_for;
use crate::render::memory::{Held, keep_within};

/// How far below their shares the next round aims.
pub(crate) const MARGIN: f64 = 1.1;

/// How far errors exceed their shares of the tolerance; up to 1 they do not.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Excess {
    /// Noise of F.
    pub noise: f64,
    /// The size of patches.
    pub size: f64,
}

impl Excess {
    /// Whether neither error exceeds its share.
    pub fn is_none(self) -> bool {
        self.noise <= 1.0 && self.size <= 1.0
    }
}

/// What no round goes beyond.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    /// Patches, and rays a patch.
    pub most: Fineness,
    /// Rounds.
    pub rounds: usize,
    /// Bytes that K may take.
    pub memory: f64,
}

/// Rounds of patches and rays.
pub(crate) struct Refinement {
    limits: Limits,
    /// Rounds begun.
    pub count: usize,
    /// Rays of a patch at least.
    pub rays: u32,
    /// Seconds that cutting patches took.
    pub cutting: f64,
    /// Whether this round has all the patches that memory allows, and whether any round had.
    pub full: bool,
    pub tight: bool,
}

impl Refinement {
    /// Cuts the patches of the first round.
    pub fn new(p: &mut Prepared, first: Fineness, limits: Limits) -> Refinement {
        let clock = Instant::now();
        p.cut_to(first.patches);
        let cutting = clock.elapsed().as_secs_f64();
        Refinement { limits, count: 0, rays: first.rays, cutting, full: false, tight: false }
    }

    /// Begins a round: no more patches than memory allows.
    pub fn begin(&mut self, p: &mut Prepared, transport: Transport, sampling: &Sampling, held: Held) {
        let clock = Instant::now();
        self.count += 1;
        self.full = keep_within(p, transport, sampling, held, self.limits.memory);
        self.tight |= self.full;
        self.cutting += clock.elapsed().as_secs_f64();
    }

    /// Patches and rays as they are.
    pub fn now(&self, p: &Prepared) -> Fineness {
        Fineness { patches: p.patches.len(), rays: self.rays }
    }

    /// The patches and rays that errors ask for.
    pub fn finer(&self, p: &Prepared, excess: Excess) -> Fineness {
        let more = patches_for(MARGIN * excess.size).clamp(1.0, 4.0);
        // Noise falls with all rays, as the root at least.
        let denser = (1.2 * excess.noise * excess.noise / more).clamp(1.0, 16.0);
        let (now, most) = (self.now(p), self.limits.most);
        Fineness {
            patches: ((now.patches as f64 * more) as usize).min(most.patches),
            rays: ((f64::from(now.rays) * denser) as u32).min(most.rays),
        }
    }

    /// Cuts all surfaces anew for the next round, into patches of one size.
    pub fn recut(&mut self, p: &mut Prepared, next: Fineness) {
        let clock = Instant::now();
        self.rays = next.rays;
        p.recut(next.patches);
        self.cutting += clock.elapsed().as_secs_f64();
    }

    /// Whether there are as many patches as are ever taken.
    pub fn has_most_patches(&self, p: &Prepared) -> bool {
        p.patches.len() >= self.limits.most.patches
    }

    /// Whether there are as many rays as are ever taken.
    pub fn has_most_rays(&self) -> bool {
        self.rays >= self.limits.most.rays
    }

    /// Whether no round is to follow, whatever its errors.
    pub fn is_last(&self) -> bool {
        self.count == self.limits.rounds
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::assembly::prepare;
    use crate::scene::Scene;

    /// Half the error takes 2^(2/1.5) times the patches, or four times the rays; what one of them does for the other is
    /// counted.
    #[test]
    fn errors_ask_for_patches_and_rays_up_to_their_limits() {
        let mut p = prepare(Scene::open("furnace").expect("a scene"), 100);
        let limits = Limits { most: Fineness { patches: 100_000, rays: 1000 }, rounds: 2, memory: f64::INFINITY };
        let rounds = Refinement::new(&mut p, Fineness { patches: 100, rays: 64 }, limits);
        let n = p.patches.len() as f64;
        let next = |noise: f64, size: f64| rounds.finer(&p, Excess { noise, size });
        assert_eq!(next(1.0, 1.0 / MARGIN).patches, p.patches.len());
        assert_eq!(next(0.5, 2.0 / MARGIN).patches, (n * 2.0_f64.powf(2.0 / 1.5)) as usize);
        assert_eq!(next(0.5, 2.0 / MARGIN).rays, 64);
        assert_eq!(next(2.0, 0.0), Fineness { patches: p.patches.len(), rays: (64.0 * 4.8) as u32 });
        // No more than four times the patches at once, and no more rays than ever.
        assert_eq!(next(100.0, f64::INFINITY), Fineness { patches: 4 * p.patches.len(), rays: 1000 });
    }
}
