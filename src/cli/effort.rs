//! How accurately a scene is solved: to a tolerance, or with so many patches, rays and samples.

use clap::Args;

use crate::cli::error::CliError;
use crate::cli::memory::{MemoryLimit, Within};
use crate::cli::values::picture_error;
use crate::light::Transport;
use crate::render::{Fineness, Prepared, check_memory, prepare};
use crate::scene::Scene;

/// Hemisphere rays for each pixel where other effort is given, but not this.
const SAMPLES: u32 = 128;

/// The wanted accuracy, or the effort itself.
#[derive(Args, Debug)]
pub struct Effort {
    /// Error to aim at, a share of the picture's RMS radiance; for bounces, of each term's power [default: 0.01]
    #[arg(long, value_name = "T", value_parser = picture_error, conflicts_with_all = ["patches", "rays", "samples"])]
    pub tolerance: Option<f64>,
    /// Cut the scene into about so many patches, whatever the error [default with --rays or --samples: 4000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub patches: Option<u32>,
    /// Cast so many hemisphere rays from each patch [default with --patches or --samples: 256]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_048_576))]
    pub rays: Option<u32>,
    /// Cast so many hemisphere rays for each pixel, rounded up to a power of two [default with --patches or --rays:
    /// 128]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_048_576))]
    pub samples: Option<u32>,
    /// Within which memory.
    #[command(flatten)]
    pub limit: MemoryLimit,
}

/// What [`Effort`] asks for.
#[derive(Clone, Copy, Debug)]
pub enum Precision {
    /// An error.
    Within(f64),
    /// Patches, rays, and hemisphere rays for each pixel.
    Fixed(Fineness, u32),
}

impl Effort {
    /// The tolerance, unless some effort is given.
    pub fn precision(&self) -> Precision {
        if let (None, None, None) = (self.patches, self.rays, self.samples) {
            return Precision::Within(self.tolerance.unwrap_or(0.01));
        }
        let default = Fineness::default();
        let patches = self.patches.map_or(default.patches, |n| n as usize);
        let fineness = Fineness { patches, rays: self.rays.unwrap_or(default.rays) };
        Precision::Fixed(fineness, self.samples.unwrap_or(SAMPLES))
    }

    /// Cuts a scene into the patches asked for, and checks that K of all modes fits.
    pub fn prepare(
        &self,
        scene: Scene,
        modes: &[Transport],
        fineness: Fineness,
        seed: u32,
    ) -> Result<Prepared, CliError> {
        let prepared = prepare(scene, fineness.patches);
        check_memory(&prepared, modes, &fineness.sampling(seed), self.limit.bytes())?;
        Ok(prepared)
    }

    /// Makes a scene ready for as many patches as a tolerance needs and memory holds; the first few must fit.
    pub fn prepare_within(&self, scene: Scene, modes: &[Transport], tolerance: f64) -> Result<Within, CliError> {
        self.limit.prepare_within(scene, modes, tolerance)
    }
}
