//! Bounding boxes: the least box around points with sides along the axes.
//!
//! Not handled: boxes that rays are cast through, which are those of the tree's builder.

use std::ops::{Add, Mul, Sub};

use glam::{DVec2, DVec3, Vec3};

/// A box between its lowest and its highest corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds<V> {
    /// The lowest corner.
    pub low: V,
    /// The highest corner.
    pub high: V,
}

/// A point as its coordinates.
pub trait Coordinates: Copy + Add<Output = Self> + Sub<Output = Self> {
    /// The box around no point.
    const NONE: Bounds<Self>;

    /// The box around two.
    fn union(own: Bounds<Self>, other: Bounds<Self>) -> Bounds<Self>;

    /// Whether each coordinate is less than that of another point.
    fn is_below(self, other: Self) -> bool;
}

macro_rules! coordinates {
    ($($vector:ty)*) => { $(impl Coordinates for $vector {
        const NONE: Bounds<Self> = Bounds { low: Self::INFINITY, high: Self::NEG_INFINITY };

        #[inline]
        fn union(own: Bounds<Self>, other: Bounds<Self>) -> Bounds<Self> {
            Bounds { low: own.low.min(other.low), high: own.high.max(other.high) }
        }

        #[inline]
        fn is_below(self, other: Self) -> bool {
            self.cmplt(other).all()
        }
    })* };
}

coordinates!(DVec2 DVec3 Vec3);

impl<V: Coordinates> Bounds<V> {
    /// The box around points.
    #[inline]
    pub fn of(points: impl IntoIterator<Item = V>) -> Bounds<V> {
        points.into_iter().fold(V::NONE, |bounds, point| bounds.union(Bounds { low: point, high: point }))
    }

    /// The box around both.
    #[inline]
    pub fn union(self, other: Bounds<V>) -> Bounds<V> {
        V::union(self, other)
    }

    /// From the lowest to the highest corner.
    #[inline]
    pub fn size(&self) -> V {
        self.high - self.low
    }

    /// Halfway between them.
    #[inline]
    pub fn middle(&self) -> V
    where
        V: Mul<f64, Output = V>,
    {
        (self.low + self.high) * 0.5
    }

    /// Whether both have points inside in common; boxes that touch have none.
    #[inline]
    pub fn meets(&self, other: &Bounds<V>) -> bool {
        self.low.is_below(other.high) && other.low.is_below(self.high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_holds_its_points_and_meets_what_reaches_into_it() {
        let unit = Bounds::of([DVec2::X, DVec2::Y]);
        assert_eq!((unit.low, unit.high, unit.size()), (DVec2::ZERO, DVec2::ONE, DVec2::ONE));
        let beside = Bounds::of([DVec2::X, DVec2::new(3.0, 1.0)]);
        assert_eq!(unit.union(beside).middle(), DVec2::new(1.5, 0.5));
        assert!(unit.union(beside).meets(&beside) && !unit.meets(&beside) && !DVec2::NONE.meets(&unit));
    }
}
