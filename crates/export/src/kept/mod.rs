//! A solved scene as a folder: F, the light on its patches and all terms, for other programs and for later runs.
//!
//! ```text
//! F.npz        F of one choice of tau, CSR: all rows and columns, whatever reflects and sends now; `row_sums`
//! F.1.npz      the same from other rays, where a tolerance was aimed at: the light is the mean of both
//! L.npy        light, patches × halves × channels        terms.npy   bounces × patches × halves × channels
//! patches.vtu  the patches with their light              meta.json   mode, patches and rays
//! scene.bin    the scene ([`scene_to_bytes`](crate::scene_to_bytes))
//! ```
//!
//! F depends on the geometry, the patches, tau of the materials, which of their sides there are, their masks, the rays
//! and their seed. A folder of which any differs is refused ([`KeptError::Differs`]). What surfaces reflect and emit,
//! alpha, lights and the camera may be others: rows and columns that a mode does not need are left out after reading,
//! so what is computed has the bits that it has without a folder.
//!
//! Several modes are one folder each in one folder, by their names. While rays are cast for a folder its finished rows
//! lie beside it ([`KeptRows`]), and a run that was interrupted goes on from there.
//!
//! Worth: F of 16,000 patches with 1,024 rays is read in a hundredth of the time that its rays take.
//!
//! Not handled: light as emitted, which is found anew; F of a tolerance, which is written and not read; several folders
//! at once.

mod error;
mod factors_file;
mod folder;
mod identity;
mod meta;
mod new_folder;
mod pieces;
mod rows;

pub use error::KeptError;
pub use folder::{KeptFolder, KeptSeries};
pub use new_folder::{Also, Keeping, NewKept};
pub use rows::KeptRows;
