//! What may lie between two facets: a test that never leaves out an occluder.
//!
//! An occluder does not matter if all of it lies on or behind the plane of either facet, if both facets lie on one side
//! of its own plane, or if a plane separates it from the convex hull of the two ([`separated`]). What is not separated
//! within so many steps counts as between, which costs time and no accuracy.
//!
//! Not handled: occluders that together hide nothing.

use glam::DVec3;

use crate::form_factors::geometry::hull::{bounds, separated};
use crate::form_factors::geometry::plane::Plane;
use crate::form_factors::objects::facet::Facet;

/// A convex polygon that stops or dims light.
#[derive(Clone, Debug)]
pub(crate) struct Occluder {
    pub plane: Plane,
    pub polygon: Vec<DVec3>,
    /// What it lets through where it is.
    pub tau: f64,
    /// Whether a mask says where that is.
    pub masked: bool,
}

/// Steps of the search for a separating plane.
const STEPS: usize = 100;

/// The occluders that may lie between the two facets, each of which lies in front of the other's plane.
pub(crate) fn between<'a>(a: &Facet, b: &Facet, all: &'a [Occluder]) -> Vec<&'a Occluder> {
    let hull: Vec<DVec3> = a.points().chain(b.points()).collect();
    let (low, high) = bounds(hull.iter().copied());
    let matters = |o: &&Occluder| {
        let (l, h) = bounds(o.polygon.iter().copied());
        let flat = DVec3::splat(o.plane.flat);
        let reach = l.cmplt(high - flat).all() && h.cmpgt(low + flat).all();
        reach
            && rises(&a.plane, &o.polygon)
            && rises(&b.plane, &o.polygon)
            && straddles(&o.plane, &hull)
            && !separated(&hull, &o.polygon, -o.plane.flat, STEPS)
    };
    all.iter().filter(matters).collect()
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
