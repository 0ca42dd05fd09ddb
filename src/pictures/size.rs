//! How many pixels a picture has each way.
//!
//! Not handled: limits of a size; what reads one checks it.

/// Width and height in pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Size {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
}

impl From<(usize, usize)> for Size {
    /// From the width and the height, in this order.
    fn from((width, height): (usize, usize)) -> Size {
        Size { width, height }
    }
}
