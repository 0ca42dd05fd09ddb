//! Pixels: the gather pass, pictures in linear radiance, their files, and the numbers that compare two of them.
//!
//! A [`Picture`] holds radiance; the sRGB curve and the exposure belong to files and screens and are applied on the
//! way out ([`Exposure`]). Not handled: colour management beyond sRGB, alpha, tone mapping other than a clamp.

mod blame;
mod budget;
mod error;
mod estimate;
mod fields;
mod files;
mod found;
mod gather;
mod guide;
mod hemisphere;
mod irradiance;
mod lattice;
mod layer;
mod layered;
mod lessons;
mod linear;
mod metrics;
mod onward;
mod picture;
mod pixel;
mod point;
mod points;
mod residual;
mod spread;
mod srgb;
mod validation;
mod walker;
mod walks;
mod whole;

pub use blame::{Blame, blame};
pub use error::ImageError;
pub use fields::{Fields, invisible};
pub use files::{check_extension, encode_png, read_picture, write_bitmap, write_picture};
pub use gather::{GatherError, GatherSampling, Gathered, Gathering, View, gather};
pub use layered::write_with_error;
pub use linear::{Linear, linear};
pub use metrics::{
    Largest, MeanDifference, MetricError, largest_difference, mean_difference, mean_e_pixel, relative_rms,
};
pub use picture::Picture;
pub use residual::{Direct, READINGS, Reading, Residual, Squared};
pub use srgb::{Bitmap, Exposure, decode_srgb, encode_srgb};
pub use walks::Walks;
pub use whole::{WriteError, abandon_files, check_destination, make_directory, write_whole};
