//! What a run of shooting is asked, and what it tells: how far it has come, and where the invisible power went,
//!
//! ```text
//! emitted + created = absorbed + held + escaped + black + undelivered + unshot.
//! ```
//!
//! At tau = 0 and alpha = 1 this reads emitted = absorbed + escaped + unshot. Each entry is summed in f64 where it
//! arises, so that [`Balance::residual`] is a check and not a definition; only what columns without a known fate (an
//! assembled F, a closed form) did not deliver is taken as a difference, shot less landed.

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
