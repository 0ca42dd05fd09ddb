//! `--save` and `--load`: what was solved as a folder, and F from one instead of from rays.
//!
//! Not handled: what F depends on ([`halflight_export::kept`]).

use std::path::PathBuf;
use std::sync::Arc;

use clap::{Args, ValueEnum};

use crate::console::Console;
use crate::error::CliError;
use crate::options::arguments::{Effort, Precision};
use halflight::form_factors::Sampling;
use halflight::light::Transport;
use halflight::pictures::Exposure;
use halflight::render::{Assembled, Discretization, Fineness, PatchLight, Solver, Watch};
use halflight::solve::Solution;
use halflight_export::kept::{Also, Keeper, Keeping};

/// A folder to make, and one to go on from.
#[derive(Args, Debug)]
pub struct Keep {
    /// Keep F, the patches, L and all its terms in a folder, for --load and for other programs
    #[arg(long, value_name = "DIR")]
    pub save: Option<PathBuf>,
    /// Take F from a folder that --save made, with its --patches and --rays; reflectances, lights, alpha and the camera
    /// may be others
    #[arg(long, value_name = "DIR")]
    pub load: Option<PathBuf>,
    /// Files that the folder is to have too: ply (patches with colours), mtx (F as Matrix Market)
    #[arg(long, value_name = "KINDS", value_enum, value_delimiter = ',', requires = "save")]
    pub save_also: Vec<AlsoChoice>,
}

/// Files beyond those that every folder has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum AlsoChoice {
    /// Patches with the colours of their light
    Ply,
    /// F as Matrix Market
    Mtx,
}

impl Keep {
    /// Opens the folders; none where none is named. Where one is read and no effort is given, it is that of the folder.
    pub fn open(&self, effort: &Effort, several: bool, exposure: Exposure) -> Result<Option<Kept>, CliError> {
        let Some(kept) = self.folders(several, exposure)? else { return Ok(None) };
        if let (Some(fineness), None) = (kept.0.fineness(), effort.tolerance) {
            effort.kept.get_or_init(|| fineness);
        }
        Ok(Some(kept))
    }

    /// Opens the folders where no effort is known.
    pub fn folders(&self, several: bool, exposure: Exposure) -> Result<Option<Kept>, CliError> {
        if self.save.is_none() && self.load.is_none() {
            return Ok(None);
        }
        let also = |also: &AlsoChoice| match also {
            AlsoChoice::Ply => Also::Ply,
            AlsoChoice::Mtx => Also::Mtx,
        };
        let also = self.save_also.iter().map(also).collect();
        let keeping = Keeping { save: self.save.clone(), load: self.load.clone(), also, several, exposure };
        Ok(Some(Kept(Arc::new(Keeper::open(keeping)?))))
    }
}

/// The folders of a run.
pub struct Kept(pub Arc<Keeper>);

impl Kept {
    /// A solver that takes rows from here.
    pub fn with(kept: Option<&Kept>, solver: Solver) -> Solver {
        match kept {
            Some(kept) => solver.rows(Arc::clone(&kept.0) as _),
            None => solver,
        }
    }

    /// Checks that the folder read fits what is requested, and says what has changed.
    pub fn check(
        &self,
        p: &Discretization,
        modes: &[Transport],
        sampling: &Sampling,
        console: &Console,
    ) -> Result<(), CliError> {
        let changed = self.0.check(p, modes, sampling)?;
        self.say(&changed, console);
        Ok(())
    }

    /// The same for the crossings of a map.
    pub fn check_layers(
        &self,
        p: &Discretization,
        (mode, sampling): (Transport, &Sampling),
        console: &Console,
    ) -> Result<(), CliError> {
        let changed = self.0.check_layers(p, mode, sampling)?;
        self.say(&changed, console);
        Ok(())
    }

    /// What a search for a tolerance begins with; says what has changed since that was found.
    pub fn start(
        &self,
        solver: &Solver,
        (mode, seed): (Transport, u32),
        console: &Console,
    ) -> Result<Option<Discretization>, CliError> {
        let Some(requested) = self.0.requested() else { return Ok(None) };
        let Some((start, changed)) = self.0.start(&solver.cut(requested), mode, seed)? else { return Ok(None) };
        self.say(&changed, console);
        Ok(Some(start))
    }

    fn say(&self, changed: &[String], console: &Console) {
        let Some(folder) = self.0.loaded() else { return };
        let since = if changed.is_empty() { String::new() } else { format!("; changed since: {}", changed.join(", ")) };
        console.say(format!("F from {}{since}", folder.display()));
    }

    /// Checks it for patches and rays that are given.
    pub fn check_fineness(
        &self,
        solver: &Solver,
        modes: &[Transport],
        (fineness, seed): (Fineness, u32),
        console: &Console,
    ) -> Result<(), CliError> {
        self.check(&solver.cut(fineness.patches), modes, &fineness.sampling(seed), console)
    }

    /// Writes the folder of a mode's light.
    pub fn save(&self, mode: &Assembled, solution: &Solution) -> Result<(), CliError> {
        Ok(self.0.save(&mode.light(solution))?)
    }

    /// Puts the folder in its place, and says where it is.
    pub fn finish(&self, console: &Console) -> Result<Option<PathBuf>, CliError> {
        let made = self.0.finish()?;
        if let Some(folder) = &made {
            console.say(format!("kept in {}", folder.display()));
        }
        Ok(made)
    }
}

/// Shows the work on the console, and keeps the light of every mode.
pub struct Watched<'a> {
    pub console: &'a Console,
    pub kept: Option<&'a Kept>,
}

impl Watch for Watched<'_> {
    fn begin(&self, step: &str, length: u64) {
        self.console.begin(step, length);
    }

    fn tick(&self, done: u64) {
        self.console.tick(done);
    }

    fn solved(&self, light: &PatchLight) {
        let Some(kept) = self.kept else { return };
        if let Err(error) = kept.0.save(light) {
            kept.0.fail(error);
        }
    }

    fn wants_light(&self) -> bool {
        self.kept.is_some_and(|kept| kept.0.saves())
    }
}

impl Effort {
    /// The folder's patches and rays, where they are not given.
    pub(crate) fn kept_precision(&self, samples: u32) -> Option<Precision> {
        let fineness = self.kept.get()?;
        let patches = self.patches.map_or(fineness.patches, |n| n as usize);
        Some(Precision::Fixed(Fineness { patches, rays: self.rays.unwrap_or(fineness.rays) }, samples))
    }
}
