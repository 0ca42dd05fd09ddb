//! How a gather ray reads the light of what it meets: at once, or after one more ray.
//!
//! Not handled: which reading a picture needs; the weighted residual tells.

/// How a gather ray reads the light of the surface it meets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Reading {
    /// The light of the patch that is met.
    #[default]
    AtOnce,
    /// Direct light at the point that is met, and what one more ray reads.
    AfterOneMore,
}

impl Reading {
    /// The readings to choose from, cheapest first.
    pub const ALL: [Reading; READINGS] = [Reading::AtOnce, Reading::AfterOneMore];

    /// More rays that are followed before light is read.
    pub fn bounces(self) -> u32 {
        self as u32
    }

    /// Its number in [`Reading::ALL`].
    pub fn number(self) -> usize {
        self as usize
    }
}

/// Readings to choose from.
pub const READINGS: usize = 2;
