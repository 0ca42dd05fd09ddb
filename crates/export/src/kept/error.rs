//! Why a kept folder cannot be used or written.
//!
//! Not handled: faults of the scene, which is read before ([`halflight::scene::SceneError`]).

use std::fmt::Display;
use std::path::{Path, PathBuf};

use halflight::pictures::WriteError;

/// A folder cannot be used, or not be written.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum KeptError {
    /// A file is missing, damaged, or of something else.
    #[error("{} {what}", path.display())]
    #[diagnostic(
        code(halflight::kept::broken),
        help("name a folder that --save wrote, with all its files as they were; run with --save to make it again")
    )]
    Broken {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        what: String,
    },
    /// What is kept is not what is requested.
    #[error("{} does not fit: {what}", path.display())]
    #[diagnostic(
        code(halflight::kept::differs),
        help(
            "F depends on the geometry, the patches, tau, the rays and --seed. Give the arguments that the folder was \
             made with, or make another: run without --load, with --save"
        )
    )]
    Differs {
        /// The folder.
        path: PathBuf,
        /// What differs, kept and now.
        what: String,
    },
    /// There is something that would be lost.
    #[error("{} is there, and holds what --save did not write", path.display())]
    #[diagnostic(
        code(halflight::kept::occupied),
        help("name a folder that is not there yet, or one that --save wrote")
    )]
    Occupied {
        /// What is there.
        path: PathBuf,
    },
    /// A file cannot be written.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Write(#[from] WriteError),
}

impl KeptError {
    /// What is wrong with a file.
    pub(super) fn broken(path: &Path, what: impl Display) -> KeptError {
        KeptError::Broken { path: path.into(), what: what.to_string() }
    }
}

/// The bytes of a file.
pub(super) fn bytes_of(path: &Path) -> Result<Vec<u8>, KeptError> {
    std::fs::read(path).map_err(|error| KeptError::broken(path, format!("cannot be read: {error}")))
}
