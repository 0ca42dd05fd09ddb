//! From the units of a file to those that all else works in, and back: the longest side of the scene's box is 2.
//!
//! Not handled: rotations; axes stay those of the file.

use glam::DVec3;

/// `file = center + scale * unit`, in the file's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitFrame {
    /// The middle of the scene's bounding box.
    pub center: DVec3,
    /// Half its largest extent.
    pub scale: f64,
}

impl UnitFrame {
    /// The frame of some points; none if there are none or all coincide.
    pub fn of(points: impl Iterator<Item = DVec3>) -> Option<UnitFrame> {
        let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (low, high) = points.fold(start, |(low, high), p| (low.min(p), high.max(p)));
        // Halves first: the sum of two large numbers overflows.
        let scale = (0.5 * high - 0.5 * low).max_element();
        let center = 0.5 * low + 0.5 * high;
        (scale > 0.0 && scale.is_finite()).then_some(UnitFrame { center, scale })
    }

    /// From the file's units to unit coordinates.
    pub fn to_unit(&self, point: DVec3) -> DVec3 {
        (point - self.center) / self.scale
    }

    /// From unit coordinates to the file's units.
    pub fn to_file(&self, point: DVec3) -> DVec3 {
        self.center + self.scale * point
    }
}
