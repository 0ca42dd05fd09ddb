//! Convex hulls of points: the box around one, and planes between two.
//!
//! Not handled: the hull's faces; its points are enough.

use glam::DVec3;

/// The least box around points: its lowest and highest corner.
pub(crate) fn bounds(points: impl IntoIterator<Item = DVec3>) -> (DVec3, DVec3) {
    let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    points.into_iter().fold(none, |(low, high), p| (low.min(p), high.max(p)))
}

/// Whether a plane is found that has the hulls of two sets of points on either side, at least `gap` apart across it.
///
/// M. Frank and P. Wolfe's iteration for the shortest vector of the Minkowski difference, stopped after `steps`: what
/// is not separated by then counts as meeting.
pub(crate) fn separated(hull: &[DVec3], other: &[DVec3], gap: f64, steps: usize) -> bool {
    let mut v = hull[0] - other[0];
    for _ in 0..steps {
        // The point of the difference furthest against v.
        let s = lowest(hull, v) - lowest(other, -v);
        if v != DVec3::ZERO && v.dot(s) >= gap * v.length() {
            return true;
        }
        let d = s - v;
        let along = -v.dot(d) / d.length_squared();
        if along <= 0.0 || !along.is_finite() {
            return false;
        }
        v += along.min(1.0) * d;
    }
    false
}

/// The point furthest against a direction.
fn lowest(points: &[DVec3], direction: DVec3) -> DVec3 {
    let mut best = (f64::INFINITY, points[0]);
    for &p in points {
        let height = direction.dot(p);
        if height < best.0 {
            best = (height, p);
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hulls_apart_are_told_from_hulls_that_meet() {
        let p = DVec3::new;
        let cube: Vec<DVec3> = (0..8).map(|k| p(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2))).collect();
        let triangle = |s: DVec3| [s, s + p(0.3, 0.1, 0.0), s + p(0.1, 0.4, 0.2)];
        let apart = |other: &[DVec3]| separated(&cube, other, -1e-12, 100);
        assert!(!apart(&triangle(p(0.4, 0.4, 0.4))));
        assert!(!apart(&triangle(p(-0.1, 0.4, 0.9))));
        // Beyond a corner, where no box or face separates.
        assert!(apart(&[p(1.6, 0.6, 0.5), p(0.6, 1.6, 0.5), p(1.2, 1.2, 2.0)]));
        assert!(apart(&triangle(p(1.01, 0.2, 0.2))));
    }
}
