//! Why a kept folder cannot be used or written.
//!
//! Not handled: faults of the scene, which is read before ([`halflight::scene::SceneError`]).

use std::path::PathBuf;

use halflight::pictures::WriteError;

/// A folder cannot be used, or not be written.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum KeptError {
    /// A file is missing or cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    #[diagnostic(code(halflight::kept::read), help("name a folder that --save wrote, with all its files"))]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// A file is damaged, or of something else.
    #[error("{} {what}", path.display())]
    #[diagnostic(
        code(halflight::kept::broken),
        help("the file is damaged, cut short or was changed: run with --save again, and do not edit the folder")
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
