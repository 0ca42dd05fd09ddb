//! What a run of shooting is asked, and what it tells: how far it has come, and where the invisible power went,
//!
//! ```text
//! emitted + created = absorbed + held + escaped + black + undelivered + unshot.
//! ```
//!
//! At tau = 0 and alpha = 1 this reads emitted = absorbed + escaped + unshot. Each entry is summed in f64 where it
//! arises, so that [`Balance::residual`] is a check and not a definition; only what columns without a known fate (an
//! assembled F, a closed form) did not deliver is taken as a difference, shot less landed.

use glam::DVec3;

use crate::operator::Bounds;
use crate::solve::neumann::{Diverges, Verdict};
use crate::solve::shooting::ledger::{Ledger, Shot};
use crate::solve::shooting::shooters::{Foreknowledge, Surfaces};

/// When to stop, and in what steps.
#[derive(Clone, Copy, Debug)]
pub struct ShootingSettings {
    /// Wanted unshot power as a share of the power emitted.
    pub unshot: f64,
    /// Patches that shoot at a time; 0 takes a 64th of all.
    pub batch: usize,
    /// Generations kept apart, at least 2; the last also takes all later ones.
    pub generations: usize,
    /// Shots at most, per patch on average; a series not decided by then is refused as undecided.
    pub shots_per_patch: u64,
}

impl Default for ShootingSettings {
    fn default() -> Self {
        ShootingSettings { unshot: 1e-3, batch: 0, generations: 16, shots_per_patch: 1000 }
    }
}

/// How far shooting has come.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Progress {
    /// Patches that shot, each shot counted.
    pub shots: u64,
    /// Batches.
    pub batches: u64,
    /// Rays cast.
    pub rays: u64,
    /// Unshot power, W over all channels.
    pub unshot: f64,
    /// Unshot power as a share of the power emitted.
    pub share: f64,
}

/// The accounts, watts summed over the three channels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Balance {
    /// `pi sum A E_invisible`, and what lights without area bring to the patches.
    pub emitted: f64,
    /// The share 1 - rho of what landed.
    pub absorbed: f64,
    /// The share (1 - alpha) rho of what landed: reflected to the camera only.
    pub held: f64,
    /// Left the scene, as rays tell.
    pub escaped: f64,
    /// Kept by black backs, as rays tell.
    pub black: f64,
    /// Made by reflecting surfaces that transmit, as rays tell.
    pub created: f64,
    /// Shot less landed where no ray tells why: light that left or met black surfaces, less what transmission made,
    /// and the noise by which F is not reciprocal. Negative where more landed than was shot.
    pub undelivered: f64,
    /// Received and not yet shot.
    pub unshot: f64,
}

impl Balance {
    /// Power that left the scene or met black, all forms together; for an assembled F at least.
    pub fn left(&self) -> f64 {
        self.escaped + self.black + self.undelivered.max(0.0)
    }

    /// Power made by transmission, all forms together; for an assembled F net of what left, and with its noise.
    pub fn made(&self) -> f64 {
        self.created + (-self.undelivered).max(0.0)
    }

    /// What the accounts miss, as a share of the power emitted; 0 where nothing is emitted.
    pub fn residual(&self) -> f64 {
        let spent = self.absorbed + self.held + self.left() + self.unshot;
        if self.emitted > 0.0 { (self.emitted + self.made() - spent) / self.emitted } else { 0.0 }
    }
}

/// Watches a run whose convergence is not known beforehand.
pub(crate) struct Growth {
    watched: bool,
    /// Invisible light each patch has shot after its first reflection.
    shot: Vec<DVec3>,
    /// Shots after which to look next.
    next: u64,
    /// Shots after which to give up.
    most: u64,
}

impl Growth {
    /// Nothing shot yet.
    pub fn new(patches: usize, foreknowledge: Foreknowledge, shots_per_patch: u64) -> Growth {
        Growth {
            watched: foreknowledge == Foreknowledge::Unknown,
            shot: vec![DVec3::ZERO; patches],
            next: patches as u64,
            most: shots_per_patch.saturating_mul(patches as u64),
        }
    }

    /// Notes what patch i shoots; light as emitted does not count.
    pub fn add(&mut self, i: usize, shot: &Shot) {
        let reflected = shot.iter().filter(|(n, _)| *n >= 1).map(|(_, l)| *l);
        self.shot[i] += reflected.sum::<DVec3>();
    }

    /// Looks four times a sweep over all patches whether the light shot so far shows growth.
    pub fn look(&mut self, surfaces: &Surfaces, ledger: &Ledger, shots: u64) -> Result<(), Diverges> {
        if !self.watched || shots < self.next {
            return Ok(());
        }
        self.next = shots + (self.shot.len() as u64).div_ceil(4);
        let radius = bounds(surfaces, ledger, &self.shot);
        let verdict = if radius.lower >= 1.0 {
            Verdict::Diverges
        } else if shots >= self.most {
            Verdict::Undecided
        } else {
            return Ok(());
        };
        Err(Diverges::new(surfaces.rho, surfaces.alpha, verdict, radius))
    }
}

/// Bounds on the spectral radius, worst channel, from the light `shot` by every patch after its first reflection.
fn bounds(surfaces: &Surfaces, ledger: &Ledger, shot: &[DVec3]) -> Bounds {
    let mut products = DVec3::ZERO;
    let mut squares = DVec3::ZERO;
    let mut upper = 0.0f64;
    for (i, &s) in shot.iter().enumerate() {
        let passed = (surfaces.alpha[i] * surfaces.rho[i]).as_dvec3();
        let incident: DVec3 = ledger.all_incident(i).iter().skip(1).sum();
        for c in (0..3).filter(|&c| passed[c] > 0.0) {
            let r = passed[c] * incident[c];
            products[c] += surfaces.areas[i] * s[c] * r / passed[c];
            squares[c] += surfaces.areas[i] * s[c] * s[c] / passed[c];
            if r > 0.0 {
                upper = upper.max(r / s[c]);
            }
        }
    }
    let quotient = |c: usize| if squares[c] > 0.0 { products[c] / squares[c] } else { 0.0 };
    let lower = (0..3).map(quotient).fold(0.0, f64::max);
    Bounds { lower, upper: upper.max(lower) }
}
