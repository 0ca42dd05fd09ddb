//! Pictures in linear radiance, their files, the numbers that compare two of them, and files of tables.
//!
//! A [`Picture`] holds radiance; the sRGB curve and the exposure belong to files and screens and are applied on the
//! way out ([`Exposure`]). Files are written whole or not at all ([`write_whole`]). Not handled: colour management
//! beyond sRGB, alpha, tone mapping other than a clamp.

pub(crate) mod atomic;
pub(crate) mod error;
pub(crate) mod files;
pub(crate) mod layered;
pub(crate) mod metrics;
pub(crate) mod picture;
pub(crate) mod size;
pub(crate) mod srgb;
pub(crate) mod table;
pub(crate) mod texels;

pub use atomic::{WriteError, abandon_files, check_destination, make_directory, write_whole};
pub use error::ImageError;
pub use files::{check_extension, encode_png, read_picture, write_bitmap, write_picture};
pub use layered::write_with_error;
pub use metrics::{
    Largest, MeanDifference, MetricError, largest_difference, mean_difference, mean_e_pixel, relative_rms,
};
pub use picture::Picture;
pub use size::Size;
pub use srgb::{Bitmap, Exposure, decode_srgb, encode_srgb};
pub use table::{Table, known};
pub use texels::{Texels, TexelsError};
