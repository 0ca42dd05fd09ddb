//! What may lie between two facets: a test that never leaves out an occluder.
//!
//! An occluder does not matter if all of it lies on or behind the plane of either facet, if both facets lie on one
//! side of its own plane, or if a plane separates it from the convex hull of the two. The last is found by Frank and
//! Wolfe's iteration for the shortest vector of the Minkowski difference, stopped early: what is not separated by
//! then counts as between, which costs time and no accuracy.

use glam::DVec3;

use crate::form_factors::geometry::plane::Plane;
use crate::form_factors::objects::facet::Facet;

/// A convex polygon that stops or dims light.
#[derive(Clone, Debug)]
pub(crate) struct Occluder {
    pub plane: Plane,
    pub polygon: Vec<DVec3>,
    /// What it lets through.
    pub tau: f64,
}

/// Steps of the iteration.
const STEPS: usize = 100;

/// The occluders that may lie between the two facets, each of which lies in front of the other's plane.
pub(crate) fn between<'a>(a: &Facet, b: &Facet, all: &'a [Occluder]) -> Vec<&'a Occluder> {
    let hull: Vec<DVec3> = a.points().chain(b.points()).collect();
    let (low, high) = bounds(&hull);
    let matters = |o: &&Occluder| {
        let (l, h) = bounds(&o.polygon);
        let flat = DVec3::splat(o.plane.flat);
        let reach = l.cmplt(high - flat).all() && h.cmpgt(low + flat).all();
        reach
            && rises(&a.plane, &o.polygon)
            && rises(&b.plane, &o.polygon)
            && straddles(&o.plane, &hull)
            && !separated(&hull, &o.polygon, o.plane.flat)
    };
    all.iter().filter(matters).collect()
}

fn bounds(points: &[DVec3]) -> (DVec3, DVec3) {
    let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let grow = |(low, high): (DVec3, DVec3), p: &DVec3| (low.min(*p), high.max(*p));
    points.iter().fold(start, grow)
}

/// Whether some of the points lie in front of the plane.
fn rises(plane: &Plane, points: &[DVec3]) -> bool {
    points.iter().any(|&p| plane.height(p) > 0.0)
}

/// Whether points lie on both sides of the plane.
fn straddles(plane: &Plane, points: &[DVec3]) -> bool {
    let mut sides = points.iter().map(|&p| plane.height(p));
    sides.clone().any(|h| h > 0.0) && sides.any(|h| h < 0.0)
}

/// Whether a plane was found that has the two sets of points on either side, or touching it.
fn separated(hull: &[DVec3], other: &[DVec3], flat: f64) -> bool {
    let mut x = hull[0] - other[0];
    for _ in 0..STEPS {
        let Some(direction) = x.try_normalize() else {
            return false;
        };
        let nearest = extreme(hull, -direction);
        let farthest = extreme(other, direction);
        let w = nearest - farthest;
        if direction.dot(w) >= -flat {
            return true;
        }
        let step = x - w;
        let share = x.dot(step) / step.length_squared();
        x -= share.clamp(0.0, 1.0) * step;
    }
    false
}

fn extreme(points: &[DVec3], direction: DVec3) -> DVec3 {
    let mut best = (f64::NEG_INFINITY, points[0]);
    for &p in points {
        let reach = p.dot(direction);
        if reach > best.0 {
            best = (reach, p);
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
        assert!(!separated(&cube, &triangle(p(0.4, 0.4, 0.4)), 1e-12));
        assert!(!separated(&cube, &triangle(p(-0.1, 0.4, 0.9)), 1e-12));
        // Beyond a corner, where no box or face separates.
        assert!(separated(&cube, &[p(1.6, 0.6, 0.5), p(0.6, 1.6, 0.5), p(1.2, 1.2, 2.0)], 1e-12));
        assert!(separated(&cube, &triangle(p(1.01, 0.2, 0.2)), 1e-12));
    }
}
