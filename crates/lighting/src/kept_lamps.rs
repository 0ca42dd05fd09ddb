//! The light of lamps as an earlier run left it: the report of `render --per luminaire --json`, with the EXR file that
//! it names, or an EXR file with layers of lamps alone.
//!
//! Not handled: reports of several modes.

use std::path::{Path, PathBuf};
use std::{fs, io};

use halflight::pictures::{ImageError, is_exr, read_layers};
use halflight::render::{EmitterPower, LayerError};
use miette::Diagnostic;
use serde::Deserialize;

use crate::relight::{LampLight, SolvedPoint};

/// Why a file gives no light of lamps.
#[derive(Debug, thiserror::Error, Diagnostic)]
pub enum LampError {
    /// It cannot be read.
    #[error("{} cannot be read: {source}", path.display())]
    #[diagnostic(help("check the file's name and permissions"))]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// It is no report.
    #[error("{} is no report of `render --json`: {source}", path.display())]
    #[diagnostic(help("name the report or an EXR file"))]
    Report {
        /// The file.
        path: PathBuf,
        /// Where in it.
        source: serde_json::Error,
    },
    /// It has several modes, or none.
    #[error("{} is a report of {count} modes", path.display())]
    #[diagnostic(help("render one of them: --mode MODE"))]
    Modes {
        /// The file.
        path: PathBuf,
        /// How many.
        count: usize,
    },
    /// Nothing in it is of single lamps.
    #[error("{} has no light of single lamps", path.display())]
    #[diagnostic(help(
        "render the scene again: halflight render SCENE --mode MODE --per luminaire --json > report.json"
    ))]
    Together {
        /// The file.
        path: PathBuf,
    },
    /// Its picture cannot be read.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Picture(#[from] ImageError),
}

/// A report.
#[derive(Deserialize)]
struct Earlier {
    modes: Vec<EarlierMode>,
}

/// The parts of a mode's report that hold the light of lamps.
#[derive(Deserialize)]
struct EarlierMode {
    #[serde(default)]
    luminaires: Vec<EmitterPower>,
    #[serde(default)]
    points: Vec<SolvedPoint>,
    #[serde(default)]
    files: Vec<PathBuf>,
    #[serde(default)]
    layers: Vec<String>,
    #[serde(default)]
    layer_errors: Vec<LayerError>,
}

impl LampLight {
    /// Reads a report, and the layers of the EXR file that it names; or those of an EXR file.
    ///
    /// # Errors
    /// A file that cannot be read, is something else, or keeps no lamp apart.
    pub fn open(path: &Path) -> Result<LampLight, LampError> {
        let lamps =
            if is_exr(path) { LampLight::new(Vec::new(), Vec::new(), read_layers(path)?) } else { of_report(path)? };
        if lamps.names().is_empty() { Err(LampError::Together { path: path.to_owned() }) } else { Ok(lamps) }
    }
}

fn of_report(path: &Path) -> Result<LampLight, LampError> {
    let own = || path.to_owned();
    let text = fs::read_to_string(path).map_err(|source| LampError::Read { path: own(), source })?;
    let read = serde_json::from_str(&text).map_err(|source| LampError::Report { path: own(), source });
    let Earlier { modes } = read?;
    let one = <[EarlierMode; 1]>::try_from(modes);
    let [EarlierMode { luminaires, points, files, layers: names, layer_errors }] =
        one.map_err(|modes| LampError::Modes { path: own(), count: modes.len() })?;
    let layers = files.iter().find(|file| is_exr(file)).map(|named| {
        let beside = path.parent().map(|folder| folder.join(named));
        read_layers(beside.filter(|path| path.is_file()).unwrap_or_else(|| named.clone()))
    });
    let lamps = LampLight::new(luminaires, points, layers.transpose()?.unwrap_or_default());
    Ok(lamps.with_errors(names.iter().map(String::as_str).zip(layer_errors)))
}
