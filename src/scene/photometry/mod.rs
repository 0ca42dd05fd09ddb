//! Luminaires as they were measured: their intensity by direction, and the files that give it.
//!
//! Not handled: the size of what shines, which counts as a point.

mod intensity;
mod lm63;

pub use intensity::{DrawnDirection, EFFICACY, Photometry};
pub(crate) use lm63::{Mounting, read as read_lm63};
