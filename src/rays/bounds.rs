//! Boxes along the axes.
//!
//! Not handled: boxes of nothing, beyond [`Bounds::EMPTY`] as the start of a union.

use glam::Vec3A;

/// The points between two corners.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    pub low: Vec3A,
    pub high: Vec3A,
}

impl Bounds {
    /// Holds no point; joined with another box it gives that box.
    pub(crate) const EMPTY: Bounds = Bounds { low: Vec3A::INFINITY, high: Vec3A::NEG_INFINITY };

    /// The smallest box around both.
    #[inline(always)]
    pub(crate) fn join(self, other: Bounds) -> Bounds {
        Bounds { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Half the area of its surface.
    #[inline(always)]
    pub(crate) fn half_area(self) -> f32 {
        let d = self.high - self.low;
        d.x * d.y + d.y * d.z + d.z * d.x
    }

    /// Twice its middle.
    #[inline(always)]
    pub(crate) fn doubled_middle(self) -> Vec3A {
        self.low + self.high
    }
}
