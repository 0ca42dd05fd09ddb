//! `--save` and `--load`: what was solved as a folder, and F from one instead of from rays.
//!
//! Not handled: what F depends on ([`halflight_export::kept`]).

use std::path::PathBuf;
use std::sync::Arc;

use clap::{Args, ValueEnum};

use crate::console::Console;
use crate::error::CliError;
use crate::options::arguments::Precision;
use halflight::form_factors::Sampling;
use halflight::light::Transport;
use halflight::pictures::Exposure;
use halflight::render::{Discretization, Fineness, LightOnPatches, PatchLight, Solver};
use halflight_export::kept::{Also, Keeping, KeptFolder, KeptRows, NewKept};

/// A folder to make, and one to go on from.
#[derive(Args, Debug)]
#[command(next_help_heading = "Keep")]
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
    /// Opens the folders; none where none is named.
    pub fn open(&self, several: bool, exposure: Exposure) -> Result<Option<Kept>, CliError> {
        if self.save.is_none() && self.load.is_none() {
            return Ok(None);
        }
        let also = |also: &AlsoChoice| match also {
            AlsoChoice::Ply => Also::Ply,
            AlsoChoice::Mtx => Also::Mtx,
        };
        let rows = Arc::new(KeptRows::new(self.save.as_deref()));
        let begin = |folder: &PathBuf| {
            let also = self.save_also.iter().map(also).collect();
            NewKept::begin(Keeping { folder: folder.clone(), also, several, exposure }, &rows)
        };
        let new = self.save.as_ref().map(begin).transpose()?;
        let loaded = self.load.as_deref().map(KeptFolder::open).transpose()?;
        Ok(Some(Kept { rows, loaded, new }))
    }
}

/// The folders of a run.
pub struct Kept {
    rows: Arc<KeptRows>,
    loaded: Option<KeptFolder>,
    new: Option<NewKept>,
}

impl Kept {
    /// The patches and rays of the folder that is read; none where there is none, or it was made to a tolerance.
    pub fn fineness(&self) -> Option<Fineness> {
        self.loaded.as_ref()?.fineness()
    }

    /// Checks that F that is read serves a picture of this precision.
    pub fn check(&self, precision: Precision) -> Result<(), CliError> {
        match (&self.loaded, precision) {
            (Some(_), Precision::Within(_)) => Err(CliError::Usage {
                message: "--load takes F of given patches and rays, and a search for a tolerance casts its own".into(),
                help: "name a folder that was made with --patches and --rays, and leave --tolerance out".into(),
            }),
            _ => Ok(()),
        }
    }

    /// A solver that takes rows from here, and returns the light that is to be kept.
    pub fn with(kept: Option<&Kept>, solver: Solver) -> Solver {
        let Some(Kept { rows, new, .. }) = kept else { return solver };
        let solver = solver.rows(Arc::clone(rows) as _);
        if new.is_some() { solver.light_on_patches(LightOnPatches::Returned) } else { solver }
    }

    /// Reads F of the modes, which must fit what is requested.
    pub fn read(
        &self,
        p: &Discretization,
        modes: &[Transport],
        sampling: &Sampling,
        console: &Console,
    ) -> Result<(), CliError> {
        let Some(folder) = &self.loaded else { return Ok(()) };
        folder.read(p, modes, sampling, &self.rows)?;
        console.say(format!("F from {}", folder.path().display()));
        Ok(())
    }

    /// Writes the folder of a mode's light.
    pub fn save(&self, light: &PatchLight) -> Result<(), CliError> {
        Ok(self.new.iter().try_for_each(|new| new.save(light))?)
    }

    /// Writes the folder of a mode's F.
    pub fn save_factors(&self, p: &Discretization, mode: Transport, sampling: Sampling) -> Result<(), CliError> {
        Ok(self.new.iter().try_for_each(|new| new.save_factors(p, mode, sampling))?)
    }

    /// Puts the folder in its place, and says where it is.
    pub fn finish(self, console: &Console) -> Result<Option<PathBuf>, CliError> {
        let Some(new) = self.new else { return Ok(None) };
        let made = new.finish()?;
        if let Some(folder) = &made {
            console.say(format!("kept in {}", folder.display()));
        }
        Ok(made)
    }
}
