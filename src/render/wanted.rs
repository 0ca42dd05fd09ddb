//! What is asked of a picture: how near, how large, by when, and from which random numbers.

use std::time::Instant;

use crate::gather::sampling::is_over;
use crate::pictures::Size;

/// What is asked.
#[derive(Clone, Copy, Debug)]
pub struct Wanted {
    /// Relative RMS error of the picture.
    pub tolerance: f64,
    /// Pixels across and down.
    pub size: Size,
    /// When the picture is to be there, whatever is reached by then; no end where there is none.
    pub deadline: Option<Instant>,
    /// Bytes that K may take; patches that are cut anew stay within.
    pub memory: f64,
    /// Chooses the scrambling of all points.
    pub seed: u32,
}

impl Wanted {
    /// Whether the time is over.
    pub(crate) fn is_late(&self) -> bool {
        is_over(self.deadline)
    }
}
