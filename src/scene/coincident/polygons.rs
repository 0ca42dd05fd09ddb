//! Convex polygons in one plane: whether two overlap, and the parts of one in and around another.
//!
//! What is narrower than [`NARROW`] is rounding: neither an overlap nor a part.
//!
//! Not handled: polygons that are not convex.

use glam::DVec2;

use crate::scene::convex_polygon::{area, edges, put_above};
use crate::scene::planes::TOLERANCE;

/// The least width of an overlap and of a part, unit coordinates: along a plane as much counts as one place as across.
const NARROW: f64 = TOLERANCE;

/// A corner this close to the line of a cut lies on it: far above the rounding of double precision and far below
/// [`NARROW`].
const SAME: f64 = 1e-9;

/// Corners of a convex polygon, counter-clockwise.
pub(super) type Polygon = Vec<DVec2>;

/// Whether two overlap by more than rounding: no edge of either has the other on its outside.
#[inline]
pub(super) fn overlap(a: &[DVec2], b: &[DVec2]) -> bool {
    boxes_meet(a, b) && !are_apart(a, b) && !are_apart(b, a)
}

#[inline]
fn boxes_meet(a: &[DVec2], b: &[DVec2]) -> bool {
    let around = |polygon: &[DVec2]| polygon.iter().fold([polygon[0]; 2], |[low, high], &p| [low.min(p), high.max(p)]);
    let ([low, high], [other_low, other_high]) = (around(a), around(b));
    low.cmple(other_high).all() && other_low.cmple(high).all()
}

/// Whether an edge of the first has the second on its outside, but for rounding.
#[inline]
fn are_apart(a: &[DVec2], b: &[DVec2]) -> bool {
    let mut from = a[a.len() - 1];
    for &to in a {
        let inwards = (to - from).perp();
        let far = b.iter().fold(f64::NEG_INFINITY, |far, &p| inwards.dot(p - from).max(far));
        if far <= 0.0 || far * far <= NARROW * NARROW * inwards.length_squared() {
            return true;
        }
        from = to;
    }
    false
}

/// How far a polygon reaches inwards of an edge.
fn reach((from, to): (DVec2, DVec2), polygon: &[DVec2]) -> f64 {
    let inwards = (to - from).perp();
    let far = polygon.iter().map(|&p| inwards.dot(p - from)).fold(f64::NEG_INFINITY, f64::max);
    far / inwards.length()
}

/// Whether a polygon is wider than rounding.
fn is_wide(polygon: &[DVec2]) -> bool {
    polygon.len() > 2 && edges(polygon).all(|edge| reach(edge, polygon) > NARROW)
}

/// The part of a polygon within another, and convex ones around that.
pub(super) fn parted(polygon: &[DVec2], other: &[DVec2]) -> (Option<Polygon>, Vec<Polygon>) {
    let (mut inside, mut outside) = (polygon.to_vec(), Vec::new());
    for (from, to) in edges(other) {
        let inwards = (to - from).perp().normalize_or_zero();
        let height = |p: DVec2| {
            let height = inwards.dot(p - from);
            if height.abs() <= SAME { 0.0 } else { height }
        };
        if inside.iter().all(|&p| height(p) >= 0.0) {
            continue;
        }
        let [mut beyond, mut within] = [Polygon::new(), Polygon::new()];
        put_above(&inside, |p| -height(p), &mut beyond);
        put_above(&inside, height, &mut within);
        outside.extend(Some(beyond).filter(|part| is_wide(part)));
        inside = within;
        if !is_wide(&inside) {
            return (None, outside);
        }
    }
    (Some(inside), outside)
}

/// Whether parts of a polygon that do not overlap make up all of it.
pub(super) fn make_up<'a>(parts: impl Iterator<Item = &'a Polygon>, polygon: &[DVec2]) -> bool {
    let lacking = area(polygon) - parts.map(|part| area(part)).sum::<f64>();
    let around: f64 = edges(polygon).map(|(a, b)| a.distance(b)).sum();
    lacking <= NARROW * around
}
