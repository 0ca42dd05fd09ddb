//! What is asked of a picture: how near, how large, and from which random numbers.

/// What is asked.
#[derive(Clone, Copy, Debug)]
pub struct Wanted {
    /// Relative RMS error of the picture.
    pub tolerance: f64,
    /// Pixels across and down.
    pub size: (usize, usize),
    /// Chooses the scrambling of all points.
    pub seed: u32,
}
