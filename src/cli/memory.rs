//! Patches for which K fits in memory, or the number that would.

use clap::Args;

use crate::cli::error::CliError;
use crate::cli::values::gibibytes;
use crate::light::Transport;
use crate::pictures::Size;
use crate::render::{Fineness, Prepared, check_memory, check_pictures, prepare, usable_memory};
use crate::scene::Scene;

/// Bytes a pixel, measured as what a run grows by with its pictures (`within`: made to a tolerance).
pub mod pixel {
    /// `render`.
    pub const RENDER: f64 = 260.0;
    /// `render` and `bounces` to a tolerance.
    pub const WITHIN: f64 = 1800.0;
    /// `trace`.
    pub const TRACE: f64 = 310.0;
    /// `bounces`, and for each term.
    pub const BOUNCES: (f64, f64) = (2000.0, 100.0);
    /// `compare`: five methods' orders, repeated.
    pub const COMPARE: f64 = 9000.0;
    /// `chart`.
    pub const CHART: f64 = 2500.0;
}

/// A scene made ready, and the bytes that K of it may take.
pub struct Within {
    pub prepared: Prepared,
    pub memory: f64,
}

/// How much memory may be used.
#[derive(Args, Debug)]
pub struct MemoryLimit {
    /// Memory that K or the pictures may take; what needs more is refused [default: four fifths of what is free]
    #[arg(long, value_name = "GIB", value_parser = gibibytes)]
    pub memory: Option<f64>,
}

impl MemoryLimit {
    /// As asked, else what there is.
    pub fn bytes(&self) -> f64 {
        let asked = self.memory.map(|gib| gib * f64::from(1 << 30));
        asked.unwrap_or_else(usable_memory)
    }

    /// Checks that pictures of a size fit, of which a command keeps `each` bytes a pixel.
    pub fn check_pictures(&self, size: Size, each: f64) -> Result<(), CliError> {
        Ok(check_pictures(size, each, self.bytes())?)
    }

    /// Makes a scene ready for as many patches as a tolerance needs and memory holds; the first few must fit.
    pub fn prepare_within(&self, scene: Scene, modes: &[Transport], tolerance: f64) -> Result<Within, CliError> {
        let first = Fineness::first(tolerance);
        let prepared = prepare(scene, first.patches);
        let memory = self.bytes();
        for mode in modes {
            check_memory(&prepared, &[*mode], &first.sampling(0), memory)?;
        }
        Ok(Within { prepared, memory })
    }
}
