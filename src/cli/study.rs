//! What `compare` and `chart` share: modes one after the other, errors, and the names of the files of each mode.
//!
//! Not handled: what is studied.

use std::path::PathBuf;

use crate::cli::console::Console;
use crate::cli::error::CliError;
use crate::cli::options::Common;
use crate::light::Transport;
use crate::scene::Scene;
use crate::study::compare::StudyError;

impl From<StudyError> for CliError {
    fn from(error: StudyError) -> CliError {
        match error {
            StudyError::Diverges(e) => e.into(),
            StudyError::Memory(e) => e.into(),
            StudyError::Image(e) => e.into(),
            StudyError::Metric(e) => e.into(),
        }
    }
}

/// Studies every mode; of several, those that diverge are named and left out.
pub fn each_mode<T>(
    transports: &[Transport],
    what: &str,
    console: &Console,
    mut study: impl FnMut(Transport) -> Result<T, CliError>,
) -> Result<Vec<T>, CliError> {
    let mut found = Vec::new();
    for &transport in transports {
        match study(transport) {
            Err(CliError::Diverges(e)) if transports.len() > 1 => {
                console.warn(format!("{}: nothing to {what}, {e}", transport.label()));
            }
            other => found.push(other?),
        }
    }
    Ok(found)
}

/// The files of one mode's study.
pub struct Files {
    start: PathBuf,
    /// Those named so far.
    pub named: Vec<PathBuf>,
}

impl Files {
    /// No files yet; they will be called after the scene, what is done with it, and the mode.
    pub fn new(common: &Common, scene: &Scene, what: &str, transport: Transport) -> Files {
        let mode = transport.label().replace(' ', "-");
        Files { start: common.out.join(format!("{}-{what}-{mode}", scene.name)), named: Vec::new() }
    }

    /// The place of one more file, by how its name ends.
    pub fn add(&mut self, end: &str) -> PathBuf {
        let mut path = self.start.clone().into_os_string();
        path.push(end);
        self.named.push(path.into());
        self.named[self.named.len() - 1].clone()
    }

    /// Tells a person where they are, and gives them back.
    pub fn told(self, console: &Console) -> Vec<PathBuf> {
        for file in &self.named {
            console.say(file.display().to_string());
        }
        self.named
    }
}
