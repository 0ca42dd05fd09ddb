//! A solved scene as a folder: F, the light on its patches and all terms, for other programs and for later runs.
//!
//! ```text
//! F.npz        F of one choice of tau, CSR: all rows and columns, whatever reflects and sends now; `row_sums`
//! F.1.npz      the same from other rays, where a tolerance was aimed at: the light is the mean of both
//! L.npy        light, patches × halves × channels        terms.npy   bounces × patches × halves × channels
//! patches.vtu  the patches with their light              meta.json   what all was made of; sums of all files
//! division.npz what light divided the patches into, where a tolerance was aimed at and it did
//! ```
//!
//! F depends on the geometry, the patches, tau of the materials, which of their sides there are, their masks, the rays
//! and their seed. All that is in `meta.json` as sums and numbers, and a folder of which any differs is refused
//! ([`KeptError::Differs`]). What surfaces reflect and emit, alpha, lights and the camera may be others:
//! [`Keeper::check`] names them. Rows and columns that a mode does not need are left out after reading, so what is
//! computed has the bits that it has without a folder.
//!
//! Several modes are one folder each in one folder, by their names. While rays are cast for a folder its finished rows
//! lie beside it ([`pieces`]), and a run that was interrupted goes on from there.
//!
//! Worth: F of 16,000 patches with 1,024 rays is read in a hundredth of the time that its rays take.
//!
//! Not handled: light as emitted, which is found anew; several folders at once.

mod folder;
mod identity;
mod keeper;
mod meta;
mod pieces;
mod sums;

use std::path::PathBuf;

pub use folder::Saved;
pub use keeper::{Keeper, Keeping};

use crate::pictures::WriteError;

/// Files that a folder may have beyond those that every one has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Also {
    /// `patches.ply`: the patches with the colours of their light.
    Ply,
    /// `F.mtx`: F as Matrix Market.
    Mtx,
}

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
    #[error("{} is there, and --save did not write it", path.display())]
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
