//! How many pixels a picture has each way.
//!
//! Not handled: limits of a size; what reads one checks it.

/// Width and height in pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, serde::Serialize)]
pub struct Size {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
}

impl Size {
    /// How many times as many pixels each way are `enough` in all.
    pub fn enlargement(self, enough: usize) -> usize {
        let pixels = (self.width * self.height).max(1);
        (1..).find(|step| step * step * pixels >= enough).unwrap_or(1)
    }

    /// So many times as many pixels each way.
    pub fn times(self, step: usize) -> Size {
        Size { width: step * self.width, height: step * self.height }
    }
}

impl From<(usize, usize)> for Size {
    /// From the width and the height, in this order.
    fn from((width, height): (usize, usize)) -> Size {
        Size { width, height }
    }
}
