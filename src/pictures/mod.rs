//! Pictures in linear radiance, their files, the numbers that compare two of them, and files of tables.
//!
//! A [`Picture`] holds radiance; the sRGB curve and the exposure belong to files and screens and are applied on the
//! way out ([`Exposure`]). Files are written whole or not at all ([`write_whole`]). Not handled: colour management
//! beyond sRGB, alpha, tone mapping other than a clamp.

mod atomic;
mod files;
mod layers;
mod metrics;
mod names;
mod picture;
mod srgb;
mod table;
mod texels;

pub use atomic::{
    NewFolder, WriteError, abandon_files, check_destination, make_directory, write_whole, write_whole_by,
};
pub use files::{
    ImageError, check_extension, encode_png, encode_texels, is_exr, read_picture, write_bitmap, write_picture,
};
pub use layers::{NamedPicture, Shows, read_layers, write_layered};
pub use metrics::{
    Largest, MeanDifference, MetricError, largest_difference, mean_difference, mean_e_pixel, relative_rms,
};
pub use names::{spaced, unlike};
pub use picture::{Picture, Size};
pub use srgb::{Bitmap, Exposure, LUMINANCE, decode_srgb, encode_srgb};
pub use table::{Table, known};
pub use texels::{Texels, TexelsError};
